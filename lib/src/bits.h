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

/* Keeps a function's frame off the stack of its siblings: inlined, the largest of them would count for all. Also for
 * what is called from several places and seldom: once is enough. */
#if defined(__GNUC__)
#define PFL_NOINLINE __attribute__((noinline))
#else
#define PFL_NOINLINE
#endif

/* Floats in a vector register of the target; 1: it has none that rounds as IEEE 754 says, and scalar forms are the
 * faster ones. Both forms of a kernel give the same bits (test_lanes.c). */
#if !defined(PFL_VECTOR_LANES)
#if defined(__GNUC__) && defined(__AVX__)
#define PFL_VECTOR_LANES 8
#elif defined(__GNUC__) && (defined(__SSE2__) || (defined(__aarch64__) && defined(__ARM_NEON)) ||                      \
                            (defined(__ARM_FEATURE_MVE) && ((__ARM_FEATURE_MVE & 2) != 0)))
#define PFL_VECTOR_LANES 4
#else
#define PFL_VECTOR_LANES 1
#endif
#endif

/* For the proofs: the bits of a float as a number, as far as words that are kept in float columns need it. Words from
 * 0x7F800000 on may be NaN, which have many bits: nothing is said of them. These contracts are trusted. */
/*@ axiomatic Bits {
      logic integer bits_of(float x);
    } */

/*@ assigns \nothing; */
static inline int32_t pfl_bits(float x)
{
    int32_t i;
    PFL_COPY(&i, &x, sizeof i);
    return i;
}

/*@ assigns \nothing; */
static inline float pfl_from_bits(int32_t i)
{
    float x;
    PFL_COPY(&x, &i, sizeof x);
    return x;
}

/* The word at the address of a float. A copy is not known to be aligned there: a core that cannot load across words
 * would go byte by byte. */
#if defined(__GNUC__)
typedef uint32_t pfl_word_t __attribute__((__may_alias__));
#define PFL_LOAD_WORD(u, p) ((u) = *(const pfl_word_t *)(p))
#define PFL_STORE_WORD(p, u) (*(pfl_word_t *)(p) = (u))
#else
#define PFL_LOAD_WORD(u, p) ((void)memcpy(&(u), (p), sizeof(uint32_t)))
#define PFL_STORE_WORD(p, u) ((void)memcpy((p), &(u), sizeof(uint32_t)))
#endif

/*@ requires \valid_read(p);
    assigns \nothing;
    ensures 0 <= bits_of(*p) < 0x7F800000 ==> \result == bits_of(*p); */
static inline uint32_t pfl_load_u32(const float *p)
{
    uint32_t u;
    PFL_LOAD_WORD(u, p);
    return u;
}

/*@ requires \valid(p);
    assigns *p;
    ensures u < 0x7F800000 ==> bits_of(*p) == u; */
static inline void pfl_store_u32(float *p, uint32_t u)
{
    PFL_STORE_WORD(p, u);
}

/*@ assigns \nothing; */
static inline bool pfl_is_finite(float x)
{
    return ((uint32_t)pfl_bits(x) & 0x7F800000u) != 0x7F800000u;
}

/*@ assigns \nothing; */
static inline bool pfl_is_not_nan(float x)
{
    return ((uint32_t)pfl_bits(x) & 0x7FFFFFFFu) <= 0x7F800000u;
}

#endif
