/* A filter's life and its cycle: init, predict, update. */
#include "core.h"

#include "pflight/port.h"

/* ---- Particles that are not finite ---------------------------------------------------------------------------- */

static bool particle_is_finite(const pfl_t *f, uint32_t i)
{
    bool finite = true;
    for (uint32_t d = 0u; d < f->config->states; d++) {
        finite = finite && pfl_is_finite(f->x[((size_t)d * f->stride) + i]);
    }
    return finite;
}

static uint32_t count_nonfinite(const pfl_t *f, uint32_t first, uint32_t n)
{
    uint32_t found = 0u;
    for (uint32_t i = first; i < (first + n); i++) {
        found += particle_is_finite(f, i) ? 0u : 1u;
    }
    return found;
}

/* One addition a value: a NaN or an infinity anywhere in the batch stays in the sum. */
static bool batch_is_suspect(const pfl_t *f, uint32_t first, uint32_t n)
{
    float sum[8] = {0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f};
    for (uint32_t d = 0u; d < f->config->states; d++) {
        const float *x = &f->x[((size_t)d * f->stride) + first];
        for (uint32_t i = 0u; i < n; i += 8u) {
            for (uint32_t l = 0u; l < 8u; l++) {
                sum[l] += x[i + l];
            }
        }
    }
    const float all = ((sum[0] + sum[1]) + (sum[2] + sum[3])) + ((sum[4] + sum[5]) + (sum[6] + sum[7]));
    return !pfl_is_finite(all);
}

/* Non-finite particles take the state of the most likely one, which is finite, and lose their weight. */
static uint32_t quarantine(pfl_t *f, uint32_t first, uint32_t n)
{
    uint32_t found = 0u;
    for (uint32_t i = first; i < (first + n); i++) {
        if (!particle_is_finite(f, i)) {
            for (uint32_t d = 0u; d < f->config->states; d++) {
                f->x[((size_t)d * f->stride) + i] = f->best[d];
            }
            f->log_weight[i] = pfl_from_bits((int32_t)0xFF800000u);
            found++;
        }
    }
    f->quarantined = ((UINT32_MAX - f->quarantined) > found) ? (f->quarantined + found) : UINT32_MAX;
    return found;
}

static void clip_to_box(pfl_t *f, uint32_t first, uint32_t n)
{
    if (f->config->lo == NULL) {
        return;
    }
    for (uint32_t d = 0u; d < f->config->states; d++) {
        float *x = &f->x[((size_t)d * f->stride) + first];
        const float lo = f->config->lo[d];
        const float hi = f->config->hi[d];
        for (uint32_t i = 0u; i < n; i++) {
            const float low = (x[i] < lo) ? lo : x[i];
            x[i] = (low > hi) ? hi : low;
        }
    }
}

/* ---- Prior ---------------------------------------------------------------------------------------------------- */

/* `columns` of noise for n particles; full batches lie end to end and are one call. */
static void make_noise(pfl_t *f, uint32_t columns, uint32_t n)
{
    const uint32_t groups = (n + (PFL_GROUP - 1u)) / PFL_GROUP;
    if (n == PFL_BATCH) {
        pfl_rng_normals(&f->rng, f->work, (size_t)columns * groups);
    } else {
        for (uint32_t q = 0u; q < columns; q++) {
            pfl_rng_normals(&f->rng, &f->work[(size_t)q * PFL_BATCH], groups);
        }
    }
}

static pfl_batch_t batch_at(pfl_t *f, uint32_t first, uint32_t n)
{
    pfl_batch_t batch = {&f->x[first], f->stride, f->work, first, n};
    return batch;
}

pfl_status_t pfl_draw_prior(pfl_t *f)
{
    const uint32_t count = f->config->particles;
    for (uint32_t first = 0u; first < count; first += PFL_BATCH) {
        const uint32_t n = ((count - first) < PFL_BATCH) ? (count - first) : PFL_BATCH;
        if (f->config->draw != NULL) {
            const pfl_batch_t batch = batch_at(f, first, n);
            make_noise(f, f->config->states, n);
            f->busy = 1u;
            f->config->draw(f->config->user, &batch);
            f->busy = 0u;
        }
        if (count_nonfinite(f, first, n) != 0u) {
            return PFL_ERR_NONFINITE;
        }
        clip_to_box(f, first, n);
    }
    for (uint32_t d = 0u; d < f->config->states; d++) {
        f->best[d] = f->x[(size_t)d * f->stride];
    }
    pfl_weights_equal(f);
    (void)pfl_moments(f, false);
    return PFL_OK;
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
    const pfl_status_t drawn = pfl_draw_prior(f);
    if (drawn != PFL_OK) {
        return pfl_fault(f, drawn);
    }
    f->alive = PFL_ALIVE;
    *out = f;
    return PFL_OK;
}

/* ---- Predict -------------------------------------------------------------------------------------------------- */

/* The first group of a step, which can be undone: saved, moved, and put back when nothing finite came out. */
static bool first_group_survives(pfl_t *f, const void *u, float dt_s, uint32_t n)
{
    const uint32_t states = f->config->states;
    for (uint32_t d = 0u; d < states; d++) {
        memcpy(&f->lanes[(size_t)d * PFL_GROUP], &f->x[(size_t)d * f->stride], sizeof(float) * n);
    }
    const pfl_rng_t rng = f->rng;
    const pfl_batch_t batch = batch_at(f, 0u, n);
    make_noise(f, f->config->noises, n);
    f->config->predict(f->config->user, u, dt_s, &batch);
    if (count_nonfinite(f, 0u, n) < n) {
        return true;
    }
    for (uint32_t d = 0u; d < states; d++) {
        memcpy(&f->x[(size_t)d * f->stride], &f->lanes[(size_t)d * PFL_GROUP], sizeof(float) * n);
    }
    f->rng = rng;
    return false;
}

/* One model step for all particles; *lost grows by those quarantined. */
static pfl_status_t step(pfl_t *f, const void *u, float dt_s, bool undoable, uint32_t *lost)
{
    const uint32_t count = f->config->particles;
    uint32_t n = (count < PFL_GROUP) ? count : PFL_GROUP;
    uint32_t first = 0u;
    if (undoable) {
        if (!first_group_survives(f, u, dt_s, n)) {
            return PFL_ERR_NONFINITE;
        }
    }
    while (first < count) {
        if (!undoable || (first > 0u)) {
            const pfl_batch_t batch = batch_at(f, first, n);
            make_noise(f, f->config->noises, n);
            f->config->predict(f->config->user, u, dt_s, &batch);
        }
        if (batch_is_suspect(f, first, n)) {
            *lost += quarantine(f, first, n);
        }
        clip_to_box(f, first, n);
        first += n;
        n = ((count - first) < PFL_BATCH) ? (count - first) : PFL_BATCH;
    }
    return PFL_OK;
}

/* What the budget put off in the cycle before is done first. */
static void catch_up(pfl_t *f)
{
    if (f->resample_pending != 0u) {
        (void)pfl_moments(f, false);
        if (f->ess < (f->config->ess_ratio * (float)f->config->particles)) {
            pfl_resample_now(f);
        }
        f->resample_pending = 0u;
    }
}

static pfl_status_t propagate(pfl_t *f, uint32_t dt_us, const void *u)
{
    const uint32_t longest = (f->config->dt_max_us != 0u) ? f->config->dt_max_us : UINT32_MAX;
    const uint32_t pieces = (dt_us / longest) + (((dt_us % longest) != 0u) ? 1u : 0u);
    if (pieces > PFL_SUBSTEPS_MAX) {
        return PFL_ERR_GAP;
    }
    catch_up(f);
    uint32_t lost = 0u;
    uint32_t left_us = dt_us;
    f->busy = 1u;
    for (uint32_t k = pieces; k > 0u; k--) {
        const uint32_t piece_us = left_us / k;
        const pfl_status_t moved = step(f, u, (float)piece_us * 1.0e-6f, k == pieces, &lost);
        if (moved != PFL_OK) {
            f->busy = 0u;
            return pfl_fault(f, moved);
        }
        left_us -= piece_us;
    }
    f->busy = 0u;
    f->t_us += dt_us;
    f->moments_current = 0u;
    return (lost == 0u) ? PFL_OK : pfl_fault(f, PFL_QUARANTINED);
}

pfl_status_t pfl_predict(pfl_t *f, uint64_t t_us, const void *u)
{
    const pfl_status_t entered = pfl_enter(f);
    if (entered != PFL_OK) {
        return entered;
    }
    if (t_us < f->t_us) {
        return PFL_ERR_TIME;
    }
    if (t_us == f->t_us) {
        return PFL_OK;
    }
    if ((t_us - f->t_us) > UINT32_MAX) {
        return PFL_ERR_GAP;
    }
    pfl_meter_begin(f);
    pfl_meter_resume(f);
    const pfl_status_t status = propagate(f, (uint32_t)(t_us - f->t_us), u);
    pfl_meter_pause(f);
    return status;
}

/* ---- Update --------------------------------------------------------------------------------------------------- */

/* All log-likelihoods into the scratch column; PFL_ERR_BUDGET when the budget ends first. */
static pfl_status_t weigh(pfl_t *f, const pfl_sensor_t *sensor, const void *z, pfl_weigh_t *w)
{
    const uint32_t count = f->config->particles;
    void *user = (sensor->user != NULL) ? sensor->user : f->config->user;
    pfl_weigh_start(w);
    f->scratch_is_weights = 0u;
    for (uint32_t first = 0u; first < count; first += PFL_BATCH) {
        const uint32_t n = ((count - first) < PFL_BATCH) ? (count - first) : PFL_BATCH;
        if (pfl_meter_spent(f)) {
            return PFL_ERR_BUDGET;
        }
        const pfl_view_t view = {&f->x[first], f->stride, first, n};
        f->busy = 1u;
        sensor->loglik(user, z, &view, &f->scratch[first]);
        f->busy = 0u;
        pfl_weigh_batch(f, first, n, &f->scratch[first], w);
    }
    return PFL_OK;
}

/* Judges what the sensor said of the particles. */
static pfl_status_t judge(pfl_t *f, const pfl_sensor_t *sensor, const pfl_weigh_t *w)
{
    const int32_t minus_infinity = (int32_t)0xFF800000u;
    if (w->worst_bits > minus_infinity) {
        const bool positive = (w->worst_bits >= 0) && (w->worst_bits < 0x7F800000);
        return pfl_fault(f, positive ? PFL_ERR_LOGLIK : PFL_ERR_NONFINITE);
    }
    if (sensor->gate > 0.0f) {
        const float best = pfl_from_bits(w->best_bits) + PFL_LOGLIK_MAX;
        const float ratio = (-2.0f * best) / sensor->gate;
        f->test_ratio = pfl_is_finite(ratio) ? ((ratio > 0.0f) ? ratio : 0.0f) : FLT_MAX;
    } else {
        f->test_ratio = 0.0f;
    }
    if ((f->test_ratio > 1.0f) || (w->top_bits >= minus_infinity)) {
        f->rejected += (f->rejected < UINT32_MAX) ? 1u : 0u;
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
    f->log_weight_top = pfl_from_bits(w->top_bits - 1);
    f->fused += (f->fused < UINT32_MAX) ? 1u : 0u;
    f->t_fused_us = f->t_us;
    pfl_set_best(f, w->top_first);
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
        f->resample_pending = 1u;
        return PFL_DEFERRED;
    }
    if (f->ess < (f->config->ess_ratio * (float)f->config->particles)) {
        if (pfl_meter_spent(f)) {
            f->resample_pending = 1u;
            return PFL_DEFERRED;
        }
        pfl_resample_now(f);
    }
    return PFL_OK;
}

pfl_status_t pfl_update(pfl_t *f, uint16_t sensor, uint64_t t_us, const void *z)
{
    const pfl_status_t entered = pfl_enter(f);
    if (entered != PFL_OK) {
        return entered;
    }
    if (z == NULL) {
        return PFL_ERR_ARG;
    }
    if (sensor >= f->config->sensor_count) {
        return PFL_ERR_SENSOR;
    }
    if (t_us != f->t_us) {
        return PFL_ERR_TIME;
    }
    pfl_meter_resume(f);
    const pfl_status_t status = fuse(f, &f->config->sensors[sensor], z);
    pfl_meter_pause(f);
    return status;
}

pfl_status_t pfl_resample(pfl_t *f)
{
    const pfl_status_t entered = pfl_enter(f);
    if (entered != PFL_OK) {
        return entered;
    }
    pfl_meter_resume(f);
    pfl_refresh(f);
    pfl_weights(f);
    pfl_resample_now(f);
    pfl_meter_pause(f);
    return PFL_OK;
}
