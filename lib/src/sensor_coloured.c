/* A position whose error is correlated in time, whitened by differences: sensors.h has the equation. */
#include "pflight/sensors.h"

void pfl_coloured_loglik(void *user, const void *z, const pfl_view_t *p, float *ll)
{
    const pfl_coloured_t *s = (const pfl_coloured_t *)user;
    const pfl_coloured_z_t *m = (const pfl_coloured_z_t *)z;
    float *restrict out = ll;
    for (uint32_t i = 0u; i < p->n; i++) {
        out[i] = 0.0f;
    }
    for (uint32_t k = 0u; k < s->count; k++) {
        const float *restrict now = &p->x[(size_t)s->state[k] * p->stride];
        const float *restrict before = &p->x[(size_t)s->before[k] * p->stride];
        const float z_now = m->now[k];
        const float z_before = m->before[k];
        for (uint32_t i = 0u; i < p->n; i++) {
            const float white = (z_now - now[i]) - (s->decay * (z_before - before[i]));
            const float e = white * s->inv_sigma[k];
            out[i] -= 0.5f * (e * e);
        }
    }
}
