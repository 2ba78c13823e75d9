/* The public float functions: thin shells around the kernels, and the square root. */
#include "pflight/math.h"

#include "math_kernels.h"
#include "sqrt_kernel.h"

float pfl_expf(float x)
{
    return pfl_exp_kernel(x);
}

float pfl_logf(float x)
{
    return pfl_log_kernel(x);
}

void pfl_sincosf(float x, float *s, float *c)
{
    pfl_sincos_kernel(x, s, c);
}

float pfl_sinf(float x)
{
    float s;
    float c;
    pfl_sincos_kernel(x, &s, &c);
    return s;
}

float pfl_cosf(float x)
{
    float s;
    float c;
    pfl_sincos_kernel(x, &s, &c);
    return c;
}

float pfl_tanf(float x)
{
    float s;
    float c;
    pfl_sincos_kernel(x, &s, &c);
    return s / c;
}

float pfl_atan2f(float y, float x)
{
    return pfl_atan2_kernel(y, x);
}

float pfl_sqrtf(float x)
{
    return pfl_sqrt_kernel(x);
}

float pfl_wrap_pi(float x)
{
    return pfl_wrap_pi_kernel(x);
}

void pfl_expf_n(const float *x, float *y, size_t n)
{
    for (size_t i = 0; i < n; i++) {
        y[i] = pfl_exp_kernel(x[i]);
    }
}

void pfl_logf_n(const float *x, float *y, size_t n)
{
    for (size_t i = 0; i < n; i++) {
        y[i] = pfl_log_kernel(x[i]);
    }
}

void pfl_sincosf_n(const float *x, float *s, float *c, size_t n)
{
    for (size_t i = 0; i < n; i++) {
        float si;
        float ci;
        pfl_sincos_kernel(x[i], &si, &ci);
        s[i] = si;
        c[i] = ci;
    }
}

void pfl_atan2f_n(const float *y, const float *x, float *angle, size_t n)
{
    for (size_t i = 0; i < n; i++) {
        angle[i] = pfl_atan2_kernel(y[i], x[i]);
    }
}
