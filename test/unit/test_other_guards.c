/* A library whose guards are built the other way round: the view on, all others off. The same answers to the bit, and
 * each switch does what guard.h says. */
#include "core.h"
#include "support.h"

#include "unity.h"

#include <string.h>

#define N 70u

static pfl_config_t config;

void setUp(void)
{
    config = ut_linear_config(N);
}

void tearDown(void)
{
    ut_arenas_end();
}

void test_the_known_answers_are_the_same(void)
{
    void *arena = ut_arena(PFL_SELF_TEST_BYTES);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_self_test(arena, PFL_SELF_TEST_BYTES));
}

static bool vandal;

/* Casts the const away, and spoils what it was only to read. */
static void vandal_loglik(void *user, const void *z, const pfl_view_t *p, float *ll)
{
    ut_linear_loglik(user, z, p, ll);
    for (uint32_t i = 0u; vandal && (i < p->n); i++) {
        ((float *)(uintptr_t)p->x)[i] = 1.0e30f;
        ((float *)(uintptr_t)p->x)[p->stride + i] = ut_nan(false);
    }
}

void test_with_the_view_a_callback_cannot_spoil_the_particles(void)
{
    static const pfl_sensor_t sensor = {.loglik = vandal_loglik};
    config.sensors = &sensor;
    uint64_t hash[2];
    for (uint32_t k = 0u; k < 2u; k++) {
        vandal = k != 0u;
        pfl_t *f = ut_filter(&config);
        hash[k] = ut_fly_linear(f, 100000u, 0.3f, UT_FNV_SEED);
        hash[k] = ut_fly_linear(f, 200000u, 0.1f, hash[k]);
        TEST_ASSERT_TRUE(pfl_invariants_hold(f));
    }
    TEST_ASSERT_TRUE(hash[0] == hash[1]);
}

void test_without_their_guards_nobody_looks_at_configuration_block_and_canaries(void)
{
    pfl_health_t h;
    pfl_t *f = ut_filter(&config);
    (void)ut_fly_linear(f, 100000u, 0.3f, UT_FNV_SEED);
    config.seed++;
    f->rejected = 7u;
    f->x[-1] = 0.0f;
    f->x[N] = 0.0f;
    (void)ut_fly_linear(f, 200000u, 0.3f, UT_FNV_SEED);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_health(f, &h));
    TEST_ASSERT_EQUAL_UINT32(7u, h.rejected);
    TEST_ASSERT_EQUAL_UINT32(0u, h.mended);
    TEST_ASSERT_EQUAL_HEX32(0u, h.fault);
}

void test_an_arena_without_a_filter_is_still_refused(void)
{
    float mean[2];
    pfl_t *f = ut_filter(&config);
    memset(f, 0, sizeof *f);
    TEST_ASSERT_EQUAL_INT(PFL_ERR_CORRUPT, pfl_predict(f, 100000u, NULL));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_CORRUPT, pfl_estimate(f, mean, NULL));
}
