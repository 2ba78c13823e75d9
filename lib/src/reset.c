/* Starting anew from the prior, and the account of it that a controller downstream needs. */
#include "guard.h"

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

/* Delta holds the mean before; it becomes the jump. */
static void account(pfl_t *f, uint32_t event)
{
    for (uint32_t d = 0u; d < f->config->states; d++) {
        const float jump = f->mean[d] - f->delta[d];
        const float near = (((f->config->circular_mask >> d) & 1u) != 0u) ? pfl_wrap_pi_kernel(jump) : jump;
        f->delta[d] = pfl_is_finite(near) ? near : ((near > 0.0f) ? FLT_MAX : -FLT_MAX);
    }
    f->reset_t_us = f->t_us;
    f->resample_pending = 0u;
    pfl_count(&f->resets, 1u);
    f->watched.event |= event;
}

static pfl_status_t reset(pfl_t *f, uint64_t t_us)
{
    if (f->config->draw == NULL) {
        return PFL_ERR_NO_DRAW;
    }
    pfl_refresh(f);
    memcpy(f->delta, f->mean, sizeof(float) * f->config->states);
    const pfl_status_t drawn = pfl_draw_prior(f);
    if (drawn != PFL_OK) {
        gather_at_mean(f, f->delta);
    }
    f->t_us = t_us;
    f->t_fused_us = t_us;
    f->test_ratio = 0.0f;
    account(f, PFL_EVENT_RESET);
    (void)pfl_watch_tell(f, WATCH_RESET, 0u, NULL);
    return (drawn == PFL_OK) ? PFL_OK : pfl_fault(f, drawn);
}

pfl_status_t pfl_reset(pfl_t *f, uint64_t t_us)
{
    const pfl_status_t entered = pfl_begin(f);
    return (entered == PFL_OK) ? pfl_end(f, reset(f, t_us)) : entered;
}

/* ---- Reinjection (Lenser and Veloso 2000: sensor resetting) ---------------------------------------------------- */

static void redraw(pfl_t *f, const pfl_sensor_t *sensor, const void *z, const pfl_batch_t *batch)
{
    f->busy = 1u;
    if (sensor->redraw != NULL) {
        sensor->redraw((sensor->user != NULL) ? sensor->user : f->config->user, z, batch);
    } else {
        f->config->draw(f->config->user, batch);
    }
    f->busy = 0u;
    pfl_guard_after_callback(f);
}

bool pfl_reinject(pfl_t *f, uint32_t sensor, const void *z)
{
    const pfl_sensor_t *s = &f->config->sensors[sensor];
    if ((s->redraw == NULL) && (f->config->draw == NULL)) {
        return false;
    }
    const uint32_t count = f->config->particles;
    const uint32_t share = (uint32_t)(f->config->watch->reinject * (float)count);
    const uint32_t drawn = (share > 0u) ? share : 1u;
    pfl_refresh(f);
    memcpy(f->delta, f->mean, sizeof(float) * f->config->states);
    pfl_weights(f);
    pfl_resample_now(f);
    pfl_guard_take_over(f);
    for (uint32_t first = count - drawn; first < count; first += PFL_BATCH) {
        const uint32_t n = ((count - first) < PFL_BATCH) ? (count - first) : PFL_BATCH;
        const pfl_batch_t batch = pfl_batch_at(f, first, n);
        pfl_make_noise(f, f->config->states, n);
        redraw(f, s, z, &batch);
        (void)pfl_quarantine(f, first, n);
        pfl_clip_to_box(f, first, n);
    }
    pfl_guard_after_batches(f);
    pfl_weights_equal(f);
    (void)pfl_moments(f, false);
    account(f, PFL_EVENT_REINJECTED);
    return true;
}

/* ---- The account ----------------------------------------------------------------------------------------------- */

pfl_status_t pfl_last_reset(const pfl_t *f, uint32_t *count, uint64_t *t_us, float *delta)
{
    const pfl_status_t looked = pfl_look(f);
    if (looked != PFL_OK) {
        return looked;
    }
    for (uint32_t d = 0u; d < f->config->states; d++) {
        if (!pfl_is_finite(f->delta[d])) {
            return PFL_ERR_CORRUPT; /* damaged where it lay */
        }
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
