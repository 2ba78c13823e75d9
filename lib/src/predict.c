/* Prediction: every particle through the model, in batches with fresh noise, all-or-nothing where it can be, and what
 * happens to particles that come out non-finite or outside their box. */
#include "guard.h"

#include "lanes.h"

/* ---- Particles that are not finite ---------------------------------------------------------------------------- */

PFL_NOINLINE static bool particle_is_finite(const pfl_t *f, uint32_t i)
{
    const float *x = &f->x[i];
    uint32_t left = f->config->states;
    float none = 0.0f;
    do {
        none += *x * 0.0f; /* NaN, of what is not finite, for good */
        x += f->stride;
        left--;
    } while (left > 0u);
    return pfl_is_finite(none);
}

uint32_t pfl_count_nonfinite(const pfl_t *f, uint32_t first, uint32_t n)
{
    uint32_t found = 0u;
    for (uint32_t i = first; i < (first + n); i++) {
        found += particle_is_finite(f, i) ? 0u : 1u;
    }
    return found;
}

/* One addition a value: a NaN or an infinity anywhere in the batch stays in the sum. */
PFL_NOINLINE static bool batch_is_suspect(const pfl_t *f, uint32_t first, uint32_t n)
{
    return !pfl_is_finite(pfl_lanes_sum(&f->x[first], f->stride, f->config->states, (uint32_t)PFL_CEIL8(n)));
}

/* Non-finite particles take the state of the most likely one, which is finite, and lose their weight. */
PFL_NOINLINE uint32_t pfl_quarantine(pfl_t *f, uint32_t first, uint32_t n)
{
    uint32_t found = 0u;
    pfl_weights_settle(f);
    for (uint32_t i = first; i < (first + n); i++) {
        if (!particle_is_finite(f, i)) {
            for (uint32_t d = 0u; d < f->config->states; d++) {
                f->x[((size_t)d * f->stride) + i] = f->best[d];
            }
            f->log_weight[i] = pfl_from_bits((int32_t)0xFF800000u);
            found++;
        }
    }
    pfl_count(&f->quarantined, found);
    return found;
}

void pfl_clip_to_box(pfl_t *f, uint32_t first, uint32_t n)
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

/* ---- Batches and their noise ---------------------------------------------------------------------------------- */

/* `columns` of noise for n particles; full batches lie end to end and are one call. */
void pfl_make_noise(pfl_t *f, uint32_t columns, uint32_t n)
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

pfl_batch_t pfl_batch_at(pfl_t *f, uint32_t first, uint32_t n)
{
    pfl_batch_t batch = {&f->x[first], f->stride, f->work, first, n};
    return batch;
}

/* ---- Steps ----------------------------------------------------------------------------------------------------- */

typedef char pfl_spare_column_fits[(sizeof(pfl_rng_t) <= (sizeof(float) * PFL_BATCH)) ? 1 : -1];

/* Saves the first group of all states, or puts it back; where there are fewer particles, what lies behind them with it,
 * which a model does not change. */
PFL_NOINLINE static void copy_first_group(const pfl_t *f, bool back)
{
    float *kept = f->lanes;
    float *x = f->x;
    for (uint32_t left = f->config->states; left > 0u; left--) {
        PFL_COPY(back ? x : kept, back ? kept : x, sizeof(float) * PFL_GROUP);
        kept += PFL_GROUP;
        x += f->stride;
    }
}

/* The first group of a step, which can be undone: saved, moved, and put back when nothing finite came out. */
static bool first_group_survives(pfl_t *f, const void *u, float dt_s, uint32_t n, bool rehearsal)
{
    const uint32_t states = f->config->states;
    float *spare = &f->work[PFL_WORK_FLOATS(states, f->config->noises) - PFL_BATCH]; /* the column no noise uses */
    copy_first_group(f, false);
    memcpy(spare, &f->rng, sizeof f->rng);
    const pfl_batch_t batch = pfl_batch_at(f, 0u, n);
    pfl_make_noise(f, f->config->noises, n);
    f->config->predict(f->config->user, u, dt_s, &batch);
    pfl_guard_after_callback(f);
    const bool survives = !batch_is_suspect(f, 0u, n) || (pfl_count_nonfinite(f, 0u, n) < n);
    if (survives && !rehearsal) {
        return true;
    }
    copy_first_group(f, true);
    memcpy(&f->rng, spare, sizeof f->rng);
    return survives;
}

/* For new attempts: what the batch was before its move. */
static void save_for_retries(pfl_t *f, uint32_t first, uint32_t n)
{
    for (uint32_t d = 0u; (f->retry != NULL) && (d < f->config->states); d++) {
        memcpy(&f->retry[(size_t)d * PFL_BATCH], &f->x[((size_t)d * f->stride) + first], sizeof(float) * n);
    }
}

/* One model step for all particles; *lost grows by those quarantined. */
PFL_NOINLINE static pfl_status_t step(pfl_t *f, const void *u, float dt_s, bool undoable, uint32_t *lost)
{
    const uint32_t count = f->config->particles;
    const bool constrained = f->config->constraint != NULL;
    uint32_t n = (count < PFL_GROUP) ? count : PFL_GROUP;
    uint32_t first = 0u;
    save_for_retries(f, first, n);
    if (undoable && !first_group_survives(f, u, dt_s, n, false)) {
        return PFL_ERR_NONFINITE;
    }
    while (first < count) {
        if (!undoable || (first > 0u)) {
            save_for_retries(f, first, n);
            const pfl_batch_t batch = pfl_batch_at(f, first, n);
            pfl_make_noise(f, f->config->noises, n);
            f->config->predict(f->config->user, u, dt_s, &batch);
            pfl_guard_after_callback(f);
        }
        if (constrained) {
            f->config->constraint->keep(f, u, dt_s, first, n);
        }
        if (batch_is_suspect(f, first, n)) {
            *lost += pfl_quarantine(f, first, n);
        }
        pfl_clip_to_box(f, first, n);
        first += n;
        n = ((count - first) < PFL_BATCH) ? (count - first) : PFL_BATCH;
    }
    pfl_guard_after_batches(f);
    return PFL_OK;
}

/* What the budget put off in the cycle before is done first, so that a filter that was cut short goes on with the same
 * bits as one that was not; but not before a rehearsal has shown that the model works, after which nothing could be
 * undone. */
PFL_NOINLINE static pfl_status_t catch_up(pfl_t *f, const void *u, float dt_s)
{
    const uint32_t count = f->config->particles;
    if (!first_group_survives(f, u, dt_s, (count < PFL_GROUP) ? count : PFL_GROUP, true)) {
        return PFL_ERR_NONFINITE;
    }
    (void)pfl_moments(f, false);
    if (pfl_resample_is_due(f)) {
        pfl_resample_now(f);
        pfl_guard_take_over(f);
    }
    f->resample_pending = 0u;
    return PFL_OK;
}

/* As few pieces as can be, none longer than `longest`. */
/*@ requires 0 < dt_us && 0 < longest;
    assigns \nothing;
    ensures 1 <= \result;
    ensures (\result - 1) * longest < dt_us;
    ensures dt_us <= \result * longest; */
static uint32_t pieces_of(uint32_t dt_us, uint32_t longest)
{
    return (dt_us / longest) + (((dt_us % longest) != 0u) ? 1u : 0u);
}

/* The next of k pieces that make up what is left of a step: not too long, leaves k - 1 that are not, and the last takes
 * all that is left, so that the pieces sum to the step. */
/*@ requires 1 <= k;
    assigns \nothing;
    ensures \result <= left_us;
    ensures k == 1 ==> \result == left_us;
    ensures \forall integer longest; 0 < longest && left_us <= k * longest ==>
              \result <= longest && left_us - \result <= (k - 1) * longest; */
static uint32_t piece_of(uint32_t left_us, uint32_t k)
{
    return left_us / k;
}

/* At most PFL_SUBSTEPS_MAX pieces: pfl_predict has refused a longer step. */
pfl_status_t pfl_propagate(pfl_t *f, uint32_t dt_us, const void *u)
{
    const uint32_t longest = (f->config->dt_max_us != 0u) ? f->config->dt_max_us : UINT32_MAX;
    const uint32_t pieces = pieces_of(dt_us, longest);
    const bool pending = f->resample_pending != 0u;
    uint32_t lost = 0u;
    uint32_t left_us = dt_us;
    f->busy = 1u;
    pfl_status_t moved = pending ? catch_up(f, u, (float)(dt_us / pieces) * 1.0e-6f) : PFL_OK;
    for (uint32_t k = pieces; (k > 0u) && (moved == PFL_OK); k--) {
        const uint32_t piece_us = piece_of(left_us, k);
        moved = step(f, u, (float)piece_us * 1.0e-6f, (k == pieces) && !pending, &lost);
        left_us -= piece_us;
    }
    f->busy = 0u;
    if (moved != PFL_OK) {
        return pfl_fault(f, moved);
    }
    f->t_us += dt_us;
    f->moments_current = MOMENTS_STALE;
    if (lost != 0u) {
        pfl_weights_after_loss(f);
    }
    return (lost == 0u) ? PFL_OK : pfl_fault(f, PFL_QUARANTINED);
}
