/* A vehicle that hovers or wanders: velocities that come back to zero, and biases that walk. models.h has the
 * equations. */
#include "pflight/models.h"

#include "pflight/math.h"

void pfl_hover_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    const pfl_hover_t *m = (const pfl_hover_t *)user;
    const float keep = pfl_expf(-dt_s / m->time_s);
    const float fresh = pfl_sqrtf(1.0f - (keep * keep));
    (void)u;
    for (uint32_t a = 0u; a < m->axes; a++) {
        float *restrict position = PFL_STATE(p, a);
        float *restrict velocity = PFL_STATE(p, m->axes + a);
        const float *restrict w = PFL_NOISE(p, a);
        const float spread = fresh * m->sigma_mps[a];
        for (uint32_t i = 0u; i < p->n; i++) {
            const float before = velocity[i];
            velocity[i] = (keep * before) + (spread * w[i]);
            position[i] += dt_s * (0.5f * (before + velocity[i]));
        }
    }
    const float root = pfl_sqrtf(dt_s);
    for (uint32_t b = 0u; b < m->biases; b++) {
        float *restrict bias = PFL_STATE(p, (2u * (uint32_t)m->axes) + b);
        const float *restrict w = PFL_NOISE(p, m->axes + b);
        const float spread = root * m->bias_walk[b];
        for (uint32_t i = 0u; i < p->n; i++) {
            bias[i] += spread * w[i];
        }
    }
}
