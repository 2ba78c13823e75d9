/* Random numbers and functions. */
#include "kernels.h"

#include "rng_kernels.h" /* private to lib/: the eight streams have no function of their own */

#include <string.h>

KERNEL(uniform_single)
{
    for (uint32_t i = 0u; i < KERNEL_N; i++) {
        kernel_data.bits[i] = pfl_rng_u32(&kernel_data.rng);
    }
}

KERNEL(uniform_lanes)
{
    uint32_t s[4][PFL_RNG_LANES]; /* a copy, as in the generator of normals */
    memcpy(s, kernel_data.rng.s, sizeof s);
    for (uint32_t i = 0u; i < KERNEL_N; i += 2u * PFL_RNG_LANES) {
        for (uint32_t l = 0u; l < PFL_RNG_LANES;
             l++) { /* two a lane, as there: a shorter loop is unrolled to scalars */
            uint32_t one[4] = {s[0][l], s[1][l], s[2][l], s[3][l]};
            kernel_data.bits[i + l] = pfl_xoshiro_next(one);
            kernel_data.bits[i + PFL_RNG_LANES + l] = pfl_xoshiro_next(one);
            s[0][l] = one[0];
            s[1][l] = one[1];
            s[2][l] = one[2];
            s[3][l] = one[3];
        }
    }
}

KERNEL(normals)
{
    pfl_rng_normals(&kernel_data.rng, kernel_data.out[0], KERNEL_N / 16u);
}

KERNEL(exp)
{
    pfl_expf_n(kernel_data.in[0], kernel_data.out[0], KERNEL_N);
}

KERNEL(log)
{
    pfl_logf_n(kernel_data.in[1], kernel_data.out[0], KERNEL_N);
}

KERNEL(sincos)
{
    pfl_sincosf_n(kernel_data.in[0], kernel_data.out[0], kernel_data.out[1], KERNEL_N);
}

KERNEL(atan2)
{
    pfl_atan2f_n(kernel_data.in[0], kernel_data.in[1], kernel_data.out[0], KERNEL_N);
}

const kernel_t kernels_math[] = {
    {"uniform_single", kernel_uniform_single, NULL},
    {"uniform_lanes", kernel_uniform_lanes, NULL},
    {"normals", kernel_normals, NULL},
    {"exp", kernel_exp, NULL},
    {"log", kernel_log, NULL},
    {"sincos", kernel_sincos, NULL},
    {"atan2", kernel_atan2, NULL},
};
const uint32_t kernels_math_count = sizeof kernels_math / sizeof kernels_math[0];
