/* States seen directly, some of them through a bias that is a state too: sensors.h has the equation. */
#include "pflight/sensors.h"

void pfl_biased_loglik(void *user, const void *z, const pfl_view_t *p, float *ll)
{
    const pfl_biased_t *s = (const pfl_biased_t *)user;
    const float *measured = (const float *)z;
    float *restrict out = ll;
    for (uint32_t i = 0u; i < p->n; i++) {
        out[i] = 0.0f;
    }
    for (uint32_t k = 0u; k < s->count; k++) {
        const float *restrict x = PFL_STATE(p, s->state[k]);
        const float *restrict bias = PFL_STATE(p, (s->bias[k] == PFL_UNBIASED) ? s->state[k] : s->bias[k]);
        const float counts = (s->bias[k] == PFL_UNBIASED) ? 0.0f : 1.0f;
        for (uint32_t i = 0u; i < p->n; i++) {
            const float e = ((x[i] + (counts * bias[i])) - measured[k]) * s->inv_sigma[k];
            out[i] -= 0.5f * (e * e);
        }
    }
}
