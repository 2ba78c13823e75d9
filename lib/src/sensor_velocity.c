/* A measured velocity in the plane, for states that hold speed and heading: sensors.h has the equation. */
#include "pflight/sensors.h"

#include "math_kernels.h"

void pfl_velocity_loglik(void *user, const void *z, const pfl_view_t *p, float *ll)
{
    const pfl_velocity_t *s = (const pfl_velocity_t *)user;
    const float *measured = (const float *)z;
    const float *restrict speed = &p->x[(size_t)s->speed_state * p->stride];
    const float *restrict heading = &p->x[(size_t)s->heading_state * p->stride];
    float *restrict out = ll;
    const float vx = measured[0];
    const float vy = measured[1];
    for (uint32_t i = 0u; i < p->n; i++) {
        float sine;
        float cosine;
        pfl_sincos_kernel(heading[i], &sine, &cosine);
        const float ex = ((speed[i] * cosine) - vx) * s->inv_sigma;
        const float ey = ((speed[i] * sine) - vy) * s->inv_sigma;
        out[i] = -0.5f * ((ex * ex) + (ey * ey));
    }
}
