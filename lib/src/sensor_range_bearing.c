/* Range and bearing from a known place: sensors.h has the equations. */
#include "pflight/sensors.h"

#include "math_kernels.h"
#include "sqrt_kernel.h"

void pfl_range_bearing_loglik(void *user, const void *z, const pfl_view_t *p, float *ll)
{
    const pfl_range_bearing_t *s = (const pfl_range_bearing_t *)user;
    const pfl_range_bearing_z_t *m = (const pfl_range_bearing_z_t *)z;
    const float *restrict x = &p->x[(size_t)s->x_state * p->stride];
    const float *restrict y = &p->x[(size_t)s->y_state * p->stride];
    float *restrict out = ll;
    for (uint32_t i = 0u; i < p->n; i++) {
        const float dx = x[i] - m->from_x_m;
        const float dy = y[i] - m->from_y_m;
        const float dr = (pfl_sqrt_kernel((dx * dx) + (dy * dy)) - m->range_m) * s->inv_sigma_range;
        const float off = pfl_wrap_pi_kernel(pfl_atan2_kernel(dy, dx) - m->bearing_rad);
        const float db = off * s->inv_sigma_bearing;
        out[i] = -0.5f * ((dr * dr) + (db * db));
    }
}
