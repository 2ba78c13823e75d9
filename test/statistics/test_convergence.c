/* The filter converges to the truth: on linear-Gaussian models its posterior mean and variance approach the exact Kalman
 * posterior as 1 / sqrt(N), with every resampling scheme.
 *
 * The error at a number of particles is the root mean square over RUNS seeds and all steps, relative to the posterior's
 * own spread. The slope of its logarithm over that of N, from four sizes, is a weighted sum of four logarithms, each
 * with a standard error below 1 / sqrt(2 RUNS): the slope's is below 1 / sqrt(2 RUNS) / 3.1 = 0.0161. [-0.6, -0.4] is
 * thus over six standard errors wide on either side and leaves one for the smallest size not being asymptotic: odds of
 * a false alarm below 1e-6 each. Seeds are fixed. */
#include "pflight/filter.h"
#include "pflight/rng.h"
#include "unity.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define SIZES 4u
#define N_MAX 6400u
#define RUNS 200u
#define STEPS 8u
#define STEP_US 500000u
#define DT 0.5
#define SENSOR_SIGMA 0.8

enum { SYSTEMATIC, STRATIFIED, RESIDUAL, MULTINOMIAL, SCHEMES };

static const pfl_scheme_fn schemes[SCHEMES] = {pfl_systematic, pfl_stratified, pfl_residual, pfl_multinomial};

static union {
    uint64_t align;
    unsigned char bytes[PFL_ARENA_BYTES(N_MAX, 2, 2)];
} arena;

/* x' = A x + B w, z = x_0 + SENSOR_SIGMA v; prior N(0, I). */
typedef struct {
    uint16_t states;
    double a[2][2];
    double b[2][2];
} model_t;

static const model_t scalar = {1u, {{0.9, 0.0}, {0.0, 0.0}}, {{0.6, 0.0}, {0.0, 0.0}}};
static const model_t moving = {2u, {{1.0, DT}, {0.0, 0.95}}, {{0.3, 0.0}, {0.1, 0.4}}};

/* Posterior of each step: mean, and covariance row by row. */
typedef struct {
    double mean[STEPS][2];
    double cov[STEPS][2][2];
} posterior_t;

static const model_t *model; /* that the callbacks fly */
static float measured[STEPS];

void setUp(void)
{
}

void tearDown(void)
{
}

static void move(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    (void)user;
    (void)u;
    (void)dt_s;
    for (uint32_t i = 0u; i < p->n; i++) {
        float before[2] = {0.0f, 0.0f};
        for (uint32_t d = 0u; d < model->states; d++) {
            before[d] = PFL_STATE(p, d)[i];
        }
        for (uint32_t d = 0u; d < model->states; d++) {
            float x = 0.0f;
            for (uint32_t e = 0u; e < model->states; e++) {
                x += ((float)model->a[d][e] * before[e]) + ((float)model->b[d][e] * PFL_NOISE(p, e)[i]);
            }
            PFL_STATE(p, d)[i] = x;
        }
    }
}

static void see(void *user, const void *z, const pfl_view_t *p, float *ll)
{
    (void)user;
    for (uint32_t i = 0u; i < p->n; i++) {
        const float e = (p->x[i] - *(const float *)z) / (float)SENSOR_SIGMA;
        ll[i] = -0.5f * e * e;
    }
}

static void draw(void *user, const pfl_batch_t *p)
{
    (void)user;
    for (uint32_t d = 0u; d < model->states; d++) {
        memcpy(PFL_STATE(p, d), PFL_NOISE(p, d), sizeof(float) * p->n);
    }
}

/* A truth of its own noise, seen STEPS times. */
static void measure(void)
{
    float noise[16];
    double x[2] = {0.5, -0.5};
    pfl_rng_t rng;
    pfl_rng_seed(&rng, 20260303u);
    for (uint32_t k = 0u; k < STEPS; k++) {
        const double before[2] = {x[0], x[1]};
        pfl_rng_normals(&rng, noise, 1u);
        for (uint32_t d = 0u; d < 2u; d++) {
            x[d] = (model->a[d][0] * before[0]) + (model->a[d][1] * before[1]) + (model->b[d][0] * (double)noise[0]) +
                   (model->b[d][1] * (double)noise[1]);
        }
        measured[k] = (float)(x[0] + (SENSOR_SIGMA * (double)noise[2]));
    }
}

/* P <- A P A' + B B' */
static void propagate_covariance(double p[2][2])
{
    double ap[2][2];
    double next[2][2];
    for (uint32_t r = 0u; r < 2u; r++) {
        for (uint32_t c = 0u; c < 2u; c++) {
            ap[r][c] = (model->a[r][0] * p[0][c]) + (model->a[r][1] * p[1][c]);
        }
    }
    for (uint32_t r = 0u; r < 2u; r++) {
        for (uint32_t c = 0u; c < 2u; c++) {
            next[r][c] = (ap[r][0] * model->a[c][0]) + (ap[r][1] * model->a[c][1]) + (model->b[r][0] * model->b[c][0]) +
                         (model->b[r][1] * model->b[c][1]);
        }
    }
    memcpy(p, next, sizeof next);
}

/* The scalar model runs as the first state of a pair whose second never moves. */
static void kalman(posterior_t *out)
{
    double m[2] = {0.0, 0.0};
    double p[2][2] = {{1.0, 0.0}, {0.0, 1.0}};
    for (uint32_t k = 0u; k < STEPS; k++) {
        const double before[2] = {m[0], m[1]};
        m[0] = (model->a[0][0] * before[0]) + (model->a[0][1] * before[1]);
        m[1] = (model->a[1][0] * before[0]) + (model->a[1][1] * before[1]);
        propagate_covariance(p);
        const double s = p[0][0] + (SENSOR_SIGMA * SENSOR_SIGMA);
        const double gain[2] = {p[0][0] / s, p[1][0] / s};
        const double row[2] = {p[0][0], p[0][1]};
        const double innovation = (double)measured[k] - m[0];
        for (uint32_t r = 0u; r < 2u; r++) {
            m[r] += gain[r] * innovation;
            for (uint32_t c = 0u; c < 2u; c++) {
                p[r][c] -= gain[r] * row[c];
            }
        }
        memcpy(out->mean[k], m, sizeof m);
        memcpy(out->cov[k], p, sizeof p);
    }
}

/* Sums of squared errors of mean and covariance, in units of the exact spread, and the signed ones of the mean. */
typedef struct {
    double mean, cov, bias;
    double terms;
} errors_t;

static void compare(const posterior_t *exact, uint32_t k, const float *mean, const float *cov, errors_t *sum)
{
    const uint32_t states = model->states;
    for (uint32_t r = 0u; r < states; r++) {
        const double spread = sqrt(exact->cov[k][r][r]);
        const double off = ((double)mean[r] - exact->mean[k][r]) / spread;
        sum->mean += off * off;
        sum->bias += (k == (STEPS - 1u)) ? (off / states) : 0.0;
        sum->terms += 1.0;
        for (uint32_t c = 0u; c < states; c++) {
            const double scale = spread * sqrt(exact->cov[k][c][c]);
            const double wrong = ((double)cov[(r * states) + c] - exact->cov[k][r][c]) / scale;
            sum->cov += (wrong * wrong) / states;
        }
    }
}

static void fly(uint32_t n, uint16_t scheme, uint64_t seed, const posterior_t *exact, errors_t *sum)
{
    const pfl_sensor_t sensor = {.loglik = see};
    float mean[2];
    float cov[4];
    pfl_config_t c;
    pfl_t *f = NULL;
    memset(&c, 0, sizeof c);
    c.abi = PFL_ABI;
    c.particles = n;
    c.states = model->states;
    c.noises = model->states;
    c.sensor_count = 1u;
    c.resampling = schemes[scheme];
    c.ess_ratio = 0.5f;
    c.seed = seed;
    c.sensors = &sensor;
    c.predict = move;
    c.draw = draw;
    TEST_ASSERT_EQUAL(PFL_OK, pfl_init(&arena, sizeof arena, &c, 0u, &f));
    for (uint32_t k = 0u; k < STEPS; k++) {
        const uint64_t t_us = (k + 1u) * (uint64_t)STEP_US;
        TEST_ASSERT_EQUAL(PFL_OK, pfl_predict(f, t_us, NULL));
        TEST_ASSERT_EQUAL(PFL_OK, pfl_update(f, 0u, t_us, &measured[k]));
        TEST_ASSERT_EQUAL(PFL_OK, pfl_estimate(f, mean, cov));
        compare(exact, k, mean, cov, sum);
    }
}

/* Least squares over the logarithms of N = 100, 400, 1600, 6400. */
static double slope_of(const double log_error[SIZES])
{
    const double step = log(4.0);
    double numerator = 0.0;
    double denominator = 0.0;
    for (uint32_t s = 0u; s < SIZES; s++) {
        const double x = ((double)s - 1.5) * step;
        numerator += x * log_error[s];
        denominator += x * x;
    }
    return numerator / denominator;
}

static void assert_converges(const model_t *flown, uint16_t scheme)
{
    static const uint32_t sizes[SIZES] = {100u, 400u, 1600u, 6400u};
    double log_mean[SIZES];
    double log_cov[SIZES];
    posterior_t exact;
    char what[96];
    errors_t sum;
    model = flown;
    measure();
    kalman(&exact);
    for (uint32_t s = 0u; s < SIZES; s++) {
        memset(&sum, 0, sizeof sum);
        for (uint32_t run = 0u; run < RUNS; run++) {
            fly(sizes[s], scheme, ((uint64_t)sizes[s] << 16) + run, &exact, &sum);
        }
        log_mean[s] = 0.5 * log(sum.mean / sum.terms);
        log_cov[s] = 0.5 * log(sum.cov / sum.terms);
    }
    const double rms = exp(log_mean[SIZES - 1u]);
    const double mean_slope = slope_of(log_mean);
    const double cov_slope = slope_of(log_cov);
    (void)snprintf(what, sizeof what, "scheme %u, %u states: slopes %.3f and %.3f, error %.2f / sqrt(N)",
                   (unsigned)scheme, (unsigned)flown->states, mean_slope, cov_slope, rms * sqrt((double)N_MAX));
    puts(what);
    TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(0.1, -0.5, mean_slope, what);
    TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(0.1, -0.5, cov_slope, what);
    /* Perfect sampling of the posterior would err by 1 / sqrt(N), and importance weights cost a small factor. */
    TEST_ASSERT_TRUE_MESSAGE((rms * sqrt((double)N_MAX) > 0.9) && (rms * sqrt((double)N_MAX) < 2.5), what);
    /* Over the runs the errors of the last step cancel: six standard errors, odds 2e-9 (bias itself is O(1/N)). */
    TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(6.0 * rms / sqrt((double)RUNS), 0.0, sum.bias / RUNS, "bias of the mean");
}

void test_scalar_systematic(void)
{
    assert_converges(&scalar, SYSTEMATIC);
}

void test_scalar_stratified(void)
{
    assert_converges(&scalar, STRATIFIED);
}

void test_scalar_residual(void)
{
    assert_converges(&scalar, RESIDUAL);
}

void test_scalar_multinomial(void)
{
    assert_converges(&scalar, MULTINOMIAL);
}

void test_moving_systematic(void)
{
    assert_converges(&moving, SYSTEMATIC);
}

void test_moving_stratified(void)
{
    assert_converges(&moving, STRATIFIED);
}

void test_moving_residual(void)
{
    assert_converges(&moving, RESIDUAL);
}

void test_moving_multinomial(void)
{
    assert_converges(&moving, MULTINOMIAL);
}
