/* The tempered update: the posterior it must reach, the bits of pfl_update where one step is enough, and every way out. */
#include "support.h"

#include "pflight/tempered.h"

#include "unity.h"

#include <math.h>
#include <string.h>

#define SIGMA 0.02
#define RHO 0.6

static pfl_kernel_t kernel;
static pfl_tempered_t tempered;
static pfl_sensor_t sensors[2];
static uint32_t calls; /* of the sensor itself */
static uint32_t nan_from;

void setUp(void)
{
    kernel = (pfl_kernel_t){0.5f, 0u, pfl_kernel_move};
    calls = 0u;
    nan_from = UINT32_MAX;
}

void tearDown(void)
{
    ut_arenas_end();
}

/* Two states, N(0, 1), with correlation RHO. */
static void draw(void *user, const pfl_batch_t *p)
{
    (void)user;
    for (uint32_t i = 0u; i < p->n; i++) {
        PFL_STATE(p, 0)[i] = PFL_NOISE(p, 0)[i];
        PFL_STATE(p, 1)[i] = ((float)RHO * PFL_NOISE(p, 0)[i]) + (0.8f * PFL_NOISE(p, 1)[i]);
    }
}

/* z: float; the first state with deviation *user. */
static void see(void *user, const void *z, const pfl_view_t *p, float *ll)
{
    const float inv = 1.0f / *(const float *)user;
    calls++;
    for (uint32_t i = 0u; i < p->n; i++) {
        const float e = (p->x[i] - *(const float *)z) * inv;
        ll[i] = (calls > nan_from) ? ut_nan(false) : (-0.5f * (e * e));
    }
}

static float sharp = (float)SIGMA;
static float broad = 3.0f;

/* Sensor 0 tempered, sensor 1 the same plain. */
static pfl_config_t config_of(uint32_t particles, float *sigma)
{
    pfl_config_t c = ut_dictated_config(particles, 2u);
    tempered = (pfl_tempered_t){.loglik = see, .user = sigma, .ess_share = 0.5f, .steps = PFL_TEMPERED_STEPS_MAX};
    memset(sensors, 0, sizeof sensors);
    sensors[0].loglik = pfl_tempered_loglik;
    sensors[0].user = &tempered;
    sensors[1].loglik = see;
    sensors[1].user = sigma;
    c.sensor_count = 2u;
    c.sensors = sensors;
    c.ess_ratio = 0.5f;
    c.kernel = &kernel;
    c.draw = draw;
    return c;
}

/* ---- The posterior -------------------------------------------------------------------------------------------------- */

typedef struct {
    double error;    /* squared, of the mean of both states, in the posterior's variances */
    double variance; /* of both states over the posterior's */
} quality_t;

static quality_t against_bayes(uint16_t sensor, uint64_t seed)
{
    const float z = 2.5f;
    const double gain = 1.0 / (1.0 + (SIGMA * SIGMA));
    const double variance[2] = {SIGMA * SIGMA * gain, 1.0 - (RHO * RHO * gain)};
    const double mean[2] = {(double)z * gain, RHO * (double)z * gain};
    pfl_config_t config = config_of(1000u, &sharp);
    config.seed = seed;
    pfl_t *f = ut_filter(&config);
    float got[2];
    float cov[4];
    const pfl_status_t status = (sensor == 0u) ? pfl_tempered_update(f, 0u, 0u, &z) : pfl_update(f, 1u, 0u, &z);
    TEST_ASSERT_EQUAL_INT(PFL_OK, status);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(f, got, cov));
    TEST_ASSERT_TRUE(pfl_invariants_hold(f));
    quality_t q = {0.0, 0.0};
    for (uint32_t d = 0u; d < 2u; d++) {
        q.error += 0.5 * pow((double)got[d] - mean[d], 2.0) / variance[d];
        q.variance += 0.5 * ((double)cov[3u * d] / variance[d]);
    }
    ut_arenas_end();
    return q;
}

/* A measurement with 1/50 of the prior's deviation, 2.5 of these out, where some 0.7 particles of a thousand lie within
 * one of the measurement's. Forty seeds: mean squared error 0.03 of the posterior's variance and its spread to 3 %. Plainly
 * updated the cloud is off by the whole of it and has lost half of its spread. */
void test_a_sharp_measurement_gives_the_posterior(void)
{
    quality_t with = {0.0, 0.0};
    quality_t without = {0.0, 0.0};
    for (uint64_t seed = 1u; seed <= 40u; seed++) {
        const quality_t a = against_bayes(0u, seed);
        const quality_t b = against_bayes(1u, seed);
        with.error += a.error / 40.0;
        with.variance += a.variance / 40.0;
        without.error += b.error / 40.0;
        without.variance += b.variance / 40.0;
    }
    TEST_ASSERT_TRUE(with.error < 0.05);
    TEST_ASSERT_DOUBLE_WITHIN(0.1, 1.0, with.variance);
    TEST_ASSERT_TRUE(without.error > (20.0 * with.error));
    TEST_ASSERT_TRUE(without.variance < 0.8);
}

/* ---- One step -------------------------------------------------------------------------------------------------------- */

void test_where_one_step_is_enough_the_bits_are_those_of_an_update(void)
{
    static const uint32_t counts[] = {1u, 8u, 127u, 128u, 300u};
    for (uint32_t k = 0u; k < sizeof counts / sizeof counts[0]; k++) {
        pfl_config_t config = config_of(counts[k], &broad);
        pfl_t *a = ut_filter(&config);
        pfl_t *b = ut_filter(&config);
        for (uint32_t step = 1u; step < 6u; step++) {
            const float z = 0.3f * (float)(int32_t)step;
            TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(a, step * 1000u, NULL));
            TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(b, step * 1000u, NULL));
            TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_tempered_update(a, 0u, step * 1000u, &z));
            TEST_ASSERT_EQUAL_UINT32(1u, tempered.taken);
            TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(b, 0u, step * 1000u, &z)); /* the tempered sensor as it is */
            TEST_ASSERT_TRUE(ut_same_bytes(ut_snapshot(a), ut_snapshot(b), pfl_snapshot_bytes(a)));
        }
    }
}

/* What the cloud already weighs counts: a measurement that evens out the one before needs no steps. */
void test_the_weights_before_count(void)
{
    float one[300];
    float other[300];
    pfl_config_t config = config_of(300u, &sharp);
    tempered.loglik = ut_dictated_loglik;
    sensors[1].loglik = ut_dictated_loglik;
    config.ess_ratio = 0.0f;
    for (uint32_t i = 0u; i < 300u; i++) {
        one[i] = -0.1f * (float)(int32_t)i;
        other[i] = -0.1f * (float)(int32_t)(299u - i);
    }
    pfl_t *f = ut_filter(&config);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(f, 1u, 0u, one));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_tempered_update(f, 0u, 0u, other));
    TEST_ASSERT_EQUAL_UINT32(1u, tempered.taken);
    TEST_ASSERT_FLOAT_WITHIN(0.1f, 300.0f, pfl_effective_sample_size(f));
    f = ut_filter(&config);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_tempered_update(f, 0u, 0u, other));
    TEST_ASSERT_TRUE(tempered.taken > 1u);
}

void test_the_sensor_is_asked_once_a_step(void)
{
    const float z = 2.5f;
    pfl_config_t config = config_of(128u, &sharp);
    pfl_t *f = ut_filter(&config);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_tempered_update(f, 0u, 0u, &z));
    TEST_ASSERT_TRUE(tempered.taken > 2u);
    TEST_ASSERT_EQUAL_UINT32(tempered.taken, calls);
}

void test_steps_are_bounded_and_one_measurement_counts_once(void)
{
    const float z = 2.5f;
    for (uint32_t steps = 1u; steps < 6u; steps++) {
        pfl_health_t health;
        pfl_config_t config = config_of(500u, &sharp);
        tempered.steps = steps;
        pfl_t *f = ut_filter(&config);
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_tempered_update(f, 0u, 0u, &z));
        TEST_ASSERT_EQUAL_UINT32(steps, tempered.taken);
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_health(f, &health));
        TEST_ASSERT_EQUAL_UINT32(1u, health.fused);
        TEST_ASSERT_TRUE(health.resampled >= (steps - 1u));
        TEST_ASSERT_TRUE(pfl_invariants_hold(f));
    }
}

/* ---- Ways out ----------------------------------------------------------------------------------------------------------- */

void test_the_gate_judges_the_whole(void)
{
    const float far = 50.0f;
    const float near = 2.5f;
    pfl_config_t config = config_of(300u, &sharp);
    sensors[0].gate = 2000.0f;
    sensors[1].gate = 2000.0f;
    pfl_t *f = ut_filter(&config);
    pfl_t *plain = ut_filter(&config);
    unsigned char *before = ut_snapshot(f);
    pfl_health_t a;
    pfl_health_t b;
    TEST_ASSERT_EQUAL_INT(PFL_REJECTED, pfl_tempered_update(f, 0u, 0u, &far));
    TEST_ASSERT_EQUAL_UINT32(0u, tempered.taken);
    TEST_ASSERT_TRUE(ut_same_posterior(before, ut_snapshot(f), pfl_snapshot_bytes(f)));
    TEST_ASSERT_EQUAL_INT(PFL_REJECTED, pfl_update(plain, 1u, 0u, &far));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_health(f, &a));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_health(plain, &b));
    TEST_ASSERT_EQUAL_UINT32(ut_bits(b.test_ratio), ut_bits(a.test_ratio));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_tempered_update(f, 0u, 0u, &near));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(plain, 1u, 0u, &near));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_health(f, &a));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_health(plain, &b));
    TEST_ASSERT_TRUE(tempered.taken > 1u);
    TEST_ASSERT_FLOAT_WITHIN(1e-6f, b.test_ratio, a.test_ratio);
    TEST_ASSERT_FLOAT_WITHIN(2e-3f, b.best_loglik, a.best_loglik);
}

void test_a_watched_measurement_that_comes_twice_is_seen(void)
{
    const pfl_watch_t watch = {.keep = pfl_watch_keep};
    const float z = 2.5f;
    pfl_sensor_health_t health;
    pfl_config_t config = config_of(300u, &sharp);
    sensors[0].z_bytes = sizeof z;
    sensors[0].gate = 1e6f;
    config.watch = &watch;
    pfl_t *f = ut_filter(&config);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_tempered_update(f, 0u, 0u, &z));
    TEST_ASSERT_TRUE(tempered.taken > 1u);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_sensor_health(f, 0u, &health));
    TEST_ASSERT_EQUAL_UINT32(0u, health.same);
    unsigned char *before = ut_snapshot(f);
    TEST_ASSERT_EQUAL_INT(PFL_ERR_TIME, pfl_tempered_update(f, 0u, 0u, &z));
    TEST_ASSERT_TRUE(ut_same_posterior(before, ut_snapshot(f), pfl_snapshot_bytes(f)));
}

void test_a_fault_ends_it(void)
{
    const float z = 2.5f;
    pfl_config_t config = config_of(128u, &sharp);
    pfl_t *f = ut_filter(&config);
    unsigned char *before = ut_snapshot(f);
    nan_from = 0u; /* from the start: refused as by pfl_update */
    TEST_ASSERT_EQUAL_INT(PFL_ERR_NONFINITE, pfl_tempered_update(f, 0u, 0u, &z));
    TEST_ASSERT_EQUAL_UINT32(0u, tempered.taken);
    TEST_ASSERT_TRUE(ut_same_posterior(before, ut_snapshot(f), pfl_snapshot_bytes(f)));
    calls = 0u;
    nan_from = 2u; /* the third step */
    TEST_ASSERT_EQUAL_INT(PFL_ERR_NONFINITE, pfl_tempered_update(f, 0u, 0u, &z));
    TEST_ASSERT_EQUAL_UINT32(2u, tempered.taken);
    TEST_ASSERT_TRUE(pfl_invariants_hold(f));
    TEST_ASSERT_TRUE(tempered.held == NULL);
}

void test_wrong_calls_are_refused(void)
{
    const float z = 2.5f;
    pfl_config_t config = config_of(128u, &sharp);
    pfl_t *f = ut_filter(&config);
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_tempered_update(NULL, 0u, 0u, &z));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_tempered_update(f, 0u, 0u, NULL));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_SENSOR, pfl_tempered_update(f, 1u, 0u, &z)); /* not a tempered one */
    TEST_ASSERT_EQUAL_INT(PFL_ERR_SENSOR, pfl_tempered_update(f, 2u, 0u, &z));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_TIME, pfl_tempered_update(f, 0u, 5u, &z));
    TEST_ASSERT_EQUAL_UINT32(0u, calls);
}

static void impossible(void *user, const void *z, const pfl_view_t *p, float *ll)
{
    (void)user;
    (void)z;
    for (uint32_t i = 0u; i < p->n; i++) {
        ll[i] = -ut_infinity();
    }
}

void test_what_is_impossible_for_all_is_refused(void)
{
    const float z = 2.5f;
    pfl_config_t config = config_of(300u, &sharp);
    tempered.loglik = impossible;
    pfl_t *f = ut_filter(&config);
    unsigned char *before = ut_snapshot(f);
    TEST_ASSERT_EQUAL_INT(PFL_REJECTED, pfl_tempered_update(f, 0u, 0u, &z));
    TEST_ASSERT_TRUE(ut_same_posterior(before, ut_snapshot(f), pfl_snapshot_bytes(f)));
}
