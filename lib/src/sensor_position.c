/* States seen directly with Gaussian noise. One loop for each number of components, so that a compiler can keep every
 * particle's sum in a register. */
#include "pflight/sensors.h"

static inline float half_square(float x, float z, float inv_sigma)
{
    const float e = (x - z) * inv_sigma;
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
    const float ia = s->inv_sigma[0];
    for (uint32_t i = 0u; i < p->n; i++) {
        ll[i] = -0.5f * half_square(a[i], za, ia);
    }
}

static void two(const pfl_position_t *s, const float *z, const pfl_view_t *p, float *restrict ll)
{
    const float *restrict a = column(s, p, 0u);
    const float *restrict b = column(s, p, 1u);
    const float za = z[0];
    const float zb = z[1];
    const float ia = s->inv_sigma[0];
    const float ib = s->inv_sigma[1];
    for (uint32_t i = 0u; i < p->n; i++) {
        ll[i] = -0.5f * (half_square(a[i], za, ia) + half_square(b[i], zb, ib));
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
    const float ia = s->inv_sigma[0];
    const float ib = s->inv_sigma[1];
    const float ic = s->inv_sigma[2];
    for (uint32_t i = 0u; i < p->n; i++) {
        const float ab = half_square(a[i], za, ia) + half_square(b[i], zb, ib);
        ll[i] = -0.5f * (ab + half_square(c[i], zc, ic));
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
                ll[i] -= 0.5f * half_square(a[i], measured[k], s->inv_sigma[k]);
            }
        }
    }
}
