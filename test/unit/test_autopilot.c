/* The UAV under its autopilot against its equations, written anew in double: wind, gusts, limits, waypoints. */
#include "support.h"

#include "pflight/models.h"
#include "pflight/sensors.h"

#include "unity.h"

#include <math.h>
#include <string.h>

#define N 61u
#define STRIDE 72u
#define D 9u
#define WIND 6u
#define WAYPOINT 8u
#define PI 3.14159265358979323846

static const pfl_autopilot_t vehicle = {
    .alpha_speed = 0.5f,
    .alpha_heading = 1.0f,
    .alpha_height = 0.36f,
    .alpha_climb = 1.2f,
    .speed_min_mps = 15.0f,
    .speed_max_mps = 25.0f,
    .turn_max_radps = 0.4f,
    .substeps = 10u,
};
static const pfl_waypoint_t square[] = {{400.0f, 0.0f}, {400.0f, 400.0f}, {0.0f, 400.0f}, {0.0f, 0.0f}};
static const pfl_route_t route = {.waypoint = square, .count = 4u, .closed = true, .reach_m = 40.0f};

static float x[D * STRIDE];
static float noise[4u * PFL_BATCH];
static double expected[D];
static uint64_t dice;

void setUp(void)
{
    static const double mean[D] = {0.0, 0.0, 100.0, 20.0, 1.0, 0.0, 0.0, 0.0, 0.0};
    static const double spread[D] = {200.0, 200.0, 5.0, 4.0, 2.0, 1.0, 2.0, 2.0, 0.0};
    dice = 99u;
    for (uint32_t k = 0u; k < (D * STRIDE); k++) {
        x[k] = (float)(mean[k / STRIDE] + (spread[k / STRIDE] * ut_gaussian(&dice)));
    }
    for (uint32_t k = 0u; k < (4u * PFL_BATCH); k++) {
        noise[k] = (float)ut_gaussian(&dice);
    }
    for (uint32_t i = 0u; i < N; i++) {
        x[(WAYPOINT * STRIDE) + i] = (float)(i % 4u);
    }
}

void tearDown(void)
{
}

/* Runs the model on the N particles, and checks that it touched no other. */
static void move(pfl_autopilot_t *m, const pfl_autopilot_input_t *u, float dt_s)
{
    float kept[D * STRIDE];
    const pfl_batch_t batch = {x, STRIDE, noise, 0u, N};
    memcpy(kept, x, sizeof x);
    pfl_autopilot_predict(m, u, dt_s, &batch);
    for (uint32_t d = 0u; d < D; d++) {
        TEST_ASSERT_EQUAL_MEMORY(&kept[(d * STRIDE) + N], &x[(d * STRIDE) + N], sizeof(float) * (STRIDE - N));
    }
}

static double clip(double a, double lo, double hi)
{
    return fmin(fmax(a, lo), hi);
}

static double wanted_error(const pfl_autopilot_input_t *u, double t_s)
{
    if (u->route == NULL) {
        return (double)u->heading_rad + ((double)u->turn_radps * t_s) - expected[4];
    }
    unsigned target = (unsigned)expected[WAYPOINT];
    if (hypot((double)square[target].x_m - expected[0], (double)square[target].y_m - expected[1]) < 40.0) {
        target = (target + 1u) % 4u;
    }
    expected[WAYPOINT] = (double)target;
    return remainder(atan2((double)square[target].y_m - expected[1], (double)square[target].x_m - expected[0]) -
                         expected[4],
                     2.0 * PI);
}

/* One step of the equations for `expected`, in the wind w. */
static void reference(const pfl_autopilot_t *m, const pfl_autopilot_input_t *u, double dt_s, const double *w)
{
    const double step = dt_s / (double)m->substeps;
    for (unsigned k = 0u; k < m->substeps; k++) {
        const double error = wanted_error(u, step * k);
        const double v = expected[3];
        const double psi = expected[4];
        const double h = expected[2];
        const double up = expected[5];
        expected[0] += step * ((v * cos(psi)) + w[0]);
        expected[1] += step * ((v * sin(psi)) + w[1]);
        expected[2] += step * up;
        expected[3] = clip(v + (step * (double)m->alpha_speed * ((double)u->speed_mps - v)), 15.0, 25.0);
        expected[4] += step * clip((double)m->alpha_heading * error, -0.4, 0.4);
        expected[5] += step * (((double)m->alpha_height * ((double)u->height_m - h)) - ((double)m->alpha_climb * up));
    }
}

/* Moves all particles by 1 s, and each by the reference. */
static void model_matches(pfl_autopilot_t *m, const pfl_autopilot_input_t *u)
{
    float before[D * STRIDE];
    memcpy(before, x, sizeof x);
    move(m, u, 1.0f);
    for (uint32_t i = 0u; i < N; i++) {
        double w[2];
        for (uint32_t d = 0u; d < D; d++) {
            expected[d] = (double)before[(d * STRIDE) + i];
        }
        for (uint32_t a = 0u; a < 2u; a++) {
            const double gust = (double)m->sigma_gust_mps * (double)noise[(a * PFL_BATCH) + i];
            const double walk = (double)m->wind_walk * (double)noise[((2u + a) * PFL_BATCH) + i];
            w[a] = (double)((a == 0u) ? m->wind_x_mps : m->wind_y_mps) + gust;
            w[a] += (m->wind_state != 0u) ? expected[WIND + a] : 0.0;
            expected[WIND + a] += (m->wind_state != 0u) ? walk : 0.0;
        }
        reference(m, u, 1.0, w);
        for (uint32_t d = 0u; d < D; d++) {
            TEST_ASSERT_DOUBLE_WITHIN(3.0e-4, expected[d], (double)x[(d * STRIDE) + i]);
        }
    }
}

/* ---- The scenario page's check of the vehicle --------------------------------------------------------------------- */

void test_vehicle_check_of_the_scenario_page(void)
{
    static const float start[6] = {0.0f, 0.0f, 90.0f, 15.0f, 0.0f, 0.0f};
    static const double end[6] = {11.998935, 152.000258, 99.848289, 19.970397, 1.999281, 0.078697};
    const pfl_autopilot_input_t u = {.speed_mps = 20.0f, .height_m = 100.0f, .heading_rad = 2.0f};
    pfl_autopilot_t m = vehicle;
    m.wind_x_mps = 1.0f;
    m.wind_y_mps = -0.5f;
    for (uint32_t d = 0u; d < 6u; d++) {
        for (uint32_t i = 0u; i < N; i++) {
            x[(d * STRIDE) + i] = start[d];
        }
    }
    for (int k = 0; k < 10; k++) {
        move(&m, &u, 1.0f);
    }
    for (uint32_t d = 0u; d < 6u; d++) {
        TEST_ASSERT_DOUBLE_WITHIN(5.0e-5, end[d], (double)x[d * STRIDE]);
        TEST_ASSERT_EQUAL_HEX32(ut_bits(x[d * STRIDE]), ut_bits(x[(d * STRIDE) + N - 1u]));
    }
}

/* ---- Equations ---------------------------------------------------------------------------------------------------- */

void test_known_wind_and_gusts_held_over_the_step(void)
{
    const pfl_autopilot_input_t u = {.speed_mps = 20.0f, .height_m = 100.0f, .heading_rad = 0.7f, .turn_radps = 0.1f};
    pfl_autopilot_t m = vehicle;
    m.wind_x_mps = -2.0f;
    m.wind_y_mps = 3.0f;
    m.sigma_gust_mps = 0.5f;
    model_matches(&m, &u);
}

void test_wind_in_the_states_walks_and_adds_to_the_known(void)
{
    const pfl_autopilot_input_t u = {.speed_mps = 18.0f, .height_m = 90.0f, .heading_rad = -0.3f};
    pfl_autopilot_t m = vehicle;
    m.wind_x_mps = 1.0f;
    m.sigma_gust_mps = 0.25f;
    m.wind_state = WIND;
    m.wind_walk = 0.2f;
    model_matches(&m, &u);
}

void test_every_particle_flies_to_its_own_waypoint(void)
{
    const pfl_autopilot_input_t u = {.speed_mps = 20.0f, .height_m = 100.0f, .route = &route};
    pfl_autopilot_t m = vehicle;
    m.wind_state = WIND;
    m.waypoint_state = WAYPOINT;
    for (int k = 0; k < 60; k++) { /* long enough for a corner or two */
        model_matches(&m, &u);
    }
}

void test_without_a_waypoint_state_a_route_is_not_flown(void)
{
    const pfl_autopilot_input_t u = {.speed_mps = 20.0f, .height_m = 100.0f, .heading_rad = 0.5f, .route = &route};
    const pfl_autopilot_input_t plain = {.speed_mps = 20.0f, .height_m = 100.0f, .heading_rad = 0.5f};
    pfl_autopilot_t m = vehicle;
    float kept[D * STRIDE];
    memcpy(kept, x, sizeof x);
    move(&m, &u, 1.0f);
    float with[D * STRIDE];
    memcpy(with, x, sizeof x);
    memcpy(x, kept, sizeof x);
    move(&m, &plain, 1.0f);
    TEST_ASSERT_EQUAL_MEMORY(with, x, sizeof x);
}

void test_a_waypoint_state_out_of_range_is_brought_back(void)
{
    const pfl_autopilot_input_t u = {.speed_mps = 20.0f, .height_m = 100.0f, .route = &route};
    const float odd[] = {-3.0f, 1.0e20f, 4.0f, 2.9f, 0.4f, -ut_infinity(), ut_infinity(), ut_nan(false)};
    const float meant[] = {0.0f, 3.0f, 3.0f, 3.0f, 0.0f, 0.0f, 3.0f, 0.0f};
    pfl_autopilot_t m = vehicle;
    m.waypoint_state = WAYPOINT;
    for (uint32_t i = 0u; i < (sizeof odd / sizeof odd[0]); i++) {
        x[(WAYPOINT * STRIDE) + i] = odd[i];
        x[i] = 200.0f; /* far from every waypoint */
        x[STRIDE + i] = 200.0f;
    }
    move(&m, &u, 0.1f);
    for (uint32_t i = 0u; i < (sizeof odd / sizeof odd[0]); i++) {
        TEST_ASSERT_FLOAT_WITHIN(0.0f, meant[i], x[(WAYPOINT * STRIDE) + i]);
    }
}

void test_zero_substeps_are_one(void)
{
    const pfl_autopilot_input_t u = {.speed_mps = 20.0f, .height_m = 100.0f};
    float kept[D * STRIDE];
    float one[D * STRIDE];
    pfl_autopilot_t m = vehicle;
    memcpy(kept, x, sizeof x);
    m.substeps = 1u;
    move(&m, &u, 0.1f);
    memcpy(one, x, sizeof x);
    memcpy(x, kept, sizeof x);
    m.substeps = 0u;
    move(&m, &u, 0.1f);
    TEST_ASSERT_EQUAL_MEMORY(one, x, sizeof x);
}

/* ---- Weights by the inverse squared distance ---------------------------------------------------------------------- */

void test_distance_weight_is_the_inverse_square(void)
{
    pfl_position_t s = {3u, {0u, 1u, 2u, 0u}, {0.5f, 0.5f, 0.5f, 0.0f}};
    const float z[3] = {10.0f, -20.0f, 99.0f};
    const pfl_view_t view = {x, STRIDE, 0u, N};
    float ll[N + 1u];
    ll[N] = 7.0f;
    pfl_position_distance_loglik(&s, z, &view, ll);
    for (uint32_t i = 0u; i < N; i++) {
        double squares = 0.0;
        for (uint32_t d = 0u; d < 3u; d++) {
            squares += pow((double)x[(d * STRIDE) + i] - (double)z[d], 2.0);
        }
        TEST_ASSERT_DOUBLE_WITHIN(2.0e-6, log(4.0 / (squares + 4.0)), (double)ll[i]);
    }
    TEST_ASSERT_FLOAT_WITHIN(0.0f, 7.0f, ll[N]);
    for (uint32_t d = 0u; d < 3u; d++) {
        x[d * STRIDE] = z[d];
    }
    pfl_position_distance_loglik(&s, z, &view, ll);
    TEST_ASSERT_FLOAT_WITHIN(0.0f, 0.0f, ll[0]); /* a perfect match */
}
