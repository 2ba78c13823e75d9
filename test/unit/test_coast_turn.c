/* The models that coast and turn, and the sensors for coloured errors and for velocity, against their equations in
 * double. */
#include "support.h"

#include "pflight/pflight.h"

#include "unity.h"

#include <math.h>
#include <string.h>

#define N PFL_BATCH
#define STRIDE (N + 8u)
#define STATES 9u
#define DT 0.1f

static float x[STATES * STRIDE];
static float before[STATES * STRIDE];
static float noise[4u * PFL_BATCH];
static float ll[N];
static pfl_rng_t rng;

static float *state(uint32_t d)
{
    return &x[d * STRIDE];
}

static double old(uint32_t d, uint32_t i)
{
    return (double)before[d * STRIDE + i];
}

static const pfl_batch_t batch = {x, STRIDE, noise, 0u, N};
static const pfl_view_t view = {x, STRIDE, 0u, N};

void setUp(void)
{
    uint64_t dice = 99u;
    for (uint32_t i = 0u; i < STATES * STRIDE; i++) {
        x[i] = (float)(3.0 * ut_gaussian(&dice));
    }
    memcpy(before, x, sizeof x);
    pfl_rng_seed(&rng, 7u);
    pfl_rng_normals(&rng, noise, 4u * PFL_BATCH / 16u);
}

void tearDown(void)
{
}

/* ---- Models ---------------------------------------------------------------------------------------------------------- */

void test_coast_moves_each_axis_by_its_velocity_and_remembers(void)
{
    pfl_coast_t coast = {.axes = 3u, .remember = 1u};
    pfl_coast_predict(&coast, NULL, DT, &batch);
    for (uint32_t i = 0u; i < N; i++) {
        for (uint32_t a = 0u; a < 3u; a++) {
            TEST_ASSERT_DOUBLE_WITHIN(2e-6, old(a, i) + (double)DT * old(3u + a, i), (double)state(a)[i]);
            TEST_ASSERT_EQUAL_HEX32(ut_bits(before[(3u + a) * STRIDE + i]), ut_bits(state(3u + a)[i]));
            TEST_ASSERT_EQUAL_HEX32(ut_bits(before[a * STRIDE + i]), ut_bits(state(6u + a)[i]));
        }
    }
}

void test_coast_without_memory_touches_nothing_else(void)
{
    pfl_coast_t coast = {.axes = 2u, .remember = 0u};
    pfl_coast_predict(&coast, NULL, DT, &batch);
    TEST_ASSERT_EQUAL_MEMORY(&before[2u * STRIDE], &x[2u * STRIDE], sizeof(float) * (STATES - 2u) * STRIDE);
}

void test_turn_follows_its_equations(void)
{
    pfl_turn_t turn = {.sigma_speed = 0.15f, .sigma_rate = 0.05f, .remember = 1u};
    pfl_turn_predict(&turn, NULL, DT, &batch);
    for (uint32_t i = 0u; i < N; i++) {
        const double dt = (double)DT;
        const double v = old(PFL_TURN_SPEED, i) + 0.15 * sqrt(dt) * (double)noise[i];
        const double omega = old(PFL_TURN_RATE, i) + 0.05 * sqrt(dt) * (double)noise[PFL_BATCH + i];
        const double psi = old(PFL_TURN_HEADING, i);
        const double c = cos(psi + 0.5 * dt * omega);
        const double s = sin(psi + 0.5 * dt * omega);
        TEST_ASSERT_DOUBLE_WITHIN(2e-6, v, (double)state(PFL_TURN_SPEED)[i]);
        TEST_ASSERT_DOUBLE_WITHIN(2e-6, omega, (double)state(PFL_TURN_RATE)[i]);
        TEST_ASSERT_DOUBLE_WITHIN(3e-6, psi + dt * omega, (double)state(PFL_TURN_HEADING)[i]);
        TEST_ASSERT_DOUBLE_WITHIN(3e-6, old(PFL_TURN_X, i) + dt * v * c, (double)state(PFL_TURN_X)[i]);
        TEST_ASSERT_DOUBLE_WITHIN(3e-6, old(PFL_TURN_Y, i) + dt * v * s, (double)state(PFL_TURN_Y)[i]);
        TEST_ASSERT_EQUAL_HEX32(ut_bits(before[PFL_TURN_X * STRIDE + i]), ut_bits(state(PFL_TURN_BEFORE_X)[i]));
        TEST_ASSERT_EQUAL_HEX32(ut_bits(before[PFL_TURN_Y * STRIDE + i]), ut_bits(state(PFL_TURN_BEFORE_Y)[i]));
    }
}

/* 1 in 100 steps: 128000 steps have 1280 +- 36 redraws; five deviations. The new rates have the deviation asked for. */
void test_turn_redraws_its_rate_as_often_as_said(void)
{
    pfl_turn_t turn = {.redraw_hz = 0.1f, .redraw_sigma = 0.3f};
    uint32_t redrawn = 0u;
    double squares = 0.0;
    for (uint32_t k = 0u; k < 1000u; k++) {
        pfl_rng_normals(&rng, noise, 4u * PFL_BATCH / 16u);
        for (uint32_t i = 0u; i < N; i++) {
            state(PFL_TURN_RATE)[i] = 100.0f;
        }
        pfl_turn_predict(&turn, NULL, DT, &batch);
        for (uint32_t i = 0u; i < N; i++) {
            const double rate = (double)state(PFL_TURN_RATE)[i];
            redrawn += rate < 50.0 ? 1u : 0u;
            squares += rate < 50.0 ? rate * rate : 0.0;
            state(PFL_TURN_HEADING)[i] = 0.0f;
        }
    }
    TEST_ASSERT_UINT32_WITHIN(178u, 10u * N, redrawn);
    TEST_ASSERT_DOUBLE_WITHIN(0.03, 0.3, sqrt(squares / (double)redrawn));
}

void test_turn_redraws_always_when_the_step_is_long(void)
{
    pfl_turn_t turn = {.redraw_hz = 10.0f, .redraw_sigma = 0.3f};
    pfl_turn_predict(&turn, NULL, 1.0f, &batch);
    for (uint32_t i = 0u; i < N; i++) {
        TEST_ASSERT_DOUBLE_WITHIN(1e-6, 0.3 * (double)noise[PFL_BATCH + i], (double)state(PFL_TURN_RATE)[i]);
    }
}

/* ---- Sensors --------------------------------------------------------------------------------------------------------- */

void test_coloured_weighs_the_difference(void)
{
    pfl_coloured_t sensor = {
        .count = 3u, .state = {0u, 4u, 2u}, .before = {6u, 1u, 8u}, .decay = 0.75f, .inv_sigma = {1.0f, 0.5f, 2.0f}};
    const pfl_coloured_z_t z = {.now = {0.5f, -1.0f, 2.0f}, .before = {0.25f, 1.5f, -3.0f}};
    pfl_coloured_loglik(&sensor, &z, &view, ll);
    for (uint32_t i = 0u; i < N; i++) {
        double expected = 0.0;
        for (uint32_t k = 0u; k < 3u; k++) {
            const double now = (double)z.now[k] - (double)state(sensor.state[k])[i];
            const double then = (double)z.before[k] - (double)state(sensor.before[k])[i];
            expected -= 0.5 * pow((now - 0.75 * then) * (double)sensor.inv_sigma[k], 2.0);
        }
        TEST_ASSERT_DOUBLE_WITHIN(2e-5 * (1.0 - expected), expected, (double)ll[i]);
    }
}

void test_coloured_without_colour_is_position(void)
{
    pfl_coloured_t sensor = {.count = 1u, .state = {3u}, .before = {5u}, .decay = 0.0f, .inv_sigma = {0.5f}};
    pfl_position_t position = {1u, {3u, 0u, 0u, 0u}, {0.5f, 0.0f, 0.0f, 0.0f}};
    const pfl_coloured_z_t z = {.now = {0.5f}, .before = {9.0f}};
    float direct[N];
    pfl_coloured_loglik(&sensor, &z, &view, ll);
    pfl_position_loglik(&position, z.now, &view, direct);
    TEST_ASSERT_EQUAL_FLOAT_ARRAY(direct, ll, N);
}

void test_velocity_sees_speed_and_heading(void)
{
    pfl_velocity_t sensor = {.speed_state = 2u, .heading_state = 3u, .inv_sigma = 4.0f};
    const float z[2] = {1.5f, -0.5f};
    pfl_velocity_loglik(&sensor, z, &view, ll);
    for (uint32_t i = 0u; i < N; i++) {
        const double v = (double)state(2u)[i];
        const double psi = (double)state(3u)[i];
        const double expected = -8.0 * (pow(v * cos(psi) - 1.5, 2.0) + pow(v * sin(psi) + 0.5, 2.0));
        TEST_ASSERT_DOUBLE_WITHIN(1e-5 * (1.0 - expected), expected, (double)ll[i]);
    }
}
