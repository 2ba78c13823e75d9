/* The reference work: 4 states, 2 normals and 3 Gaussian measurements a particle. */
#include "work.h"

#define VAR_W 5.0f
#define VAR_NOISE 10.0f

static pfl_land_vehicle_t vehicle = {100000.0f, 0.3f, 1250.0f, 2.5f, 0.5f, 0.0f, 0.0f, 0.0f};
static pfl_position_t seen = {3u, {0u, 1u, 2u, 0u}, {0.0f, 0.0f, 0.0f, 0.0f}};
static pfl_land_input_t inputs[WORK_STEPS_MAX];
static float measured[WORK_STEPS_MAX][WORK_MEASURED_MAX];

/* The start, known exactly. */
static void draw(void *user, const pfl_batch_t *p)
{
    static const float start[PFL_LAND_STATES] = {0.0f, 0.0f, 4.0f, 2.5f};
    (void)user;
    for (uint32_t d = 0u; d < PFL_LAND_STATES; d++) {
        for (uint32_t i = 0u; i < p->n; i++) {
            PFL_STATE(p, d)[i] = start[d];
        }
    }
}

static float steer_of(uint32_t k)
{
    if (k < 45u) {
        return -0.05f;
    }
    return (k < 65u) ? -0.005f : ((k < 80u) ? 0.01f : -0.01f);
}

static const void *input_of(uint32_t k)
{
    return &inputs[k];
}

static const float *measured_at(uint32_t k)
{
    return measured[k];
}

const work_t *work_land_vehicle(void)
{
    static const work_t work = {
        PFL_LAND_STATES, 2u,         pfl_land_vehicle_predict, draw, pfl_position_loglik, &vehicle, &seen,
        input_of,        measured_at};
    float noise[PFL_BATCH * 3u]; /* truth and measurements, by the library's own model on a batch of one */
    float x[PFL_LAND_STATES];
    const pfl_batch_t truth = {x, 1u, noise, 0u, 1u};
    pfl_rng_t rng;
    vehicle.sigma_position_mps = pfl_sqrtf(VAR_W);
    for (uint32_t k = 0u; k < 3u; k++) {
        seen.inv_sigma[k] = 1.0f / pfl_sqrtf(VAR_NOISE);
    }
    pfl_rng_seed(&rng, 2026u);
    draw(NULL, &truth);
    for (uint32_t k = 0u; k < WORK_STEPS_MAX; k++) {
        inputs[k].throttle = 0.03f;
        inputs[k].steer_rad = steer_of(k % 100u);
        pfl_rng_normals(&rng, noise, (sizeof noise / sizeof noise[0]) / 16u);
        pfl_land_vehicle_predict(&vehicle, &inputs[k], (float)WORK_STEP_US * 1.0e-6f, &truth);
        pfl_rng_normals(&rng, noise, 1u);
        for (uint32_t s = 0u; s < 3u; s++) {
            measured[k][s] = x[s] + (pfl_sqrtf(VAR_NOISE) * noise[s]);
        }
    }
    return &work;
}

const work_t *work_land_vehicle_antithetic(void)
{
    static pfl_antithetic_t mirrored;
    static work_t work;
    work = *work_land_vehicle();
    mirrored.predict = work.predict;
    mirrored.user = work.model;
    mirrored.noises = work.noises;
    work.predict = pfl_antithetic_predict;
    work.model = &mirrored;
    work.noises = (uint16_t)PFL_ANTITHETIC_NOISES(mirrored.noises);
    return &work;
}
