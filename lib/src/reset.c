/* Starting anew from the prior, and the account of it that a controller downstream needs. */
#include "core.h"

#include "math_kernels.h"

/* A draw that fails leaves a filter that still answers: every particle at the last mean. */
static void gather_at_mean(pfl_t *f, const float *mean)
{
    for (uint32_t d = 0u; d < f->config->states; d++) {
        for (uint32_t i = 0u; i < f->config->particles; i++) {
            f->x[((size_t)d * f->stride) + i] = mean[d];
        }
        f->best[d] = mean[d];
    }
    pfl_weights_equal(f);
    (void)pfl_moments(f, false);
}

pfl_status_t pfl_reset(pfl_t *f, uint64_t t_us)
{
    const pfl_status_t entered = pfl_begin(f);
    if (entered != PFL_OK) {
        return entered;
    }
    if (f->config->draw == NULL) {
        return PFL_ERR_NO_DRAW;
    }
    const uint32_t states = f->config->states;
    pfl_refresh(f);
    memcpy(f->delta, f->mean, sizeof(float) * states); /* the mean before, until the jump is known */
    const pfl_status_t drawn = pfl_draw_prior(f);
    if (drawn != PFL_OK) {
        gather_at_mean(f, f->delta);
    }
    for (uint32_t d = 0u; d < states; d++) {
        const float jump = f->mean[d] - f->delta[d];
        const float near = (((f->config->circular_mask >> d) & 1u) != 0u) ? pfl_wrap_pi_kernel(jump) : jump;
        f->delta[d] = pfl_is_finite(near) ? near : ((near > 0.0f) ? FLT_MAX : -FLT_MAX);
    }
    f->t_us = t_us;
    f->reset_t_us = t_us;
    f->t_fused_us = t_us;
    f->test_ratio = 0.0f;
    f->resample_pending = 0u;
    pfl_count(&f->resets, 1u);
    return (drawn == PFL_OK) ? PFL_OK : pfl_fault(f, drawn);
}

pfl_status_t pfl_last_reset(const pfl_t *f, uint32_t *count, uint64_t *t_us, float *delta)
{
    if (f == NULL) {
        return PFL_ERR_ARG;
    }
    if (!pfl_is_alive(f)) {
        return PFL_ERR_CORRUPT;
    }
    if (count != NULL) {
        *count = f->resets;
    }
    if (t_us != NULL) {
        *t_us = f->reset_t_us;
    }
    if (delta != NULL) {
        memcpy(delta, f->delta, sizeof(float) * f->config->states);
    }
    return PFL_OK;
}
