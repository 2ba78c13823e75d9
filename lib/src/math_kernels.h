/* The float functions as inline kernels, for loops that a compiler should turn into vectors: no branches, no calls,
 * selections on integer masks. Coefficients are our own minimax fits (Remez exchange in 40 digits, rounded to float;
 * the fit's relative error stands beside each). math.h tells ranges and measured errors. */
#ifndef PFL_MATH_KERNELS_H
#define PFL_MATH_KERNELS_H

#include "bits.h"

#define PFL_ROUND_MAGIC 12582912.0f /* 1.5 * 2^23: adding it rounds to an integer held in the low mantissa bits */
#define PFL_LN2_HI 0.693359375f     /* 9 significant bits: k * PFL_LN2_HI is exact for |k| < 2^15 */
#define PFL_LN2_LO (-2.12194442e-4f)

static inline float pfl_select(int32_t mask, float if_set, float if_clear)
{
    return pfl_from_bits((pfl_bits(if_set) & mask) | (pfl_bits(if_clear) & ~mask));
}

/* 2^k for -126 <= k <= 127. */
static inline float pfl_pow2i(int32_t k)
{
    return pfl_from_bits((int32_t)((uint32_t)(k + 127) << 23));
}

static inline float pfl_exp_kernel(float x)
{
    const float top = 88.72283905f;
    const float bottom = -87.33654475f;
    const int32_t above = -(int32_t)(x > top); /* neither for a NaN, which goes through */
    const int32_t below = -(int32_t)(x < bottom);
    const float c = pfl_select(below, bottom, pfl_select(above, top, x));
    const float biased = (c * 1.44269504f) + PFL_ROUND_MAGIC;
    const float kf = biased - PFL_ROUND_MAGIC;
    const int32_t k = pfl_bits(biased) - pfl_bits(PFL_ROUND_MAGIC);
    const float r = (c - (kf * PFL_LN2_HI)) - (kf * PFL_LN2_LO);
    float p = 1.38145406e-3f; /* exp(r) = 1 + r + r^2 P(r), 3.1e-9 */
    p = (p * r) + 8.36874545e-3f;
    p = (p * r) + 4.16683890e-2f;
    p = (p * r) + 1.66665211e-1f;
    p = (p * r) + 4.99999940e-1f;
    const float e = ((p * (r * r)) + r) + 1.0f;
    const int32_t half = k >> 1; /* 2^128 is out of a float's reach: two factors, both exact */
    const float y = (e * pfl_pow2i(half)) * pfl_pow2i(k - half);
    return pfl_select(above, pfl_from_bits(0x7F800000), pfl_from_bits(pfl_bits(y) & ~below));
}

/* log(m 2^e) for positive normal m 2^e, no special cases. */
static inline float pfl_log_positive_kernel(float x)
{
    const int32_t i = (int32_t)((uint32_t)pfl_bits(x) - 0x3F3504F3u); /* m in [sqrt(1/2), sqrt(2)) */
    const float e = (float)(i >> 23);
    const float t = pfl_from_bits((i & 0x007FFFFF) + 0x3F3504F3) - 1.0f;
    float p = -7.63449371e-2f; /* log(1+t) = t - t^2/2 + t^3 P(t), 5.8e-9 */
    p = (p * t) + 1.27615750e-1f;
    p = (p * t) - 1.31601825e-1f;
    p = (p * t) + 1.42017588e-1f;
    p = (p * t) - 1.66233569e-1f;
    p = (p * t) + 2.00012267e-1f;
    p = (p * t) - 2.50008196e-1f;
    p = (p * t) + 3.33333313e-1f;
    const float t2 = t * t;
    const float tail = ((t2 * t) * p) + (e * PFL_LN2_LO);
    return ((tail - (0.5f * t2)) + t) + (e * PFL_LN2_HI);
}

/* For log-likelihoods by the logarithm above, which makes a number of a NaN: one that is not finite in what was measured
 * refuses the measurement by its first particle. */
static inline void pfl_log_tells(float *ll, float measured)
{
    ll[0] += 0.0f * measured;
}

static inline float pfl_log_kernel(float x)
{
    const int32_t i = pfl_bits(x);
    const float y = pfl_log_positive_kernel(x);
    const int32_t small = -(int32_t)((i & 0x7FFFFFFF) < 0x00800000);    /* zero, subnormal */
    const int32_t negative = (i >> 31) & ~small;                        /* below: NaN */
    const int32_t special = -(int32_t)((i & 0x7FFFFFFF) >= 0x7F800000); /* inf, NaN: as they are */
    const float a = pfl_select(small, pfl_from_bits((int32_t)0xFF800000u), y);
    const float b = pfl_select(special, x, a);
    return pfl_select(negative, pfl_from_bits(0x7FC00000), b);
}

static inline void pfl_sincos_kernel(float x, float *s, float *c)
{
    const float biased = (x * 0.636619772f) + PFL_ROUND_MAGIC;
    const float kf = biased - PFL_ROUND_MAGIC;
    const int32_t k = pfl_bits(biased);
    /* pi/2 in parts (Cody and Waite 1980); the first, rounded up, and the second are exact up to |k| = 1024 */
    const float r = ((x - (kf * 1.57080078125f)) + (kf * 4.45451587e-6f)) - (kf * 6.07710063e-11f);
    const float r2 = r * r;
    float ps = -1.95149580e-4f; /* sin r = r + r^3 P(r^2), 3.8e-9 */
    ps = (ps * r2) + 8.33215844e-3f;
    ps = (ps * r2) - 1.66666552e-1f;
    const float sr = ((ps * r2) * r) + r;
    float pc = 2.44380899e-5f; /* cos r = 1 - r^2/2 + r^4 P(r^2), 9.6e-11 */
    pc = (pc * r2) - 1.38873642e-3f;
    pc = (pc * r2) + 4.16666456e-2f;
    const float cr = ((pc * (r2 * r2)) - (0.5f * r2)) + 1.0f;
    const int32_t swap = -(k & 1); /* odd quadrant: sine and cosine change places */
    const int32_t change = (pfl_bits(sr) ^ pfl_bits(cr)) & swap;
    const int32_t s_sign = (int32_t)((uint32_t)k << 30) & (int32_t)0x80000000u;
    const int32_t c_sign = (int32_t)(((uint32_t)k + 1u) << 30) & (int32_t)0x80000000u;
    *s = pfl_from_bits((pfl_bits(sr) ^ change) ^ s_sign);
    *c = pfl_from_bits((pfl_bits(cr) ^ change) ^ c_sign);
}

/* A way of `length` in the direction `heading`: its parts along x and y, for the moves of models. In turns, whose count
 * does not matter; sine and cosine of a quarter of what is left, scaled by 8^(1/4), are doubled twice: no quadrants, no
 * signs. Right to 8e-7 of the length for a heading within one ULP of the given one, up to 1e6 rad. */
static inline void pfl_way_kernel(float length, float heading, float *x, float *y)
{
    const float turns = heading * 0.159154943f;
    const float r = turns - ((turns + PFL_ROUND_MAGIC) - PFL_ROUND_MAGIC);
    const float r2 = r * r;
    float s = -7.68285943e-3f; /* 3.5e-9 */
    s = (s * r2) + 1.33981690e-1f;
    s = (s * r2) - 1.08637393f;
    s = ((s * r2) + 2.64175391f) * r;
    float c = -3.41750756e-2f; /* 5.6e-8 */
    c = (c * r2) + 4.26449746e-1f;
    c = (c * r2) - 2.07481861f;
    c = (c * r2) + 1.68179274f;
    const float s1 = s * c; /* sqrt(2) times the sine of half the angle, and c1 the cosine */
    const float c1 = 1.41421354f - (s * s);
    *x = length * (1.0f - (s1 * s1));
    *y = length * (s1 * c1);
}

static inline float pfl_atan2_kernel(float y, float x)
{
    const int32_t sign_bit = (int32_t)0x80000000u;
    const float ax = pfl_from_bits(pfl_bits(x) & 0x7FFFFFFF);
    const float ay = pfl_from_bits(pfl_bits(y) & 0x7FFFFFFF);
    const int32_t steep = -(int32_t)(ay > ax);
    const float high = pfl_select(steep, ay, ax);
    const float low = pfl_select(steep, ax, ay);
    const int32_t origin = -(int32_t)(pfl_bits(high) == 0);
    const float t = low / pfl_select(origin, 1.0f, high);
    const float t2 = t * t;
    float p = 2.92069977e-3f; /* atan t = t + t^3 P(t^2), 1.7e-8 */
    p = (p * t2) - 1.63679570e-2f;
    p = (p * t2) + 4.32119034e-2f;
    p = (p * t2) - 7.55221769e-2f;
    p = (p * t2) + 1.06660061e-1f;
    p = (p * t2) - 1.42110556e-1f;
    p = (p * t2) + 1.99937731e-1f;
    p = (p * t2) - 3.33331525e-1f;
    const float a = ((p * t2) * t) + t;
    /* pi/2 and pi carry a correction, so that the difference keeps its last bits */
    const float b = pfl_select(steep, (1.57079637f - a) - 4.37113883e-8f, a);
    const int32_t back = -(int32_t)((pfl_bits(x) & sign_bit) != 0) & ~origin;
    const float c = pfl_select(back, (3.14159274f - b) - 8.74227766e-8f, b);
    return pfl_from_bits(pfl_bits(c) | (pfl_bits(y) & sign_bit));
}

static inline float pfl_wrap_pi_kernel(float x)
{
    const float k = ((x * 0.159154943f) + PFL_ROUND_MAGIC) - PFL_ROUND_MAGIC;
    return ((x - (k * 6.28271484375f)) - (k * 4.70459461e-4f)) - (k * 3.96837432e-9f);
}

#endif
