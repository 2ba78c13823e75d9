/* Callbacks made of functions of one particle: the same bits as loops over batches, on every batch length. */
#include "pflight/pflight.h"

#include "unity.h"

#include <string.h>

#define N 150u /* two batches and a part of one */

void setUp(void)
{
}
void tearDown(void)
{
}

/* ---- One particle, and the same as batches ------------------------------------------------------------------------- */

static void fall(void *user, const void *u, float dt_s, float *x, const float *w)
{
    const float *sigma = (const float *)user;
    const float *thrust = (const float *)u;
    x[0] += dt_s * x[1];
    x[1] += dt_s * ((*thrust - 9.81f) + (*sigma * w[0]));
}
PFL_PER_PARTICLE_PREDICT(fall_predict, 2, 1, fall)

static float barometer(void *user, const void *z, const float *x)
{
    const float e = x[0] - *(const float *)z;
    (void)user;
    return -2.0f * (e * e);
}
PFL_PER_PARTICLE_LOGLIK(barometer_loglik, 1, barometer)

static void anywhere(void *user, float *x, const float *w)
{
    (void)user;
    x[0] = 100.0f + w[0];
    x[1] = 2.0f * w[1];
    x[2] = w[2] * w[0];
}
PFL_PER_PARTICLE_DRAW(anywhere_draw, 3, anywhere)

static void batch_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    for (uint32_t i = 0u; i < p->n; i++) {
        PFL_STATE(p, 0)[i] += dt_s * PFL_STATE(p, 1)[i];
        PFL_STATE(p, 1)[i] += dt_s * ((*(const float *)u - 9.81f) + (*(const float *)user * PFL_NOISE(p, 0)[i]));
    }
}

static void batch_loglik(void *user, const void *z, const pfl_view_t *p, float *ll)
{
    (void)user;
    for (uint32_t i = 0u; i < p->n; i++) {
        const float e = p->x[i] - *(const float *)z;
        ll[i] = -2.0f * (e * e);
    }
}

static void batch_draw(void *user, const pfl_batch_t *p)
{
    (void)user;
    for (uint32_t i = 0u; i < p->n; i++) {
        PFL_STATE(p, 0)[i] = 100.0f + PFL_NOISE(p, 0)[i];
        PFL_STATE(p, 1)[i] = 2.0f * PFL_NOISE(p, 1)[i];
        PFL_STATE(p, 2)[i] = PFL_NOISE(p, 2)[i] * PFL_NOISE(p, 0)[i];
    }
}

/* ---- Flights ------------------------------------------------------------------------------------------------------- */

static void fly(void *arena, size_t bytes, pfl_predict_fn predict, pfl_loglik_fn loglik, pfl_draw_fn draw,
                float x[3][N])
{
    float sigma = 0.5f;
    const float thrust = 9.0f;
    const pfl_sensor_t sensor = {.loglik = loglik};
    pfl_config_t config;
    pfl_view_t view;
    pfl_t *f = NULL;
    memset(&config, 0, sizeof config);
    config.abi = PFL_ABI;
    config.particles = N;
    config.states = 3u;
    config.noises = 1u;
    config.sensor_count = 1u;
    config.ess_ratio = 0.5f;
    config.seed = 3u;
    config.sensors = &sensor;
    config.predict = predict;
    config.draw = draw;
    config.user = &sigma;
    TEST_ASSERT_EQUAL(PFL_OK, pfl_init(arena, bytes, &config, 0u, &f));
    for (uint64_t k = 1u; k <= 20u; k++) {
        const float z = 100.0f - (0.04f * (float)k);
        TEST_ASSERT_EQUAL(PFL_OK, pfl_predict(f, k * 100000u, &thrust));
        TEST_ASSERT_EQUAL(PFL_OK, pfl_update(f, 0u, k * 100000u, &z));
    }
    TEST_ASSERT_EQUAL(PFL_OK, pfl_particles(f, &view, NULL));
    for (uint32_t d = 0u; d < 3u; d++) {
        memcpy(x[d], PFL_STATE(&view, d), sizeof x[d]);
    }
}

void test_one_particle_at_a_time_computes_the_bits_of_batches(void)
{
    PFL_ARENA(arena, N, 3u, 1u);
    static float single[3][N];
    static float batch[3][N];
    fly(&arena, sizeof arena, fall_predict, barometer_loglik, anywhere_draw, single);
    fly(&arena, sizeof arena, batch_predict, batch_loglik, batch_draw, batch);
    TEST_ASSERT_EQUAL_MEMORY(batch, single, sizeof single);
    TEST_ASSERT_TRUE(single[0][0] > 95.0f && single[0][0] < 105.0f);
}

/* A model of the first two states of three. */
void test_further_states_are_left_alone(void)
{
    float x[3][PFL_BATCH];
    float noise[PFL_BATCH];
    float sigma = 0.0f;
    const float thrust = 9.81f;
    const pfl_batch_t batch = {&x[0][0], PFL_BATCH, noise, 0u, 5u};
    for (uint32_t i = 0u; i < PFL_BATCH; i++) {
        noise[i] = 1.0f;
        for (uint32_t d = 0u; d < 3u; d++) {
            x[d][i] = (float)(d + 1u);
        }
    }
    fall_predict(&sigma, &thrust, 0.5f, &batch);
    for (uint32_t i = 0u; i < PFL_BATCH; i++) {
        TEST_ASSERT_EQUAL_FLOAT((i < 5u) ? 2.0f : 1.0f, x[0][i]);
        TEST_ASSERT_EQUAL_FLOAT(2.0f, x[1][i]);
        TEST_ASSERT_EQUAL_FLOAT(3.0f, x[2][i]);
    }
}
