/* A linear work of any even number of states, to see what a state costs: states 2k and 2k + 1 are position and speed of
 * mass k, noise k drives its speed, and its position is seen. */
#include "work.h"

#define SIGMA_DRIVE 0.2f
#define SIGMA_SEEN 2.0f

static work_t work;
static float measured[WORK_STEPS_MAX][WORK_MEASURED_MAX];

static void move(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    const uint32_t masses = *(const uint16_t *)user / 2u;
    (void)u;
    for (uint32_t k = 0u; k < masses; k++) {
        float *restrict x = PFL_STATE(p, 2u * k);
        float *restrict v = PFL_STATE(p, (2u * k) + 1u);
        const float *restrict w = PFL_NOISE(p, k);
        for (uint32_t i = 0u; i < p->n; i++) {
            x[i] += dt_s * v[i];
            v[i] += SIGMA_DRIVE * w[i];
        }
    }
}

static void see(void *user, const void *z, const pfl_view_t *p, float *restrict ll)
{
    const uint32_t masses = *(const uint16_t *)user / 2u;
    const float *position = (const float *)z;
    for (uint32_t i = 0u; i < p->n; i++) {
        ll[i] = 0.0f;
    }
    for (uint32_t k = 0u; k < masses; k++) {
        const float *restrict x = PFL_STATE(p, 2u * k);
        const float at = position[k];
        for (uint32_t i = 0u; i < p->n; i++) {
            const float miss = (x[i] - at) * (1.0f / SIGMA_SEEN);
            ll[i] -= 0.5f * (miss * miss);
        }
    }
}

static const void *no_input(uint32_t k)
{
    (void)k;
    return NULL;
}

static const float *measured_at(uint32_t k)
{
    return measured[k];
}

const work_t *work_chain(uint16_t states)
{
    float x[PFL_STATES_MAX] = {0.0f};
    float noise[PFL_BATCH * WORK_MEASURED_MAX];
    const pfl_batch_t truth = {x, 1u, noise, 0u, 1u};
    pfl_rng_t rng;
    work =
        (work_t){states, (uint16_t)(states / 2u), move, NULL, see, &work.states, &work.states, no_input, measured_at};
    pfl_rng_seed(&rng, 2026u);
    for (uint32_t k = 0u; k < WORK_STEPS_MAX; k++) {
        pfl_rng_normals(&rng, noise, (sizeof noise / sizeof noise[0]) / 16u);
        move(&work.states, NULL, (float)WORK_STEP_US * 1.0e-6f, &truth);
        pfl_rng_normals(&rng, noise, 1u);
        for (uint32_t m = 0u; m < (states / 2u); m++) {
            measured[k][m] = x[2u * m] + (SIGMA_SEEN * noise[m]);
        }
    }
    return &work;
}
