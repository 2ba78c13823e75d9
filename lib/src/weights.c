/* First pass of an update: log-likelihoods into log-weights, and what decides whether they are accepted. core.h tells
 * how the weights are kept. Integer minima and maxima do not depend on their order, so plain loops keep the bits. */
#include "core.h"

#include <limits.h>

/* The rest of a group weighs nothing. */
static void pad(float *log_weight, uint32_t n)
{
    for (uint32_t i = 0u; i < n; i++) {
        log_weight[i] = pfl_from_bits((int32_t)0xFF800000u);
    }
}

void pfl_weigh_start(pfl_weigh_t *w, bool gated)
{
    w->gated = gated ? 1u : 0u;
    w->worst_bits = INT32_MIN;
    w->best_bits = INT32_MAX;
    w->top_bits = INT32_MAX;
    w->top_first = 0u;
}

/* Three forms of one loop. Where the weights are equal there is nothing to add, and the best log-likelihood is the
 * largest log-weight; where there is no gate nobody asks for it. */
static inline int32_t weigh(const float *restrict old, float old_top, uint32_t n, const float *restrict ll,
                            float *restrict log_weight, pfl_weigh_t *w, bool equal, bool gated)
{
    int32_t worst = w->worst_bits;
    int32_t best = w->best_bits;
    int32_t top = INT32_MAX;
    for (uint32_t i = 0u; i < n; i++) {
        const float y = ll[i] - PFL_LOGLIK_SHIFT;
        const float s = equal ? y : ((old[i] - old_top) + y);
        const int32_t y_bits = pfl_bits(y);
        const int32_t s_bits = pfl_bits(s);
        log_weight[i] = s;
        worst = (y_bits > worst) ? y_bits : worst;
        best = (gated && (y_bits < best)) ? y_bits : best;
        top = (s_bits < top) ? s_bits : top;
    }
    w->worst_bits = worst;
    w->best_bits = (equal && (top < best)) ? top : best;
    return top;
}

void pfl_weigh_batch(const pfl_t *f, uint32_t first, uint32_t n, const float *ll, pfl_weigh_t *w)
{
    const float *old = &f->log_weight[first];
    float *log_weight = &f->scratch[first];
    int32_t top;
    if (f->weights_equal != 0u) {
        top = weigh(old, 0.0f, n, ll, log_weight, w, true, false);
    } else if (w->gated != 0u) {
        top = weigh(old, f->log_weight_top, n, ll, log_weight, w, false, true);
    } else {
        top = weigh(old, f->log_weight_top, n, ll, log_weight, w, false, false);
    }
    pad(&log_weight[n], (uint32_t)PFL_CEIL8(n) - n);
    if (top < w->top_bits) {
        w->top_bits = top;
        w->top_first = first;
    }
}

void pfl_weights_equal(pfl_t *f)
{
    f->weights_equal = 1u;
    f->log_weight_top = 0.0f;
    f->scratch_is_weights = 0u;
}

void pfl_weights_settle(pfl_t *f)
{
    const uint32_t count = f->config->particles;
    if (f->weights_equal != 0u) {
        memset(f->log_weight, 0, sizeof(float) * count);
        pad(&f->log_weight[count], pfl_padded(f) - count);
        f->weights_equal = 0u;
    }
}

void pfl_weights_after_loss(pfl_t *f)
{
    const uint32_t count = f->config->particles;
    uint32_t best = 0u;
    for (uint32_t i = 1u; i < count; i++) {
        best = (f->log_weight[i] > f->log_weight[best]) ? i : best;
    }
    f->best_index = best;
    f->scratch_is_weights = 0u;
    if (pfl_is_finite(f->log_weight[best])) {
        f->log_weight_top = f->log_weight[best];
    } else {
        pfl_weights_equal(f);
    }
}
