/* Range to a fixed point, Gaussian or Student's t: sensors.h has the equations. */
#include "pflight/sensors.h"

#include "math_kernels.h"
#include "sqrt_kernel.h"

void pfl_range_loglik(void *user, const void *z, const pfl_view_t *p, float *ll)
{
    const pfl_range_t *s = (const pfl_range_t *)user;
    const pfl_range_z_t *m = (const pfl_range_z_t *)z;
    const float *restrict x = &p->x[(size_t)s->x_state * p->stride];
    const float *restrict y = &p->x[(size_t)s->y_state * p->stride];
    float *restrict out = ll;
    const float inv_sigma = s->inv_sigma / m->scale;
    const float height2 = m->height_m * m->height_m;
    for (uint32_t i = 0u; i < p->n; i++) {
        const float dx = x[i] - m->anchor_x_m;
        const float dy = y[i] - m->anchor_y_m;
        const float e = (pfl_sqrt_kernel(((dx * dx) + (dy * dy)) + height2) - m->range_m) * inv_sigma;
        out[i] = e * e;
    }
    if (s->dof > 0.0f) {
        const float inv_dof = 1.0f / s->dof;
        const float power = -0.5f * (s->dof + 1.0f);
        for (uint32_t i = 0u; i < p->n; i++) {
            out[i] = power * pfl_log_positive_kernel(1.0f + (out[i] * inv_dof));
        }
        pfl_log_tells(out, ((m->anchor_x_m + m->anchor_y_m) + (m->height_m + m->range_m)) + inv_sigma);
    } else {
        for (uint32_t i = 0u; i < p->n; i++) {
            out[i] = -0.5f * out[i];
        }
    }
}
