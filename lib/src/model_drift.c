/* Biases and coloured noise as states beside any model: errors.h has the equations. */
#include "pflight/errors.h"
#include "pflight/math.h"

void pfl_drift_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    const pfl_drift_t *m = (const pfl_drift_t *)user;
    if (m->predict != NULL) {
        m->predict(m->user, u, dt_s, p);
    }
    for (uint32_t k = 0u; k < m->count; k++) {
        const bool walks = !(m->tau_s[k] > 0.0f);
        const float keep = walks ? 1.0f : pfl_expf(-dt_s / m->tau_s[k]);
        const float step = m->sigma[k] * pfl_sqrtf(walks ? dt_s : (1.0f - (keep * keep)));
        const float *restrict w = PFL_NOISE(p, m->noise[k]);
        float *restrict x = PFL_STATE(p, m->state[k]);
        for (uint32_t i = 0u; i < p->n; i++) {
            x[i] = (keep * x[i]) + (step * w[i]);
        }
    }
}
