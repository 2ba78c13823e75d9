/* Standard normals, 16 at a time: eight lanes draw a radius and an angle each (Box and Muller 1958). The hottest loop
 * of a filter, so its two functions are fitted to this use alone: the radius needs no more than 1e-7 relative, the
 * angle covers half a circle and a random sign the other half. */
#include "pflight/rng.h"

#include "bits.h"
#include "rng_kernels.h"
#include "sqrt_kernel.h"

/* A copy that nothing else can point to lets a compiler keep the streams in vector registers; where there are none, it
 * would only cost stack. */
#if defined(__SSE2__) || defined(__ARM_NEON) || defined(__ALTIVEC__) || defined(__riscv_vector)
#define WORK_ON_COPY 1
#else
#define WORK_ON_COPY 0
#endif

/* sqrt(-2 log u) with u = (bits/2 + 1/2) / 2^31 in (0, 1], uniform. */
static inline float radius(uint32_t bits)
{
    const float f = (float)(int32_t)(bits >> 1) + 0.5f;
    const int32_t i = pfl_bits(f) - 0x3F3504F3; /* f = m 2^e with m in [sqrt(1/2), sqrt(2)) */
    const float e = (float)(i >> 23);
    const float t = pfl_from_bits((i & 0x007FFFFF) + 0x3F3504F3) - 1.0f;
    float p = 2.02137560e-1f; /* -2 log(1+t) = t P(t), 1.7e-7 */
    p = (p * t) - 3.24451596e-1f;
    p = (p * t) + 3.45016718e-1f;
    p = (p * t) - 3.98003310e-1f;
    p = (p * t) + 4.99398172e-1f;
    p = (p * t) - 6.66701198e-1f;
    p = (p * t) + 1.00000727f;
    p = (p * t) - 1.99999988f;
    const float octaves = (31.0f - e) * 1.38629436f; /* 2 log 2 each; exactly 0 at u = 1 */
    return pfl_sqrt_kernel(octaves + (p * t));
}

/* (cos, sin) of v pi/2 for v in [-1, 1], the cosine not negative. */
static inline float half_circle_cos(float v2)
{
    float p = 8.58190644e-4f; /* 4.7e-8 absolute */
    p = (p * v2) - 2.08106283e-2f;
    p = (p * v2) + 2.53650755e-1f;
    p = (p * v2) - 1.23369825f;
    return (p * v2) + 9.99999940e-1f;
}

static inline float half_circle_sin(float v, float v2)
{
    float p = 1.50820561e-4f; /* 3.3e-9 absolute */
    p = (p * v2) - 4.67222789e-3f;
    p = (p * v2) + 7.96884820e-2f;
    p = (p * v2) - 6.45963371e-1f;
    return ((p * v2) * v) + (1.57079625f * v);
}

void pfl_rng_normals(pfl_rng_t *rng, float *out, size_t groups)
{
#if WORK_ON_COPY
    uint32_t s[4][PFL_RNG_LANES];
    memcpy(s, rng->s, sizeof s);
#else
    uint32_t(*s)[PFL_RNG_LANES] = rng->s;
#endif
    for (size_t g = 0; g < groups; g++) {
        float *z = &out[g * 2u * PFL_RNG_LANES];
        for (uint32_t l = 0u; l < PFL_RNG_LANES; l++) {
            uint32_t one[4] = {s[0][l], s[1][l], s[2][l], s[3][l]};
            const uint32_t a = pfl_xoshiro_next(one);
            const uint32_t b = pfl_xoshiro_next(one);
            s[0][l] = one[0];
            s[1][l] = one[1];
            s[2][l] = one[2];
            s[3][l] = one[3];
            const float r = radius(a);
            const float v = (float)(int32_t)b * 4.65661287e-10f; /* 2^-31 */
            const float v2 = v * v;
            const int32_t side = (int32_t)(a << 31); /* the bit that the radius left unused */
            const float c = pfl_from_bits(pfl_bits(half_circle_cos(v2)) ^ side);
            z[l] = r * c;
            z[l + PFL_RNG_LANES] = r * half_circle_sin(v, v2);
        }
    }
#if WORK_ON_COPY
    memcpy(rng->s, s, sizeof s);
#endif
}
