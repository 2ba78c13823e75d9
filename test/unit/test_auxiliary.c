/* The auxiliary filter: unbiased against the Kalman filter and closer to it than the bootstrap filter, fully adapted with
 * the optimal proposal, and without a trace where it has nothing to do. */
#include "support.h"

#include "pflight/auxiliary.h"
#include "pflight/proposal.h"

#include "unity.h"

#include <math.h>
#include <string.h>

#define N 200u
#define STEPS 30u
#define NOISE 0.1   /* of the position in a step (ut_linear_predict) */
#define SPEED 0.05  /* of the speed */
#define SIGMA 0.03f /* measured */

enum { POSITION, VELOCITY, FAVOUR, STATES };

static float sharp = SIGMA;
static float looking;
static pfl_auxiliary_t auxiliary;
static pfl_sensor_t sensor;

static void see(void *user, const void *z, const pfl_view_t *p, float *ll)
{
    const float inv = 1.0f / *(const float *)user;
    for (uint32_t i = 0u; i < p->n; i++) {
        const float e = (p->x[i] - *(const float *)z) * inv;
        ll[i] = -0.5f * (e * e);
    }
}

static void draw(void *user, const pfl_batch_t *p)
{
    ut_linear_draw(user, p);
    memset(PFL_STATE(p, FAVOUR), 0, sizeof(float) * p->n);
}

void setUp(void)
{
    looking = (float)sqrt((NOISE * NOISE) + (double)(SIGMA * SIGMA));
    auxiliary = (pfl_auxiliary_t){see, &looking, 0.0f, 1.0f, FAVOUR};
    sensor = (pfl_sensor_t){.loglik = see, .user = &sharp};
}

void tearDown(void)
{
    ut_arenas_end();
}

static pfl_config_t config_of(uint64_t seed)
{
    pfl_config_t c = ut_linear_config(N);
    c.states = STATES;
    c.sensors = &sensor;
    c.draw = draw;
    c.seed = seed;
    return c;
}

/* ---- The exact answer ----------------------------------------------------------------------------------------------- */

typedef struct {
    double m[2];
    double p[2][2];
} kalman_t;

static void kalman_step(kalman_t *k, double z)
{
    const double dt = 0.1;
    k->m[0] += dt * k->m[1];
    const double p00 = k->p[0][0] + (2.0 * dt * k->p[0][1]) + (dt * dt * k->p[1][1]) + (NOISE * NOISE);
    const double p01 = k->p[0][1] + (dt * k->p[1][1]);
    const double p11 = k->p[1][1] + (SPEED * SPEED);
    const double s = p00 + ((double)SIGMA * (double)SIGMA);
    const double e = z - k->m[0];
    k->m[0] += (p00 / s) * e;
    k->m[1] += (p01 / s) * e;
    k->p[0][0] = p00 - (p00 * p00 / s);
    k->p[0][1] = p01 - (p00 * p01 / s);
    k->p[1][0] = k->p[0][1];
    k->p[1][1] = p11 - (p01 * p01 / s);
}

typedef struct {
    double bias;   /* mean of the velocity's errors against the Kalman filter, in its deviations */
    double square; /* of both states' */
} error_t;

/* One run; how far the particles' mean is from the Kalman filter's. */
static error_t fly(uint64_t seed, bool look)
{
    const pfl_config_t config = config_of(seed);
    pfl_t *f = ut_filter(&config);
    kalman_t k = {{0.0, 0.0}, {{1.0, 0.0}, {0.0, 1.0}}};
    uint64_t dice = seed * 31u;
    double x = ut_gaussian(&dice);
    double v = ut_gaussian(&dice);
    error_t error = {0.0, 0.0};
    for (uint32_t step = 1u; step <= STEPS; step++) {
        x += (0.1 * v) + (NOISE * ut_gaussian(&dice));
        v += SPEED * ut_gaussian(&dice);
        const float z = (float)(x + ((double)SIGMA * ut_gaussian(&dice)));
        const uint64_t t_us = step * 100000u;
        float mean[STATES];
        kalman_step(&k, (double)z);
        if (look) {
            TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_auxiliary_look(f, &auxiliary, t_us, NULL, &z));
            TEST_ASSERT_TRUE(pfl_invariants_hold(f));
        }
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(f, t_us, NULL));
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(f, 0u, t_us, &z));
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(f, mean, NULL));
        for (uint32_t d = 0u; d < 2u; d++) {
            const double off = ((double)mean[d] - k.m[d]) / sqrt(k.p[d][d]);
            error.square += off * off / (2.0 * STEPS);
            error.bias += off / (2.0 * STEPS);
        }
    }
    ut_arenas_end();
    return error;
}

/* 200 runs of 200 particles. The mean error is zero within 5 of its standard errors, taken from the runs themselves: 6e-7.
 * Squared, it is at most seven tenths of the bootstrap filter's. */
void test_unbiased_and_closer_than_the_bootstrap_filter(void)
{
    double bias = 0.0;
    double spread = 0.0;
    double with = 0.0;
    double without = 0.0;
    for (uint64_t seed = 1u; seed <= 200u; seed++) {
        const error_t a = fly(seed, true);
        bias += a.bias / 200.0;
        spread += a.bias * a.bias / 200.0;
        with += a.square / 200.0;
        without += fly(seed, false).square / 200.0;
    }
    TEST_ASSERT_DOUBLE_WITHIN(5.0 * sqrt(spread / 200.0), 0.0, bias);
    TEST_ASSERT_TRUE(with < (0.7 * without));
}

/* ---- With the optimal proposal ---------------------------------------------------------------------------------------- */

static void coast(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    (void)user;
    (void)u;
    for (uint32_t i = 0u; i < p->n; i++) {
        PFL_STATE(p, POSITION)[i] += dt_s * PFL_STATE(p, VELOCITY)[i];
        PFL_STATE(p, VELOCITY)[i] += (float)SPEED * PFL_NOISE(p, 1)[i];
    }
}

/* The look with the very deviation of a particle's prediction takes off what the proposal puts on: equal weights. */
void test_fully_adapted_with_the_optimal_proposal(void)
{
    enum { LOGLIK = STATES };
    pfl_proposal_t proposal = {.predict = coast,
                               .loglik_state = LOGLIK,
                               .count = 1u,
                               .sigma_noise = {(float)NOISE},
                               .sigma_measured = {SIGMA}};
    pfl_config_t config = config_of(3u);
    config.states = STATES + 1u;
    config.predict = pfl_proposal_predict;
    config.user = &proposal;
    sensor.loglik = pfl_proposal_loglik;
    sensor.user = &proposal;
    pfl_t *f = ut_filter(&config);
    uint64_t dice = 5u;
    for (uint32_t step = 1u; step <= 20u; step++) {
        const float z = (float)(0.2 * ut_gaussian(&dice));
        const pfl_proposal_input_t blind = {NULL, NULL};
        const pfl_proposal_input_t in = {NULL, &z};
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_auxiliary_look(f, &auxiliary, step * 100000u, &blind, &z));
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(f, step * 100000u, &in));
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(f, 0u, step * 100000u, &z));
        TEST_ASSERT_FLOAT_WITHIN(0.01f, (float)N, pfl_effective_sample_size(f));
    }
}

/* ---- Nothing to do -------------------------------------------------------------------------------------------------------- */

static void check_untouched(pfl_t *f, pfl_status_t expected, uint64_t t_us, float z)
{
    unsigned char *before = ut_snapshot(f);
    TEST_ASSERT_EQUAL_INT(expected, pfl_auxiliary_look(f, &auxiliary, t_us, NULL, &z));
    TEST_ASSERT_TRUE(ut_same_posterior(before, ut_snapshot(f), pfl_snapshot_bytes(f)));
    TEST_ASSERT_TRUE(pfl_invariants_hold(f));
}

void test_what_is_not_needed_or_not_allowed_changes_nothing(void)
{
    pfl_config_t config = config_of(1u);
    config.dt_max_us = 50000u;
    pfl_t *f = ut_filter(&config);
    looking = 100.0f;
    auxiliary.ess_ratio = 0.5f;
    check_untouched(f, PFL_OK, 100000u, 0.3f); /* flat: everybody agrees */
    looking = 0.1f;
    auxiliary.gate = 11.0f;
    check_untouched(f, PFL_REJECTED, 100000u, 50.0f);
    auxiliary.gate = 0.0f;
    check_untouched(f, PFL_REJECTED, 100000u, ut_infinity());
    check_untouched(f, PFL_ERR_NONFINITE, 100000u, ut_nan(false));
    check_untouched(f, PFL_ERR_GAP, 100000000u, 0.3f);
    auxiliary.state = STATES;
    check_untouched(f, PFL_ERR_CONFIG, 100000u, 0.3f);
    auxiliary.state = FAVOUR;
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_auxiliary_look(f, NULL, 0u, NULL, &looking));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_auxiliary_look(f, &auxiliary, 0u, NULL, NULL));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_auxiliary_look(NULL, &auxiliary, 0u, NULL, &looking));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(f, 100000u, NULL));
    check_untouched(f, PFL_ERR_TIME, 0u, 0.3f);
}
