/* The correctly rounded square root: one instruction where the CPU has it, digit by digit in integers where not, with
 * the same bits. Without -fno-math-errno the builtin would also call libm's sqrtf. */
#ifndef PFL_SQRT_KERNEL_H
#define PFL_SQRT_KERNEL_H

#include "bits.h"

#if defined(__SSE__) || defined(__aarch64__) || (defined(__ARM_FP) && ((__ARM_FP & 4) != 0)) ||                        \
    defined(__riscv_flen) || defined(__powerpc64__) || defined(__s390x__)
#define PFL_SQRT_IN_HARDWARE 1
#else
#define PFL_SQRT_IN_HARDWARE 0
#endif

/* For CPUs without a square root; compiled everywhere so that the tests can compare. */
static inline float pfl_sqrt_in_integers(float x)
{
    int32_t i = pfl_bits(x);
    if ((i & 0x7FFFFFFF) == 0) {
        return x; /* +-0 */
    }
    if (((uint32_t)i & 0x7F800000u) == 0x7F800000u) {
        return (i == (int32_t)0xFF800000u) ? pfl_from_bits(0x7FC00000) : x;
    }
    if (i < 0) {
        return pfl_from_bits(0x7FC00000);
    }
    int32_t e = (i >> 23) - 127;
    uint32_t m = (uint32_t)i & 0x007FFFFFu;
    if (e == -127) { /* subnormal: bring the leading bit up */
        e = -126;
        while ((m & 0x00800000u) == 0u) {
            m <<= 1;
            e--;
        }
    }
    m |= 0x00800000u;
    if ((e & 1) != 0) {
        m <<= 1;
        e--;
    }
    uint32_t root = 0u; /* 24 bits of root and one more to round by; the remainder says if it is exact */
    uint32_t rest = 0u;
    uint64_t radicand = (uint64_t)m << 25; /* 50 bits, two a step */
    for (int step = 0; step < 25; step++) {
        rest = (rest << 2) | (uint32_t)((radicand >> 48) & 3u);
        radicand <<= 2;
        const uint32_t trial = (root << 2) | 1u;
        root <<= 1;
        if (rest >= trial) {
            rest -= trial;
            root |= 1u;
        }
    }
    root = (root >> 1) + (root & 1u); /* a tie is impossible */
    return pfl_from_bits((int32_t)(root + ((uint32_t)((e / 2) + 126) << 23)));
}

static inline float pfl_sqrt_kernel(float x)
{
#if PFL_SQRT_IN_HARDWARE
    return __builtin_sqrtf(x);
#else
    return pfl_sqrt_in_integers(x);
#endif
}

#endif
