/* Kernels without shrinkage, and the widths that suit kernels: regularised.h tells when to use them.
 *
 * The first d of the d + 4 coordinates of a point drawn evenly from the unit sphere in d + 4 dimensions have the density
 * of Epanechnikov's kernel, (d + 2) / (2 c_d) (1 - |n|^2): the squared radius is Beta(d/2, 2). Their variance is
 * 1 / (d + 4). A vector of d + 4 normals divided by its length is such a point. */
#include "pflight/regularised.h"

#include "pflight/math.h"

#include "kernel.h"
#include "sqrt_kernel.h"

#define MORE_NORMALS 4u
#define WIDEST 0.99f /* pfl_kernel_t.width lies below 1 */

void pfl_kernel_gaussian(pfl_t *f)
{
    pfl_kernel_spread(f, 0.0f, NULL);
}

/* The squares of the four normals that are not used for anything else, added up; two at a time, for the stack. */
static void sum_of_four(pfl_t *f, uint32_t n, float *restrict sum)
{
    for (uint32_t i = 0u; i < n; i += PFL_GROUP) {
        float two[2u * PFL_GROUP];
        for (uint32_t pair = 0u; pair < 2u; pair++) {
            pfl_rng_normals(&f->rng, two, 2u);
            for (uint32_t k = 0u; k < PFL_GROUP; k++) {
                const float squares = (two[k] * two[k]) + (two[PFL_GROUP + k] * two[PFL_GROUP + k]);
                sum[i + k] = (pair == 0u) ? squares : (sum[i + k] + squares);
            }
        }
    }
}

static void epanechnikov(pfl_t *f, uint32_t n)
{
    const uint32_t states = f->config->states;
    float *restrict sum = &f->work[PFL_WORK_FLOATS(states, f->config->noises) - PFL_BATCH];
    uint32_t taking = 0u;
    sum_of_four(f, n, sum);
    for (uint32_t d = 0u; d < states; d++) {
        const float *restrict noise = &f->work[(size_t)d * PFL_BATCH];
        if (pfl_kernel_takes(f, d)) {
            taking++;
            for (uint32_t i = 0u; i < n; i++) {
                sum[i] += noise[i] * noise[i];
            }
        }
    }
    const float variance = (float)(taking + MORE_NORMALS);
    for (uint32_t i = 0u; i < n; i++) {
        sum[i] = pfl_sqrt_kernel(variance / sum[i]);
    }
    for (uint32_t d = 0u; d < states; d++) {
        float *restrict noise = &f->work[(size_t)d * PFL_BATCH];
        for (uint32_t i = 0u; i < n; i++) {
            noise[i] *= sum[i];
        }
    }
}

void pfl_kernel_epanechnikov(pfl_t *f)
{
    pfl_kernel_spread(f, 0.0f, epanechnikov);
}

/* ---- Widths ------------------------------------------------------------------------------------------------------- */

static float no_wider(float width)
{
    return (width < WIDEST) ? width : WIDEST;
}

float pfl_kernel_width_gaussian(uint32_t particles, uint32_t states)
{
    const float d = (float)(int32_t)states;
    const float n = (float)(int32_t)particles;
    return no_wider(pfl_expf((pfl_logf(4.0f / (d + 2.0f)) - pfl_logf(n)) / (d + 4.0f)));
}

/* A = (8 (d + 4) (2 sqrt pi)^d / c_d)^(1 / (d + 4)), c_d the volume of the unit ball; in units of the kernel's deviation. */
float pfl_kernel_width_epanechnikov(uint32_t particles, uint32_t states)
{
    const float d = (float)(int32_t)states;
    const float n = (float)(int32_t)particles;
    float volume = ((states & 1u) != 0u) ? 2.0f : 1.0f;
    for (uint32_t k = 2u + (states & 1u); k <= states; k += 2u) {
        volume *= (2.0f * PFL_PI) / (float)(int32_t)k;
    }
    const float log_base = pfl_logf((8.0f * (d + 4.0f)) / volume) + (d * 1.26551212f); /* log(2 sqrt pi) */
    const float h = pfl_expf((log_base - pfl_logf(n)) / (d + 4.0f));
    return no_wider(h / pfl_sqrt_kernel(d + 4.0f));
}

float pfl_kernel_width_discount(float delta)
{
    const float a = ((3.0f * delta) - 1.0f) / (2.0f * delta);
    return no_wider(pfl_sqrt_kernel(1.0f - (a * a)));
}
