/* The hovering vehicle and the sensor with biases, against their equations in double. */
#include "support.h"

#include "pflight/pflight.h"

#include "unity.h"

#include <math.h>
#include <string.h>

#define N 40u
#define STATES 7u

static float x[STATES * N];
static float before[STATES * N];
static float noise[4u * PFL_BATCH];

void setUp(void)
{
    uint64_t dice = 11u;
    for (uint32_t k = 0u; k < STATES * N; k++) {
        x[k] = (float)(3.0 * ut_gaussian(&dice));
    }
    for (uint32_t k = 0u; k < 4u * PFL_BATCH; k++) {
        noise[k] = (float)ut_gaussian(&dice);
    }
    memcpy(before, x, sizeof x);
}

void tearDown(void)
{
}

void test_velocities_come_back_and_biases_walk(void)
{
    pfl_hover_t model = {3u, 1u, 2.0f, {3.0f, 2.0f, 1.0f}, {0.1f}};
    const double sigma[] = {3.0, 2.0, 1.0};
    const double keep = exp(-0.25 / 2.0);
    const pfl_batch_t batch = {x, N, noise, 0u, N};
    pfl_hover_predict(&model, NULL, 0.25f, &batch);
    for (uint32_t i = 0u; i < N; i++) {
        for (uint32_t a = 0u; a < 3u; a++) {
            const double old = (double)before[(3u + a) * N + i];
            const double v = keep * old + sqrt(1.0 - keep * keep) * sigma[a] * (double)noise[a * PFL_BATCH + i];
            TEST_ASSERT_DOUBLE_WITHIN(1e-5, v, (double)x[(3u + a) * N + i]);
            TEST_ASSERT_DOUBLE_WITHIN(1e-5, (double)before[a * N + i] + 0.125 * (old + v), (double)x[a * N + i]);
        }
        const double bias = (double)before[6u * N + i] + 0.1 * 0.5 * (double)noise[3u * PFL_BATCH + i];
        TEST_ASSERT_DOUBLE_WITHIN(1e-5, bias, (double)x[6u * N + i]);
    }
}

void test_a_bias_adds_to_what_is_seen(void)
{
    pfl_biased_t sensor = {3u, {0u, 2u, 5u}, {PFL_UNBIASED, 6u, PFL_UNBIASED}, {0.5f, 2.0f, 1.0f}};
    const float z[3] = {1.0f, -2.0f, 0.5f};
    const pfl_view_t view = {x, N, 0u, N};
    float ll[N];
    pfl_biased_loglik(&sensor, z, &view, ll);
    for (uint32_t i = 0u; i < N; i++) {
        const double a = 0.5 * ((double)x[i] - 1.0);
        const double b = 2.0 * ((double)x[2u * N + i] + (double)x[6u * N + i] + 2.0);
        const double c = (double)x[5u * N + i] - 0.5;
        TEST_ASSERT_DOUBLE_WITHIN(2e-4, -0.5 * (a * a + b * b + c * c), (double)ll[i]);
    }
}
