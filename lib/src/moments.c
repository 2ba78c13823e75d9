/* Second pass of an update: weights, effective sample size, mean and covariance, in one sweep over the particles.
 *
 * Deviations are taken from the most likely particle, which lies inside the cloud, so one sweep loses nothing to
 * cancellation; those of angles from their circular mean, which takes a sweep of its own. lanes.h tells how the sums
 * are formed. */
#include "moments.h"

#define LONG_PIECE (4u * PFL_BATCH) /* particles; a few columns of as many fit into a first-level cache */

PFL_NOINLINE static float row_sum(const pfl_t *f, uint32_t row)
{
    return pfl_lane_sum(pfl_row_at(f, row));
}

static bool is_full(const pfl_t *f)
{
    return f->config->moments == (uint16_t)PFL_MOMENTS_FULL;
}

/* ---- Sums of a batch, whose n is a multiple of eight ------------------------------------------------------------- */

PFL_NOINLINE static void weigh_lanes(pfl_t *f, uint32_t first, uint32_t n)
{
    pfl_lanes_weigh(pfl_row_at(f, ROW_WEIGHT), &f->scratch[first], &f->log_weight[first], f->log_weight_top, n);
}

/* Neighbouring columns, and what is to be taken off each. */
typedef struct {
    const float *x;
    uint32_t stride;
    uint32_t count;
    const float *centre;
} columns_t;

/* As many rows, from `row` on, grow by w (x - centre). */
PFL_NOINLINE static void product_lanes(const pfl_t *f, uint32_t row, const float *w, const columns_t *of, uint32_t n)
{
    float *rows = pfl_row_at(f, row);
    const float *x = of->x;
    const float *centre = of->centre;
    uint32_t left = of->count;
    for (; left > 1u; left -= 2u) {
        pfl_lanes_products(rows, w, x, of->stride, centre, n);
        rows += 2u * PFL_LANES;
        x += 2u * (size_t)of->stride;
        centre += 2;
    }
    if (left > 0u) {
        pfl_lanes_product(rows, w, x, centre, n);
    }
}

/* Only the means, and those of the angles are known: the sums of every run of other states. */
static void mean_lanes(const pfl_t *f, uint32_t first, uint32_t n)
{
    const uint32_t states = f->config->states;
    for (uint32_t d = 0u; d < states; d++) {
        uint32_t end = d;
        while ((end < states) && !pfl_is_circular(f, end)) {
            end++;
        }
        const columns_t of = {&f->x[((size_t)d * f->stride) + first], f->stride, end - d, &f->centre[d]};
        product_lanes(f, ROW_MEAN + d, &f->scratch[first], &of, n);
        d = end;
    }
}

/* Deviations of one state into a work column. */
static void deviations(pfl_t *f, uint32_t d, const float *restrict x, uint32_t n)
{
    float *restrict dev = &f->work[(size_t)d * PFL_BATCH];
    const float centre = f->centre[d];
    if (pfl_is_circular(f, d)) {
        for (uint32_t i = 0u; i < n; i++) {
            dev[i] = pfl_wrap_pi_kernel(x[i] - centre);
        }
    } else {
        for (uint32_t i = 0u; i < n; i++) {
            dev[i] = x[i] - centre;
        }
    }
}

/* Means and covariance. */
static void full_lanes(pfl_t *f, uint32_t first, uint32_t n)
{
    const uint32_t states = f->config->states;
    const float *w = &f->scratch[first];
    float *restrict weighted = &f->work[(size_t)states * PFL_BATCH];
    static const float no_centre[PFL_STATES_MAX] = {0.0f};
    columns_t of = {f->work, PFL_BATCH, states, no_centre};
    for (uint32_t d = 0u; d < states; d++) {
        deviations(f, d, &f->x[((size_t)d * f->stride) + first], n);
    }
    product_lanes(f, ROW_MEAN, w, &of, n);
    for (uint32_t row = ROW_PRODUCT(states); of.count > 0u; row += of.count + 1u) {
        for (uint32_t i = 0u; i < n; i++) {
            weighted[i] = w[i] * of.x[i];
        }
        product_lanes(f, row, weighted, &of, n);
        of.x += PFL_BATCH;
        of.count--;
    }
}

PFL_NOINLINE static void state_lanes(pfl_t *f, uint32_t first, uint32_t n)
{
    if (is_full(f)) {
        full_lanes(f, first, n);
    } else {
        mean_lanes(f, first, n);
    }
}

/* ---- Of all batches ------------------------------------------------------------------------------------------------ */

/* Sums to mean and covariance. The shift of the mean from the centre is taken off the second moments again. */
PFL_NOINLINE static void finish(const pfl_t *f, float *mean, float *cov)
{
    const uint32_t states = f->config->states;
    const float sum = row_sum(f, ROW_WEIGHT);
    float shift[PFL_STATES_MAX];
    for (uint32_t d = 0u; d < states; d++) {
        shift[d] = row_sum(f, ROW_MEAN + d) / sum;
        mean[d] = pfl_is_circular(f, d) ? f->centre[d] : (f->centre[d] + shift[d]);
    }
    if (is_full(f)) {
        const uint32_t rows = ROW_PRODUCT(states);
        uint32_t k = 0u;
        for (uint32_t d = 0u; d < states; d++) {
            for (uint32_t e = d; e < states; e++) {
                const float c = (row_sum(f, rows + k) / sum) - (shift[d] * shift[e]);
                cov[k] = ((d == e) && (c < 0.0f)) ? 0.0f : c;
                k++;
            }
        }
    }
}

/* Sum of the weights and effective sample size. */
static void finish_weights(pfl_t *f)
{
    const float sum = row_sum(f, ROW_WEIGHT);
    const float ess = (sum * sum) / row_sum(f, ROW_SQUARE);
    const float count = (float)f->config->particles;
    const float at_least_one = (ess >= 1.0f) ? ess : 1.0f; /* never NaN */
    f->weight_sum = sum;
    f->ess = (at_least_one > count) ? count : at_least_one;
    f->scratch_is_weights = 1u;
}

/* Is one of the next 4 PFL_LANES log-weights the wanted one? A vector core asks for many at a time. */
static inline bool next_have(const float *x, int32_t bits)
{
    uint32_t found = 0u;
    for (uint32_t k = 0u; k < (4u * PFL_LANES); k++) {
        found |= (pfl_bits(x[k]) == bits) ? 1u : 0u;
    }
    return found != 0u;
}

void pfl_set_best(pfl_t *f, uint32_t first)
{
    const int32_t top = pfl_bits(f->log_weight_top);
    uint32_t best = first;
    while ((PFL_VECTOR_LANES > 1) && ((best + (4u * PFL_LANES)) < f->config->particles) &&
           !next_have(&f->log_weight[best], top)) {
        best += 4u * PFL_LANES;
    }
    while ((pfl_bits(f->log_weight[best]) != top) && ((best + 1u) < f->config->particles)) {
        best++;
    }
    f->best_index = best;
    for (uint32_t d = 0u; d < f->config->states; d++) {
        f->best[d] = f->x[((size_t)d * f->stride) + best];
    }
}

/* What a pass does with each batch: the padding belongs to the last one. */
typedef enum { PASS_WEIGHTS = 1, PASS_CIRCLES = 2, PASS_STATES = 4 } pass_t;

/* Where neither budget nor work columns ask for batches longer pieces save some overhead. */
static uint32_t piece_of(const pfl_t *f, uint32_t passes)
{
    const bool in_batches = (f->config->budget_cycles != 0u) || is_full(f) || ((passes & PASS_CIRCLES) != 0u);
    return in_batches ? PFL_BATCH : LONG_PIECE;
}

/* One sweep over the particles; false when the budget ran out. */
static bool sweep(pfl_t *f, bool budgeted, uint32_t passes)
{
    const uint32_t piece = piece_of(f, passes);
    const uint32_t padded = pfl_padded(f);
    pfl_weights_settle(f);
    for (uint32_t first = 0u; first < padded; first += piece) {
        const uint32_t n = ((padded - first) < piece) ? (padded - first) : piece;
        if (budgeted && pfl_meter_spent(f)) {
            return false;
        }
        if ((passes & PASS_WEIGHTS) != 0u) {
            weigh_lanes(f, first, n);
        }
        if ((passes & PASS_CIRCLES) != 0u) {
            f->config->circular(f, first, n);
        }
        if ((passes & PASS_STATES) != 0u) {
            state_lanes(f, first, n);
        }
    }
    return true;
}

/* The heaviest particle weighs one: a smaller sum is that of damaged log-weights. */
static bool sum_is_sound(const pfl_t *f)
{
    return row_sum(f, ROW_WEIGHT) >= 0.5f;
}

static void mend_weights(pfl_t *f)
{
    pfl_count(&f->mended, pfl_mend_log_weights(f));
    pfl_weights_after_loss(f);
    f->watched.event |= PFL_EVENT_MENDED;
}

static void sum_up_weights(pfl_t *f)
{
    memset(f->lanes, 0, sizeof(float) * PFL_LANES * ROW_MEAN);
    (void)sweep(f, false, PASS_WEIGHTS);
}

/* Always anew: between two calls weights may have been damaged, and resampling trusts their sum. */
void pfl_weights(pfl_t *f)
{
    sum_up_weights(f);
    if (!sum_is_sound(f)) {
        mend_weights(f);
        sum_up_weights(f);
    }
    f->weight_sum = row_sum(f, ROW_WEIGHT);
    f->scratch_is_weights = 1u;
}

/* All sums; false when the budget ran out. Without angles one sweep does it, batch by batch in the cache; with them
 * the states wait for the circular means. */
static bool sum_up(pfl_t *f, bool budgeted)
{
    const uint32_t states = f->config->states;
    const uint32_t rows = is_full(f) ? ROW_END(states) : ROW_PRODUCT(states);
    f->scratch_is_weights = 0u;
    memset(f->lanes, 0, sizeof(float) * PFL_LANES * rows);
    for (uint32_t d = 0u; d < states; d++) {
        f->centre[d] = f->x[((size_t)d * f->stride) + f->best_index];
    }
    if (f->config->circular_mask == 0u) {
        return sweep(f, budgeted, PASS_WEIGHTS | PASS_STATES);
    }
    if (!sweep(f, budgeted, PASS_WEIGHTS | PASS_CIRCLES)) {
        return false;
    }
    f->config->circular(f, 0u, 0u);
    return sweep(f, budgeted, PASS_STATES);
}

/* Are mean and covariance finite? A product with zero is NaN for what is not. */
static bool moments_are_finite(const pfl_t *f)
{
    const uint32_t states = f->config->states;
    float sum = 0.0f;
    for (uint32_t d = 0u; d < states; d++) {
        sum += f->mean[d] * 0.0f;
    }
    for (uint32_t k = 0u; is_full(f) && (k < ((states * (states + 1u)) / 2u)); k++) {
        sum += f->cov[k] * 0.0f;
    }
    return pfl_is_finite(sum);
}

/* Angles beyond all reason have no centre. Nothing that is not finite stays in the arena. */
PFL_NOINLINE static void mend_centre(const pfl_t *f)
{
    for (uint32_t d = 0u; d < f->config->states; d++) {
        f->centre[d] = pfl_is_finite(f->centre[d]) ? f->centre[d] : 0.0f;
    }
}

bool pfl_moments(pfl_t *f, bool budgeted)
{
    const uint32_t states = f->config->states;
    f->moments_current = MOMENTS_STALE;
    if (!sum_up(f, budgeted)) {
        mend_centre(f);
        return false;
    }
    if (!sum_is_sound(f)) {
        mend_weights(f);
        (void)sum_up(f, false);
    }
    finish_weights(f);
    finish(f, f->mean, f->cov);
    f->moments_current = MOMENTS_CURRENT;
    if (!moments_are_finite(f)) {
        mend_centre(f);
        memcpy(f->mean, f->centre, sizeof(float) * states);
        memset(f->cov, 0, sizeof(float) * ((states * (states + 1u)) / 2u));
        f->moments_current = MOMENTS_OVERFLOWED;
    }
    return true;
}

void pfl_cloud_moments(pfl_t *f, float *mean, float *cov)
{
    (void)sum_up(f, false);
    finish(f, mean, cov);
    mend_centre(f);
}

void pfl_refresh(pfl_t *f)
{
    if (f->moments_current == MOMENTS_STALE) {
        const float ess = f->ess; /* stays that of the last update, unless the budget cut that one short */
        (void)pfl_moments(f, false);
        f->ess = (f->resample_pending != 0u) ? f->ess : ess;
    }
}
