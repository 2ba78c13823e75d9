/* Single-precision functions with the same bits on every CPU: polynomials in + - * / and the exact square root, no
 * libm, no tables, no state. Errors in units of the last place (ULP) are measured over every float of the range by
 * `tools/ulp`; NaN in gives NaN out. All O(1), re-entrant. */
#ifndef PFLIGHT_MATH_H
#define PFLIGHT_MATH_H

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

#define PFL_PI 3.14159265f /* the float nearest to pi */

/* e^x. At most 1 ULP for -87.33 <= x <= 88.72; 0 below (no subnormal results), +infinity above. */
float pfl_expf(float x);

/* Natural logarithm. At most 1 ULP for normal x > 0; -infinity for 0 and subnormals, NaN for x < 0. */
float pfl_logf(float x);

/* Sine and cosine of x [rad], |x| <= 1608 (256 turns): at most 2.6 ULP. Up to 6.5e6 the absolute error stays under
 * one ULP of x; beyond, the result means nothing. */
float pfl_sinf(float x);
float pfl_cosf(float x);
void pfl_sincosf(float x, float *s, float *c);

/* Tangent of x [rad], |x| <= 1608: the quotient of the two above, at most 4.5 ULP. */
float pfl_tanf(float x);

/* Angle of the point (x, y) in [-pi, pi]; 0 for (0, 0). At most 3 ULP for results that are not subnormal. Finite
 * arguments. */
float pfl_atan2f(float y, float x);

/* Correctly rounded square root; NaN for x < 0. */
float pfl_sqrtf(float x);

/* x less the multiple of 2 pi that brings it to [-pi, pi]. For |x| <= 6400 the absolute error is at most 4e-7; the
 * result may lie outside by up to 9e-8 for |x| <= 10, and by up to 5e-4 at the end of the range. */
float pfl_wrap_pi(float x);

/* The same over n elements: faster, where the compiler has vectors. In and out may be the same array, s and c not. */
void pfl_expf_n(const float *x, float *y, size_t n);
void pfl_logf_n(const float *x, float *y, size_t n);
void pfl_sincosf_n(const float *x, float *s, float *c, size_t n);
void pfl_atan2f_n(const float *y, const float *x, float *angle, size_t n);

#ifdef __cplusplus
}
#endif

#endif
