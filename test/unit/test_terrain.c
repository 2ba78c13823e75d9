/* The elevation grid, the radar altimeter over trees, and dead reckoning, against what their header says, in double. */
#include "support.h"

#include "pflight/terrain.h"

#include "unity.h"

#include <math.h>

#define N 40u

static const int16_t height_m[3u * 4u] = {100, 110, 130, 160, 140, 150, 160, 170, 90, 80, 85, -20};
static const pfl_grid_t grid = {height_m, 3u, 4u, 1000.0f, 500.0f, 0.01f, 0.02f}; /* rows 100 m apart, columns 50 m */

static float x[PFL_DR_STATES * N];
static float noise[5u * PFL_BATCH];

void setUp(void)
{
    uint64_t dice = 3u;

    for (uint32_t k = 0u; k < PFL_DR_STATES * N; k++) {
        x[k] = (float)ut_gaussian(&dice);
    }
    for (uint32_t k = 0u; k < 5u * PFL_BATCH; k++) {
        noise[k] = (float)ut_gaussian(&dice);
    }
}

void tearDown(void)
{
}

void test_the_grid_has_its_points_and_is_bilinear_between_them(void)
{
    for (uint32_t r = 0u; r < 3u; r++) {
        for (uint32_t c = 0u; c < 4u; c++) {
            TEST_ASSERT_FLOAT_WITHIN(1e-3f, (float)height_m[r * 4u + c],
                                     pfl_grid_height(&grid, 1000.0f + 100.0f * (float)r, 500.0f + 50.0f * (float)c));
        }
    }
    /* a quarter north, three quarters east in the cell of rows 0, 1 and columns 1, 2 */
    const double south = 110.0 + 0.75 * 20.0;
    const double north = 150.0 + 0.75 * 10.0;
    TEST_ASSERT_FLOAT_WITHIN(1e-3f, (float)(south + 0.25 * (north - south)), pfl_grid_height(&grid, 1025.0f, 587.5f));
}

void test_beyond_its_edges_the_grid_holds_their_height(void)
{
    TEST_ASSERT_EQUAL_FLOAT(100.0f, pfl_grid_height(&grid, -1e30f, -1e30f));
    TEST_ASSERT_EQUAL_FLOAT(-20.0f, pfl_grid_height(&grid, 1e30f, 1e30f));
    TEST_ASSERT_EQUAL_FLOAT(90.0f, pfl_grid_height(&grid, ut_infinity(), -ut_infinity()));
    TEST_ASSERT_TRUE(ut_finite(pfl_grid_height(&grid, ut_nan(false), 600.0f)));
}

static double expected_loglik(const pfl_terrain_t *s, const pfl_terrain_z_t *z, double ground_m, double bias_m)
{
    const double e = (double)z->altitude_m - bias_m - ground_m - (double)z->agl_m;
    const double good = (1.0 - (double)s->tree_share - (double)s->gross_share) / (double)z->sigma_m;
    const double tree = (double)s->tree_share / (double)s->tree_sigma_m;
    const double gross = sqrt(2.0 * 3.14159265358979) * (double)s->gross_share / (double)s->gross_span_m;
    const double y = e / (double)z->sigma_m;
    const double t = (e - (double)s->tree_mean_m) / (double)s->tree_sigma_m;
    const double sum = good * exp(-0.5 * y * y) + tree * exp(-0.5 * t * t) + gross;
    return (double)z->power * log(sum / (good + tree + gross));
}

void test_the_altimeter_weighs_by_its_mixture(void)
{
    pfl_terrain_t s = {&grid, PFL_DR_NORTH, PFL_DR_EAST, PFL_DR_BARO, 0u, 0.12f, 0.01f, 15.0f, 6.0f, 1000.0f};
    const pfl_terrain_z_t z = {900.0f, 770.0f, 3.5f, 0.6f};
    const pfl_view_t view = {x, N, 0u, N};
    float ll[N];
    for (uint32_t i = 0u; i < N; i++) {
        x[PFL_DR_NORTH * N + i] = 1000.0f + 5.0f * (float)i;
        x[PFL_DR_EAST * N + i] = 500.0f + 3.5f * (float)i;
        x[PFL_DR_BARO * N + i] *= 15.0f;
    }
    for (uint32_t with = 0u; with < 2u; with++) {
        s.bias_state = with != 0u ? (uint16_t)PFL_DR_BARO : (uint16_t)PFL_TERRAIN_NO_BIAS;
        pfl_terrain_loglik(&s, &z, &view, ll);
        for (uint32_t i = 0u; i < N; i++) {
            const double ground = (double)pfl_grid_height(&grid, x[PFL_DR_NORTH * N + i], x[PFL_DR_EAST * N + i]);
            const double bias = with != 0u ? (double)x[PFL_DR_BARO * N + i] : 0.0;
            TEST_ASSERT_DOUBLE_WITHIN(1e-3, expected_loglik(&s, &z, ground, bias), (double)ll[i]);
            TEST_ASSERT_TRUE(ll[i] <= 0.0f);
        }
    }
}

void test_a_short_echo_costs_less_than_a_long_one(void)
{
    pfl_terrain_t s = {&grid, 0u, 1u, PFL_TERRAIN_NO_BIAS, 0u, 0.12f, 0.01f, 15.0f, 6.0f, 1000.0f};
    const pfl_view_t view = {x, N, 0u, 1u};
    pfl_terrain_z_t z = {900.0f, 785.0f, 3.0f, 1.0f}; /* 800 m to the ground */
    float short_ll;
    float long_ll;
    x[0] = 1000.0f;
    x[N] = 500.0f;
    pfl_terrain_loglik(&s, &z, &view, &short_ll);
    z.agl_m = 815.0f;
    pfl_terrain_loglik(&s, &z, &view, &long_ll);
    TEST_ASSERT_TRUE(short_ll > long_ll + 1.5f);
    z.agl_m = 100.0f; /* a gross error costs no more than its share says */
    pfl_terrain_loglik(&s, &z, &view, &long_ll);
    TEST_ASSERT_DOUBLE_WITHIN(1e-3, expected_loglik(&s, &z, 100.0, 0.0), (double)long_ll);
}

void test_the_power_is_whole_for_a_narrow_cloud_and_keeps_its_floor(void)
{
    TEST_ASSERT_FLOAT_WITHIN(1e-6f, 1.0f, pfl_terrain_power(0.0f, 30.0f, 0.02f));
    TEST_ASSERT_FLOAT_WITHIN(1e-6f, 0.5f, pfl_terrain_power(30.0f, 30.0f, 0.02f));
    TEST_ASSERT_FLOAT_WITHIN(1e-6f, 0.02f, pfl_terrain_power(1e6f, 30.0f, 0.02f));
}

void test_dead_reckoning_moves_as_its_header_says(void)
{
    pfl_dead_reckoning_t m = {0.1f, 0.99f, 0.07f, 0.2f};
    const pfl_dead_reckoning_input_t u = {30.0f, -12.0f};
    for (uint32_t i = 0u; i < N; i++) {
        const float was[PFL_DR_STATES] = {x[i], x[N + i], x[2u * N + i], x[3u * N + i], x[4u * N + i]};
        const float w[5] = {noise[i], noise[PFL_BATCH + i], noise[2u * PFL_BATCH + i], noise[3u * PFL_BATCH + i],
                            noise[4u * PFL_BATCH + i]};
        const pfl_batch_t one = {&x[i], N, &noise[i], i, 1u};
        pfl_dead_reckoning_predict(&m, &u, 0.5f, &one);
        TEST_ASSERT_FLOAT_WITHIN(1e-5f, was[0] + 0.5f * (30.0f - was[3] + 0.1f * w[0]), x[i]);
        TEST_ASSERT_FLOAT_WITHIN(1e-5f, was[1] + 0.5f * (-12.0f - was[4] + 0.1f * w[1]), x[N + i]);
        TEST_ASSERT_FLOAT_WITHIN(1e-5f, was[2] + 0.2f * w[4], x[2u * N + i]);
        TEST_ASSERT_FLOAT_WITHIN(1e-5f, 0.99f * was[3] + 0.07f * w[2], x[3u * N + i]);
        TEST_ASSERT_FLOAT_WITHIN(1e-5f, 0.99f * was[4] + 0.07f * w[3], x[4u * N + i]);
        const float baro = x[2u * N + i];
        const float biases[2] = {x[3u * N + i], x[4u * N + i]};
        const float north = x[i];
        pfl_dead_reckoning_rest_predict(&m, &u, 0.5f, &one);
        TEST_ASSERT_FLOAT_WITHIN(1e-5f, north + 15.0f, x[i]);
        TEST_ASSERT_FLOAT_WITHIN(1e-5f, baro + 0.2f * w[2], x[2u * N + i]);
        TEST_ASSERT_EQUAL_FLOAT(biases[0], x[3u * N + i]);
        TEST_ASSERT_EQUAL_FLOAT(biases[1], x[4u * N + i]);
    }
}

/* Without gross errors their span means nothing. */
void test_without_gross_errors_an_echo_may_cost_anything(void)
{
    pfl_terrain_t s = {&grid, 0u, 1u, PFL_TERRAIN_NO_BIAS, 0u, 0.12f, 0.0f, 15.0f, 6.0f, 0.0f};
    const pfl_view_t view = {x, N, 0u, 1u};
    x[0] = 1000.0f; /* 100 m high, so 800 m to the ground */
    x[N] = 500.0f;
    for (float agl_m = 760.0f; agl_m < 830.0f; agl_m += 5.0f) {
        const pfl_terrain_z_t z = {900.0f, agl_m, 3.0f, 1.0f};
        float ll;
        pfl_terrain_loglik(&s, &z, &view, &ll);
        s.gross_span_m = 1.0f; /* the test's own division */
        const double expected = expected_loglik(&s, &z, 100.0, 0.0);
        s.gross_span_m = 0.0f;
        TEST_ASSERT_DOUBLE_WITHIN(1e-4 - (1e-5 * expected), expected, (double)ll);
    }
}
