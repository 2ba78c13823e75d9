/* Weights times a power of a likelihood: scout.h tells for whom. */
#include "scout.h"

#include "lanes.h"

void pfl_scout_keep(pfl_scout_t *found, const float *restrict ll, uint32_t n, float *restrict scratch)
{
    int32_t worst = found->worst;
    float best = found->best;
    for (uint32_t i = 0u; i < n; i++) {
        const int32_t bits = pfl_bits(ll[i] - PFL_LOGLIK_SHIFT);
        worst = (bits > worst) ? bits : worst;
        best = (ll[i] > best) ? ll[i] : best;
        scratch[i] = ll[i];
    }
    found->worst = worst;
    found->best = best;
}

pfl_status_t pfl_scout_verdict(const pfl_scout_t *found)
{
    if (found->worst <= (int32_t)0xFF800000u) {
        return PFL_OK;
    }
    return ((found->worst >= 0) && (found->worst < 0x7F800000)) ? PFL_ERR_LOGLIK : PFL_ERR_NONFINITE;
}

/* Log-weights of a batch, padded to whole groups. */
static void stepped(const pfl_t *f, uint32_t first, uint32_t n, float power, float *restrict s)
{
    const float *restrict ll = &f->scratch[first];
    const float *restrict old = &f->log_weight[first];
    if (f->weights_equal != 0u) {
        for (uint32_t i = 0u; i < n; i++) {
            s[i] = power * ll[i];
        }
    } else {
        const float top = f->log_weight_top;
        for (uint32_t i = 0u; i < n; i++) {
            s[i] = (old[i] - top) + (power * ll[i]);
        }
    }
    for (uint32_t i = n; i < (uint32_t)PFL_CEIL8(n); i++) {
        s[i] = pfl_from_bits((int32_t)0xFF800000u);
    }
}

float pfl_scout_ess(pfl_t *f, float power)
{
    const uint32_t count = f->config->particles;
    float *s = f->work;
    float *w = &f->work[PFL_BATCH];
    float top = -FLT_MAX;
    for (uint32_t first = 0u; first < count; first += PFL_BATCH) {
        const uint32_t n = pfl_scout_batch(f, first);
        stepped(f, first, n, power, s);
        for (uint32_t i = 0u; i < n; i++) {
            top = (s[i] > top) ? s[i] : top;
        }
    }
    memset(f->lanes, 0, sizeof(float) * 2u * PFL_LANES);
    for (uint32_t first = 0u; first < count; first += PFL_BATCH) {
        const uint32_t n = pfl_scout_batch(f, first);
        stepped(f, first, n, power, s);
        pfl_lanes_weigh(f->lanes, w, s, top, (uint32_t)PFL_CEIL8(n));
    }
    const float sum = pfl_lane_sum(f->lanes);
    return (sum * sum) / pfl_lane_sum(&f->lanes[PFL_LANES]);
}

bool pfl_scout_weigh(pfl_t *f, float power)
{
    pfl_weigh_t w;
    pfl_weigh_start(&w, false);
    for (uint32_t first = 0u; first < f->config->particles; first += PFL_BATCH) {
        const uint32_t n = pfl_scout_batch(f, first);
        float *restrict ll = f->work;
        const float *restrict held = &f->scratch[first];
        for (uint32_t i = 0u; i < n; i++) {
            ll[i] = power * held[i];
        }
        pfl_weigh_batch(f, first, n, ll, &w);
    }
    if (w.top_bits >= (int32_t)0xFF800000u) {
        return false;
    }
    float *old = f->log_weight;
    f->log_weight = f->scratch;
    f->scratch = old;
    f->weights_equal = 0u;
    f->log_weight_top = pfl_from_bits(w.top_bits);
    f->moments_current = MOMENTS_STALE;
    pfl_set_best(f, w.top_first);
    return true;
}
