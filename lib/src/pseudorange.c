/* Pseudoranges with reflections, and the clocks that particles carry along: pseudorange.h has the equations. */
#include "pflight/pseudorange.h"

#include "math_kernels.h"

#define PART 32u            /* particles at a time: their sums stay on the stack, which is small */
#define T3_PEAK 0.36755260f /* density of Student's t of 3 degrees of freedom at 0 */

#define TINY 1.0e-30f /* keeps a share of nothing from being 0 / 0 */

/* What of a satellite's mixture does not depend on the particle. */
typedef struct {
    float direct;    /* density of the direct range at its peak, times its probability */
    float reflected; /* likewise */
    float inv_3s2;
    float inv_tail; /* negative */
} mixture_t;

static mixture_t mixture_of(const pfl_pseudorange_t *s, const pfl_satellite_t *satellite)
{
    mixture_t m;
    m.direct = ((1.0f - satellite->reflected) * T3_PEAK) / s->sigma_m;
    m.inv_3s2 = 1.0f / ((3.0f * s->sigma_m) * s->sigma_m);
    m.inv_tail = (s->tail_m > 0.0f) ? (-1.0f / s->tail_m) : -1.0f;
    m.reflected = (s->tail_m > 0.0f) ? (satellite->reflected / s->tail_m) : 0.0f;
    return m;
}

static inline float direct_density(const mixture_t *m, float e)
{
    const float t = 1.0f + ((e * e) * m->inv_3s2);
    return m->direct / (t * t);
}

static inline float reflected_density(const mixture_t *m, float e)
{
    const int32_t is_short = pfl_bits(e) >> 31;
    const float far = pfl_from_bits(pfl_bits(e) & 0x7FFFFFFF);
    const float density = m->reflected * pfl_exp_kernel(far * m->inv_tail);
    return pfl_from_bits(pfl_bits(density) & ~is_short);
}

static inline float clip(float x, float most)
{
    const int32_t below = -(int32_t)(x < -most);
    const int32_t above = -(int32_t)(x > most);
    return pfl_select(above, most, pfl_select(below, -most, x));
}

/* ---- The clocks ------------------------------------------------------------------------------------------------- */

typedef struct {
    float weight[2][PART];
    float pull[2][PART];
} sums_t;

static void add_range(const pfl_pseudorange_t *s, const pfl_satellite_t *satellite, const pfl_batch_t *p, sums_t *sums)
{
    const uint32_t k = (satellite->system != 0u) ? 1u : 0u;
    const float *restrict x = PFL_STATE(p, s->x_state);
    const float *restrict y = PFL_STATE(p, s->y_state);
    const float *restrict clock = PFL_STATE(p, s->clock_state + k);
    float *restrict weight = sums->weight[k];
    float *restrict pull = sums->pull[k];
    const mixture_t m = mixture_of(s, satellite);
    const pfl_satellite_t from = *satellite;
    const float leak = s->leak;
    const float most = s->clip_m;
    for (uint32_t i = 0u; i < p->n; i++) {
        const float e = (from.range_m + ((from.ux * x[i]) + (from.uy * y[i]))) - clock[i];
        const float direct = direct_density(&m, e);
        const float w = leak + (direct / ((direct + reflected_density(&m, e)) + TINY));
        weight[i] += w;
        pull[i] += w * clip(e, most);
    }
}

/* The robust mean of a constellation's errors pulls its clock, that of all the drift. */
static void pull_clocks(const pfl_pseudorange_t *s, const sums_t *sums, const pfl_batch_t *p)
{
    float *restrict first = PFL_STATE(p, s->clock_state);
    float *restrict second = PFL_STATE(p, s->clock_state + 1u);
    float *restrict drift = PFL_STATE(p, s->clock_state + 2u);
    for (uint32_t i = 0u; i < p->n; i++) {
        const float w0 = sums->weight[0][i];
        const float w1 = sums->weight[1][i];
        const float off0 = sums->pull[0][i] / (w0 + 1.0f); /* one range's worth of what is known already */
        const float off1 = sums->pull[1][i] / (w1 + 1.0f);
        first[i] += s->gain_clock * off0;
        second[i] += s->gain_clock * off1;
        drift[i] += s->gain_drift * (((w0 * off0) + (w1 * off1)) / ((w0 + w1) + 1.0e-3f));
    }
}

static void correct(const pfl_pseudorange_t *s, const pfl_pseudoranges_t *fused, const pfl_batch_t *p)
{
    for (uint32_t from = 0u; from < p->n; from += PART) {
        const uint32_t left = p->n - from;
        const pfl_batch_t part = {p->x + from, p->stride, p->noise + from, p->first + from,
                                  (left < PART) ? left : PART};
        sums_t sums;
        for (uint32_t i = 0u; i < PART; i++) {
            sums.weight[0][i] = 0.0f;
            sums.weight[1][i] = 0.0f;
            sums.pull[0][i] = 0.0f;
            sums.pull[1][i] = 0.0f;
        }
        for (uint32_t k = 0u; k < fused->count; k++) {
            add_range(s, &fused->satellite[k], &part, &sums);
        }
        pull_clocks(s, &sums, &part);
    }
}

void pfl_clocks_predict(const pfl_pseudorange_t *s, const pfl_pseudoranges_t *fused, float dt_s, const pfl_batch_t *p)
{
    if (fused != NULL) {
        correct(s, fused, p);
    }
    const float *restrict drift = PFL_STATE(p, s->clock_state + 2u);
    for (uint32_t k = 0u; k < 2u; k++) {
        float *restrict clock = PFL_STATE(p, s->clock_state + k);
        for (uint32_t i = 0u; i < p->n; i++) {
            clock[i] += dt_s * drift[i];
        }
    }
}

static float larger(float a, float b)
{
    return (a > b) ? a : b;
}

void pfl_clocks_fused(pfl_pseudorange_t *s)
{
    const float k = (float)((s->epochs < 10000u) ? s->epochs : 10000u);
    const float both = (k + 1.0f) * (k + 2.0f);
    s->gain_clock = larger(s->gain, (2.0f * ((2.0f * k) + 1.0f)) / both);
    s->gain_drift = larger((s->gain * s->gain) / (2.0f - s->gain), 6.0f / both) / s->interval_s;
    if (s->epochs == 0u) { /* one epoch tells no drift */
        s->gain_drift = 0.0f;
    }
    s->epochs++;
}

/* ---- The weights ------------------------------------------------------------------------------------------------- */

static void add_mixture(const pfl_pseudorange_t *s, const pfl_satellite_t *satellite, const pfl_view_t *p, float *ll)
{
    const float *restrict x = PFL_STATE(p, s->x_state);
    const float *restrict y = PFL_STATE(p, s->y_state);
    const float *restrict clock = PFL_STATE(p, s->clock_state + ((satellite->system != 0u) ? 1u : 0u));
    float *restrict out = ll;
    const mixture_t m = mixture_of(s, satellite);
    const float inv_top = 1.0f / (m.direct + m.reflected);
    for (uint32_t i = 0u; i < p->n; i++) {
        const float e = (satellite->range_m + ((satellite->ux * x[i]) + (satellite->uy * y[i]))) - clock[i];
        const float density = direct_density(&m, e) + reflected_density(&m, e);
        out[i] += s->power * pfl_log_positive_kernel(density * inv_top);
    }
    pfl_log_tells(out, (satellite->ux + satellite->uy) + satellite->range_m);
}

static void add_gaussian(const pfl_pseudorange_t *s, const pfl_satellite_t *satellite, const pfl_view_t *p, float *ll)
{
    const float *restrict x = PFL_STATE(p, s->x_state);
    const float *restrict y = PFL_STATE(p, s->y_state);
    const float *restrict clock = PFL_STATE(p, s->clock_state + ((satellite->system != 0u) ? 1u : 0u));
    float *restrict out = ll;
    const float scale = (-0.5f * s->power) / (s->sigma_m * s->sigma_m);
    for (uint32_t i = 0u; i < p->n; i++) {
        const float e = (satellite->range_m + ((satellite->ux * x[i]) + (satellite->uy * y[i]))) - clock[i];
        out[i] += scale * (e * e);
    }
}

void pfl_pseudorange_loglik(void *user, const void *z, const pfl_view_t *p, float *ll)
{
    const pfl_pseudorange_t *s = (const pfl_pseudorange_t *)user;
    const pfl_pseudoranges_t *ranges = (const pfl_pseudoranges_t *)z;
    for (uint32_t i = 0u; i < p->n; i++) {
        ll[i] = 0.0f;
    }
    for (uint32_t k = 0u; k < ranges->count; k++) {
        if (s->tail_m > 0.0f) {
            add_mixture(s, &ranges->satellite[k], p, ll);
        } else {
            add_gaussian(s, &ranges->satellite[k], p, ll);
        }
    }
}
