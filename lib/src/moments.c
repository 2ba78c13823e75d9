/* Second pass of an update: weights, effective sample size, mean and covariance, in one sweep over the particles.
 *
 * Deviations are taken from the most likely particle, which lies inside the cloud, so one sweep loses nothing to
 * cancellation; those of angles from their circular mean, which takes a sweep of its own. Every sum runs in eight lanes (particle i in lane i mod 8) that are added up as a fixed tree: the same
 * bits from a scalar core and from any vector width. Columns are padded with particles of weight zero. */
#include "core.h"

#include "math_kernels.h"

#include "pflight/math.h"

#define LANES 8u
#define LANE_WEIGHT 0u /* rows of f->lanes: sum w, sum w^2, */
#define LANE_SQUARE 1u
#define LANE_MEAN 2u /* D rows of sum w dev, then D of sum w sin dev and D of sum w cos dev (angles only), */
                     /* then the upper triangle of sum w dev_d dev_e */

static float *lane_row(const pfl_t *f, uint32_t row)
{
    return f->lanes + ((size_t)row * LANES);
}

static float lane_sum(const float *lane)
{
    return ((lane[0] + lane[1]) + (lane[2] + lane[3])) + ((lane[4] + lane[5]) + (lane[6] + lane[7]));
}

/* exp(d) for d <= 0: 2^y, y = k + r, |r| <= 1/2. 0 below 2^-63, so that no square is a subnormal number, and a particle
 * without weight has none however far away it is. */
static inline float weight_of(float d)
{
    const int32_t most = 0x422E47AE; /* 43.57; floats without sign are ordered as their bits */
    const int32_t size = pfl_bits(d) & 0x7FFFFFFF;
    const int32_t counts = -(int32_t)(size < most);
    const float y = pfl_from_bits((size < most) ? size : most) * -1.44269504f;
    const float biased = y + PFL_ROUND_MAGIC;
    const float r = y - (biased - PFL_ROUND_MAGIC);
    float p = 1.32764783e-3f; /* 7.5e-8 */
    p = (p * r) + 9.67554189e-3f;
    p = (p * r) + 5.55071309e-2f;
    p = (p * r) + 2.40221202e-1f;
    p = (p * r) + 6.93146944e-1f;
    p = (p * r) + 1.00000012f;
    const uint32_t power = (uint32_t)pfl_bits(p) + ((uint32_t)pfl_bits(biased) << 23);
    return pfl_from_bits((int32_t)power & counts);
}

/* One quantity a function: gcc vectorises a loop over eight accumulators, but not over sixteen. */
static void sum_lanes(float *row, const float *restrict a, uint32_t n)
{
    float sum[LANES];
    PFL_COPY(sum, row, sizeof sum);
    for (uint32_t i = 0u; i < n; i += LANES) {
        for (uint32_t l = 0u; l < LANES; l++) {
            sum[l] += a[i + l];
        }
    }
    PFL_COPY(row, sum, sizeof sum);
}

static void product_lanes(float *row, const float *a, const float *b, uint32_t n)
{
    float sum[LANES];
    PFL_COPY(sum, row, sizeof sum);
    for (uint32_t i = 0u; i < n; i += LANES) {
        for (uint32_t l = 0u; l < LANES; l++) {
            sum[l] += a[i + l] * b[i + l];
        }
    }
    PFL_COPY(row, sum, sizeof sum);
}

PFL_NOINLINE static void weigh_lanes(pfl_t *f, uint32_t first, uint32_t n)
{
    const float *restrict s = &f->log_weight[first];
    float *restrict w = &f->scratch[first];
    const float top = f->log_weight_top;
    for (uint32_t i = 0u; i < n; i++) {
        w[i] = weight_of(s[i] - top);
    }
    for (uint32_t i = n; i < PFL_CEIL8(n); i++) {
        w[i] = 0.0f;
    }
    sum_lanes(lane_row(f, LANE_WEIGHT), w, (uint32_t)PFL_CEIL8(n));
    product_lanes(lane_row(f, LANE_SQUARE), w, w, (uint32_t)PFL_CEIL8(n));
}

static void mean_lanes(float *row, const float *restrict x, const float *restrict w, float centre, uint32_t n)
{
    float sum[LANES];
    PFL_COPY(sum, row, sizeof sum);
    for (uint32_t i = 0u; i < n; i += LANES) {
        for (uint32_t l = 0u; l < LANES; l++) {
            sum[l] += w[i + l] * (x[i + l] - centre);
        }
    }
    PFL_COPY(row, sum, sizeof sum);
}

static bool is_circular(const pfl_t *f, uint32_t d)
{
    return ((f->config->circular_mask >> d) & 1u) != 0u;
}

/* Deviations of one state into a work column. */
static void deviations(pfl_t *f, uint32_t d, const float *restrict x, uint32_t n)
{
    float *restrict dev = &f->work[(size_t)d * PFL_BATCH];
    const float centre = f->centre[d];
    if (is_circular(f, d)) {
        for (uint32_t i = 0u; i < n; i++) {
            dev[i] = pfl_wrap_pi_kernel(x[i] - centre);
        }
    } else {
        for (uint32_t i = 0u; i < n; i++) {
            dev[i] = x[i] - centre;
        }
    }
}

/* Sums of sine and cosine of the angles, about the most likely particle. */
PFL_NOINLINE static void circle_lanes(pfl_t *f, uint32_t first, uint32_t n)
{
    const uint32_t states = f->config->states;
    float *restrict work = f->work;
    for (uint32_t d = 0u; d < states; d++) {
        if (is_circular(f, d)) {
            const float *restrict x = &f->x[((size_t)d * f->stride) + first];
            const float centre = f->centre[d];
            for (uint32_t i = 0u; i < n; i++) {
                pfl_sincos_kernel(pfl_wrap_pi_kernel(x[i] - centre), &work[i], &work[PFL_BATCH + i]);
            }
            product_lanes(lane_row(f, LANE_MEAN + states + d), &f->scratch[first], work, n);
            product_lanes(lane_row(f, LANE_MEAN + (2u * states) + d), &f->scratch[first], &work[PFL_BATCH], n);
        }
    }
}

/* The circular means become the centres of the angles. */
static void centre_circles(const pfl_t *f)
{
    const uint32_t states = f->config->states;
    for (uint32_t d = 0u; d < states; d++) {
        if (is_circular(f, d)) {
            const float turn = pfl_atan2_kernel(lane_sum(lane_row(f, LANE_MEAN + states + d)),
                                                lane_sum(lane_row(f, LANE_MEAN + (2u * states) + d)));
            const float near_pi = pfl_wrap_pi_kernel(f->centre[d] + turn); /* to 4e-4, after many turns */
            const float mean = pfl_wrap_pi_kernel(near_pi);
            f->centre[d] = ((mean >= PFL_PI) || (mean < -PFL_PI)) ? -PFL_PI : mean;
        }
    }
}

PFL_NOINLINE static void state_lanes(pfl_t *f, uint32_t first, uint32_t n)
{
    const uint32_t states = f->config->states;
    const uint32_t padded = (uint32_t)PFL_CEIL8(n);
    const float *w = &f->scratch[first];
    const bool full = f->config->moments == (uint16_t)PFL_MOMENTS_FULL;
    for (uint32_t d = 0u; d < states; d++) {
        const float *x = &f->x[((size_t)d * f->stride) + first];
        if (full) {
            deviations(f, d, x, padded);
            product_lanes(lane_row(f, LANE_MEAN + d), w, &f->work[(size_t)d * PFL_BATCH], padded);
        } else if (!is_circular(f, d)) {
            mean_lanes(lane_row(f, LANE_MEAN + d), x, w, f->centre[d], padded);
        } else {
            /* its mean is known */
        }
    }
    if (!full) {
        return;
    }
    float *restrict weighted = &f->work[(size_t)states * PFL_BATCH];
    uint32_t row = LANE_MEAN + (3u * states);
    for (uint32_t d = 0u; d < states; d++) {
        const float *dev = &f->work[(size_t)d * PFL_BATCH];
        for (uint32_t i = 0u; i < padded; i++) {
            weighted[i] = w[i] * dev[i];
        }
        for (uint32_t e = d; e < states; e++) {
            product_lanes(lane_row(f, row), weighted, &f->work[(size_t)e * PFL_BATCH], padded);
            row++;
        }
    }
}

/* Sums to mean and covariance. The shift of the mean from the centre is taken off the second moments again. */
PFL_NOINLINE static void finish(const pfl_t *f, float *mean, float *cov)
{
    const uint32_t states = f->config->states;
    const float sum = lane_sum(lane_row(f, LANE_WEIGHT));
    float shift[PFL_STATES_MAX];
    for (uint32_t d = 0u; d < states; d++) {
        shift[d] = lane_sum(lane_row(f, LANE_MEAN + d)) / sum;
        mean[d] = is_circular(f, d) ? f->centre[d] : (f->centre[d] + shift[d]);
    }
    if (f->config->moments == (uint16_t)PFL_MOMENTS_FULL) {
        const uint32_t rows = LANE_MEAN + (3u * states);
        uint32_t k = 0u;
        for (uint32_t d = 0u; d < states; d++) {
            for (uint32_t e = d; e < states; e++) {
                const float c = (lane_sum(lane_row(f, rows + k)) / sum) - (shift[d] * shift[e]);
                cov[k] = ((d == e) && (c < 0.0f)) ? 0.0f : c;
                k++;
            }
        }
    }
}

/* Sum of the weights and effective sample size. */
static void finish_weights(pfl_t *f)
{
    const float sum = lane_sum(lane_row(f, LANE_WEIGHT));
    const float ess = (sum * sum) / lane_sum(lane_row(f, LANE_SQUARE));
    const float count = (float)f->config->particles;
    const float at_least_one = (ess < 1.0f) ? 1.0f : ess;
    f->weight_sum = sum;
    f->ess = (at_least_one > count) ? count : at_least_one;
    f->scratch_is_weights = 1u;
}

void pfl_set_best(pfl_t *f, uint32_t first)
{
    const uint32_t rest = f->config->particles - first;
    const uint32_t n = (rest < PFL_BATCH) ? rest : PFL_BATCH;
    uint32_t best = first;
    int32_t bits = pfl_bits(f->log_weight[first]);
    for (uint32_t i = first + 1u; i < (first + n); i++) {
        const int32_t candidate = pfl_bits(f->log_weight[i]);
        if (candidate < bits) {
            bits = candidate;
            best = i;
        }
    }
    f->best_index = best;
    for (uint32_t d = 0u; d < f->config->states; d++) {
        f->best[d] = f->x[((size_t)d * f->stride) + best];
    }
}

void pfl_weights(pfl_t *f)
{
    const uint32_t count = f->config->particles;
    if (f->scratch_is_weights != 0u) {
        return;
    }
    memset(f->lanes, 0, sizeof(float) * LANES * LANE_MEAN);
    for (uint32_t first = 0u; first < count; first += PFL_BATCH) {
        weigh_lanes(f, first, ((count - first) < PFL_BATCH) ? (count - first) : PFL_BATCH);
    }
    f->weight_sum = lane_sum(lane_row(f, LANE_WEIGHT));
    f->scratch_is_weights = 1u;
}

/* Weights of all particles and, where there are angles, their circular means; false when the budget ran out. */
PFL_NOINLINE static bool weigh_up(pfl_t *f, bool budgeted)
{
    const uint32_t count = f->config->particles;
    for (uint32_t first = 0u; first < count; first += PFL_BATCH) {
        const uint32_t n = ((count - first) < PFL_BATCH) ? (count - first) : PFL_BATCH;
        if (budgeted && pfl_meter_spent(f)) {
            return false;
        }
        weigh_lanes(f, first, n);
        circle_lanes(f, first, (uint32_t)PFL_CEIL8(n));
    }
    centre_circles(f);
    return true;
}

/* All sums; false when the budget ran out. Without angles one sweep does it, batch by batch in the cache. */
static bool sum_up(pfl_t *f, bool budgeted)
{
    const uint32_t count = f->config->particles;
    const bool angles = f->config->circular_mask != 0u;
    f->scratch_is_weights = 0u;
    memset(f->lanes, 0, sizeof(float) * PFL_LANE_FLOATS(f->config->states));
    for (uint32_t d = 0u; d < f->config->states; d++) {
        f->centre[d] = f->x[((size_t)d * f->stride) + f->best_index];
    }
    if (angles && !weigh_up(f, budgeted)) {
        return false;
    }
    for (uint32_t first = 0u; first < count; first += PFL_BATCH) {
        const uint32_t n = ((count - first) < PFL_BATCH) ? (count - first) : PFL_BATCH;
        if (budgeted && pfl_meter_spent(f)) {
            return false;
        }
        if (!angles) {
            weigh_lanes(f, first, n);
        }
        state_lanes(f, first, n);
    }
    return true;
}

/* Are mean and covariance finite? A product with zero is NaN for what is not. */
static bool moments_are_finite(const pfl_t *f)
{
    const uint32_t states = f->config->states;
    float sum = 0.0f;
    for (uint32_t d = 0u; d < states; d++) {
        sum += f->mean[d] * 0.0f;
    }
    for (uint32_t k = 0u; k < ((states * (states + 1u)) / 2u); k++) {
        sum += f->cov[k] * 0.0f;
    }
    return pfl_is_finite(sum);
}

/* Angles beyond all reason have no centre. Nothing that is not finite stays in the arena. */
static void mend_centre(const pfl_t *f)
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
