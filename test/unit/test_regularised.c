/* Kernels of the regularised filter: what their noise does to a cloud, its law, and the widths by their formulas. */
#include "support.h"

#include "pflight/regularised.h"

#include "unity.h"

#include <math.h>
#include <string.h>

#define N 20000u
#define MEASUREMENTS 2000u
#define PI 3.14159265358979

static float before[3u * N];

void setUp(void)
{
}

void tearDown(void)
{
    ut_arenas_end();
}

/* A cloud of three correlated states, resampled once with a kernel: systematic resampling of equal weights leaves each
 * particle where it is, so that only the kernel moves it. */
static pfl_t *moved(void (*move)(pfl_t *f), float width, uint32_t mask)
{
    static const float offset[3] = {1.0f, -2.0f, 30.0f};
    static pfl_kernel_t kernel;
    static ut_table_t table;
    uint64_t dice = 5u;
    for (uint32_t i = 0u; i < N; i++) {
        const float a = (float)ut_gaussian(&dice);
        const float b = (float)ut_gaussian(&dice);
        const float c = (float)ut_gaussian(&dice);
        before[i] = offset[0] + (2.0f * a);
        before[N + i] = offset[1] + (0.6f * a) + (0.8f * b);
        before[(2u * N) + i] = offset[2] + (5.0f * c) - b;
    }
    kernel = (pfl_kernel_t){width, mask, move};
    table = (ut_table_t){before, N, 3u};
    static pfl_config_t config;
    config = ut_dictated_config(N, 3u);
    config.kernel = &kernel;
    config.draw = ut_table_draw;
    config.user = &table;
    pfl_t *f = ut_filter(&config);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_resample(f));
    return f;
}

static double covariance_of(const float *x, const float *y, double mean_x, double mean_y)
{
    double sum = 0.0;
    for (uint32_t i = 0u; i < N; i++) {
        sum += ((double)x[i] - mean_x) * ((double)y[i] - mean_y);
    }
    return sum / (double)N;
}

static double mean_of(const float *x)
{
    double sum = 0.0;
    for (uint32_t i = 0u; i < N; i++) {
        sum += (double)x[i];
    }
    return sum / (double)N;
}

/* The means stay, the covariance of the jumps is width^2 times the cloud's. */
static void check_moments(void (*move)(pfl_t *f), double width)
{
    static float jump[3u * N];
    pfl_t *f = moved(move, (float)width, 0u);
    pfl_view_t view;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_particles(f, &view, NULL));
    for (uint32_t k = 0u; k < 3u * N; k++) {
        jump[k] = view.x[((k / N) * view.stride) + (k % N)] - before[k];
    }
    for (uint32_t d = 0u; d < 3u; d++) {
        const float *x = &before[d * N];
        const double var_d = covariance_of(x, x, mean_of(x), mean_of(x));
        /* 5.5 standard errors: 4e-8, three times */
        TEST_ASSERT_DOUBLE_WITHIN(5.5 * width * sqrt(var_d / (double)N), 0.0, mean_of(&jump[d * N]));
        for (uint32_t e = d; e < 3u; e++) {
            const float *y = &before[e * N];
            const double var_e = covariance_of(y, y, mean_of(y), mean_of(y));
            const double expected = width * width * covariance_of(x, y, mean_of(x), mean_of(y));
            const double error = width * width * sqrt(2.0 * var_d * var_e / (double)N); /* at most, of a normal's */
            TEST_ASSERT_DOUBLE_WITHIN(5.5 * error, expected, covariance_of(&jump[d * N], &jump[e * N], 0.0, 0.0));
        }
    }
    TEST_ASSERT_TRUE(pfl_invariants_hold(f));
}

void test_jumps_have_the_covariance_of_the_cloud(void)
{
    check_moments(pfl_kernel_gaussian, 0.3);
    check_moments(pfl_kernel_epanechnikov, 0.3);
    check_moments(pfl_kernel_epanechnikov, 0.9);
}

/* Root of the cloud's covariance, lower triangle: the jumps in its units are the kernel's. */
static void whiten(const pfl_view_t *view, double width, uint32_t states, double *squares)
{
    double root[3][3] = {{0.0}};
    for (uint32_t d = 0u; d < states; d++) {
        for (uint32_t e = 0u; e <= d; e++) {
            const float *x = &before[d * N];
            const float *y = &before[e * N];
            double sum = covariance_of(x, y, mean_of(x), mean_of(y));
            for (uint32_t k = 0u; k < e; k++) {
                sum -= root[d][k] * root[e][k];
            }
            root[d][e] = (d == e) ? sqrt(sum) : (sum / root[e][e]);
        }
    }
    for (uint32_t i = 0u; i < N; i++) {
        double n[3];
        squares[i] = 0.0;
        for (uint32_t d = 0u; d < states; d++) {
            n[d] = ((double)view->x[(d * view->stride) + i] - (double)before[(d * N) + i]) / width;
            for (uint32_t e = 0u; e < d; e++) {
                n[d] -= root[d][e] * n[e];
            }
            n[d] /= root[d][d];
            squares[i] += n[d] * n[d];
        }
    }
}

/* The squared radius over d + 4 is Beta(d/2, 2): for two states 1 - (1 - u)^2, for three u^1.5 (5 - 3 u) / 2. */
static double beta(double u, uint32_t states)
{
    return (states == 2u) ? (1.0 - ((1.0 - u) * (1.0 - u))) : (0.5 * u * sqrt(u) * (5.0 - (3.0 * u)));
}

static void check_law(uint32_t states)
{
    static double squares[N];
    pfl_t *f = moved(pfl_kernel_epanechnikov, 0.5f, (1u << states) - 1u);
    const double reach = (double)(states + 4u);
    pfl_view_t view;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_particles(f, &view, NULL));
    whiten(&view, 0.5, states, squares);
    double worst = 0.0;
    for (uint32_t k = 1u; k < 200u; k++) {
        const double u = (double)k / 200.0;
        uint32_t below = 0u;
        for (uint32_t i = 0u; i < N; i++) {
            below += (squares[i] < (u * reach)) ? 1u : 0u;
        }
        const double off = fabs(((double)below / (double)N) - beta(u, states));
        worst = (off > worst) ? off : worst;
    }
    /* Kolmogorov: 2 exp(-2 2.8^2) = 3e-7 */
    TEST_ASSERT_TRUE(worst < (2.8 / sqrt((double)N)));
    for (uint32_t i = 0u; i < N; i++) {
        TEST_ASSERT_TRUE(squares[i] < (reach * 1.0001));
    }
}

void test_the_radius_has_the_law_of_epanechnikov(void)
{
    check_law(2u);
    check_law(3u);
}

void test_a_state_that_does_not_take_part_stays(void)
{
    static void (*const moves[])(pfl_t *) = {pfl_kernel_gaussian, pfl_kernel_epanechnikov};
    for (uint32_t k = 0u; k < 2u; k++) {
        pfl_t *f = moved(moves[k], 0.5f, 5u);
        pfl_view_t view;
        uint32_t still = 0u;
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_particles(f, &view, NULL));
        TEST_ASSERT_EQUAL_INT(0, memcmp(&view.x[view.stride], &before[N], sizeof(float) * N));
        for (uint32_t i = 0u; i < N; i++) {
            still += (ut_bits(view.x[i]) == ut_bits(before[i])) ? 1u : 0u;
        }
        TEST_ASSERT_TRUE(still < 10u);
    }
}

/* ---- Widths ------------------------------------------------------------------------------------------------------- */

static double no_wider(double width)
{
    return (width < 0.99) ? width : 0.99;
}

void test_widths_are_those_of_the_formulas(void)
{
    static const uint32_t counts[] = {1u, 2u, 50u, 500u, 5000u, 1048576u};
    for (uint32_t d = 1u; d <= PFL_STATES_MAX; d++) {
        const double volume = pow(PI, 0.5 * d) / tgamma((0.5 * d) + 1.0);
        for (uint32_t k = 0u; k < sizeof counts / sizeof counts[0]; k++) {
            const double n = (double)counts[k];
            const double power = 1.0 / ((double)d + 4.0);
            const double gaussian = pow(4.0 / ((d + 2.0) * n), power);
            const double a = pow((8.0 / volume) * (d + 4.0) * pow(2.0 * sqrt(PI), (double)d), power);
            const double epanechnikov = (a * pow(n, -power)) / sqrt(d + 4.0);
            TEST_ASSERT_DOUBLE_WITHIN(2e-6, no_wider(gaussian), (double)pfl_kernel_width_gaussian(counts[k], d));
            TEST_ASSERT_DOUBLE_WITHIN(2e-6, no_wider(epanechnikov),
                                      (double)pfl_kernel_width_epanechnikov(counts[k], d));
        }
    }
    for (double delta = 0.9; delta < 0.999; delta += 0.01) {
        const double a = ((3.0 * delta) - 1.0) / (2.0 * delta);
        TEST_ASSERT_DOUBLE_WITHIN(1e-5, sqrt(1.0 - (a * a)), (double)pfl_kernel_width_discount((float)delta));
    }
}

/* ---- A constant, learned ------------------------------------------------------------------------------------------- */

static void draw_constant(void *user, const pfl_batch_t *p)
{
    (void)user;
    memcpy(p->x, p->noise, sizeof(float) * p->n);
}

/* Measurements of unit variance of a constant from N(0, 1): the posterior is normal, its variance 1 / (1 + MEASUREMENTS).
 * Returns the filter's variance in that unit, and the distance of its mean in its deviations. */
static double learn(const pfl_kernel_t *kernel, uint64_t seed, double *off)
{
    pfl_config_t config = ut_linear_config(300u);
    config.kernel = kernel;
    config.states = 1u;
    config.noises = 0u;
    config.predict = ut_hold_predict;
    config.draw = draw_constant;
    config.seed = seed;
    pfl_t *f = ut_filter(&config);
    uint64_t dice = seed * 77u;
    double sum = 0.0;
    float mean;
    float cov;
    for (uint32_t k = 0u; k < MEASUREMENTS; k++) {
        const float z = (float)(0.7 + ut_gaussian(&dice));
        sum += (double)z;
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(f, 0u, 0u, &z));
    }
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(f, &mean, &cov));
    *off = ((double)mean - (sum / (double)(MEASUREMENTS + 1u))) * sqrt((double)(MEASUREMENTS + 1u));
    ut_arenas_end();
    return (double)cov * (double)(MEASUREMENTS + 1u);
}

/* Twenty seeds of 300 particles. Liu and West's kernel keeps the spread right to 2 % and the mean to 0.02 of the
 * posterior's variance; without a kernel the particles are the five or so of the first draw that lie within the posterior,
 * and the mean is off by 0.34 of it. */
void test_a_constant_needs_the_kernel(void)
{
    const pfl_kernel_t kernel = {pfl_kernel_width_discount(0.98f), 0u, pfl_kernel_move};
    double spread = 0.0;
    double with = 0.0;
    double without = 0.0;
    for (uint64_t seed = 1u; seed <= 20u; seed++) {
        double off;
        spread += learn(&kernel, seed, &off) / 20.0;
        with += (off * off) / 20.0;
        (void)learn(NULL, seed, &off);
        without += (off * off) / 20.0;
    }
    TEST_ASSERT_DOUBLE_WITHIN(0.1, 1.0, spread);
    TEST_ASSERT_TRUE(with < 0.06);
    TEST_ASSERT_TRUE(without > (5.0 * with));
}
