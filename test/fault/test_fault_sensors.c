/* Fault matrix, rows S1 to S3: sensors that fall silent, lie, repeat themselves or come late. Row S2's figures over many
 * flights are those of tools/survival gates. */
#include "fault_support.h"

#include "unity.h"

#include <math.h>
#include <string.h>

static ft_t t;

void setUp(void)
{
}

void tearDown(void)
{
    ut_arenas_end();
}

static float variance(void)
{
    float mean[2];
    float cov[4];
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(t.f, mean, cov));
    return cov[0];
}

/* ---- S1 ----------------------------------------------------------------------------------------------------------- */

static void silent_for(uint32_t cycles, bool lost)
{
    ft_configure(&t);
    ft_start(&t);
    ft_cycles(&t, 30u, 0.0f);
    float before = variance();
    const float start = before;
    for (uint32_t k = 0u; k < cycles; k++) {
        t.now_us += FT_STEP_US;
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(t.f, t.now_us, NULL));
        const float now = variance();
        TEST_ASSERT_TRUE_MESSAGE(now > (0.97f * before), "the spread shrinks without a measurement");
        before = now;
    }
    TEST_ASSERT_TRUE((cycles < 10u) || (before > start));
    const pfl_health_t h = ft_health(t.f);
    TEST_ASSERT_EQUAL_INT(cycles > 10u, (h.mode & PFL_MODE_STALE) != 0u);
    TEST_ASSERT_EQUAL_INT(lost, h.phase == PFL_PHASE_LOST);
    ft_cycles(&t, 100u, 0.0f);
    TEST_ASSERT_TRUE(fabsf(ft_finite_mean(t.f)) < 1.0f);
    TEST_ASSERT_EQUAL_INT(PFL_PHASE_TRACKING, ft_health(t.f).phase);
    ut_arenas_end();
}

void test_S1_a_silent_sensor_widens_the_cloud_goes_stale_and_comes_back(void)
{
    silent_for(1u, false);
    silent_for(10u, false);
    silent_for(40u, false);
    silent_for(100u, true);
    silent_for(600u, true);
}

void test_S1_a_sensor_that_never_starts_never_makes_the_filter_usable(void)
{
    ft_configure(&t);
    ft_start(&t);
    for (uint32_t k = 0u; k < 600u; k++) {
        t.now_us += FT_STEP_US;
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(t.f, t.now_us, NULL));
        (void)ft_finite_mean(t.f);
        TEST_ASSERT_EQUAL_UINT32(0u, ft_health(t.f).mode & PFL_MODE_USABLE);
    }
}

/* ---- S2 ----------------------------------------------------------------------------------------------------------- */

/* Root mean square error over 60 s with `share` of the measurements `sigmas` off. */
static double error_with(double share, double sigmas)
{
    uint64_t state = 11u;
    double square = 0.0;
    ft_configure(&t);
    t.watch.lost_rejects = 20u;
    ft_start(&t);
    for (uint32_t k = 0u; k < 600u; k++) {
        const double noise = ut_gaussian(&state);
        const bool off = (ut_uniform(&state) < share) && (k >= 20u);
        const double side = (ut_uniform(&state) < 0.5) ? -sigmas : sigmas;
        const pfl_status_t status = ft_cycle(&t, (float)(off ? side : noise));
        const double mean = (double)ft_finite_mean(t.f);
        TEST_ASSERT_TRUE(!off || (sigmas < 9.0) || (status == PFL_REJECTED));
        square += (k >= 20u) ? (mean * mean) : 0.0;
    }
    ut_arenas_end();
    return sqrt(square / 580.0);
}

void test_S2_outliers_of_any_size_cost_little_up_to_a_fifth(void)
{
    const double clean = error_with(0.0, 0.0);
    const double shares[3] = {0.05, 0.2, 0.5};
    for (uint32_t s = 0u; s < 3u; s++) {
        const double most = (s < 2u) ? 1.5 : 3.0;
        TEST_ASSERT_TRUE(error_with(shares[s], 10.0) < (most * clean));
        TEST_ASSERT_TRUE(error_with(shares[s], 1000.0) < (most * clean));
    }
}

void test_S2_a_constant_bias_beyond_the_gate_is_refused_and_told(void)
{
    ft_configure(&t);
    t.watch.reinject = 0.0f;
    ft_start(&t);
    ft_cycles(&t, 20u, 0.0f);
    for (uint32_t k = 0u; k < 30u; k++) {
        const float good = 0.0f;
        TEST_ASSERT_EQUAL_INT(PFL_REJECTED, ft_cycle(&t, 30.0f));
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(t.f, 1u, t.now_us, &good));
        TEST_ASSERT_EQUAL_HEX32(1u, ft_health(t.f).reject);
        TEST_ASSERT_TRUE(fabsf(ft_finite_mean(t.f)) < 1.0f);
    }
    pfl_sensor_health_t sensor;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_sensor_health(t.f, 0u, &sensor));
    TEST_ASSERT_TRUE(sensor.test_ratio > 1.0f);
}

void test_S2_a_frozen_sensor_goes_stale_by_its_content(void)
{
    ft_configure(&t);
    t.sensors[0].z_bytes = (uint16_t)sizeof(float);
    t.sensors[0].frozen_after = 3u;
    ft_start(&t);
    for (uint32_t k = 0u; k < 20u; k++) {
        TEST_ASSERT_EQUAL_INT(PFL_OK, ft_cycle(&t, 0.01f * (float)k));
    }
    for (uint32_t k = 0u; k < 30u; k++) {
        TEST_ASSERT_EQUAL_INT((k < 3u) ? PFL_OK : PFL_REJECTED, ft_cycle(&t, 0.5f));
    }
    TEST_ASSERT_TRUE((ft_health(t.f).mode & PFL_MODE_STALE) != 0u);
}

/* ---- S3 ----------------------------------------------------------------------------------------------------------- */

void test_S3_late_early_and_repeated_samples_are_refused_or_fused_once(void)
{
    ft_configure(&t);
    t.sensors[0].z_bytes = (uint16_t)sizeof(float);
    ft_start(&t);
    ft_cycles(&t, 11u, 0.0f);
    const float z = 0.25f;
    (void)ft_cycle(&t, z);
    const unsigned char *before = ut_snapshot(t.f);
    const uint64_t stamps[6] = {0u, 1u, t.now_us - 1u, t.now_us + 1u, t.now_us + 1000000u, UINT64_MAX};
    for (uint32_t k = 0u; k < 6u; k++) {
        TEST_ASSERT_EQUAL_INT(PFL_ERR_TIME, pfl_update(t.f, 0u, stamps[k], &z));
    }
    TEST_ASSERT_EQUAL_INT(PFL_ERR_TIME, pfl_update(t.f, 0u, t.now_us, &z)); /* the same again */
    TEST_ASSERT_TRUE(ut_same_posterior(before, ut_snapshot(t.f), pfl_snapshot_bytes(t.f)));
    TEST_ASSERT_TRUE((ft_health(t.f).fault & PFL_FAULT_TIME) != 0u);
    TEST_ASSERT_EQUAL_INT(PFL_OK, ft_cycle(&t, 0.26f));
}

void test_S3_the_order_of_two_sensors_does_not_matter(void)
{
    float mean[2][2];
    const float z[2] = {0.3f, -0.2f};
    for (uint32_t order = 0u; order < 2u; order++) {
        ft_configure(&t);
        t.config.ess_ratio = 0.0f;
        ft_start(&t);
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(t.f, FT_STEP_US, NULL));
        for (uint32_t k = 0u; k < 2u; k++) {
            const uint32_t sensor = (k + order) % 2u;
            TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(t.f, (uint16_t)sensor, FT_STEP_US, &z[sensor]));
        }
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(t.f, mean[order], NULL));
        ut_arenas_end();
    }
    TEST_ASSERT_FLOAT_WITHIN(1.0e-5f, mean[0][0], mean[1][0]);
    TEST_ASSERT_FLOAT_WITHIN(1.0e-5f, mean[0][1], mean[1][1]);
}
