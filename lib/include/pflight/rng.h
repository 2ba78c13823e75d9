/* Random numbers with the same bits on every CPU: eight xoshiro128++ streams side by side (Blackman and Vigna, 2021),
 * 2^64 steps apart, so that vector hosts fill eight lanes at once and small cores go one lane after the other. */
#ifndef PFLIGHT_RNG_H
#define PFLIGHT_RNG_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define PFL_RNG_LANES 8u /* streams side by side */

/* Word k of lane l is s[k][l]. The ninth stream `one` serves single draws. The caller owns it; copy it to fork. */
typedef struct {
    uint32_t s[4][PFL_RNG_LANES];
    uint32_t one[4];
} pfl_rng_t;

/* Starts all streams from a seed (SplitMix64, then jumps); no seed gives a dead state. Streams of different seeds are
 * independent for all practical purposes; for guaranteed disjoint ones use pfl_rng_long_jump. O(1), some 20 000
 * instructions. */
void pfl_rng_seed(pfl_rng_t *rng, uint64_t seed);

/* Moves every stream 2^96 steps on: disjoint runs from one seed. O(1). */
void pfl_rng_long_jump(pfl_rng_t *rng);

/* Next 32 uniform bits of the ninth stream. O(1). */
uint32_t pfl_rng_u32(pfl_rng_t *rng);

/* Fills out[0 .. groups*16-1] with standard normals (Box and Muller 1958; |z| < 6.56). In each group of 16, lane l
 * makes elements l and l+8: the radius from its next number, the angle from the one after, taken as xoshiro128+ gives it.
 * O(groups). */
void pfl_rng_normals(pfl_rng_t *rng, float *out, size_t groups);

#ifdef __cplusplus
}
#endif

#endif
