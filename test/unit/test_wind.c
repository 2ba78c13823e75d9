/* The wind filter: with scale and offset known it is a Kalman filter, written anew in double; its model moves as the
 * header says, and gross velocities are widened. */
#include "support.h"

#include "pflight/pflight.h"

#include "unity.h"

#include <math.h>
#include <string.h>

#define N 24u
#define PI 3.14159265358979323846

typedef struct {
    double x[3]; /* position, wind, gust on one axis */
    double p[3][3];
} axis_t;

static pfl_wind_t wind;

void setUp(void)
{
    wind = (pfl_wind_t){.wind_walk = 0.05f,
                        .gust_sigma_mps = 0.8f,
                        .gust_time_s = 9.0f,
                        .offset_time_s = 30.0f,
                        .sigma_position_m = 2.0f,
                        .sigma_velocity_mps = 1.5f,
                        .start_x_m = 10.0f,
                        .start_y_m = -20.0f,
                        .start_wind_mps = 5.0f};
    pfl_wind_start(&wind);
}

void tearDown(void)
{
    ut_arenas_end();
}

static void kalman_start(axis_t *a, double position)
{
    memset(a, 0, sizeof *a);
    a->x[0] = position;
    a->p[0][0] = 4.0;
    a->p[1][1] = 25.0;
    a->p[2][2] = 0.64;
}

static void kalman_move(axis_t *a, double dt, double way)
{
    const double keep = exp(-dt / 9.0);
    const double f[3][3] = {{1.0, dt, dt}, {0.0, 1.0, 0.0}, {0.0, 0.0, keep}};
    double fp[3][3] = {{0.0}};
    double moved[3][3] = {{0.0}};
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            for (int k = 0; k < 3; k++) {
                fp[i][j] += f[i][k] * a->p[k][j];
            }
        }
    }
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            for (int k = 0; k < 3; k++) {
                moved[i][j] += fp[i][k] * f[j][k];
            }
        }
    }
    memcpy(a->p, moved, sizeof moved);
    a->p[1][1] += 0.05 * 0.05 * dt;
    a->p[2][2] += (1.0 - keep * keep) * 0.64;
    a->x[0] += dt * (a->x[1] + a->x[2]) + way;
    a->x[2] *= keep;
}

/* A scalar measurement of h'x, one after the other: the same as both at once, their noises being independent. */
static void kalman_fuse(axis_t *a, const double *h, double z, double variance)
{
    double ph[3] = {0.0};
    double s = variance;
    double off = z;
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            ph[i] += a->p[i][j] * h[j];
        }
        s += h[i] * ph[i];
        off -= h[i] * a->x[i];
    }
    for (int i = 0; i < 3; i++) {
        a->x[i] += ph[i] / s * off;
        for (int j = 0; j < 3; j++) {
            a->p[i][j] -= ph[i] * ph[j] / s;
        }
    }
}

static void kalman_fix(axis_t *a, double position, double velocity_less_air)
{
    const double at[3] = {1.0, 0.0, 0.0};
    const double over[3] = {0.0, 1.0, 1.0};
    kalman_fuse(a, at, position, 4.0);
    kalman_fuse(a, over, velocity_less_air, 2.25);
}

static void is_kalman(const axis_t *x, const axis_t *y, const float *mean)
{
    for (uint32_t k = 0u; k < 3u; k++) {
        TEST_ASSERT_DOUBLE_WITHIN(1e-3, x->x[k], (double)mean[PFL_WIND_X + k]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-3, y->x[k], (double)mean[PFL_WIND_Y + k]);
    }
    uint32_t at = 0u;
    for (uint32_t r = 0u; r < 3u; r++) {
        for (uint32_t c = r; c < 3u; c++) {
            TEST_ASSERT_DOUBLE_WITHIN(1e-4, x->p[r][c], (double)wind.cov[at]);
            at++;
        }
    }
}

void test_known_air_data_make_a_kalman_filter(void)
{
    const pfl_sensor_t sensor = {.loglik = pfl_wind_loglik, .user = &wind};
    const pfl_config_t config = {.abi = PFL_ABI,
                                 .particles = N,
                                 .states = PFL_WIND_STATES,
                                 .noises = 2u,
                                 .sensor_count = 1u,
                                 .ess_ratio = 0.5f,
                                 .seed = 3u,
                                 .sensors = &sensor,
                                 .predict = pfl_wind_predict,
                                 .draw = pfl_wind_draw,
                                 .user = &wind};
    size_t bytes;
    void *arena = ut_arena_for(&config, &bytes);
    uint64_t dice = 5u;
    axis_t x;
    axis_t y;
    pfl_t *f;
    pfl_wind_fix_t fix[2];
    float mean[PFL_WIND_STATES];
    TEST_ASSERT_EQUAL(PFL_OK, pfl_init(arena, bytes, &config, 0u, &f));
    kalman_start(&x, 10.0);
    kalman_start(&y, -20.0);
    for (uint32_t k = 1u; k <= 200u; k++) {
        const float yaw = 0.03f * (float)k;
        const pfl_wind_input_t input = {k > 1u ? &fix[(k - 1u) % 2u] : NULL, 15.0f, yaw};
        pfl_wind_fix_t *now = &fix[k % 2u];
        *now = (pfl_wind_fix_t){(float)(x.x[0] + 3.0 * ut_gaussian(&dice)),
                                (float)(y.x[0] + 3.0 * ut_gaussian(&dice)),
                                (float)(20.0 * ut_gaussian(&dice)),
                                (float)(20.0 * ut_gaussian(&dice)),
                                15.0f,
                                yaw,
                                1.0f};
        kalman_move(&x, 0.2, 0.2 * 15.0 * cos((double)yaw));
        kalman_move(&y, 0.2, 0.2 * 15.0 * sin((double)yaw));
        pfl_wind_move(&wind, 0.2f);
        TEST_ASSERT_EQUAL(PFL_OK, pfl_predict(f, (uint64_t)k * 200000u, &input));
        TEST_ASSERT_EQUAL(PFL_OK, pfl_estimate(f, mean, NULL));
        is_kalman(&x, &y, mean);
        pfl_wind_weigh(&wind, mean, now);
        TEST_ASSERT_EQUAL(PFL_OK, pfl_update(f, 0u, (uint64_t)k * 200000u, now));
        TEST_ASSERT_EQUAL(PFL_OK, pfl_estimate(f, mean, NULL));
        pfl_wind_fuse(&wind, mean, now);
        kalman_fix(&x, (double)now->x_m, (double)now->vx_mps - 15.0 * cos((double)yaw));
        kalman_fix(&y, (double)now->y_m, (double)now->vy_mps - 15.0 * sin((double)yaw));
        is_kalman(&x, &y, mean);
    }
}

/* -1/2 of the squared innovations of both axes by the inverse of their covariance, particle by particle. */
void test_the_log_likelihood_is_that_of_both_axes(void)
{
    float x[PFL_WIND_STATES * N];
    float ll[N];
    uint64_t dice = 17u;
    const pfl_view_t view = {x, N, 0u, N};
    const pfl_wind_fix_t fix = {12.0f, -7.0f, 9.0f, 4.0f, 11.0f, 0.6f, 1.0f};
    const double inverse[3] = {0.25, -0.0625, 0.125};
    for (uint32_t k = 0u; k < 3u; k++) {
        wind.inverse[k] = (float)inverse[k];
    }
    for (uint32_t k = 0u; k < PFL_WIND_STATES * N; k++) {
        x[k] = (float)(3.0 * ut_gaussian(&dice));
    }
    pfl_wind_loglik(&wind, &fix, &view, ll);
    for (uint32_t i = 0u; i < N; i++) {
        const double air = 11.0 * (double)x[PFL_WIND_SCALE * N + i];
        const double yaw = (double)fix.yaw_rad + (double)x[PFL_WIND_OFFSET * N + i];
        const double position[2] = {12.0 - (double)x[PFL_WIND_X * N + i], -7.0 - (double)x[PFL_WIND_Y * N + i]};
        const double velocity[2] = {
            9.0 - air * cos(yaw) - (double)x[PFL_WIND_X_WIND * N + i] - (double)x[PFL_WIND_X_GUST * N + i],
            4.0 - air * sin(yaw) - (double)x[PFL_WIND_Y_WIND * N + i] - (double)x[PFL_WIND_Y_GUST * N + i]};
        double expected = 0.0;
        for (int axis = 0; axis < 2; axis++) {
            const double p = position[axis];
            const double v = velocity[axis];
            expected -= 0.5 * (inverse[0] * p * p + 2.0 * inverse[1] * p * v + inverse[2] * v * v);
        }
        TEST_ASSERT_DOUBLE_WITHIN(1e-5 * (1.0 - expected), expected, (double)ll[i]);
    }
}

void test_scale_and_offset_turn_the_way(void)
{
    float x[PFL_WIND_STATES * N];
    float noise[2u * PFL_BATCH];
    const pfl_batch_t batch = {x, N, noise, 0u, N};
    const pfl_wind_input_t input = {NULL, 12.0f, 0.7f};
    memset(x, 0, sizeof x);
    memset(noise, 0, sizeof noise);
    for (uint32_t i = 0u; i < N; i++) {
        x[PFL_WIND_SCALE * N + i] = 1.0f + 0.01f * (float)i;
        x[PFL_WIND_OFFSET * N + i] = 0.02f * (float)i;
        noise[PFL_BATCH + i] = 1.0f;
    }
    wind.offset_sigma_rad = 0.1f;
    pfl_wind_predict(&wind, &input, 0.5f, &batch);
    for (uint32_t i = 0u; i < N; i++) {
        const double keep = exp(-0.5 / 30.0);
        const double offset = keep * 0.02 * i + 0.1 * sqrt(1.0 - keep * keep);
        const double way = 0.5 * 12.0 * (1.0 + 0.01 * i);
        TEST_ASSERT_DOUBLE_WITHIN(1e-5, offset, (double)x[PFL_WIND_OFFSET * N + i]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-4, way * cos(0.7 + offset), (double)x[PFL_WIND_X * N + i]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-4, way * sin(0.7 + offset), (double)x[PFL_WIND_Y * N + i]);
    }
}

void test_the_draw_spreads_scale_and_offset_only(void)
{
    float x[PFL_WIND_STATES * N];
    float noise[PFL_WIND_STATES * PFL_BATCH];
    const pfl_batch_t batch = {x, N, noise, 0u, N};
    for (uint32_t k = 0u; k < PFL_WIND_STATES * PFL_BATCH; k++) {
        noise[k] = 2.0f;
    }
    wind.start_scale = 0.1f;
    wind.offset_sigma_rad = 0.3f;
    pfl_wind_draw(&wind, &batch);
    const float expected[PFL_WIND_STATES] = {10.0f, 0.0f, 0.0f, -20.0f, 0.0f, 0.0f, 1.2f, 0.6f};
    for (uint32_t d = 0u; d < PFL_WIND_STATES; d++) {
        TEST_ASSERT_EACH_EQUAL_FLOAT(expected[d], &x[d * N], N);
    }
}

void test_a_gross_velocity_hardly_pulls(void)
{
    const float mean[PFL_WIND_STATES] = {0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 1.0f, 0.0f};
    const pfl_wind_fix_t usual = {0.0f, 0.0f, 15.0f, 0.0f, 15.0f, 0.0f, 1.0f};
    pfl_wind_fix_t gross = usual;
    gross.vx_mps = 75.0f;
    pfl_wind_weigh(&wind, mean, &usual);
    const float gain = wind.gain_velocity[1];
    pfl_wind_weigh(&wind, mean, &gross);
    TEST_ASSERT_EQUAL_FLOAT(gain, wind.gain_velocity[1]); /* Gaussian: all the same */
    wind.dof = 4.0f;
    pfl_wind_weigh(&wind, mean, &usual);
    TEST_ASSERT_EQUAL_FLOAT(gain, wind.gain_velocity[1]);
    pfl_wind_weigh(&wind, mean, &gross);
    TEST_ASSERT_TRUE(wind.gain_velocity[1] < 0.6f * gain);
    gross.vx_mps = 15.0f + 8.0f; /* a little too much widens a little: (4 + 64 / 27.89) / 6 times */
    pfl_wind_weigh(&wind, mean, &gross);
    TEST_ASSERT_FLOAT_WITHIN(1e-5f, 25.0f / (25.64f + (2.25f * ((4.0f + (64.0f / 27.89f)) / 6.0f))),
                             wind.gain_velocity[1]);
}
