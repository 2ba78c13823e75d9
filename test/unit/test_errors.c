/* Laws of errors against their equations in double, what they do with NaN and infinity, biases, and drifting states. */
#include "support.h"

#include "pflight/errors.h"
#include "pflight/rng.h"
#include "pflight/sensors.h"

#include "unity.h"

#include <math.h>
#include <string.h>

#define N 301u

void setUp(void)
{
}

void tearDown(void)
{
}

static double gauss(double y)
{
    return -0.5 * y * y;
}

static double student(double y, double dof)
{
    return -0.5 * (dof + 1.0) * log1p(y * y / dof);
}

/* Errors on both sides, from far below a sigma to far above. */
static float error_at(uint32_t i)
{
    const float size = (float)pow(10.0, (((double)(i / 2u)) / 25.0) - 3.0);
    return ((i & 1u) != 0u) ? -size : size;
}

typedef double (*reference_fn)(const void *law, double error);

static void check_law(pfl_law_fn law, const void *parameters, reference_fn reference)
{
    float values[N];
    for (uint32_t i = 0u; i < N; i++) {
        values[i] = error_at(i);
    }
    law(parameters, values, N);
    for (uint32_t i = 0u; i < N; i++) {
        const double expected = reference(parameters, (double)error_at(i));
        TEST_ASSERT_DOUBLE_WITHIN(2e-6 + (2e-6 * fabs(expected)), expected, (double)values[i]);
        TEST_ASSERT_TRUE(values[i] <= PFL_LOGLIK_MAX);
    }
    float special[4] = {ut_nan(false), ut_nan(true), 0.0f, -0.0f};
    law(parameters, special, 4u);
    TEST_ASSERT_FALSE(ut_finite(special[0]));
    TEST_ASSERT_FALSE(ut_finite(special[1]));
    TEST_ASSERT_TRUE(fabsf(special[2]) < 0.2f);
    TEST_ASSERT_TRUE(fabsf(special[3]) < 0.2f);
}

static double gaussian_reference(const void *law, double error)
{
    return gauss(error * (double)((const pfl_gaussian_law_t *)law)->inv_sigma);
}

static double student_reference(const void *law, double error)
{
    const pfl_student_law_t *l = (const pfl_student_law_t *)law;
    return student(error * (double)l->inv_sigma, (double)l->dof);
}

static double split_reference(const void *law, double error)
{
    const pfl_split_law_t *l = (const pfl_split_law_t *)law;
    const uint32_t k = (error < 0.0) ? 0u : 1u;
    const double y = error * (double)l->inv_sigma[k];
    return (l->dof[k] > 0.0f) ? student(y, (double)l->dof[k]) : gauss(y);
}

static double mixture_reference(const void *law, double error)
{
    const pfl_mixture_law_t *l = (const pfl_mixture_law_t *)law;
    const double most = fmax((double)l->height[0], (double)l->height[1]);
    const double h = (double)l->height[(error < 0.0) ? 0u : 1u];
    const double y2 = pow(error * (double)l->inv_sigma, 2.0);
    return log((exp(-0.5 * y2) + (h * exp(-0.5 * (double)l->narrow * y2))) / (1.0 + most));
}

void test_laws_are_their_equations(void)
{
    const pfl_gaussian_law_t gaussian = {0.5f};
    const pfl_student_law_t students[] = {{2.0f, 1.0f}, {0.3f, 4.0f}, {1.0f, 30.0f}};
    const pfl_split_law_t splits[] = {
        {{1.0f, 0.2f}, {0.0f, 2.0f}}, {{0.1f, 3.0f}, {1.5f, 0.0f}}, {{1.0f, 2.0f}, {3.0f, 5.0f}}};
    const pfl_mixture_law_t mixtures[] = {
        {1.0f, {0.01f, 0.01f}, 0.0f}, {2.0f, {1e-6f, 0.2f}, 0.0f}, {1.0f, {0.05f, 0.05f}, 0.001f}};
    check_law(pfl_gaussian_law, &gaussian, gaussian_reference);
    for (uint32_t k = 0u; k < 3u; k++) {
        check_law(pfl_student_law, &students[k], student_reference);
        check_law(pfl_split_law, &splits[k], split_reference);
        check_law(pfl_mixture_law, &mixtures[k], mixture_reference);
    }
}

/* What each error more costs, far out: nothing more, by the mixture; the same for twice as much, by Student. */
void test_tails(void)
{
    const pfl_student_law_t student_law = {1.0f, 3.0f};
    const pfl_mixture_law_t mixture = {1.0f, {0.0f, 0.01f}, 0.0f};
    float t[2] = {1000.0f, 2000.0f};
    float m[3] = {100.0f, 1e15f, ut_infinity()};
    float below[1] = {-100.0f};
    pfl_student_law(&student_law, t, 2u);
    TEST_ASSERT_FLOAT_WITHIN(1e-4f, -4.0f * logf(2.0f), t[1] - t[0]);
    pfl_mixture_law(&mixture, m, 3u);
    TEST_ASSERT_FLOAT_WITHIN(1e-5f, logf(0.01f / 1.01f), m[0]);
    TEST_ASSERT_EQUAL_UINT32(ut_bits(m[0]), ut_bits(m[1]));
    TEST_ASSERT_EQUAL_UINT32(ut_bits(m[0]), ut_bits(m[2]));
    pfl_mixture_law(&mixture, below, 1u); /* no outliers on that side */
    TEST_ASSERT_FLOAT_WITHIN(0.02f, -5000.0f, below[0]);
}

/* ---- Sensors ------------------------------------------------------------------------------------------------------ */

void test_sensors_take_the_bias_off(void)
{
    float x[4u * N];
    float ll[N];
    uint64_t dice = 3u;
    for (uint32_t k = 0u; k < 4u * N; k++) {
        x[k] = (float)(4.0 * ut_gaussian(&dice));
    }
    const pfl_view_t view = {x, N, 0u, N};
    const pfl_student_law_t law = {2.0f, 3.0f};
    const float z = 1.25f;
    const pfl_range_z_t range = {2.0f, -1.0f, 0.5f, 7.0f, 1.5f};
    for (uint32_t k = 0u; k < 2u; k++) {
        const uint16_t bias = (k == 0u) ? (uint16_t)PFL_NO_BIAS : 3u;
        pfl_scalar_t scalar = {1u, bias, pfl_student_law, &law};
        pfl_ranging_t ranging = {0u, 2u, bias, 0u, pfl_student_law, &law};
        pfl_scalar_loglik(&scalar, &z, &view, ll);
        for (uint32_t i = 0u; i < N; i++) {
            const double b = (k == 0u) ? 0.0 : (double)x[(3u * N) + i];
            const double y = 2.0 * ((double)z - (double)x[N + i] - b);
            TEST_ASSERT_DOUBLE_WITHIN(1e-5 + (1e-5 * y * y), student(y, 3.0), (double)ll[i]);
        }
        pfl_ranging_loglik(&ranging, &range, &view, ll);
        for (uint32_t i = 0u; i < N; i++) {
            const double b = (k == 0u) ? 0.0 : (double)x[(3u * N) + i];
            const double dx = (double)x[i] - 2.0;
            const double dy = (double)x[(2u * N) + i] + 1.0;
            const double y = 2.0 * (7.0 - sqrt((dx * dx) + (dy * dy) + 0.25) - b) / 1.5;
            TEST_ASSERT_DOUBLE_WITHIN(1e-5 + (1e-5 * y * y), student(y, 3.0), (double)ll[i]);
        }
    }
}

/* ---- Drift -------------------------------------------------------------------------------------------------------- */

static void shift(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    (void)user;
    (void)dt_s;
    for (uint32_t i = 0u; i < p->n; i++) {
        PFL_STATE(p, 0)[i] += *(const float *)u;
    }
}

#define WALKERS (64u * PFL_BATCH)

/* 8192 particles, 60 steps: variances to 5.5 standard errors, sqrt(2/8192), 4e-8; likewise the correlation over a step. */
void test_drifting_states_have_their_statistics(void)
{
    static float x[4u * WALKERS];
    static float before[WALKERS];
    float noise[2u * PFL_BATCH];
    const float one = 1.0f;
    pfl_drift_t drift = {shift, NULL, 3u, {1u, 2u, 3u}, {0u, 1u, 1u}, {2.0f, 0.5f, 0.0f}, {3.0f, 0.0f, 0.0f}};
    pfl_rng_t rng;
    pfl_rng_seed(&rng, 4u);
    memset(x, 0, sizeof x);
    for (uint32_t i = 0u; i < WALKERS; i++) {
        x[(3u * WALKERS) + i] = 7.0f;
    }
    for (uint32_t step = 0u; step < 60u; step++) {
        memcpy(before, &x[WALKERS], sizeof before);
        for (uint32_t first = 0u; first < WALKERS; first += PFL_BATCH) {
            const pfl_batch_t batch = {&x[first], WALKERS, noise, first, PFL_BATCH};
            pfl_rng_normals(&rng, noise, 2u * PFL_BATCH / 16u);
            pfl_drift_predict(&drift, &one, 0.5f, &batch);
        }
    }
    double var = 0.0;
    double lag = 0.0;
    double walk = 0.0;
    for (uint32_t i = 0u; i < WALKERS; i++) {
        var += pow((double)x[WALKERS + i], 2.0) / WALKERS;
        lag += ((double)x[WALKERS + i] * (double)before[i]) / WALKERS;
        walk += pow((double)x[(2u * WALKERS) + i], 2.0) / WALKERS;
        TEST_ASSERT_EQUAL_FLOAT(60.0f, x[i]);
        TEST_ASSERT_EQUAL_FLOAT(7.0f, x[(3u * WALKERS) + i]);
    }
    const double error = 5.5 * sqrt(2.0 / WALKERS);
    TEST_ASSERT_DOUBLE_WITHIN(4.0 * error, 4.0, var); /* 30 s are ten correlation times */
    TEST_ASSERT_DOUBLE_WITHIN(4.0 * error, 4.0 * exp(-0.5 / 3.0), lag);
    TEST_ASSERT_DOUBLE_WITHIN(7.5 * error, 0.25 * 30.0, walk);
    drift.predict = NULL;
    const pfl_batch_t batch = {x, WALKERS, noise, 0u, 1u};
    pfl_drift_predict(&drift, NULL, 0.5f, &batch);
    TEST_ASSERT_EQUAL_FLOAT(60.0f, x[0]);
    drift.tau_s[0] = 0.5f; /* short, and still no walk */
    x[WALKERS] = 1.0f;
    memset(noise, 0, sizeof noise);
    pfl_drift_predict(&drift, NULL, 0.5f, &batch);
    TEST_ASSERT_FLOAT_WITHIN(1e-6f, 0.36787944f, x[WALKERS]);
}

void test_the_mixture_counts_from_its_better_side(void)
{
    const pfl_mixture_law_t below = {1.0f, {0.1f, 0.02f}, 0.001f};
    const pfl_mixture_law_t above = {1.0f, {0.02f, 0.1f}, 0.001f};
    check_law(pfl_mixture_law, &below, mixture_reference);
    check_law(pfl_mixture_law, &above, mixture_reference);
}
