/* The kernel step after resampling: copies move apart, mean and covariance stay. filter.h has the equation. Steps of other
 * kernels (regularised.c) differ in the pull and in the shape of the noise. */
#include "kernel.h"

#include "math_kernels.h"
#include "sqrt_kernel.h"

/* Position of element (d, e), d <= e, in an upper triangle stored row by row. */
static size_t at(size_t states, size_t d, size_t e)
{
    return ((d * ((2u * states) - d + 1u)) / 2u) + (e - d);
}

/* Cholesky root of the covariance in place: C = U' U, U upper triangular. A state without spread of its own gets a row
 * of zeros, so that a semi-definite matrix is no error. */
PFL_NOINLINE static void root_in_place(const pfl_t *f, float *u)
{
    const uint32_t states = f->config->states;
    for (uint32_t d = 0u; d < states; d++) {
        const float whole = u[at(states, d, d)];
        float rest = whole;
        for (uint32_t k = 0u; k < d; k++) {
            rest -= u[at(states, k, d)] * u[at(states, k, d)];
        }
        const bool spread = pfl_kernel_takes(f, d) && (rest > (whole * 1.0e-6f));
        const float pivot = spread ? pfl_sqrt_kernel(rest) : 0.0f;
        const float inverse = spread ? (1.0f / pivot) : 0.0f;
        u[at(states, d, d)] = pivot;
        for (uint32_t e = d + 1u; e < states; e++) {
            float sum = u[at(states, d, e)];
            for (uint32_t k = 0u; k < d; k++) {
                sum -= u[at(states, k, d)] * u[at(states, k, e)];
            }
            u[at(states, d, e)] = pfl_kernel_takes(f, e) ? (sum * inverse) : 0.0f;
        }
    }
}

/* A cloud so wide that its moments overflow has no root to move along. A product with zero is NaN for what is not
 * finite. */
static bool root_is_finite(const pfl_t *f)
{
    const uint32_t states = f->config->states;
    float sum = 0.0f;
    for (uint32_t d = 0u; d < states; d++) {
        sum += f->kernel_mean[d] * 0.0f;
    }
    for (uint32_t k = 0u; k < ((states * (states + 1u)) / 2u); k++) {
        sum += f->kernel_cov[k] * 0.0f;
    }
    return pfl_is_finite(sum);
}

PFL_NOINLINE static void move_state(pfl_t *f, uint32_t d, uint32_t first, uint32_t n, float pull)
{
    const uint32_t states = f->config->states;
    const float width = f->config->kernel->width;
    const float mean = f->kernel_mean[d];
    const bool circular = ((f->config->circular_mask >> d) & 1u) != 0u;
    float *restrict x = &f->x[((size_t)d * f->stride) + first];
    for (uint32_t i = 0u; i < n; i++) {
        const float back = mean - x[i];
        x[i] += pull * (circular ? pfl_wrap_pi_kernel(back) : back);
    }
    for (uint32_t k = 0u; k <= d; k++) {
        const float scale = width * f->kernel_cov[at(states, k, d)];
        const float *restrict noise = &f->work[(size_t)k * PFL_BATCH];
        for (uint32_t i = 0u; i < n; i++) {
            x[i] += scale * noise[i];
        }
    }
}

void pfl_kernel_spread(pfl_t *f, float pull, void (*shape)(pfl_t *f, uint32_t n))
{
    const uint32_t count = f->config->particles;
    pfl_cloud_moments(f, f->kernel_mean, f->kernel_cov);
    root_in_place(f, f->kernel_cov);
    if (!root_is_finite(f)) {
        return;
    }
    for (uint32_t first = 0u; first < count; first += PFL_BATCH) {
        const uint32_t n = ((count - first) < PFL_BATCH) ? (count - first) : PFL_BATCH;
        pfl_make_noise(f, f->config->states, n);
        if (shape != NULL) {
            shape(f, n);
        }
        for (uint32_t d = 0u; d < f->config->states; d++) {
            if (pfl_kernel_takes(f, d)) {
                move_state(f, d, first, n, pull);
            }
        }
        pfl_clip_to_box(f, first, n);
    }
}

void pfl_kernel_move(pfl_t *f)
{
    const float width = f->config->kernel->width;
    pfl_kernel_spread(f, 1.0f - pfl_sqrt_kernel(1.0f - (width * width)), NULL);
}
