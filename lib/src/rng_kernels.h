/* One step of xoshiro128 1.0 (Blackman and Vigna, 2021) and what it gives. */
#ifndef PFL_RNG_KERNELS_H
#define PFL_RNG_KERNELS_H

#include "pflight/rng.h"

#include <stdbool.h>

/*@ requires 0 < k < 32;
    assigns \nothing; */
static inline uint32_t pfl_rotl(uint32_t x, uint32_t k)
{
    return (x << k) | (x >> (32u - k));
}

/*@ requires \valid(s + (0 .. 3));
    assigns s[0 .. 3]; */
static inline void pfl_xoshiro_step(uint32_t s[4])
{
    const uint32_t t = s[1] << 9;
    s[2] ^= s[0];
    s[3] ^= s[1];
    s[1] ^= s[2];
    s[0] ^= s[3];
    s[2] ^= t;
    s[3] = pfl_rotl(s[3], 11u);
}

/* xoshiro128++: every bit is good. */
/*@ requires \valid(s + (0 .. 3));
    assigns s[0 .. 3]; */
static inline uint32_t pfl_xoshiro_next(uint32_t s[4])
{
    const uint32_t result = pfl_rotl(s[0] + s[3], 7u) + s[0];
    pfl_xoshiro_step(s);
    return result;
}

/* xoshiro128+, which its authors made for floats: the lowest few bits follow linear rules, and rounding drops them. */
static inline uint32_t pfl_xoshiro_next_upper(uint32_t s[4])
{
    const uint32_t result = s[0] + s[3];
    pfl_xoshiro_step(s);
    return result;
}

/* False when a stream sits in the all-zero state, from which it would never come back. */
/*@ requires \valid_read(rng);
    assigns \nothing; */
bool pfl_rng_alive(const pfl_rng_t *rng);

/* Starts all streams anew in the midst of a flight, without the jumps of pfl_rng_seed, which cost more than a batch of
 * particles: any state but zero will do. */
void pfl_rng_revive(pfl_rng_t *rng, uint32_t seed);

#endif
