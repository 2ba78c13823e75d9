/* A filter that lives on a copy of its configuration, -DPFL_GUARD_CONFIG=2: what a configuration points to may be struck
 * while a callback runs, and the call ends as if nothing had been. */
#include "support.h"

#include "unity.h"

#include <math.h>
#include <string.h>

#define N 100u

static pfl_constraint_t constraint;
static pfl_kernel_t kernel;
static bool strikes;

static void strike(void)
{
    if (strikes) {
        memset(&constraint, 0, sizeof constraint); /* functions that there are not */
        memset(&kernel, 0, sizeof kernel);
    }
}

static void inside(void *user, const pfl_view_t *p, uint32_t *is_inside)
{
    (void)user;
    for (uint32_t i = 0u; i < p->n; i++) {
        is_inside[i] = (fabsf(p->x[i]) < 1.0f) ? 1u : 0u;
    }
}

static void project(void *user, const pfl_batch_t *p)
{
    (void)user;
    for (uint32_t i = 0u; i < p->n; i++) {
        PFL_STATE(p, 0)[i] = fminf(fmaxf(PFL_STATE(p, 0)[i], -0.9f), 0.9f);
    }
}

static void struck_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    ut_linear_predict(user, u, dt_s, p);
    strike();
}

static void struck_loglik(void *user, const void *z, const pfl_view_t *p, float *ll)
{
    ut_linear_loglik(user, z, p, ll);
    strike();
}

static const pfl_sensor_t sensor = {.loglik = struck_loglik};
static pfl_config_t config;

static void heal(void)
{
    constraint = (pfl_constraint_t){inside, project, NULL, 3u, 0u, pfl_constraint_keep};
    kernel = (pfl_kernel_t){0.3f, 0u, pfl_kernel_move};
}

void setUp(void)
{
    strikes = false;
    heal();
    config = ut_linear_config(N);
    config.predict = struck_predict;
    config.sensors = &sensor;
    config.constraint = &constraint;
    config.kernel = &kernel;
    config.ess_ratio = 1.0f; /* each update ends with a kernel step */
}

void tearDown(void)
{
    ut_arenas_end();
}

static pfl_t *filter(void)
{
    const size_t bytes = pfl_arena_bytes(&config);
    pfl_t *f = NULL;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_init(ut_arena(bytes), bytes, &config, 0u, &f));
    return f;
}

static unsigned char *flown(bool struck)
{
    pfl_t *f = filter();
    for (uint64_t step = 1u; step <= 5u; step++) {
        const float z = 0.2f;
        strikes = struck;
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(f, step * 100000u, NULL));
        heal();
        if (config.sensor_count > 0u) {
            TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(f, 0u, step * 100000u, &z));
        }
        heal();
        strikes = false;
    }
    pfl_health_t health;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_health(f, &health));
    TEST_ASSERT_TRUE(health.redrawn > 0u);
    TEST_ASSERT_EQUAL_UINT32((config.sensor_count > 0u) ? 5u : 0u, health.resampled);
    return ut_snapshot(f);
}

static void check_struck(void)
{
    const size_t bytes = pfl_snapshot_bytes(filter());
    const unsigned char *clean = flown(false);
    TEST_ASSERT_TRUE(ut_same_posterior(clean, flown(true), bytes));
}

void test_constraint_and_kernel_step_are_copied(void)
{
    check_struck();
}

void test_a_filter_without_sensors_is_copied_too(void)
{
    config.sensor_count = 0u;
    config.sensors = NULL;
    check_struck();
}
