/* Sensors that take any law of errors, and a bias from a state: errors.h has the equations. */
#include "pflight/errors.h"
#include "pflight/sensors.h"

#include "sqrt_kernel.h"

/* What is measured includes the bias. */
static void take_bias_off(uint16_t bias_state, const pfl_view_t *p, float *restrict errors)
{
    if (bias_state != PFL_NO_BIAS) {
        const float *restrict bias = &p->x[(size_t)bias_state * p->stride];
        for (uint32_t i = 0u; i < p->n; i++) {
            errors[i] -= bias[i];
        }
    }
}

void pfl_scalar_loglik(void *user, const void *z, const pfl_view_t *p, float *restrict ll)
{
    const pfl_scalar_t *s = (const pfl_scalar_t *)user;
    const float measured = *(const float *)z;
    const float *restrict x = &p->x[(size_t)s->state * p->stride];
    for (uint32_t i = 0u; i < p->n; i++) {
        ll[i] = measured - x[i];
    }
    take_bias_off(s->bias_state, p, ll);
    s->law(s->parameters, ll, p->n);
}

void pfl_ranging_loglik(void *user, const void *z, const pfl_view_t *p, float *restrict ll)
{
    const pfl_ranging_t *s = (const pfl_ranging_t *)user;
    const pfl_range_z_t *m = (const pfl_range_z_t *)z;
    const float *restrict x = &p->x[(size_t)s->x_state * p->stride];
    const float *restrict y = &p->x[(size_t)s->y_state * p->stride];
    const float height2 = m->height_m * m->height_m;
    const float inv_scale = 1.0f / m->scale;
    for (uint32_t i = 0u; i < p->n; i++) {
        const float dx = x[i] - m->anchor_x_m;
        const float dy = y[i] - m->anchor_y_m;
        ll[i] = m->range_m - pfl_sqrt_kernel(((dx * dx) + (dy * dy)) + height2);
    }
    take_bias_off(s->bias_state, p, ll);
    for (uint32_t i = 0u; i < p->n; i++) {
        ll[i] *= inv_scale;
    }
    s->law(s->parameters, ll, p->n);
}
