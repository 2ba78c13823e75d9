/* Several models in one filter: jump.h tells when. */
#include "pflight/jump.h"

#include "pflight/math.h"

#include "guard.h"
#include "math_kernels.h"
#include "parents.h"
#include "resample.h"
#include "rng_kernels.h"
#include "uniform_kernel.h"

/* ---- Jumps and moves ---------------------------------------------------------------------------------------------- */

/* Upper ends of the intervals of [0, 1) that lead from regime i to 0, 1, ...; what is above all of them stays. */
static void ends_of(const pfl_jump_t *m, uint32_t i, float dt_s, float *ends)
{
    float rate = 0.0f;
    for (uint32_t j = 0u; j < m->regimes; j++) {
        rate += (j != i) ? m->rate_hz[i][j] : 0.0f;
    }
    const float leaves = 1.0f - pfl_expf(-rate * dt_s);
    float end = 0.0f;
    for (uint32_t j = 0u; j < m->regimes; j++) {
        end += ((j != i) && (rate > 0.0f)) ? ((leaves * m->rate_hz[i][j]) / rate) : 0.0f;
        ends[j] = end;
    }
}

static uint32_t regime_of(float number, uint32_t regimes)
{
    const float low = (number > 0.0f) ? number : 0.0f; /* none for NaN */
    const float most = (float)(int32_t)(regimes - 1u);
    return (uint32_t)(int32_t)(((low < most) ? low : most) + 0.5f);
}

static void jump(const pfl_jump_t *m, float dt_s, const pfl_batch_t *p)
{
    float ends[PFL_REGIMES_MAX][PFL_REGIMES_MAX];
    float *number = PFL_STATE(p, m->state);
    const float *normal = PFL_NOISE(p, m->noises);
    for (uint32_t i = 0u; i < m->regimes; i++) {
        ends_of(m, i, dt_s, ends[i]);
    }
    for (uint32_t k = 0u; k < p->n; k++) {
        const uint32_t from = regime_of(number[k], m->regimes);
        const float u = pfl_uniform_kernel(normal[k]);
        uint32_t to = 0u;
        while ((to < m->regimes) && (u >= ends[from][to])) {
            to++;
        }
        number[k] = (float)(int32_t)((to < m->regimes) ? to : from);
    }
}

/* The particles of one regime, close together in the caller's room, through its model and back to their places. */
static void move_regime(const pfl_jump_t *m, uint32_t regime, const void *u, float dt_s, const pfl_batch_t *p)
{
    uint8_t place[PFL_BATCH];
    uint32_t n = 0u;
    const float *number = PFL_STATE(p, m->state);
    for (uint32_t k = 0u; k < p->n; k++) {
        place[n] = (uint8_t)k;
        n += (regime_of(number[k], m->regimes) == regime) ? 1u : 0u;
    }
    if (n == 0u) {
        return;
    }
    float *const noise = &m->room[(size_t)m->states * PFL_BATCH];
    const pfl_batch_t batch = {m->room, PFL_BATCH, noise, p->first, n};
    for (uint32_t d = 0u; d < m->states; d++) {
        for (uint32_t k = 0u; k < n; k++) {
            PFL_STATE(&batch, d)[k] = PFL_STATE(p, d)[place[k]];
        }
    }
    for (uint32_t q = 0u; q < m->noises; q++) {
        for (uint32_t k = 0u; k < n; k++) {
            noise[((size_t)q * PFL_BATCH) + k] = PFL_NOISE(p, q)[place[k]];
        }
    }
    m->regime[regime].predict(m->regime[regime].user, u, dt_s, &batch);
    for (uint32_t d = 0u; d < m->states; d++) {
        for (uint32_t k = 0u; k < n; k++) {
            PFL_STATE(p, d)[place[k]] = PFL_STATE(&batch, d)[k];
        }
    }
}

void pfl_jump_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    const pfl_jump_t *m = (const pfl_jump_t *)user;
    jump(m, dt_s, p);
    for (uint32_t r = 0u; r < m->regimes; r++) {
        move_regime(m, r, u, dt_s, p);
    }
}

/* ---- Resampling by regimes ------------------------------------------------------------------------------------------ */

/* One regime's part of a resampling. */
typedef struct {
    uint32_t sum;   /* of its integer weights */
    uint32_t n;     /* particles that it gets */
    uint32_t shift; /* brings the sum to the comb's range */
    comb_t comb;
    uint32_t start, reach, before;
} share_t;

static uint32_t regime_at(const pfl_t *f, const pfl_jump_t *m, uint32_t i)
{
    return regime_of(f->x[((size_t)m->state * f->stride) + i], m->regimes);
}

/* Integer weights into the scratch column; their sums by regimes. */
static uint32_t weigh(pfl_t *f, const pfl_jump_t *m, share_t *shares)
{
    pfl_weights(f);
    const uint32_t total = pfl_quantise(f);
    f->scratch_is_weights = 0u;
    memset(shares, 0, sizeof(share_t) * PFL_REGIMES_MAX);
    for (uint32_t i = 0u; i < f->config->particles; i++) {
        shares[regime_at(f, m, i)].sum += pfl_load_u32(&f->scratch[i]);
    }
    return total;
}

/* By probability, but the least for each that is possible; the likeliest regime gets what is left. */
static void allot(const pfl_t *f, const pfl_jump_t *m, uint32_t total, share_t *shares)
{
    const float each = (float)f->config->particles / (float)total;
    uint32_t likeliest = 0u;
    uint32_t left = f->config->particles;
    for (uint32_t r = 0u; r < m->regimes; r++) {
        likeliest = (shares[r].sum > shares[likeliest].sum) ? r : likeliest;
    }
    for (uint32_t r = 0u; r < m->regimes; r++) {
        share_t *s = &shares[r];
        if ((r != likeliest) && (s->sum != 0u)) {
            const uint32_t by_weight = (uint32_t)(int32_t)((float)s->sum * each);
            const uint32_t enough = (by_weight > m->least) ? by_weight : m->least;
            s->n = (enough > 0u) ? enough : 1u; /* a probability that nobody carries were lost */
            left -= s->n;
        }
    }
    shares[likeliest].n = left;
}

static void set_combs(pfl_t *f, const pfl_jump_t *m, share_t *shares)
{
    for (uint32_t r = 0u; r < m->regimes; r++) {
        share_t *s = &shares[r];
        if (s->sum != 0u) {
            while ((s->sum << s->shift) <= 0x40000000u) {
                s->shift++;
            }
            s->comb = pfl_comb_of(s->n, s->sum << s->shift);
            s->start = pfl_xoshiro_next(f->rng.one) >> (32u - s->comb.shift);
        }
    }
}

static uint32_t list_parents(const pfl_t *f, const pfl_jump_t *m, share_t *shares)
{
    uint32_t parents = 0u;
    for (uint32_t i = 0u; i < f->config->particles; i++) {
        const uint32_t weight = pfl_load_u32(&f->scratch[i]);
        share_t *s = &shares[regime_at(f, m, i)];
        if (weight != 0u) {
            s->reach += weight;
            const uint32_t below = (height(s->comb.factor, s->reach << s->shift) + s->start) >> s->comb.shift;
            if (below > s->before) {
                pfl_store_u32(&f->scratch[parents], below - s->before);
                pfl_store_u32(&f->log_weight[parents], i);
                parents++;
            }
            s->before = below;
        }
    }
    return parents;
}

/* Each particle of a regime carries an equal part of its probability. */
static void share_out(pfl_t *f, const pfl_jump_t *m, const share_t *shares)
{
    float each[PFL_REGIMES_MAX] = {0.0f};
    float top = -FLT_MAX;
    for (uint32_t r = 0u; r < m->regimes; r++) {
        if (shares[r].n > 0u) {
            each[r] = pfl_log_kernel((float)(int32_t)shares[r].sum / (float)(int32_t)shares[r].n);
            top = (each[r] > top) ? each[r] : top;
        }
    }
    const uint32_t count = f->config->particles;
    for (uint32_t i = 0u; i < count; i++) {
        f->log_weight[i] = (each[regime_at(f, m, i)] - top) - PFL_LOGLIK_SHIFT;
    }
    for (uint32_t i = count; i < pfl_padded(f); i++) {
        f->log_weight[i] = pfl_from_bits((int32_t)0xFF800000u);
    }
    f->weights_equal = 0u;
    f->scratch_is_weights = 0u;
    f->log_weight_top = -PFL_LOGLIK_SHIFT;
    f->best_index = 0u;
}

static void resample(pfl_t *f, const pfl_jump_t *m)
{
    const uint32_t begun = pfl_meter_read(f);
    share_t shares[PFL_REGIMES_MAX];
    const uint32_t total = weigh(f, m, shares);
    allot(f, m, total, shares);
    set_combs(f, m, shares);
    const uint32_t parents = list_parents(f, m, shares);
    pfl_parents_gather(f, parents);
    pfl_parents_fill(f, parents);
    share_out(f, m, shares);
    f->resample_pending = 0u;
    pfl_count(&f->resampled, 1u);
    f->watched.event |= PFL_EVENT_RESAMPLED;
    f->cycles_resample += pfl_meter_read(f) - begun;
}

/* ---- Calls ----------------------------------------------------------------------------------------------------------- */

static pfl_status_t enter(pfl_t *f, const pfl_jump_t *m)
{
    if (m == NULL) {
        return PFL_ERR_ARG;
    }
    const pfl_status_t entered = pfl_begin(f);
    if (entered != PFL_OK) {
        return entered;
    }
    const uint32_t square = m->regimes * m->regimes;
    const bool good = (m->regimes >= 1u) && (m->regimes <= PFL_REGIMES_MAX) && (m->state < f->config->states) &&
                      (m->states == f->config->states) && (f->config->particles >= square) &&
                      (m->least <= (f->config->particles / square));
    return good ? PFL_OK : pfl_end(f, PFL_ERR_CONFIG);
}

pfl_status_t pfl_jump_resample(pfl_t *f, const pfl_jump_t *m)
{
    const pfl_status_t entered = enter(f, m);
    if (entered != PFL_OK) {
        return entered;
    }
    pfl_meter_resume(f);
    pfl_refresh(f);
    if ((m->ess_ratio >= 1.0f) || (f->ess < (m->ess_ratio * (float)f->config->particles))) {
        resample(f, m);
    }
    pfl_meter_pause(f);
    return pfl_end(f, PFL_OK);
}

pfl_status_t pfl_jump_probabilities(pfl_t *f, const pfl_jump_t *m, float *probability)
{
    const pfl_status_t entered = (probability != NULL) ? enter(f, m) : PFL_ERR_ARG;
    if (entered != PFL_OK) {
        return entered;
    }
    share_t shares[PFL_REGIMES_MAX];
    const uint32_t total = weigh(f, m, shares);
    for (uint32_t r = 0u; r < m->regimes; r++) {
        probability[r] = (float)shares[r].sum / (float)total;
    }
    return pfl_end(f, PFL_OK);
}
