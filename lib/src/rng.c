/* Seeding and jumps of the xoshiro128++ streams, and single draws. The normals have a file of their own. */
#include "pflight/rng.h"

#include "bits.h"
#include "hash_kernel.h"
#include "rng_kernels.h"

/* SplitMix64 (Steele, Lea and Flood 2014): spreads any seed over 64 bits. Each step after the addition is invertible and
 * maps zero to zero, so that of two successive numbers one at most is zero: no seed makes a dead stream. */
PFL_NOINLINE static uint64_t splitmix64(uint64_t *state)
{
    *state += 0x9E3779B97F4A7C15u;
    uint64_t z = *state;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return z ^ (z >> 31);
}

/* Moves one stream ahead by the number of steps that `polynomial` encodes (x^steps modulo the characteristic one). */
static void jump(uint32_t s[4], const uint32_t polynomial[4])
{
    uint32_t sum[4] = {0u, 0u, 0u, 0u};
    for (uint32_t bit = 0u; bit < 128u; bit++) {
        if ((polynomial[bit >> 5] & ((uint32_t)1u << (bit & 31u))) != 0u) {
            for (uint32_t k = 0u; k < 4u; k++) {
                sum[k] ^= s[k];
            }
        }
        (void)pfl_xoshiro_next(s);
    }
    for (uint32_t k = 0u; k < 4u; k++) {
        s[k] = sum[k];
    }
}

void pfl_rng_seed(pfl_rng_t *rng, uint64_t seed)
{
    static const uint32_t jump_64[4] = {0x8764000Bu, 0xF542D2D3u, 0x6FA035C3u, 0x77F2DB5Bu};
    uint64_t mix = seed;
    const uint64_t a = splitmix64(&mix);
    const uint64_t b = splitmix64(&mix);
    uint32_t s[4] = {(uint32_t)a, (uint32_t)(a >> 32), (uint32_t)b, (uint32_t)(b >> 32)};
    for (uint32_t lane = 0u; lane < PFL_RNG_LANES; lane++) {
        for (uint32_t k = 0u; k < 4u; k++) {
            rng->s[k][lane] = s[k];
        }
        jump(s, jump_64);
    }
    for (uint32_t k = 0u; k < 4u; k++) {
        rng->one[k] = s[k];
    }
}

void pfl_rng_revive(pfl_rng_t *rng, uint32_t seed)
{
    unsigned char *bytes = (unsigned char *)rng;
    uint32_t word = seed;
    for (uint32_t at = 0u; at < sizeof *rng; at += 4u) {
        word = pfl_hash_step(word, at);
        PFL_COPY(&bytes[at], &word, sizeof word);
    }
}

void pfl_rng_long_jump(pfl_rng_t *rng)
{
    static const uint32_t jump_96[4] = {0xB523952Eu, 0x0B6F099Fu, 0xCCF5A0EFu, 0x1C580662u};
    for (uint32_t lane = 0u; lane < PFL_RNG_LANES; lane++) {
        uint32_t s[4];
        for (uint32_t k = 0u; k < 4u; k++) {
            s[k] = rng->s[k][lane];
        }
        jump(s, jump_96);
        for (uint32_t k = 0u; k < 4u; k++) {
            rng->s[k][lane] = s[k];
        }
    }
    jump(rng->one, jump_96);
}

uint32_t pfl_rng_u32(pfl_rng_t *rng)
{
    return pfl_xoshiro_next(rng->one);
}

bool pfl_rng_alive(const pfl_rng_t *rng)
{
    bool alive = (rng->one[0] | rng->one[1] | rng->one[2] | rng->one[3]) != 0u;
    for (uint32_t lane = 0u; lane < PFL_RNG_LANES; lane++) {
        alive = alive && ((rng->s[0][lane] | rng->s[1][lane] | rng->s[2][lane] | rng->s[3][lane]) != 0u);
    }
    return alive;
}
