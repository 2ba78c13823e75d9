/* Idle-time repair of what memory errors leave in particles, weights and random streams. The control block, the
 * configuration and the canaries are looked at by every call anyway (guard.c). */
#include "core.h"

#include "rng_kernels.h"

static uint32_t count_outside_box(const pfl_t *f)
{
    uint32_t outside = 0u;
    for (uint32_t d = 0u; (f->config->lo != NULL) && (d < f->config->states); d++) {
        const float *x = &f->x[(size_t)d * f->stride];
        for (uint32_t i = 0u; i < f->config->particles; i++) {
            outside += ((x[i] < f->config->lo[d]) || (x[i] > f->config->hi[d])) ? 1u : 0u;
        }
    }
    return outside;
}

/* Log-weights that no update can have written. One of them is at the top, where the heaviest particle stands. */
uint32_t pfl_mend_log_weights(pfl_t *f)
{
    uint32_t bad = 0u;
    uint32_t lost = 1u;
    for (uint32_t i = 0u; i < f->config->particles; i++) {
        const float relative = f->log_weight[i] - f->log_weight_top;
        if (!pfl_is_not_nan(relative) || (relative > 0.0f)) {
            f->log_weight[i] = pfl_from_bits((int32_t)0xFF800000u);
            bad++;
        }
        lost = (relative >= 0.0f) ? 0u : lost;
    }
    return bad + lost;
}

static bool best_is_finite(const pfl_t *f)
{
    bool finite = true;
    for (uint32_t d = 0u; d < f->config->states; d++) {
        finite = finite && pfl_is_finite(f->best[d]);
    }
    return finite;
}

/* What takes the place of broken particles must be whole itself. */
static uint32_t mend_best(pfl_t *f)
{
    if (best_is_finite(f)) {
        return 0u;
    }
    for (uint32_t d = 0u; d < f->config->states; d++) {
        f->best[d] = pfl_is_finite(f->mean[d]) ? f->mean[d] : 0.0f;
    }
    return 1u;
}

pfl_status_t pfl_scrub(pfl_t *f, uint32_t *mended)
{
    const pfl_status_t entered = pfl_begin(f);
    if (entered != PFL_OK) {
        return entered;
    }
    const uint32_t before = f->mended;
    pfl_weights_settle(f);
    pfl_count(&f->mended, mend_best(f) + count_outside_box(f));
    pfl_count(&f->mended, pfl_quarantine(f, 0u, f->config->particles));
    pfl_clip_to_box(f, 0u, f->config->particles);
    pfl_count(&f->mended, pfl_mend_log_weights(f));
    pfl_count(&f->mended, pfl_revive_random(f) ? 1u : 0u);
    if (f->mended != before) {
        pfl_weights_after_loss(f);
        f->watched.event |= PFL_EVENT_MENDED;
    }
    const pfl_status_t status = pfl_end(f, PFL_OK);
    if (mended != NULL) {
        *mended = f->mended - before;
    }
    return status;
}

bool pfl_revive_random(pfl_t *f)
{
    if (pfl_rng_alive(&f->rng)) {
        return false;
    }
    pfl_rng_revive(&f->rng, (uint32_t)f->t_us);
    f->watched.fault |= PFL_FAULT_RANDOM;
    f->watched.event |= PFL_EVENT_MENDED;
    return true;
}
