/* A uniform random number out of a noise column, for models that choose. Private to lib/. */
#ifndef PFL_UNIFORM_KERNEL_H
#define PFL_UNIFORM_KERNEL_H

#include "bits.h"
#include "math_kernels.h"

/* Distribution function of the standard normal, to 1e-7 (Abramowitz and Stegun 1964, 26.2.17). */
static inline float pfl_uniform_kernel(float normal)
{
    const float x = pfl_from_bits(pfl_bits(normal) & 0x7FFFFFFF);
    const float t = 1.0f / (1.0f + (0.2316419f * x));
    float p = 1.330274429f;
    p = (p * t) - 1.821255978f;
    p = (p * t) + 1.781477937f;
    p = (p * t) - 0.356563782f;
    p = (p * t) + 0.319381530f;
    const float tail = (p * t) * (0.398942280f * pfl_exp_kernel(-0.5f * (x * x)));
    return pfl_select(-(int32_t)(pfl_bits(normal) < 0), tail, 1.0f - tail);
}

#endif
