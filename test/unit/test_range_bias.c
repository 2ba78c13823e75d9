/* Ranges with learnt biases: with the place known, a scalar Kalman filter of each bias; and a likelihood that counts what
 * is not known of them yet. */
#include "support.h"

#include "pflight/pflight.h"

#include "unity.h"

#include <math.h>
#include <string.h>

#define N 40u
#define STATES 4u

static float x[STATES * N];
static pfl_range_bias_t sensor;
static const pfl_batch_t batch = {x, N, NULL, 0u, N};
static const pfl_view_t view = {x, N, 0u, N};

void setUp(void)
{
    uint64_t dice = 31u;
    for (uint32_t k = 0u; k < STATES * N; k++) {
        x[k] = (float)(5.0 * ut_gaussian(&dice));
    }
    for (uint32_t k = 2u * N; k < STATES * N; k++) {
        x[k] = 0.1f;
    }
    sensor = (pfl_range_bias_t){.x_state = 0u,
                                .y_state = 1u,
                                .bias_state = 2u,
                                .anchors = 2u,
                                .sigma_m = 0.1f,
                                .dof = 3.0f,
                                .walk = 0.01f,
                                .variance_m2 = {0.0025f, 0.0025f}};
}

void tearDown(void)
{
}

static double range_of(uint32_t i)
{
    return sqrt(((double)x[i] - 1.0) * ((double)x[i] - 1.0) + ((double)x[N + i] + 2.0) * ((double)x[N + i] + 2.0) +
                0.25);
}

void test_the_likelihood_counts_what_is_not_known(void)
{
    const pfl_range_bias_z_t z = {1.0f, -2.0f, 0.5f, 4.0f, 1u};
    float ll[N];
    sensor.variance_m2[1] = 0.02f;
    pfl_range_bias_loglik(&sensor, &z, &view, ll);
    for (uint32_t i = 0u; i < N; i++) {
        const double e = 4.0 - range_of(i) - 0.1;
        TEST_ASSERT_DOUBLE_WITHIN(1e-4, -2.0 * log(1.0 + e * e / (3.0 * 0.03)), (double)ll[i]);
    }
}

void test_a_known_place_teaches_the_bias(void)
{
    double mean = 0.1;
    double variance = 0.0025;
    uint64_t dice = 32u;
    for (uint32_t i = 0u; i < N; i++) {
        x[i] = 4.0f;
        x[N + i] = 2.0f;
    }
    for (uint32_t k = 0u; k < 100u; k++) {
        const pfl_range_bias_z_t z = {1.0f, -2.0f, 0.0f, (float)(5.17 + 0.02 * ut_gaussian(&dice)), 0u};
        pfl_range_bias_move(&sensor, 0.25f);
        variance += 0.25 * 1e-4;
        const double gain = variance / (variance + 0.01);
        const double e = (double)z.range_m - 5.0 - mean;
        mean += gain * fmin(1.0, 4.0 / (3.0 + e * e / (variance + 0.01))) * e;
        variance *= 1.0 - gain;
        pfl_range_bias_fused(&sensor, &z);
        pfl_range_bias_correct(&sensor, &z, &batch);
        TEST_ASSERT_DOUBLE_WITHIN(1e-5, mean, (double)x[2u * N]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-6, variance, (double)sensor.variance_m2[0]);
    }
    TEST_ASSERT_DOUBLE_WITHIN(0.01, 0.17, (double)x[2u * N]);
    TEST_ASSERT_EACH_EQUAL_FLOAT(0.1f, &x[3u * N], N);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 0.0025 + 25.0 * 1e-4, (double)sensor.variance_m2[1]);
}

void test_a_gross_range_hardly_pulls(void)
{
    const pfl_range_bias_z_t z = {1.0f, -2.0f, 0.5f, 30.0f, 0u};
    pfl_range_bias_correct(&sensor, NULL, &batch);
    TEST_ASSERT_EACH_EQUAL_FLOAT(0.1f, &x[2u * N], N);
    pfl_range_bias_fused(&sensor, &z);
    pfl_range_bias_correct(&sensor, &z, &batch);
    for (uint32_t i = 0u; i < N; i++) {
        const double e = 30.0 - range_of(i) - 0.1;
        TEST_ASSERT_DOUBLE_WITHIN(2e-6, 0.1 + 0.2 * 4.0 / (3.0 + e * e / 0.0125) * e, (double)x[2u * N + i]);
        TEST_ASSERT_FLOAT_WITHIN(0.02f, 0.1f, x[2u * N + i]);
    }
}

void test_a_range_that_is_no_number_is_refused(void)
{
    const float bad[] = {NAN, -NAN, INFINITY, -INFINITY};
    for (uint32_t k = 0u; k < 4u; k++) {
        const pfl_range_bias_z_t z = {1.0f, -2.0f, 0.5f, bad[k], 1u};
        float ll[N];
        uint32_t finite = 0u;
        pfl_range_bias_loglik(&sensor, &z, &view, ll);
        for (uint32_t i = 0u; i < N; i++) {
            finite += isfinite(ll[i]) ? 1u : 0u;
        }
        TEST_ASSERT_LESS_THAN_UINT32(N, finite);
    }
}
