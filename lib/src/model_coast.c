/* Constant velocity on a few axes, without any noise: models.h has its equations. */
#include "pflight/models.h"

void pfl_coast_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    const pfl_coast_t *m = (const pfl_coast_t *)user;
    (void)u;
    for (uint32_t a = 0u; a < m->axes; a++) {
        float *restrict position = PFL_STATE(p, a);
        const float *restrict velocity = PFL_STATE(p, m->axes + a);
        if (m->remember != 0u) {
            float *restrict before = PFL_STATE(p, (2u * (uint32_t)m->axes) + a);
            for (uint32_t i = 0u; i < p->n; i++) {
                before[i] = position[i];
            }
        }
        for (uint32_t i = 0u; i < p->n; i++) {
            position[i] += dt_s * velocity[i];
        }
    }
}
