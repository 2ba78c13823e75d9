/* The ready models and sensors against their equations, written anew in double. */
#include "support.h"

#include "pflight/models.h"
#include "pflight/sensors.h"

#include "unity.h"

#include <math.h>
#include <string.h>

#define N 61u
#define STRIDE 72u
#define D 5u
#define PI 3.14159265358979323846

static float x[D * STRIDE];
static float noise[4u * PFL_BATCH];
static double before[D][N];
static double w[4][N];
static float ll[N + 1u];
static uint64_t dice;

void setUp(void)
{
    dice = 4711u;
    for (uint32_t k = 0u; k < (D * STRIDE); k++) {
        x[k] = (float)(10.0 * ut_gaussian(&dice));
    }
    for (uint32_t k = 0u; k < (4u * PFL_BATCH); k++) {
        noise[k] = (float)ut_gaussian(&dice);
    }
    for (uint32_t i = 0u; i < N; i++) {
        for (uint32_t d = 0u; d < D; d++) {
            before[d][i] = (double)x[(d * STRIDE) + i];
        }
        for (uint32_t q = 0u; q < 4u; q++) {
            w[q][i] = (double)noise[(q * PFL_BATCH) + i];
        }
    }
}

void tearDown(void)
{
}

/* Runs a model on the N particles, and checks that it touched no other. */
static void move(pfl_predict_fn model, void *user, const void *u, float dt_s)
{
    float kept[D * STRIDE];
    const pfl_batch_t batch = {x, STRIDE, noise, 0u, N};
    memcpy(kept, x, sizeof x);
    model(user, u, dt_s, &batch);
    for (uint32_t d = 0u; d < D; d++) {
        TEST_ASSERT_EQUAL_MEMORY(&kept[(d * STRIDE) + N], &x[(d * STRIDE) + N], sizeof(float) * (STRIDE - N));
    }
}

static void state_is(double expected, uint32_t d, uint32_t i)
{
    TEST_ASSERT_DOUBLE_WITHIN(2.0e-5, expected, (double)x[(d * STRIDE) + i]);
}

/* ---- Land vehicle ------------------------------------------------------------------------------------------------------------ */

static const pfl_land_vehicle_t vehicle = {100000.0f, 0.3f, 1250.0f, 2.5f, 0.5f, 1.5f, 0.05f, 0.02f};

static void land_matches(bool jitter)
{
    pfl_land_vehicle_t m = vehicle;
    const pfl_land_input_t in = {0.03f, -0.05f};
    const double dt = 0.5;
    move(jitter ? pfl_land_vehicle_jitter_predict : pfl_land_vehicle_predict, &m, &in, 0.5f);
    for (uint32_t i = 0u; i < N; i++) {
        const double v = before[2][i];
        const double th = before[3][i];
        const double sv = jitter ? (0.05 * w[2][i]) : 0.0;
        const double sh = jitter ? (0.02 * w[3][i]) : 0.0;
        state_is(before[0][i] + (dt * v * cos(th)) + (dt * 1.5 * w[0][i]), 0u, i);
        state_is(before[1][i] + (dt * v * sin(th)) + (dt * 1.5 * w[1][i]), 1u, i);
        state_is(v + (dt * ((100000.0 * 0.03 / ((v > 0.5) ? v : 0.5)) - (0.3 * v * v)) / 1250.0) + sv, 2u, i);
        state_is(th + (dt * v * tan(-0.05) / 2.5) + sh, 3u, i);
        state_is(before[4][i], 4u, i);
    }
}

void test_land_vehicle_follows_its_equations(void)
{
    land_matches(false);
}

void test_land_vehicle_with_jitter_follows_its_equations(void)
{
    land_matches(true);
}

/* The noise-free check of the paper's page: 100 steps of 0.5 s from (0, 0, 4, 2.5). */
void test_land_vehicle_reaches_the_end_of_its_route(void)
{
    pfl_land_vehicle_t m = vehicle;
    m.sigma_position_mps = 0.0f;
    memset(x, 0, sizeof x);
    for (uint32_t i = 0u; i < N; i++) {
        x[(2u * STRIDE) + i] = 4.0f;
        x[(3u * STRIDE) + i] = 2.5f;
    }
    for (uint32_t k = 0u; k < 100u; k++) {
        const float steer = (k < 45u) ? -0.05f : ((k < 65u) ? -0.005f : ((k < 80u) ? 0.01f : -0.01f));
        const pfl_land_input_t in = {0.03f, steer};
        const pfl_batch_t batch = {x, STRIDE, noise, 0u, N};
        pfl_land_vehicle_predict(&m, &in, 0.5f, &batch);
    }
    for (uint32_t i = 0u; i < N; i++) {
        TEST_ASSERT_FLOAT_WITHIN(0.006f, 203.59f, x[i]);
        TEST_ASSERT_FLOAT_WITHIN(0.006f, -263.70f, x[STRIDE + i]);
        TEST_ASSERT_FLOAT_WITHIN(0.0051f, 14.87f, x[(2u * STRIDE) + i]);
        TEST_ASSERT_FLOAT_WITHIN(0.0051f, -1.51f, x[(3u * STRIDE) + i]);
    }
}

/* ---- Constant velocity --------------------------------------------------------------------------------------------------------- */

static void constant_velocity_matches(float sigma_position)
{
    pfl_constant_velocity_t m = {0.7f, sigma_position};
    const double dt = 0.2;
    move(pfl_constant_velocity_predict, &m, NULL, 0.2f);
    for (uint32_t i = 0u; i < N; i++) {
        for (uint32_t axis = 0u; axis < 2u; axis++) {
            const double a = 0.7 * w[axis][i] / sqrt(dt);
            const double walk = (double)sigma_position * sqrt(dt) * w[2u + axis][i];
            state_is(before[axis][i] + (dt * before[2u + axis][i]) + (0.5 * dt * dt * a) + walk, axis, i);
            state_is(before[2u + axis][i] + (dt * a), 2u + axis, i);
        }
        state_is(before[4][i], 4u, i);
    }
}

void test_constant_velocity_follows_its_equations(void)
{
    constant_velocity_matches(0.0f);
}

void test_constant_velocity_with_a_random_walk_follows_its_equations(void)
{
    constant_velocity_matches(0.3f);
}

/* ---- Odometry -------------------------------------------------------------------------------------------------------------------- */

static void odometry_matches(float speed, float rate)
{
    pfl_odometry_t m = {1.1f, 0.05f, 0.2f, 0.01f, 0.03f};
    const pfl_odometry_input_t in = {speed, rate};
    const double dt = 0.1;
    setUp();
    move(pfl_odometry_predict, &m, &in, 0.1f);
    for (uint32_t i = 0u; i < N; i++) {
        const double root = sqrt(dt);
        const double way = (dt * 1.1 * (double)speed) + (root * 0.05 * fabs((double)speed) * w[0][i]);
        const double turn = (dt * (double)rate) + (root * (0.01 + (0.2 * fabs((double)rate))) * w[1][i]);
        const double th = before[2][i] + (0.5 * turn);
        state_is(before[0][i] + (way * cos(th)) + (root * 0.03 * w[2][i]), 0u, i);
        state_is(before[1][i] + (way * sin(th)) + (root * 0.03 * w[3][i]), 1u, i);
        state_is(before[2][i] + turn, 2u, i);
        state_is(before[3][i], 3u, i); /* further states are left alone */
        state_is(before[4][i], 4u, i);
    }
}

void test_odometry_follows_its_equations_in_every_direction(void)
{
    odometry_matches(1.5f, 0.4f);
    odometry_matches(-1.5f, 0.4f);
    odometry_matches(1.5f, -0.4f);
    odometry_matches(0.0f, 0.0f);
}

/* ---- Sensors ---------------------------------------------------------------------------------------------------------------------- */

static const pfl_view_t view = {x, STRIDE, 0u, N};

static void weigh(pfl_loglik_fn sensor, void *user, const void *z)
{
    ll[N] = 77.0f;
    sensor(user, z, &view, ll);
    TEST_ASSERT_FLOAT_WITHIN(0.0f, 77.0f, ll[N]); /* nothing beyond n */
}

static void loglik_is(double expected, uint32_t i)
{
    TEST_ASSERT_DOUBLE_WITHIN(1.0e-5 + (1.0e-5 * fabs(expected)), expected, (double)ll[i]);
}

void test_position_of_one_to_four_components(void)
{
    static const uint16_t states[4] = {3u, 0u, 4u, 1u};
    static const float inv[4] = {0.5f, 2.0f, 0.1f, 1.0f};
    static const float z[4] = {1.0f, -2.0f, 3.0f, 5.0f};
    for (uint16_t count = 1u; count <= PFL_POSITION_MAX; count++) {
        pfl_position_t s;
        memset(&s, 0, sizeof s);
        s.count = count;
        memcpy(s.state, states, sizeof states);
        memcpy(s.inv_sigma, inv, sizeof inv);
        weigh(pfl_position_loglik, &s, z);
        for (uint32_t i = 0u; i < N; i++) {
            double sum = 0.0;
            for (uint32_t k = 0u; k < count; k++) {
                const double e = (before[states[k]][i] - (double)z[k]) * (double)inv[k];
                sum += e * e;
            }
            loglik_is(-0.5 * sum, i);
        }
    }
}

static void range_matches(float dof, float scale, float height)
{
    pfl_range_t s = {1u, 4u, 2.0f, dof};
    const pfl_range_z_t z = {3.0f, -4.0f, height, 12.0f, scale};
    weigh(pfl_range_loglik, &s, &z);
    for (uint32_t i = 0u; i < N; i++) {
        const double dx = before[1][i] - 3.0;
        const double dy = before[4][i] + 4.0;
        const double e = (sqrt((dx * dx) + (dy * dy) + ((double)height * (double)height)) - 12.0) * 2.0 / (double)scale;
        const double n = (double)dof;
        loglik_is((n > 0.0) ? (-0.5 * (n + 1.0) * log1p((e * e) / n)) : (-0.5 * e * e), i);
    }
}

void test_range_gaussian(void)
{
    range_matches(0.0f, 1.0f, 0.0f);
    range_matches(0.0f, 3.0f, 2.5f);
}

void test_range_student_t(void)
{
    static const float dofs[] = {1.0f, 2.0f, 3.5f, 5.0f};
    for (size_t k = 0u; k < 4u; k++) {
        range_matches(dofs[k], 1.0f, 0.0f);
        range_matches(dofs[k], 2.0f, -1.5f);
    }
}

/* Gross errors: a range that is off by a light-minute costs little with heavy tails, and stays finite. */
void test_range_tails_survive_gross_errors(void)
{
    pfl_range_t s = {0u, 1u, 10.0f, 3.0f};
    const pfl_range_z_t z = {0.0f, 0.0f, 0.0f, 1.0e10f, 1.0f};
    weigh(pfl_range_loglik, &s, &z);
    for (uint32_t i = 0u; i < N; i++) {
        TEST_ASSERT_TRUE(ut_finite(ll[i]) && (ll[i] > -120.0f) && (ll[i] < -80.0f));
    }
}

void test_range_bearing_wraps_its_innovation(void)
{
    pfl_range_bearing_t s = {0u, 1u, 0.5f, 3.0f};
    for (int turns = -3; turns <= 3; turns++) {
        for (float bearing = -3.1f; bearing < 3.15f; bearing += 0.31f) {
            const float told = (float)((double)bearing + (2.0 * PI * (double)turns));
            const pfl_range_bearing_z_t z = {2.0f, -1.0f, 9.0f, told};
            weigh(pfl_range_bearing_loglik, &s, &z);
            for (uint32_t i = 0u; i < N; i++) {
                const double dx = before[0][i] - 2.0;
                const double dy = before[1][i] + 1.0;
                const double dr = (sqrt((dx * dx) + (dy * dy)) - 9.0) * 0.5;
                const double db = remainder(atan2(dy, dx) - (double)told, 2.0 * PI) * 3.0;
                TEST_ASSERT_DOUBLE_WITHIN(2.0e-4, -0.5 * ((dr * dr) + (db * db)), (double)ll[i]);
            }
        }
    }
}

void test_a_perfect_match_is_zero(void)
{
    pfl_position_t p = {2u, {0u, 1u, 0u, 0u}, {1.0f, 1.0f, 0.0f, 0.0f}};
    pfl_range_t r = {0u, 1u, 5.0f, 3.0f};
    pfl_range_bearing_t b = {0u, 1u, 5.0f, 5.0f};
    const float z[2] = {3.0f, 4.0f};
    const pfl_range_z_t rz = {0.0f, 0.0f, 0.0f, 5.0f, 1.0f};
    const pfl_range_bearing_z_t bz = {0.0f, 0.0f, 5.0f, 0.927295218f};
    for (uint32_t i = 0u; i < N; i++) {
        x[i] = 3.0f;
        x[STRIDE + i] = 4.0f;
    }
    weigh(pfl_position_loglik, &p, z);
    TEST_ASSERT_FLOAT_WITHIN(0.0f, 0.0f, ll[7]);
    weigh(pfl_range_loglik, &r, &rz);
    TEST_ASSERT_FLOAT_WITHIN(0.0f, 0.0f, ll[7]);
    weigh(pfl_range_bearing_loglik, &b, &bz);
    TEST_ASSERT_FLOAT_WITHIN(1.0e-6f, 0.0f, ll[7]);
}

/* No sensor gives more than a perfect match, whatever the particle. */
void test_no_sensor_gives_more_than_zero(void)
{
    pfl_range_t r = {0u, 1u, 1.0f, 1.0f};
    pfl_range_bearing_t b = {0u, 1u, 1.0f, 1.0f};
    for (uint32_t round = 0u; round < 2000u; round++) {
        const float range = (float)(ut_uniform(&dice) * 30.0);
        const pfl_range_z_t rz = {(float)ut_gaussian(&dice), 0.0f, 0.0f, range, 1.0f};
        const pfl_range_bearing_z_t bz = {0.0f, 0.0f, range, (float)(4.0 * ut_gaussian(&dice))};
        weigh(pfl_range_loglik, &r, &rz);
        for (uint32_t i = 0u; i < N; i++) {
            TEST_ASSERT_TRUE(ll[i] <= 0.0f);
        }
        weigh(pfl_range_bearing_loglik, &b, &bz);
        for (uint32_t i = 0u; i < N; i++) {
            TEST_ASSERT_TRUE(ll[i] <= 0.0f);
        }
    }
}

/* ---- Measurements that are no numbers ----------------------------------------------------------------------------- */

#define Z_WORDS 5u

/* Each of the first floats of z in turn is a NaN of either sign or an infinity: not every log-likelihood is finite then, so that the
 * update is refused. */
static void is_refused(pfl_loglik_fn loglik, void *user, const float *z, uint32_t words, const float *bad,
                       uint32_t kinds)
{
    static const pfl_view_t all = {x, STRIDE, 0u, N};
    float seen[Z_WORDS];
    for (uint32_t k = 0u; k < (words * kinds); k++) {
        uint32_t finite = 0u;
        memcpy(seen, z, sizeof(float) * Z_WORDS);
        seen[k / kinds] = bad[k % kinds];
        loglik(user, seen, &all, ll);
        for (uint32_t i = 0u; i < N; i++) {
            finite += isfinite(ll[i]) ? 1u : 0u;
        }
        TEST_ASSERT_LESS_THAN_UINT32_MESSAGE(N, finite, "a measurement that is no number was weighed");
    }
}

void test_measurements_that_are_no_numbers_are_refused(void)
{
    const float bad[4] = {NAN, -NAN, INFINITY, -INFINITY};
    static const float range_z[Z_WORDS] = {3.0f, -4.0f, 1.0f, 12.0f, 1.0f}; /* a pfl_range_z_t */
    static const float at[Z_WORDS] = {1.0f, 2.0f, 3.0f};
    pfl_position_t position = {3u, {0u, 1u, 2u, 0u}, {1.0f, 2.0f, 0.5f, 0.0f}};
    pfl_range_t gauss = {1u, 4u, 2.0f, 0.0f};
    pfl_range_t student = {1u, 4u, 2.0f, 3.0f};
    is_refused(pfl_position_loglik, &position, at, 3u, bad, 4u);
    is_refused(pfl_position_distance_loglik, &position, at, 3u, bad, 4u);
    is_refused(pfl_range_loglik, &gauss, range_z, 4u, bad, 4u);
    is_refused(pfl_range_loglik, &student, range_z, 4u, bad, 4u);
}
