/* States seen directly, weighed by the inverse squared distance: sensors.h has the equation. */
#include "pflight/sensors.h"

#include "math_kernels.h"

void pfl_position_distance_loglik(void *user, const void *z, const pfl_view_t *p, float *ll)
{
    const pfl_position_t *s = (const pfl_position_t *)user;
    const float *measured = (const float *)z;
    float *restrict out = ll;
    for (uint32_t i = 0u; i < p->n; i++) {
        out[i] = 1.0f;
    }
    for (uint32_t k = 0u; k < s->count; k++) {
        const float *restrict x = &p->x[(size_t)s->state[k] * p->stride];
        const float zk = measured[k];
        const float inv_sigma = s->inv_sigma[k];
        for (uint32_t i = 0u; i < p->n; i++) {
            const float e = (x[i] - zk) * inv_sigma;
            out[i] += e * e;
        }
    }
    for (uint32_t i = 0u; i < p->n; i++) {
        out[i] = -pfl_log_positive_kernel(out[i]);
    }
    for (uint32_t k = 0u; k < s->count; k++) {
        pfl_log_tells(out, measured[k]);
    }
}
