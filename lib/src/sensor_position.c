/* States seen directly with Gaussian noise. One loop for each number of components, so that a compiler can keep every
 * particle's sum in a register. */
#include "pflight/sensors.h"

/* What a squared distance counts for. */
static inline float factor(const pfl_position_t *s, uint32_t k)
{
    return -0.5f * (s->inv_sigma[k] * s->inv_sigma[k]);
}

static inline float square(float x, float z)
{
    const float e = x - z;
    return e * e;
}

static const float *column(const pfl_position_t *s, const pfl_view_t *p, uint32_t k)
{
    return &p->x[(size_t)s->state[k] * p->stride];
}

static void one(const pfl_position_t *s, const float *z, const pfl_view_t *p, float *restrict ll)
{
    const float *restrict a = column(s, p, 0u);
    const float za = z[0];
    const float fa = factor(s, 0u);
    for (uint32_t i = 0u; i < p->n; i++) {
        ll[i] = square(a[i], za) * fa;
    }
}

static void two(const pfl_position_t *s, const float *z, const pfl_view_t *p, float *restrict ll)
{
    const float *restrict a = column(s, p, 0u);
    const float *restrict b = column(s, p, 1u);
    const float za = z[0];
    const float zb = z[1];
    const float fa = factor(s, 0u);
    const float fb = factor(s, 1u);
    for (uint32_t i = 0u; i < p->n; i++) {
        ll[i] = (square(a[i], za) * fa) + (square(b[i], zb) * fb);
    }
}

static void three(const pfl_position_t *s, const float *z, const pfl_view_t *p, float *restrict ll)
{
    const float *restrict a = column(s, p, 0u);
    const float *restrict b = column(s, p, 1u);
    const float *restrict c = column(s, p, 2u);
    const float za = z[0];
    const float zb = z[1];
    const float zc = z[2];
    const float fa = factor(s, 0u);
    const float fb = factor(s, 1u);
    const float fc = factor(s, 2u);
    for (uint32_t i = 0u; i < p->n; i++) {
        const float ab = (square(a[i], za) * fa) + (square(b[i], zb) * fb);
        ll[i] = ab + (square(c[i], zc) * fc);
    }
}

void pfl_position_loglik(void *user, const void *z, const pfl_view_t *p, float *ll)
{
    const pfl_position_t *s = (const pfl_position_t *)user;
    const float *measured = (const float *)z;
    if (s->count <= 1u) {
        one(s, measured, p, ll);
    } else if (s->count == 2u) {
        two(s, measured, p, ll);
    } else {
        three(s, measured, p, ll);
        for (uint32_t k = 3u; k < s->count; k++) {
            const float *restrict a = column(s, p, k);
            for (uint32_t i = 0u; i < p->n; i++) {
                ll[i] += square(a[i], measured[k]) * factor(s, k);
            }
        }
    }
}
