/* The bits of a float as an integer and back, and the exponent test for infinities and NaN. Integer tests stay right
 * when a firmware's flags make the compiler assume that NaN does not exist; memcpy keeps aliasing rules. */
#ifndef PFL_BITS_H
#define PFL_BITS_H

#include <float.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

#if defined(__FAST_MATH__) || (defined(__FINITE_MATH_ONLY__) && (__FINITE_MATH_ONLY__ != 0))
#error "pflight needs strict IEEE arithmetic: build lib/ without -ffast-math and -ffinite-math-only"
#endif
#if FLT_EVAL_METHOD != 0
#error "pflight needs floats evaluated as floats: use SSE math on i386, -fexcess-precision=fast on s390x"
#endif

/* The builtin stays one move also in firmware that is built with -ffreestanding or -fno-builtin. */
#if defined(__GNUC__)
#define PFL_COPY(to, from, bytes) ((void)__builtin_memcpy((to), (from), (bytes)))
#else
#define PFL_COPY(to, from, bytes) ((void)memcpy((to), (from), (bytes)))
#endif

static inline int32_t pfl_bits(float x)
{
    int32_t i;
    PFL_COPY(&i, &x, sizeof i);
    return i;
}

static inline float pfl_from_bits(int32_t i)
{
    float x;
    PFL_COPY(&x, &i, sizeof x);
    return x;
}

/* Told again that a float's address is one of a word: a core that cannot load across words would go byte by byte. */
#if defined(__GNUC__)
#define PFL_WORD(p) __builtin_assume_aligned((p), sizeof(uint32_t))
#else
#define PFL_WORD(p) (p)
#endif

static inline uint32_t pfl_load_u32(const float *p)
{
    uint32_t u;
    PFL_COPY(&u, PFL_WORD(p), sizeof u);
    return u;
}

static inline void pfl_store_u32(float *p, uint32_t u)
{
    PFL_COPY(PFL_WORD(p), &u, sizeof u);
}

static inline bool pfl_is_finite(float x)
{
    return ((uint32_t)pfl_bits(x) & 0x7F800000u) != 0x7F800000u;
}

static inline bool pfl_is_not_nan(float x)
{
    return ((uint32_t)pfl_bits(x) & 0x7FFFFFFFu) <= 0x7F800000u;
}

#endif
