/* The look ahead of the auxiliary filter: auxiliary.h tells what it is.
 *
 * Particles are moved in copies, as many at a time as half the work columns hold: their states in the second halves, a
 * noise of zeros in the first. */
#include "pflight/auxiliary.h"

#include "guard.h"
#include "scout.h"

#define CHUNK (PFL_BATCH / 2u)

/* One look on its way. */
typedef struct {
    const pfl_auxiliary_t *a;
    const void *u;
    const void *z;
    uint32_t dt_us;
    pfl_scout_t found;
} look_t;

/* A copy of n particles through the model without noise, in the pieces of a predict. */
static pfl_view_t moved(pfl_t *f, const look_t *w, uint32_t first, uint32_t n)
{
    const uint32_t longest = (f->config->dt_max_us != 0u) ? f->config->dt_max_us : UINT32_MAX;
    const uint32_t pieces = (w->dt_us / longest) + (((w->dt_us % longest) != 0u) ? 1u : 0u);
    const pfl_batch_t batch = {&f->work[CHUNK], PFL_BATCH, f->work, first, n};
    const pfl_view_t view = {batch.x, PFL_BATCH, first, n};
    uint32_t left_us = w->dt_us;
    for (uint32_t d = 0u; d < f->config->states; d++) {
        memcpy(PFL_STATE(&batch, d), &f->x[((size_t)d * f->stride) + first], sizeof(float) * n);
    }
    for (uint32_t k = pieces; k > 0u; k--) {
        const uint32_t piece_us = left_us / k;
        for (uint32_t q = 0u; q < f->config->noises; q++) {
            memset(&f->work[(size_t)q * PFL_BATCH], 0, sizeof(float) * n);
        }
        f->config->predict(f->config->user, w->u, (float)piece_us * 1.0e-6f, &batch);
        left_us -= piece_us;
    }
    return view;
}

/* What the measurement says of all particles, into the scratch column. */
static pfl_status_t scout(pfl_t *f, look_t *w)
{
    const uint32_t count = f->config->particles;
    f->scratch_is_weights = 0u;
    for (uint32_t first = 0u; first < count; first += CHUNK) {
        const uint32_t n = ((count - first) < CHUNK) ? (count - first) : CHUNK;
        f->busy = 1u;
        const pfl_view_t view = moved(f, w, first, n);
        float *ll = pfl_guard_bay(f, n);
        w->a->loglik(w->a->user, w->z, &view, ll);
        f->busy = 0u;
        pfl_guard_after_callback(f);
        if (!pfl_guard_bay_is_whole(ll, n)) {
            return PFL_ERR_CORRUPT;
        }
        pfl_scout_keep(&w->found, ll, n, &f->scratch[first]);
    }
    pfl_guard_after_batches(f);
    return pfl_scout_verdict(&w->found);
}

/* Every particle's weight is one over what it was favoured by. */
static void take_off(pfl_t *f, const float *restrict favour)
{
    const uint32_t count = f->config->particles;
    float least = favour[0];
    for (uint32_t i = 1u; i < count; i++) {
        least = (favour[i] < least) ? favour[i] : least;
    }
    for (uint32_t i = 0u; i < count; i++) {
        f->log_weight[i] = (least - favour[i]) - PFL_LOGLIK_SHIFT;
    }
    for (uint32_t i = count; i < pfl_padded(f); i++) {
        f->log_weight[i] = pfl_from_bits((int32_t)0xFF800000u);
    }
    f->weights_equal = 0u;
    f->scratch_is_weights = 0u;
    f->log_weight_top = -PFL_LOGLIK_SHIFT;
    pfl_set_best(f, 0u);
}

static pfl_status_t look(pfl_t *f, look_t *w)
{
    const uint32_t count = f->config->particles;
    float *favour = &f->x[(size_t)w->a->state * f->stride];
    const pfl_status_t scouted = scout(f, w);
    if (scouted != PFL_OK) {
        return pfl_fault(f, scouted);
    }
    if ((w->a->gate > 0.0f) && ((-2.0f * w->found.best) > w->a->gate)) {
        return PFL_REJECTED;
    }
    if ((w->a->ess_ratio < 1.0f) && (pfl_scout_ess(f, 1.0f) >= (w->a->ess_ratio * (float)count))) {
        return PFL_OK;
    }
    const uint32_t moments = f->moments_current;
    memcpy(favour, f->scratch, sizeof(float) * count);
    if (!pfl_scout_weigh(f, 1.0f)) {
        memset(favour, 0, sizeof(float) * count);
        return PFL_REJECTED;
    }
    pfl_weights(f);
    pfl_resample_now(f);
    take_off(f, favour);
    f->moments_current = moments;
    return PFL_OK;
}

/* As pfl_predict will find it. */
static pfl_status_t timely(const pfl_t *f, uint64_t t_us)
{
    const uint64_t longest = f->config->dt_max_us;
    const uint64_t dt_us = t_us - f->t_us;
    if (t_us < f->t_us) {
        return PFL_ERR_TIME;
    }
    const bool gap = (dt_us > UINT32_MAX) || ((longest != 0u) && (dt_us > (longest * PFL_SUBSTEPS_MAX)));
    return gap ? PFL_ERR_GAP : PFL_OK;
}

pfl_status_t pfl_auxiliary_look(pfl_t *f, const pfl_auxiliary_t *a, uint64_t t_us, const void *u, const void *z)
{
    if ((a == NULL) || (z == NULL)) {
        return PFL_ERR_ARG;
    }
    const pfl_status_t entered = pfl_begin(f);
    if (entered != PFL_OK) {
        return entered;
    }
    if (a->state >= f->config->states) {
        return pfl_end(f, PFL_ERR_CONFIG);
    }
    pfl_status_t status = timely(f, t_us);
    if (status == PFL_OK) {
        look_t w = {a, u, z, (uint32_t)(t_us - f->t_us), PFL_SCOUT_NOTHING};
        pfl_meter_resume(f);
        status = look(f, &w);
        pfl_meter_pause(f);
    }
    return pfl_end(f, status);
}
