/* The tempered update: tempered.h tells what it is.
 *
 * A scout evaluates the whole log-likelihood of every particle into the scratch column, which is free before an update.
 * From there the effective sample size of any power of the likelihood is a sweep of arithmetic. The first step goes
 * through pfl_update, whose callback hands out the scouted values times the power: so admission, gate, counters and watch
 * see one ordinary measurement. Later steps only change weights. */
#include "pflight/tempered.h"

#include "guard.h"
#include "math_kernels.h"
#include "scout.h"

#define POWER_HALVINGS 16 /* the least power of a step: 2^-16 of the rest */

void pfl_tempered_loglik(void *user, const void *z, const pfl_view_t *p, float *restrict ll)
{
    const pfl_tempered_t *m = (const pfl_tempered_t *)user;
    if (m->held == NULL) {
        m->loglik(m->user, z, p, ll);
        return;
    }
    const float *restrict held = &m->held[p->first];
    for (uint32_t i = 0u; i < p->n; i++) {
        ll[i] = m->power * held[i];
    }
}

/* ---- Scout -------------------------------------------------------------------------------------------------------- */

/* One measurement on its way into the filter. */
typedef struct {
    pfl_tempered_t *m;
    const void *z;
    uint32_t sensor;
    float best; /* log-likelihood in the last scout */
    float rest; /* of the power, not yet fused */
} fusion_t;

/* The whole log-likelihood of all particles into the scratch column. */
static pfl_status_t scout(pfl_t *f, fusion_t *w)
{
    pfl_scout_t found = PFL_SCOUT_NOTHING;
    f->scratch_is_weights = 0u;
    for (uint32_t first = 0u; first < f->config->particles; first += PFL_BATCH) {
        const uint32_t n = pfl_scout_batch(f, first);
        const pfl_view_t view = pfl_guard_view(f, first, n);
        float *ll = pfl_guard_bay(f, n);
        f->busy = 1u;
        w->m->loglik(w->m->user, w->z, &view, ll);
        f->busy = 0u;
        pfl_guard_after_callback(f);
        if (!pfl_guard_bay_is_whole(ll, n)) {
            return PFL_ERR_CORRUPT;
        }
        pfl_scout_keep(&found, ll, n, &f->scratch[first]);
    }
    pfl_guard_after_batches(f);
    w->best = found.best;
    return pfl_scout_verdict(&found);
}

/* ---- How much of it at once ------------------------------------------------------------------------------------------ */

/* The largest power of two times 1 or 1.5 that leaves the effective sample size above the bound, by bisection over its
 * half steps; all of the rest where that is small enough. */
static float power_of_step(pfl_t *f, const pfl_tempered_t *m, float rest)
{
    const float bound = m->ess_share * (float)f->config->particles;
    if (pfl_scout_ess(f, rest) >= bound) {
        return rest;
    }
    int32_t low = -2 * POWER_HALVINGS; /* taken, whatever it leaves */
    int32_t high = 0;                  /* too much */
    float power = rest * pfl_pow2i(-POWER_HALVINGS);
    while ((high - low) > 1) {
        const int32_t middle = (low + high) >> 1;
        const float trial = rest * (pfl_pow2i(middle >> 1) * (((middle & 1) != 0) ? 1.5f : 1.0f));
        if (pfl_scout_ess(f, trial) >= bound) {
            low = middle;
            power = trial;
        } else {
            high = middle;
        }
    }
    return power;
}

/* ---- Steps ------------------------------------------------------------------------------------------------------------ */

/* Scouts, and chooses the power of the first step: all of it for what pfl_update is going to refuse. */
static void prepare(pfl_t *f, fusion_t *w)
{
    const float gate = f->config->sensors[w->sensor].gate;
    w->m->power = 1.0f;
    pfl_meter_resume(f);
    if (scout(f, w) == PFL_OK) {
        const bool refused = (gate > 0.0f) && ((-2.0f * w->best) > gate);
        const bool whole = refused || (w->m->steps <= 1u) || pfl_meter_spent(f);
        w->m->power = whole ? 1.0f : power_of_step(f, w->m, 1.0f);
        w->m->held = f->scratch;
    }
    pfl_meter_pause(f);
}

/* Health is that of the whole log-likelihood, not of the first step's share. */
static void tell_of_the_whole(pfl_t *f, const fusion_t *w)
{
    const bool watched = f->config->watch != NULL;
    const float gate = f->config->sensors[w->sensor].gate;
    if (gate > 0.0f) {
        f->test_ratio = (w->best < 0.0f) ? ((-2.0f * w->best) / gate) : 0.0f;
    }
    if ((gate > 0.0f) || watched) {
        f->watched.best_loglik = w->best;
    }
    if (watched) {
        f->sensor[w->sensor].test_ratio = f->test_ratio;
    }
}

/* What pfl_update does once the weights are in. */
static pfl_status_t conclude(pfl_t *f)
{
    if (pfl_moments(f, true)) {
        if (!pfl_resample_is_due(f)) {
            return PFL_OK;
        }
        if (!pfl_meter_spent(f)) {
            pfl_resample_now(f);
            return PFL_OK;
        }
    }
    f->resample_pending = 1u;
    f->watched.event |= PFL_EVENT_DEFERRED;
    return PFL_DEFERRED;
}

/* One step more. The step before has used up the cloud as far as it should: it is resampled whatever the configured
 * ratio. */
static pfl_status_t go_on(pfl_t *f, fusion_t *w)
{
    const bool last = pfl_meter_spent(f) || ((w->m->taken + 1u) >= w->m->steps);
    if ((f->weights_equal == 0u) && !pfl_meter_spent(f)) {
        pfl_weights(f);
        pfl_resample_now(f);
        pfl_guard_take_over(f);
    }
    const pfl_status_t scouted = scout(f, w);
    if (scouted != PFL_OK) {
        return pfl_fault(f, scouted);
    }
    const float power = last ? w->rest : power_of_step(f, w->m, w->rest);
    if (!pfl_scout_weigh(f, power)) {
        return PFL_REJECTED;
    }
    w->m->taken++;
    w->rest = (power < w->rest) ? (w->rest - power) : 0.0f;
    return (w->rest > 0.0f) ? PFL_OK : conclude(f);
}

static pfl_status_t step_more(pfl_t *f, fusion_t *w)
{
    const pfl_status_t entered = pfl_begin(f);
    if (entered != PFL_OK) {
        return entered;
    }
    if (w->m->taken == 1u) {
        tell_of_the_whole(f, w);
    }
    pfl_meter_resume(f);
    const pfl_status_t status = go_on(f, w);
    pfl_meter_pause(f);
    return pfl_end(f, status);
}

static pfl_status_t fuse(pfl_t *f, uint64_t t_us, fusion_t *w)
{
    w->m->held = NULL;
    w->m->taken = 0u;
    if (t_us == f->t_us) {
        prepare(f, w);
    }
    pfl_status_t status = pfl_end(f, PFL_OK);
    if (status == PFL_OK) {
        status = pfl_update(f, (uint16_t)w->sensor, t_us, w->z);
    }
    w->m->held = NULL;
    if (status < PFL_OK) {
        return status;
    }
    w->m->taken = 1u;
    w->rest = 1.0f - w->m->power;
    while ((status >= PFL_OK) && (w->rest > 0.0f)) {
        status = step_more(f, w);
    }
    return status;
}

pfl_status_t pfl_tempered_update(pfl_t *f, uint16_t sensor, uint64_t t_us, const void *z)
{
    const pfl_status_t entered = (z != NULL) ? pfl_begin(f) : PFL_ERR_ARG;
    if (entered != PFL_OK) {
        return entered;
    }
    const pfl_config_t *c = f->config;
    if ((sensor >= c->sensor_count) || (c->sensors[sensor].loglik != pfl_tempered_loglik) ||
        (c->sensors[sensor].user == NULL)) {
        return pfl_end(f, PFL_ERR_SENSOR);
    }
    fusion_t w = {(pfl_tempered_t *)c->sensors[sensor].user, z, sensor, 0.0f, 1.0f};
    return fuse(f, t_us, &w);
}
