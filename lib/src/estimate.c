/* What a filter answers: moments, the most likely particle, quantiles, the cloud, health, invariants. */
#include "guard.h"

#include "rng_kernels.h"
#include "sqrt_kernel.h"

PFL_NOINLINE static bool all_finite(const float *x, uint32_t n)
{
    bool finite = true;
    for (uint32_t k = 0u; k < n; k++) {
        finite = finite && pfl_is_finite(x[k]);
    }
    return finite;
}

/* What lies in the cache may have been damaged there. */
static bool cache_is_whole(const pfl_t *f)
{
    const uint32_t states = f->config->states;
    const bool full = f->config->moments == (uint16_t)PFL_MOMENTS_FULL;
    return all_finite(f->mean, states) && (!full || all_finite(f->cov, (states * (states + 1u)) / 2u));
}

static void copy_moments(const pfl_t *f, float *mean, float *cov)
{
    const uint32_t states = f->config->states;
    memcpy(mean, f->mean, sizeof(float) * states);
    const float *upper = f->cov;
    for (uint32_t d = 0u; (cov != NULL) && (d < states); d++) {
        for (uint32_t e = d; e < states; e++) {
            cov[(d * states) + e] = *upper;
            cov[(e * states) + d] = *upper;
            upper++;
        }
    }
}

static pfl_status_t estimate(pfl_t *f, float *mean, float *cov)
{
    if (mean == NULL) {
        return PFL_ERR_ARG;
    }
    if ((cov != NULL) && (f->config->moments != (uint16_t)PFL_MOMENTS_FULL)) {
        return PFL_ERR_CONFIG;
    }
    if (!cache_is_whole(f)) {
        f->moments_current = MOMENTS_STALE;
    }
    pfl_refresh(f);
    if (f->moments_current == MOMENTS_OVERFLOWED) {
        return pfl_fault(f, PFL_ERR_NONFINITE);
    }
    copy_moments(f, mean, cov);
    return PFL_OK;
}

pfl_status_t pfl_estimate(pfl_t *f, float *mean, float *cov)
{
    if ((pfl_enter(f) == PFL_OK) && (f->moments_current == MOMENTS_CURRENT) && cache_is_whole(f)) {
        return estimate(f, mean, cov); /* nothing changes, so nothing needs a new seal */
    }
    const pfl_status_t entered = pfl_begin(f);
    return (entered == PFL_OK) ? pfl_end(f, estimate(f, mean, cov)) : entered;
}

pfl_status_t pfl_most_likely(const pfl_t *f, float *state)
{
    const pfl_status_t looked = (state != NULL) ? pfl_look(f) : PFL_ERR_ARG;
    if (looked != PFL_OK) {
        return looked;
    }
    if (!all_finite(f->best, f->config->states)) {
        return PFL_ERR_CORRUPT;
    }
    memcpy(state, f->best, sizeof(float) * f->config->states);
    return PFL_OK;
}

float pfl_effective_sample_size(const pfl_t *f)
{
    return (pfl_look(f) == PFL_OK) ? f->ess : 0.0f;
}

pfl_status_t pfl_particles(const pfl_t *f, pfl_view_t *view, float *log_weights)
{
    const pfl_status_t looked = (view != NULL) ? pfl_look(f) : PFL_ERR_ARG;
    if (looked != PFL_OK) {
        return looked;
    }
    const pfl_view_t all = {f->x, f->stride, 0u, f->config->particles};
    *view = all;
    for (uint32_t i = 0u; (log_weights != NULL) && (i < all.n); i++) {
        const float relative = f->log_weight[i] - f->log_weight_top;
        const float whole = (relative <= 0.0f) ? relative : pfl_from_bits((int32_t)0xFF800000u);
        log_weights[i] = (f->weights_equal != 0u) ? 0.0f : whole;
    }
    return PFL_OK;
}

static float farthest_square(const pfl_t *f, uint32_t x_state, uint32_t y_state, float x, float y)
{
    const float *restrict px = &f->x[(size_t)x_state * f->stride];
    const float *restrict py = &f->x[(size_t)y_state * f->stride];
    float farthest = 0.0f;
    for (uint32_t i = 0u; i < f->config->particles; i++) {
        const float dx = px[i] - x;
        const float dy = py[i] - y;
        const float square = (dx * dx) + (dy * dy);
        farthest = (square > farthest) ? square : farthest;
    }
    return farthest;
}

pfl_status_t pfl_farthest(const pfl_t *f, uint16_t x_state, uint16_t y_state, float x, float y, float *distance)
{
    const pfl_status_t looked = (distance != NULL) ? pfl_look(f) : PFL_ERR_ARG;
    if (looked != PFL_OK) {
        return looked;
    }
    if ((x_state >= f->config->states) || (y_state >= f->config->states) || !pfl_is_finite(x) || !pfl_is_finite(y)) {
        return PFL_ERR_ARG;
    }
    const float farthest = farthest_square(f, x_state, y_state, x, y);
    *distance = pfl_is_finite(farthest) ? pfl_sqrt_kernel(farthest) : FLT_MAX;
    return PFL_OK;
}

/* ---- Quantiles: bisection over the ordered bits of a float, with weights as integers -------------------------- */

/* Order-preserving integer image of a float. */
static uint32_t key_of(float x)
{
    const uint32_t u = (uint32_t)pfl_bits(x);
    return ((u & 0x80000000u) != 0u) ? ~u : (u | 0x80000000u);
}

static float from_key(uint32_t key)
{
    const uint32_t u = ((key & 0x80000000u) != 0u) ? (key & 0x7FFFFFFFu) : ~key;
    return pfl_from_bits((int32_t)u);
}

static uint64_t weight_up_to(const pfl_t *f, const float *x, uint32_t key)
{
    uint64_t sum = 0u;
    for (uint32_t i = 0u; i < f->config->particles; i++) {
        sum += (key_of(x[i]) <= key) ? (uint64_t)pfl_load_u32(&f->scratch[i]) : 0u;
    }
    return sum;
}

static pfl_status_t quantile(pfl_t *f, uint16_t state, float p, float *value)
{
    if ((value == NULL) || (state >= f->config->states) || !(p > 0.0f) || !(p <= 1.0f)) {
        return PFL_ERR_ARG;
    }
    pfl_weights(f);
    const float scale = 2.0e9f / f->weight_sum;
    for (uint32_t i = 0u; i < f->config->particles; i++) {
        pfl_store_u32(&f->scratch[i], (uint32_t)(int32_t)(f->scratch[i] * scale));
    }
    f->scratch_is_weights = 0u;
    const float *x = &f->x[(size_t)state * f->stride];
    const uint64_t total = weight_up_to(f, x, UINT32_MAX);
    const uint64_t share = (total * (uint32_t)(p * 16777216.0f)) >> 24; /* p in steps of 2^-24 */
    const uint64_t wanted = (share > 0u) ? share : 1u;
    uint32_t low = 0u;
    uint32_t high = UINT32_MAX;
    while (low < high) {
        const uint32_t middle = low + ((high - low) / 2u);
        if (weight_up_to(f, x, middle) >= wanted) {
            high = middle;
        } else {
            low = middle + 1u;
        }
    }
    if (!pfl_is_finite(from_key(low))) {
        return pfl_fault(f, PFL_ERR_NONFINITE); /* damaged since the last predict */
    }
    *value = from_key(low);
    return PFL_OK;
}

pfl_status_t pfl_quantile(pfl_t *f, uint16_t state, float p, float *value)
{
    const pfl_status_t entered = pfl_begin(f);
    return (entered == PFL_OK) ? pfl_end(f, quantile(f, state, p, value)) : entered;
}

/* ---- Invariants ------------------------------------------------------------------------------------------------ */

static bool block_is_sane(const pfl_t *f)
{
    const uint32_t count = f->config->particles;
    return (f->stride == PFL_STRIDE(count)) && pfl_rng_alive(&f->rng) && (f->busy == 0u) &&
           pfl_is_finite(f->log_weight_top) && (f->ess >= 1.0f) && (f->ess <= (float)count);
}

static bool particles_are_finite(const pfl_t *f)
{
    for (uint32_t d = 0u; d < f->config->states; d++) {
        const float *x = &f->x[(size_t)d * f->stride];
        for (uint32_t i = 0u; i < f->config->particles; i++) {
            if (!pfl_is_finite(x[i])) {
                return false;
            }
        }
    }
    return true;
}

/* None is NaN or above the top, and one reaches it: else all weights could be zero. */
static bool log_weights_are_sane(const pfl_t *f)
{
    bool reached = f->weights_equal != 0u;
    for (uint32_t i = 0u; (f->weights_equal == 0u) && (i < f->config->particles); i++) {
        const float relative = f->log_weight[i] - f->log_weight_top;
        if (!(relative <= 0.0f)) {
            return false;
        }
        reached = reached || (relative >= 0.0f);
    }
    return reached;
}

bool pfl_invariants_hold(const pfl_t *f)
{
    if ((pfl_look(f) != PFL_OK) || !pfl_config_is_good(f->config)) {
        return false;
    }
    return block_is_sane(f) && particles_are_finite(f) && log_weights_are_sane(f);
}
