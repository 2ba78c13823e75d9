/* A filter's life and its cycle: init, predict, update. */
#include "guard.h"

#include "pflight/port.h"

/* ---- Prior ---------------------------------------------------------------------------------------------------- */

pfl_status_t pfl_draw_prior(pfl_t *f)
{
    const uint32_t count = f->config->particles;
    for (uint32_t first = 0u; first < count; first += PFL_BATCH) {
        const uint32_t n = ((count - first) < PFL_BATCH) ? (count - first) : PFL_BATCH;
        if (f->config->draw != NULL) {
            const pfl_batch_t batch = pfl_batch_at(f, first, n);
            pfl_make_noise(f, f->config->states, n);
            f->busy = 1u;
            f->config->draw(f->config->user, &batch);
            f->busy = 0u;
            pfl_guard_after_callback(f);
        }
        if (pfl_count_nonfinite(f, first, n) != 0u) {
            return PFL_ERR_NONFINITE;
        }
        pfl_clip_to_box(f, first, n);
    }
    pfl_guard_after_batches(f);
    f->best_index = 0u;
    for (uint32_t d = 0u; d < f->config->states; d++) {
        f->best[d] = f->x[(size_t)d * f->stride];
    }
    pfl_weights_equal(f);
    (void)pfl_moments(f, false);
    return PFL_OK;
}

/* A sensor is not late before its first timeout, and a budget needs a counter. */
static void start_watch(pfl_t *f)
{
    for (uint32_t k = 0u; (f->sensor != NULL) && (k < f->config->sensor_count); k++) {
        f->sensor[k].t_fused_us = f->t_us;
    }
    const bool blind = (f->config->budget_cycles != 0u) && (f->meter.mask == 0u);
    f->watched.fault = blind ? PFL_FAULT_PORT : 0u;
}

pfl_status_t pfl_init(void *arena, size_t arena_bytes, const pfl_config_t *config, uint64_t t_us, pfl_t **out)
{
    if (out == NULL) {
        return PFL_ERR_ARG;
    }
    *out = NULL;
    if (config == NULL) {
        return PFL_ERR_ARG;
    }
    if (config->abi != PFL_ABI) {
        return PFL_ERR_ABI;
    }
    if (!pfl_config_is_good(config)) {
        return PFL_ERR_CONFIG;
    }
    pfl_t *f = NULL;
    const pfl_status_t laid = pfl_lay_out(arena, arena_bytes, config, &f);
    if (laid != PFL_OK) {
        return laid;
    }
    f->t_us = t_us;
    f->t_fused_us = t_us;
    f->meter.mask = pfl_port_self_test() ? pfl_port_cycles_mask() : 0u;
    pfl_rng_seed(&f->rng, config->seed);
    start_watch(f);
    pfl_guard_start(f);
    pfl_status_t status = pfl_draw_prior(f);
    if (status == PFL_OK) {
        f->alive = PFL_ALIVE;
        status = pfl_guard_close(f, PFL_OK);
    } else {
        (void)pfl_fault(f, status);
    }
    *out = (status == PFL_OK) ? f : NULL;
    return status;
}

/* ---- Predict -------------------------------------------------------------------------------------------------- */

/* A time stamp that does not fit is worth a bit in the mask, but nothing went wrong in here. */
static pfl_status_t misfit(pfl_t *f, pfl_status_t status)
{
    f->watched.fault |= PFL_FAULT_TIME;
    return status;
}

/* Found before anything is begun: a refusal leaves the cycle's count alone too. */
static bool is_gap(const pfl_t *f, uint64_t dt_us)
{
    const uint64_t longest = f->config->dt_max_us;
    return (dt_us > UINT32_MAX) || ((longest != 0u) && (dt_us > (longest * PFL_SUBSTEPS_MAX)));
}

static pfl_status_t predict(pfl_t *f, uint64_t t_us, const void *u)
{
    if (t_us == f->t_us) {
        return PFL_OK;
    }
    if (t_us < f->t_us) {
        return misfit(f, PFL_ERR_TIME);
    }
    if (is_gap(f, t_us - f->t_us)) {
        return misfit(f, PFL_ERR_GAP);
    }
    f->watched.fault &= PFL_FAULT_PORT;
    f->watched.event = 0u;
    f->watched.quarantined = 0u;
    (void)pfl_revive_random(f);
    pfl_meter_begin(f);
    pfl_meter_resume(f);
    const uint32_t before = f->quarantined;
    const pfl_status_t status = pfl_propagate(f, (uint32_t)(t_us - f->t_us), u);
    const uint32_t lost = f->quarantined - before;
    pfl_meter_pause(f);
    f->watched.event |= (lost != 0u) ? PFL_EVENT_QUARANTINED : 0u;
    (void)pfl_watch_tell(f, WATCH_MOVED, lost, NULL);
    return status;
}

pfl_status_t pfl_predict(pfl_t *f, uint64_t t_us, const void *u)
{
    const pfl_status_t entered = pfl_begin(f);
    return (entered == PFL_OK) ? pfl_end(f, predict(f, t_us, u)) : entered;
}

/* ---- Update --------------------------------------------------------------------------------------------------- */

/* All log-likelihoods into the scratch column; PFL_ERR_BUDGET when the budget ends first. */
PFL_NOINLINE static pfl_status_t weigh(pfl_t *f, const pfl_sensor_t *sensor, const void *z, pfl_weigh_t *w)
{
    const uint32_t count = f->config->particles;
    void *user = (sensor->user != NULL) ? sensor->user : f->config->user;
    pfl_weigh_start(w, (sensor->gate > 0.0f) || (f->config->watch != NULL));
    f->scratch_is_weights = 0u;
    for (uint32_t first = 0u; first < count; first += PFL_BATCH) {
        const uint32_t n = ((count - first) < PFL_BATCH) ? (count - first) : PFL_BATCH;
        if (pfl_meter_spent(f)) {
            return PFL_ERR_BUDGET;
        }
        const pfl_view_t view = pfl_guard_view(f, first, n);
        float *ll = pfl_guard_bay(f, n);
        f->busy = 1u;
        sensor->loglik(user, z, &view, ll);
        f->busy = 0u;
        pfl_guard_after_callback(f);
        if (!pfl_guard_bay_is_whole(ll, n)) {
            f->watched.event |= PFL_EVENT_MENDED;
            return PFL_ERR_CORRUPT;
        }
        pfl_weigh_batch(f, first, n, ll, w);
    }
    pfl_guard_after_batches(f);
    return PFL_OK;
}

/* Judges what the sensor said of the particles. */
PFL_NOINLINE static pfl_status_t judge(pfl_t *f, const pfl_sensor_t *sensor, const pfl_weigh_t *w)
{
    const int32_t minus_infinity = (int32_t)0xFF800000u;
    if (w->worst_bits > minus_infinity) {
        const bool positive = (w->worst_bits >= 0) && (w->worst_bits < 0x7F800000);
        return pfl_fault(f, positive ? PFL_ERR_LOGLIK : PFL_ERR_NONFINITE);
    }
    const float best = pfl_from_bits(w->best_bits) + PFL_LOGLIK_MAX;
    if (w->gated != 0u) {
        f->watched.best_loglik = pfl_is_finite(best) ? best : -FLT_MAX;
    }
    if (sensor->gate > 0.0f) {
        const float ratio = (-2.0f * best) / sensor->gate;
        f->test_ratio = pfl_is_finite(ratio) ? ((ratio > 0.0f) ? ratio : 0.0f) : FLT_MAX;
    } else {
        f->test_ratio = 0.0f;
    }
    if ((f->test_ratio > 1.0f) || (w->top_bits >= minus_infinity)) {
        return PFL_REJECTED;
    }
    return PFL_OK;
}

/* The new log-weights become the filter's: an exchange of two columns, and nothing can fail any more. */
static void commit(pfl_t *f, const pfl_weigh_t *w)
{
    float *old = f->log_weight;
    f->log_weight = f->scratch;
    f->scratch = old;
    f->weights_equal = 0u;
    f->log_weight_top = pfl_from_bits(w->top_bits);
    pfl_count(&f->fused, 1u);
    f->t_fused_us = f->t_us;
    pfl_set_best(f, w->top_first);
}

static pfl_status_t put_off(pfl_t *f)
{
    f->resample_pending = 1u;
    f->watched.event |= PFL_EVENT_DEFERRED;
    return PFL_DEFERRED;
}

static pfl_status_t fuse(pfl_t *f, const pfl_sensor_t *sensor, const void *z)
{
    pfl_weigh_t w;
    const pfl_status_t weighed = weigh(f, sensor, z, &w);
    if (weighed != PFL_OK) {
        return pfl_fault(f, weighed);
    }
    const pfl_status_t judged = judge(f, sensor, &w);
    if (judged != PFL_OK) {
        return judged;
    }
    commit(f, &w);
    if (!pfl_moments(f, true)) {
        return put_off(f);
    }
    if (pfl_resample_is_due(f)) {
        if (pfl_meter_spent(f)) {
            return put_off(f);
        }
        pfl_resample_now(f);
    }
    return PFL_OK;
}

static pfl_status_t update(pfl_t *f, uint16_t sensor, uint64_t t_us, const void *z)
{
    if (z == NULL) {
        return PFL_ERR_ARG;
    }
    if (sensor >= f->config->sensor_count) {
        return PFL_ERR_SENSOR;
    }
    const pfl_status_t news = (t_us == f->t_us) ? pfl_watch_tell(f, WATCH_ADMIT, sensor, z) : PFL_ERR_TIME;
    if (news == PFL_ERR_TIME) {
        return misfit(f, news);
    }
    pfl_meter_resume(f);
    const pfl_sensor_t now = f->config->sensors[sensor]; /* whatever becomes of it while its callback runs */
    const pfl_status_t status = (news == PFL_OK) ? fuse(f, &now, z) : news;
    if (status >= PFL_OK) {
        f->watched.reject &= ~(1u << sensor);
        (void)pfl_watch_tell(f, WATCH_FUSED, sensor, z);
    }
    if (status == PFL_REJECTED) {
        pfl_count(&f->rejected, 1u);
        f->watched.reject |= 1u << sensor;
        (void)pfl_watch_tell(f, WATCH_REFUSED, sensor, z);
    }
    pfl_meter_pause(f);
    return status;
}

pfl_status_t pfl_update(pfl_t *f, uint16_t sensor, uint64_t t_us, const void *z)
{
    const pfl_status_t entered = pfl_begin(f);
    return (entered == PFL_OK) ? pfl_end(f, update(f, sensor, t_us, z)) : entered;
}

pfl_status_t pfl_resample(pfl_t *f)
{
    const pfl_status_t entered = pfl_begin(f);
    if (entered != PFL_OK) {
        return entered;
    }
    pfl_meter_resume(f);
    pfl_refresh(f);
    pfl_weights(f);
    pfl_resample_now(f);
    pfl_meter_pause(f);
    return pfl_end(f, PFL_OK);
}
