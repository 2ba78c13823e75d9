/* The optimal proposal for measurements linear in the state: proposal.h has its equations. With e = z - f, the noise of a
 * component given its measurement is normal, its mean sigma_noise e / (sigma_noise^2 + sigma_measured^2), its deviation
 * sigma_measured / sqrt(the same sum). */
#include "pflight/proposal.h"

#include "pflight/math.h"

/* Moves component k by its noise given the measurement, and adds to the log-likelihood what it says of the particle. */
static void move_given(const pfl_proposal_t *m, uint32_t k, float z, const pfl_batch_t *p)
{
    const float s = m->sigma_noise[k];
    const float r = m->sigma_measured[k];
    const float inv_variance = 1.0f / ((s * s) + (r * r));
    const float gain = s * inv_variance;
    const float spread = r * pfl_sqrtf(inv_variance);
    const float weight = 0.5f * inv_variance;
    const float *restrict w = PFL_NOISE(p, m->noise[k]);
    float *restrict x = PFL_STATE(p, m->state[k]);
    float *restrict ll = PFL_STATE(p, m->loglik_state);
    if (m->sigma_other[k] > 0.0f) { /* first: it needs x as the model left it */
        const float other = m->sigma_other[k];
        float *restrict y = PFL_STATE(p, m->other[k]);
        for (uint32_t i = 0u; i < p->n; i++) {
            y[i] += other * ((gain * (z - x[i])) + (spread * w[i]));
        }
    }
    for (uint32_t i = 0u; i < p->n; i++) {
        const float e = z - x[i];
        ll[i] -= weight * (e * e);
        x[i] += s * ((gain * e) + (spread * w[i]));
    }
}

/* Without a measurement: the model's own noise. */
static void move_freely(const pfl_proposal_t *m, uint32_t k, const pfl_batch_t *p)
{
    const float s = m->sigma_noise[k];
    const float other = m->sigma_other[k];
    const float *restrict w = PFL_NOISE(p, m->noise[k]);
    float *restrict x = PFL_STATE(p, m->state[k]);
    for (uint32_t i = 0u; i < p->n; i++) {
        x[i] += s * w[i];
    }
    if (other > 0.0f) {
        float *restrict y = PFL_STATE(p, m->other[k]);
        for (uint32_t i = 0u; i < p->n; i++) {
            y[i] += other * w[i];
        }
    }
}

void pfl_proposal_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    const pfl_proposal_t *m = (const pfl_proposal_t *)user;
    const pfl_proposal_input_t *in = (const pfl_proposal_input_t *)u;
    float *restrict ll = PFL_STATE(p, m->loglik_state);
    m->predict(m->user, in->u, dt_s, p);
    for (uint32_t i = 0u; i < p->n; i++) {
        ll[i] = 0.0f;
    }
    for (uint32_t k = 0u; k < m->count; k++) {
        if (in->z != NULL) {
            move_given(m, k, in->z[k], p);
        } else {
            move_freely(m, k, p);
        }
    }
}

void pfl_proposal_loglik(void *user, const void *z, const pfl_view_t *p, float *restrict ll)
{
    const pfl_proposal_t *m = (const pfl_proposal_t *)user;
    const float *restrict kept = &p->x[(size_t)m->loglik_state * p->stride];
    (void)z;
    for (uint32_t i = 0u; i < p->n; i++) {
        ll[i] = kept[i];
    }
}
