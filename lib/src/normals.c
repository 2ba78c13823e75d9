/* Standard normals, 16 at a time: eight lanes draw a radius and an angle each (Box and Muller 1958). The hottest loop
 * of a filter, so its polynomials are fitted to this use alone, and constant factors are moved into their coefficients
 * until none is left. */
#include "pflight/rng.h"

#include "bits.h"
#include "rng_kernels.h"
#include "sqrt_kernel.h"

/* Where there are vector registers, the lanes go side by side; where there are none, one after the other, so that a
 * stream stays in four registers. The same numbers in the same places. */
#if defined(__SSE2__) || defined(__ARM_NEON) || defined(__ALTIVEC__) || defined(__riscv_vector)
#define LANES_SIDE_BY_SIDE 1
#else
#define LANES_SIDE_BY_SIDE 0
#endif

/* 2^11.5 sqrt(-log2 u) for u = |f| / 2^31 in (0, 1], uniform: f is a negative integer. From the bits of f to those of
 * -2^31 is, in steps of 2^-23, the logarithm, only with its fraction y too large by log2(2 - y) - (1 - y) = y K(y).
 * One step more keeps the root's argument above zero. The fit leaves 2.2e-6 of a normal's radius. */
static inline float radius(uint32_t bits)
{
    const float f = (float)(int32_t)(bits | 0x80000000u);
    const int32_t octaves = (int32_t)(0xCF000001u - (uint32_t)pfl_bits(f));
    const float y = (float)(octaves & 0x007FFFFF);
    float p = -5.3932552e-37f;
    p = (p * y) + 4.67630837e-30f;
    p = (p * y) - 7.70625597e-23f;
    p = (p * y) - 7.47253313e-16f;
    p = (p * y) - 2.16209415e-08f;
    p = (p * y) + 0.278692544f;
    return pfl_sqrt_kernel((float)octaves - (p * y));
}

/* One pair, eight apart. For the angle pi v, the sine and cosine of pi v / 4 are doubled twice, with scales that turn the
 * doubling into x^2 and x y and leave sqrt(2 log 2) 2^-11.5, the rest of the radius, in the end. c1 is fitted to
 * sqrt(1 - s1^2) rather than to the cosine, so that what s1 lacks (6e-7) bends the angle, by up to 3.8e-6, more than the
 * radius, 2.0e-6 of itself. The density over the angle is even to 3e-5: 2^32 pairs do not show it. */
static inline void pair(uint32_t s[4], float *z)
{
    const uint32_t a = pfl_xoshiro_next(s); /* far out, the radius shows its lowest bits; the angle never does */
    const uint32_t b = pfl_xoshiro_next_upper(s);
    const float r = radius(a);
    const float v = (float)(int32_t)b * 4.65661287e-10f; /* 2^-31 */
    const float v2 = v * v;
    float p = 5.79579792e-4f;
    p = (p * v2) - 1.92748718e-2f;
    const float s1 = ((p * v2) + 0.187555969f) * v;
    float q = -7.84455624e-5f;
    q = (q * v2) + 3.78842792e-3f;
    q = (q * v2) - 7.36544579e-2f;
    const float c1 = (q * v2) + 0.238804936f;
    const float s2 = s1 * c1;
    const float c2 = 0.0285138846f - (s1 * s1);
    z[0] = r * (4.06520806e-4f - (s2 * s2));
    z[PFL_RNG_LANES] = r * (s2 * c2);
}

void pfl_rng_normals(pfl_rng_t *rng, float *out, size_t groups)
{
#if LANES_SIDE_BY_SIDE
    uint32_t s[4][PFL_RNG_LANES]; /* a copy that nothing else can point to stays in vector registers */
    for (uint32_t k = 0u; k < 4u; k++) {
        for (uint32_t l = 0u; l < PFL_RNG_LANES; l++) {
            s[k][l] = rng->s[k][l];
        }
    }
    for (size_t g = 0; g < groups; g++) {
        for (uint32_t l = 0u; l < PFL_RNG_LANES; l++) {
            uint32_t one[4] = {s[0][l], s[1][l], s[2][l], s[3][l]};
            pair(one, &out[(g * 2u * PFL_RNG_LANES) + l]);
            s[0][l] = one[0];
            s[1][l] = one[1];
            s[2][l] = one[2];
            s[3][l] = one[3];
        }
    }
    for (uint32_t k = 0u; k < 4u; k++) {
        for (uint32_t l = 0u; l < PFL_RNG_LANES; l++) {
            rng->s[k][l] = s[k][l];
        }
    }
#else
    for (uint32_t l = 0u; l < PFL_RNG_LANES; l++) {
        uint32_t one[4] = {rng->s[0][l], rng->s[1][l], rng->s[2][l], rng->s[3][l]};
        float *z = &out[l];
        for (size_t left = groups; left > 0u; left--) {
            pair(one, z);
            z += 2u * PFL_RNG_LANES;
        }
        rng->s[0][l] = one[0];
        rng->s[1][l] = one[1];
        rng->s[2][l] = one[2];
        rng->s[3][l] = one[3];
    }
#endif
}
