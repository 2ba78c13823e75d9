/* Fault matrix, rows T1 to T3, B1 and B2: time stamps, clocks that wrap, cycle counters that lie, budgets that run out. */
#include "fault_port.h"
#include "fault_support.h"

#include "pflight/clock.h"

#include "unity.h"

#include <math.h>
#include <string.h>

static ft_t t;

void setUp(void)
{
    fault_port_reset();
}

void tearDown(void)
{
    ut_arenas_end();
}

/* ---- T1 ----------------------------------------------------------------------------------------------------------- */

void test_T1_any_step_is_taken_or_refused_unchanged(void)
{
    static const struct {
        int64_t step_us;
        pfl_status_t status;
    } cases[] = {{0, PFL_OK},        {1, PFL_OK},           {FT_STEP_US, PFL_OK},      {10 * FT_STEP_US, PFL_OK},
                 {-1, PFL_ERR_TIME}, {-5000, PFL_ERR_TIME}, {3600000000, PFL_ERR_GAP}, {INT64_MAX, PFL_ERR_GAP}};
    for (size_t k = 0u; k < (sizeof cases / sizeof cases[0]); k++) {
        ft_configure(&t);
        t.config.dt_max_us = 2u * FT_STEP_US;
        ft_start(&t);
        ft_cycles(&t, 12u, 0.0f);
        const unsigned char *before = ut_snapshot(t.f);
        TEST_ASSERT_EQUAL_INT(cases[k].status, pfl_predict(t.f, t.now_us + (uint64_t)cases[k].step_us, NULL));
        if (cases[k].status != PFL_OK) {
            TEST_ASSERT_TRUE(ut_same_posterior(before, ut_snapshot(t.f), pfl_snapshot_bytes(t.f)));
            TEST_ASSERT_TRUE((ft_health(t.f).fault & PFL_FAULT_TIME) != 0u);
        }
        (void)ft_finite_mean(t.f);
        ut_arenas_end();
    }
}

static uint32_t calls;

static void counting_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    calls++;
    ut_linear_predict(user, u, dt_s, p);
}

void test_T1_a_long_step_is_bounded_in_calls(void)
{
    const uint32_t batches = 1u + ((FT_N - 16u + 63u) / 64u);
    ft_configure(&t);
    t.config.predict = counting_predict;
    t.config.dt_max_us = FT_STEP_US;
    ft_start(&t);
    calls = 0u;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(t.f, 16u * FT_STEP_US, NULL));
    TEST_ASSERT_TRUE(calls <= (16u * batches));
}

/* ---- T2 ----------------------------------------------------------------------------------------------------------- */

void test_T2_a_hundred_wraps_of_the_clock_are_not_to_be_seen(void)
{
    const uint64_t step_us = 61356676u; /* 70 to a wrap */
    uint64_t extended_us = 0u;
    uint64_t one = UT_FNV_SEED;
    uint64_t two = UT_FNV_SEED;
    ft_configure(&t);
    pfl_t *a = ut_filter(&t.config);
    pfl_t *b = ut_filter(&t.config);
    for (uint64_t k = 1u; k <= 7010u; k++) {
        const uint64_t now_us = k * step_us;
        extended_us = pfl_clock_extend(extended_us, (uint32_t)now_us);
        TEST_ASSERT_TRUE(extended_us == now_us);
        one = ut_fly_linear(a, now_us, 0.1f, one);
        two = ut_fly_linear(b, extended_us, 0.1f, two);
        TEST_ASSERT_TRUE(one == two);
    }
    TEST_ASSERT_TRUE(extended_us > (100u * UINT64_C(0x100000000)));
}

void test_T2_a_clock_that_steps_back_gives_an_earlier_time_and_recovers(void)
{
    TEST_ASSERT_TRUE(pfl_clock_extend(0u, 5u) == 5u);
    TEST_ASSERT_TRUE(pfl_clock_extend(5u, 5u) == 5u);
    TEST_ASSERT_TRUE(pfl_clock_extend(UINT64_C(0x100000005), 0xFFFFFFFFu) == UINT64_C(0xFFFFFFFF));
    TEST_ASSERT_TRUE(pfl_clock_extend(UINT64_C(0xFFFFFFFF), 6u) == UINT64_C(0x100000006));
    TEST_ASSERT_TRUE(pfl_clock_extend(UINT64_C(0x100000000), 0x7FFFFFFFu) == UINT64_C(0x17FFFFFFF));
    TEST_ASSERT_TRUE(pfl_clock_extend(UINT64_C(0x100000000), 0x80000000u) == UINT64_C(0x80000000));
    TEST_ASSERT_TRUE(pfl_clock_extend(3u, 0xFFFFFFFFu) == UINT64_C(0xFFFFFFFF)); /* never before zero */
    TEST_ASSERT_TRUE(pfl_clock_extend(UINT64_MAX, 0u) == 0u);
}

void test_T2_the_end_of_64_bits_and_a_clock_that_stands_still(void)
{
    ft_configure(&t);
    size_t bytes = 0u;
    void *arena = ut_arena_for(&t.config, &bytes);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_init(arena, bytes, &t.config, UINT64_MAX - 10u, &t.f));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(t.f, UINT64_MAX, NULL));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_TIME, pfl_predict(t.f, 5u, NULL));
    for (uint32_t k = 0u; k < 1000u; k++) {
        const float z = 0.01f * (float)k;
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(t.f, UINT64_MAX, NULL));
        (void)pfl_update(t.f, 0u, UINT64_MAX, &z);
        (void)ft_finite_mean(t.f);
    }
}

/* ---- T3 ----------------------------------------------------------------------------------------------------------- */

/* A flight on this counter gives the numbers of one without a budget, whatever the counter does. */
static void fly_with_counter(uint32_t budget)
{
    static ft_t plain;
    ft_configure(&plain);
    pfl_t *a = ut_filter(&plain.config);
    ft_configure(&t);
    t.config.budget_cycles = budget;
    pfl_t *b = ut_filter(&t.config);
    for (uint64_t k = 1u; k <= 100u; k++) {
        const uint64_t one = ut_fly_linear(a, k * FT_STEP_US, 0.1f, UT_FNV_SEED);
        const uint64_t two = ut_fly_linear(b, k * FT_STEP_US, 0.1f, UT_FNV_SEED);
        TEST_ASSERT_TRUE(one == two);
    }
    t.f = b;
}

void test_T3_counters_that_lie_never_stop_a_filter_that_is_in_time(void)
{
    static const fault_port_t liars[] = {
        {.step = 0u, .mask = 0xFFFFFFFFu, .width = 0xFFFFFFFFu, .jump_at = 0xFFFFFFFFu}, /* stuck */
        {.step = 10u,
         .mask = 0x00FFFFFFu,
         .width = 0x00FFFFFFu,
         .jump_at = 0xFFFFFFFFu,
         .count = 0x00FFFF00u}, /* 24 bits */
        {.step = 10u,
         .mask = 0xFFFFFFFFu,
         .width = 0xFFFFFFFFu,
         .jump_at = 0xFFFFFFFFu,
         .count = 0xFFFFFE00u}, /* wraps */
        {.step = 10u,
         .mask = 0xFFFFFFFFu,
         .width = 0x00FFFFFFu,
         .jump_at = 0xFFFFFFFFu,
         .count = 0x00FFFF00u},                                                                        /* narrower */
        {.step = 10u, .mask = 0xFFFFFFFFu, .width = 0xFFFFFFFFu, .jump_at = 50u, .jump = 0x90000000u}, /* back */
        {.step = 0xFFFFFFF0u, .mask = 0xFFFFFFFFu, .width = 0xFFFFFFFFu, .jump_at = 0xFFFFFFFFu}};     /* down */
    for (size_t k = 0u; k < (sizeof liars / sizeof liars[0]); k++) {
        fault_port = liars[k];
        fly_with_counter(100000u);
        TEST_ASSERT_EQUAL_UINT32(0u, ft_health(t.f).overruns);
        ut_arenas_end();
    }
}

void test_T3_no_counter_turns_the_budget_off_and_says_so(void)
{
    fault_port.mask = 0u;
    fly_with_counter(1u);
    const pfl_health_t h = ft_health(t.f);
    TEST_ASSERT_FALSE(h.counter_usable);
    TEST_ASSERT_TRUE((h.fault & PFL_FAULT_PORT) != 0u);
}

/* ---- B1, B2 ------------------------------------------------------------------------------------------------------- */

void test_B1_a_budget_that_ends_at_any_batch_leaves_the_posterior_or_defers(void)
{
    uint32_t refused = 0u;
    uint32_t deferred = 0u;
    uint32_t fused = 0u;
    for (uint32_t budget = 10u; budget <= 400u; budget += 5u) {
        const float z = 0.2f;
        fault_port_reset();
        ft_configure(&t);
        t.config.budget_cycles = budget;
        t.config.ess_ratio = 1.0f;
        ft_start(&t);
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(t.f, FT_STEP_US, NULL));
        const unsigned char *before = ut_snapshot(t.f);
        const uint32_t start = fault_port.count;
        const pfl_status_t status = pfl_update(t.f, 0u, FT_STEP_US, &z);
        refused += (status == PFL_ERR_BUDGET) ? 1u : 0u;
        deferred += (status == PFL_DEFERRED) ? 1u : 0u;
        fused += (status == PFL_OK) ? 1u : 0u;
        if (status == PFL_ERR_BUDGET) {
            TEST_ASSERT_TRUE(ut_same_posterior(before, ut_snapshot(t.f), pfl_snapshot_bytes(t.f)));
            TEST_ASSERT_TRUE((fault_port.count - start) <= (budget + 40u)); /* a batch more, and the end of the call */
        }
        TEST_ASSERT_TRUE((status == PFL_OK) || (ft_health(t.f).overruns == 1u));
        (void)ft_finite_mean(t.f);
        TEST_ASSERT_TRUE(pfl_invariants_hold(t.f));
        ut_arenas_end();
    }
    TEST_ASSERT_TRUE((refused > 0u) && (deferred > 0u) && (fused > 0u));
}

static uint32_t slowness;

static void slow_loglik(void *user, const void *z, const pfl_view_t *p, float *ll)
{
    fault_port.count += slowness;
    ut_linear_loglik(user, z, p, ll);
}

void test_B2_slow_callbacks_cost_their_cycle_only(void)
{
    static const uint32_t slow[3] = {1200u, 3000u, 1000000u};
    ft_configure(&t);
    t.sensors[0].loglik = slow_loglik;
    t.config.budget_cycles = 1000u;
    slowness = 300u;
    ft_start(&t);
    ft_cycles(&t, 20u, 0.0f);
    TEST_ASSERT_EQUAL_UINT32(0u, ft_health(t.f).overruns);
    for (uint32_t k = 0u; k < 3u; k++) {
        slowness = slow[k];
        (void)ft_cycle(&t, 0.0f);
        TEST_ASSERT_EQUAL_UINT32(k + 1u, ft_health(t.f).overruns);
        slowness = 300u;
        TEST_ASSERT_EQUAL_INT(PFL_OK, ft_cycle(&t, 0.0f));
        TEST_ASSERT_EQUAL_UINT32(k + 1u, ft_health(t.f).overruns);
        (void)ft_finite_mean(t.f);
    }
}
