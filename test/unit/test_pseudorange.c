/* Pseudoranges, the clocks that particles carry, and the wheels with their errors as states, against their equations in
 * double. */
#include "support.h"

#include "pflight/pflight.h"

#include "unity.h"

#include <math.h>
#include <string.h>

#define N 50u
#define STATES 8u
#define CLOCK 5u

static float x[STATES * N];
static float noise[6u * PFL_BATCH];
static pfl_pseudorange_t sensor;
static pfl_pseudoranges_t ranges;
static const pfl_batch_t batch = {x, N, noise, 0u, N};
static const pfl_view_t view = {x, N, 0u, N};

void setUp(void)
{
    uint64_t dice = 21u;
    for (uint32_t k = 0u; k < STATES * N; k++) {
        x[k] = (float)(20.0 * ut_gaussian(&dice));
    }
    for (uint32_t k = 0u; k < 6u * PFL_BATCH; k++) {
        noise[k] = (float)ut_gaussian(&dice);
    }
    sensor = (pfl_pseudorange_t){.x_state = 0u,
                                 .y_state = 1u,
                                 .clock_state = CLOCK,
                                 .sigma_m = 8.0f,
                                 .tail_m = 40.0f,
                                 .power = 0.1f,
                                 .clip_m = 30.0f,
                                 .leak = 0.03f,
                                 .gain = 0.05f,
                                 .interval_s = 0.2f};
    ranges.count = 3u;
    ranges.satellite[0] = (pfl_satellite_t){0.6f, -0.3f, 12.0f, 0.4f, 0u};
    ranges.satellite[1] = (pfl_satellite_t){-0.2f, 0.7f, 55.0f, 0.8f, 1u};
    ranges.satellite[2] = (pfl_satellite_t){0.1f, 0.1f, -9.0f, 0.05f, 1u};
}

void tearDown(void)
{
}

static double error_of(const float *state, uint32_t k, uint32_t i)
{
    const pfl_satellite_t *s = &ranges.satellite[k];
    return (double)s->range_m + (double)s->ux * (double)state[i] + (double)s->uy * (double)state[N + i] -
           (double)state[(CLOCK + s->system) * N + i];
}

static double direct(double e)
{
    const double t = 1.0 + e * e / (3.0 * 64.0);
    return 2.0 / (3.14159265358979 * sqrt(3.0) * 8.0) / (t * t);
}

static double reflected(double e)
{
    return e < 0.0 ? 0.0 : exp(-e / 40.0) / 40.0;
}

void test_the_likelihood_is_the_mixture(void)
{
    float ll[N];
    pfl_pseudorange_loglik(&sensor, &ranges, &view, ll);
    for (uint32_t i = 0u; i < N; i++) {
        double expected = 0.0;
        for (uint32_t k = 0u; k < 3u; k++) {
            const double q = (double)ranges.satellite[k].reflected;
            const double e = error_of(x, k, i);
            const double top = (1.0 - q) * direct(0.0) + q / 40.0;
            expected += 0.1 * log(((1.0 - q) * direct(e) + q * reflected(e)) / top);
        }
        TEST_ASSERT_DOUBLE_WITHIN(1e-5, expected, (double)ll[i]);
        TEST_ASSERT_TRUE(ll[i] <= 0.0f);
    }
}

void test_without_a_tail_it_is_gaussian(void)
{
    float ll[N];
    sensor.tail_m = 0.0f;
    pfl_pseudorange_loglik(&sensor, &ranges, &view, ll);
    for (uint32_t i = 0u; i < N; i++) {
        double expected = 0.0;
        for (uint32_t k = 0u; k < 3u; k++) {
            const double e = error_of(x, k, i) / 8.0;
            expected -= 0.05 * e * e;
        }
        TEST_ASSERT_DOUBLE_WITHIN(1e-5 * (1.0 - expected), expected, (double)ll[i]);
    }
}

void test_ranges_pull_the_clocks(void)
{
    float before[STATES * N];
    memcpy(before, x, sizeof x);
    pfl_clocks_fused(&sensor);
    TEST_ASSERT_EQUAL_FLOAT(1.0f, sensor.gain_clock);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, sensor.gain_drift);
    pfl_clocks_fused(&sensor);
    TEST_ASSERT_EQUAL_FLOAT(1.0f, sensor.gain_clock); /* a line through two points */
    TEST_ASSERT_EQUAL_FLOAT(5.0f, sensor.gain_drift);
    pfl_clocks_predict(&sensor, &ranges, 0.5f, &batch);
    for (uint32_t i = 0u; i < N; i++) {
        double w[2] = {0.0, 0.0};
        double pull[2] = {0.0, 0.0};
        for (uint32_t k = 0u; k < 3u; k++) {
            const pfl_satellite_t *s = &ranges.satellite[k];
            const double q = (double)s->reflected;
            const double e = error_of(before, k, i);
            const double weight = 0.03 + (1.0 - q) * direct(e) / ((1.0 - q) * direct(e) + q * reflected(e));
            w[s->system] += weight;
            pull[s->system] += weight * fmin(fmax(e, -30.0), 30.0);
        }
        const double off[2] = {pull[0] / (w[0] + 1.0), pull[1] / (w[1] + 1.0)};
        const double drift =
            (double)before[(CLOCK + 2u) * N + i] + 5.0 * (w[0] * off[0] + w[1] * off[1]) / (w[0] + w[1] + 1e-3);
        TEST_ASSERT_DOUBLE_WITHIN(1e-3, drift, (double)x[(CLOCK + 2u) * N + i]);
        for (uint32_t k = 0u; k < 2u; k++) {
            const double clock = (double)before[(CLOCK + k) * N + i] + off[k] + 0.5 * drift;
            TEST_ASSERT_DOUBLE_WITHIN(1e-3, clock, (double)x[(CLOCK + k) * N + i]);
        }
        TEST_ASSERT_EQUAL_FLOAT(before[i], x[i]);
    }
}

void test_gains_end_at_the_configured_one(void)
{
    for (uint32_t k = 0u; k < 1000u; k++) {
        pfl_clocks_fused(&sensor);
    }
    TEST_ASSERT_EQUAL_FLOAT(0.05f, sensor.gain_clock);
    TEST_ASSERT_FLOAT_WITHIN(1e-6f, 0.05f * 0.05f / 1.95f / 0.2f, sensor.gain_drift);
}

void test_wheels_follow_their_equations(void)
{
    const pfl_odometry_input_t in = {3.0f, -0.4f};
    pfl_wheels_t wheels = {0.05f, 0.1f, 0.02f, 0.3f, 0.01f, 0.004f};
    float before[STATES * N];
    memcpy(before, x, sizeof x);
    pfl_wheels_predict(&wheels, &in, 0.25f, &batch);
    for (uint32_t i = 0u; i < N; i++) {
        const double w[6] = {(double)noise[i],
                             (double)noise[PFL_BATCH + i],
                             (double)noise[2u * PFL_BATCH + i],
                             (double)noise[3u * PFL_BATCH + i],
                             (double)noise[4u * PFL_BATCH + i],
                             (double)noise[5u * PFL_BATCH + i]};
        const double scale = (double)before[PFL_WHEELS_SCALE * N + i] + 0.5 * 0.01 * w[4];
        const double bias = (double)before[PFL_WHEELS_BIAS * N + i] + 0.5 * 0.004 * w[5];
        const double way = 0.25 * 3.0 * scale + 0.5 * 0.05 * 3.0 * w[0];
        const double turn = 0.25 * (-0.4 + bias) + 0.5 * (0.02 + 0.1 * 0.4) * w[1];
        const double heading = (double)before[PFL_WHEELS_HEADING * N + i];
        TEST_ASSERT_DOUBLE_WITHIN(2e-5, heading + turn, (double)x[PFL_WHEELS_HEADING * N + i]);
        TEST_ASSERT_DOUBLE_WITHIN(4e-4, (double)before[i] + way * cos(heading + 0.5 * turn) + 0.15 * w[2],
                                  (double)x[i]);
        TEST_ASSERT_DOUBLE_WITHIN(4e-4, (double)before[N + i] + way * sin(heading + 0.5 * turn) + 0.15 * w[3],
                                  (double)x[N + i]);
    }
}

void test_a_range_that_is_no_number_is_refused(void)
{
    const float bad[] = {NAN, -NAN, INFINITY, -INFINITY};
    for (uint32_t k = 0u; k < 12u; k++) {
        float ll[N];
        uint32_t finite = 0u;
        const float kept = ranges.satellite[k / 4u].range_m;
        ranges.satellite[k / 4u].range_m = bad[k % 4u];
        pfl_pseudorange_loglik(&sensor, &ranges, &view, ll);
        ranges.satellite[k / 4u].range_m = kept;
        for (uint32_t i = 0u; i < N; i++) {
            finite += isfinite(ll[i]) ? 1u : 0u;
        }
        TEST_ASSERT_LESS_THAN_UINT32(N, finite);
    }
}
/* Backwards and turning left: errors grow with the size of the motion. */
void test_wheels_that_reverse_err_as_much(void)
{
    const pfl_odometry_input_t in = {-2.0f, 0.6f};
    pfl_wheels_t wheels = {0.05f, 0.1f, 0.02f, 0.0f, 0.0f, 0.0f};
    float before[STATES * N];
    memcpy(before, x, sizeof x);
    pfl_wheels_predict(&wheels, &in, 0.25f, &batch);
    for (uint32_t i = 0u; i < N; i++) {
        const double scale = (double)before[PFL_WHEELS_SCALE * N + i];
        const double bias = (double)before[PFL_WHEELS_BIAS * N + i];
        const double way = -0.25 * 2.0 * scale + 0.5 * 0.05 * 2.0 * (double)noise[i];
        const double turn = 0.25 * (0.6 + bias) + 0.5 * (0.02 + 0.1 * 0.6) * (double)noise[PFL_BATCH + i];
        const double heading = (double)before[PFL_WHEELS_HEADING * N + i];
        TEST_ASSERT_DOUBLE_WITHIN(2e-5, heading + turn, (double)x[PFL_WHEELS_HEADING * N + i]);
        TEST_ASSERT_DOUBLE_WITHIN(4e-4, (double)before[i] + way * cos(heading + 0.5 * turn), (double)x[i]);
    }
}

/* The clocks go on at their drift, in the same way for both constellations. */
void test_without_ranges_the_clocks_run_on(void)
{
    float before[STATES * N];
    memcpy(before, x, sizeof x);
    pfl_clocks_fused(&sensor);
    pfl_clocks_predict(&sensor, NULL, 0.5f, &batch);
    for (uint32_t i = 0u; i < N; i++) {
        const float drift = before[(CLOCK + 2u) * N + i];
        TEST_ASSERT_EQUAL_FLOAT(before[CLOCK * N + i] + (0.5f * drift), x[CLOCK * N + i]);
        TEST_ASSERT_EQUAL_FLOAT(before[(CLOCK + 1u) * N + i] + (0.5f * drift), x[(CLOCK + 1u) * N + i]);
        TEST_ASSERT_EQUAL_FLOAT(drift, x[(CLOCK + 2u) * N + i]);
    }
}

/* Nothing is a reflection: every range pulls with its whole weight, and the share of those that might be. */
void test_without_a_tail_all_ranges_pull_alike(void)
{
    float before[STATES * N];
    memcpy(before, x, sizeof x);
    sensor.tail_m = 0.0f;
    sensor.gain_clock = 1.0f;
    pfl_clocks_predict(&sensor, &ranges, 0.0f, &batch);
    for (uint32_t i = 0u; i < N; i++) {
        double pull[2] = {0.0, 0.0};
        double weight[2] = {0.0, 0.0};
        for (uint32_t k = 0u; k < 3u; k++) {
            const uint32_t system = ranges.satellite[k].system;
            weight[system] += 1.03;
            pull[system] += 1.03 * fmin(fmax(error_of(before, k, i), -30.0), 30.0);
        }
        for (uint32_t k = 0u; k < 2u; k++) {
            const double clock = (double)before[(CLOCK + k) * N + i] + pull[k] / (weight[k] + 1.0);
            TEST_ASSERT_DOUBLE_WITHIN(1e-3, clock, (double)x[(CLOCK + k) * N + i]);
        }
    }
}

/* A line through very many points: the gains of one through 10 001. */
void test_gains_of_a_line_stop_falling(void)
{
    sensor.gain = 0.0f;
    sensor.epochs = 3000000000u;
    pfl_clocks_fused(&sensor);
    TEST_ASSERT_FLOAT_WITHIN(1e-9f, 2.0f * 20001.0f / (10001.0f * 10002.0f), sensor.gain_clock);
    TEST_ASSERT_FLOAT_WITHIN(1e-12f, 6.0f / (10001.0f * 10002.0f) / 0.2f, sensor.gain_drift);
}
