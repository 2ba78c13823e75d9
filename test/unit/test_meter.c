/* The library against a mock of the port: budgets that run out anywhere, counters that lie, and the fault hook. */
#include "support.h"

#include "Mockport.h"
#include "unity.h"

#include <stdio.h>
#include <string.h>

#define N 400u /* four batches */
#define BUDGET 1000u

/* The counter: moves by `stride` at each read, and by `jump` more at read number `jump_at`. */
static uint32_t now;
static uint32_t stride;
static uint32_t width_mask;
static uint32_t jump;
static uint32_t jump_at;
static uint32_t reads;
static bool healthy;

static uint32_t faults;
static int32_t last_fault;
static uint32_t weighed; /* batches */
static uint32_t weighed_at_jump;

static uint32_t read_counter(int calls)
{
    (void)calls;
    reads++;
    now += stride;
    if (reads == jump_at) {
        now += jump;
        weighed_at_jump = weighed;
    }
    return now & width_mask;
}

static uint32_t read_mask(int calls)
{
    (void)calls;
    return width_mask;
}

static bool report_health(int calls)
{
    (void)calls;
    return healthy;
}

static void note_fault(int32_t status, int calls)
{
    (void)calls;
    last_fault = status;
    faults++;
}

void setUp(void)
{
    now = 0u;
    stride = 0u;
    width_mask = 0xFFFFFFFFu;
    jump = 0u;
    jump_at = 0u;
    reads = 0u;
    healthy = true;
    faults = 0u;
    weighed = 0u;
    pfl_port_cycles_Stub(read_counter);
    pfl_port_cycles_mask_Stub(read_mask);
    pfl_port_self_test_Stub(report_health);
    pfl_port_fault_Stub(note_fault);
}

void tearDown(void)
{
    ut_arenas_end();
}

/* ---- Helpers ---------------------------------------------------------------------------------------------------------------- */

static void counted_loglik(void *user, const void *z, const pfl_view_t *p, float *ll)
{
    weighed++;
    ut_linear_loglik(user, z, p, ll);
}

static pfl_config_t budgeted(uint32_t budget, float ess_ratio)
{
    static const pfl_sensor_t sensor = {.loglik = counted_loglik};
    pfl_config_t c = ut_linear_config(N);
    c.budget_cycles = budget;
    c.ess_ratio = ess_ratio;
    c.sensors = &sensor;
    return c;
}

static pfl_health_t health_of(const pfl_t *f)
{
    pfl_health_t h;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_health(f, &h));
    return h;
}

/* The counter leaps by `by` at the k-th read from now. */
static void leap(uint32_t k, uint32_t by)
{
    reads = 0u;
    jump_at = k;
    jump = by;
}

static const float measured = 1.2f;

static pfl_t *ready(const pfl_config_t *c)
{
    pfl_t *f = ut_filter(c);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(f, 100000u, NULL));
    return f;
}

/* ---- Budget ----------------------------------------------------------------------------------------------------------------- */

void test_a_budget_spent_before_the_measurement_is_in_leaves_the_posterior(void)
{
    const pfl_config_t c = budgeted(BUDGET, 1.0f);
    pfl_t *f = ready(&c);
    const unsigned char *before = ut_snapshot(f);
    leap(2u, BUDGET + 1u);
    TEST_ASSERT_EQUAL_INT(PFL_ERR_BUDGET, pfl_update(f, 0u, 100000u, &measured));
    TEST_ASSERT_TRUE(ut_same_posterior(before, ut_snapshot(f), pfl_snapshot_bytes(f)));
    TEST_ASSERT_EQUAL_UINT32(0u, health_of(f).fused);
    TEST_ASSERT_EQUAL_UINT32(1u, health_of(f).overruns);
    TEST_ASSERT_EQUAL_UINT32(1u, faults);
    TEST_ASSERT_EQUAL_INT32(PFL_ERR_BUDGET, last_fault);
    TEST_ASSERT_TRUE(pfl_invariants_hold(f));
    jump_at = 0u;
    (void)ut_fly_linear(f, 200000u, 0.0f, 0u); /* the next cycle has a budget of its own */
    TEST_ASSERT_EQUAL_UINT32(1u, health_of(f).overruns);
}

void test_a_budget_just_met_is_no_overrun(void)
{
    const pfl_config_t c = budgeted(BUDGET, 1.0f);
    pfl_t *f = ready(&c);
    leap(2u, BUDGET);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(f, 0u, 100000u, &measured));
    TEST_ASSERT_EQUAL_UINT32(0u, health_of(f).overruns);
    TEST_ASSERT_EQUAL_UINT32(BUDGET, health_of(f).cycles_last);
}

/* What must hold when the budget runs out at the k-th read of an update. */
static pfl_status_t cut_at(uint32_t k, const pfl_config_t *c, const float *mean, const unsigned char *caught_up)
{
    char text[48];
    float got[2];
    pfl_t *f = ready(c);
    const size_t bytes = pfl_snapshot_bytes(f);
    const unsigned char *before = ut_snapshot(f);
    weighed = 0u;
    faults = 0u;
    leap(k, BUDGET + 1u);
    const pfl_status_t status = pfl_update(f, 0u, 100000u, &measured);
    jump_at = 0u;
    (void)snprintf(text, sizeof text, "budget spent at read %lu", (unsigned long)k);
    TEST_ASSERT_EQUAL_UINT32_MESSAGE(1u, health_of(f).overruns, text);
    if (status == PFL_ERR_BUDGET) {
        TEST_ASSERT_TRUE_MESSAGE(ut_same_posterior(before, ut_snapshot(f), bytes), text);
        TEST_ASSERT_EQUAL_UINT32_MESSAGE(weighed_at_jump, weighed, text); /* not a batch more */
        TEST_ASSERT_EQUAL_UINT32_MESSAGE(1u, faults, text);
        return status;
    }
    TEST_ASSERT_TRUE_MESSAGE((status == PFL_OK) || (status == PFL_DEFERRED), text);
    TEST_ASSERT_EQUAL_UINT32_MESSAGE(1u, health_of(f).fused, text);
    if ((k & 1u) != 0u) { /* the estimate, asked for or not, does not change what follows */
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(f, got, NULL));
        TEST_ASSERT_EQUAL_MEMORY_MESSAGE(mean, got, sizeof got, text);
    }
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(f, 200000u, NULL));
    TEST_ASSERT_EQUAL_UINT32_MESSAGE(1u, health_of(f).resampled, text);
    TEST_ASSERT_TRUE_MESSAGE(ut_same_posterior(caught_up, ut_snapshot(f), bytes), text);
    return status;
}

static void cut_everywhere(uint32_t circular_mask)
{
    float mean[2];
    uint32_t refused = 0u;
    uint32_t deferred = 0u;
    pfl_config_t c = budgeted(BUDGET, 1.0f);
    c.circular_mask = circular_mask;
    c.circular = pfl_circular_means;
    jump_at = 0u;
    pfl_t *calm = ready(&c);
    reads = 0u;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(calm, 0u, 100000u, &measured));
    const uint32_t last = reads;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(calm, mean, NULL));
    TEST_ASSERT_EQUAL_UINT32(1u, health_of(calm).resampled);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(calm, 200000u, NULL));
    const unsigned char *caught_up = ut_snapshot(calm);
    TEST_ASSERT_TRUE(last >= 8u);
    for (uint32_t k = 2u; k <= last; k++) { /* the first read only starts the clock */
        const pfl_status_t status = cut_at(k, &c, mean, caught_up);
        refused += (status == PFL_ERR_BUDGET) ? 1u : 0u;
        deferred += (status == PFL_DEFERRED) ? 1u : 0u;
    }
    TEST_ASSERT_EQUAL_UINT32(4u, refused); /* before each of four batches */
    TEST_ASSERT_TRUE(deferred >= 5u);      /* at each batch of the moments, and before resampling */
}

void test_a_budget_spent_at_any_batch_either_refuses_or_defers(void)
{
    cut_everywhere(0u);
}

/* Angles need a sweep of their own before the rest. */
void test_a_budget_spent_at_any_batch_of_angles_either_refuses_or_defers(void)
{
    cut_everywhere(2u);
}

void test_what_was_put_off_is_caught_up_without_resampling_where_that_is_not_due(void)
{
    const pfl_config_t c = budgeted(BUDGET, 0.0f);
    pfl_t *calm = ready(&c);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(calm, 0u, 100000u, &measured));
    pfl_t *f = ready(&c);
    leap(7u, BUDGET + 1u);
    TEST_ASSERT_EQUAL_INT(PFL_DEFERRED, pfl_update(f, 0u, 100000u, &measured));
    TEST_ASSERT_TRUE((health_of(f).mode & PFL_MODE_PENDING) != 0u);
    jump_at = 0u;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(calm, 200000u, NULL));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(f, 200000u, NULL));
    TEST_ASSERT_EQUAL_UINT32(0u, health_of(f).mode & PFL_MODE_PENDING);
    TEST_ASSERT_EQUAL_UINT32(0u, health_of(f).resampled);
    TEST_ASSERT_TRUE(ut_same_posterior(ut_snapshot(calm), ut_snapshot(f), pfl_snapshot_bytes(f)));
}

/* Fewer particles than the first group of a predict. */
void test_a_small_cloud_catches_up_like_a_large_one(void)
{
    pfl_config_t c = budgeted(BUDGET, 1.0f);
    c.particles = 5u;
    pfl_t *calm = ready(&c);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(calm, 0u, 100000u, &measured));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(calm, 200000u, NULL));
    pfl_t *f = ready(&c);
    leap(3u, BUDGET + 1u);
    TEST_ASSERT_EQUAL_INT(PFL_DEFERRED, pfl_update(f, 0u, 100000u, &measured));
    jump_at = 0u;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(f, 200000u, NULL));
    TEST_ASSERT_EQUAL_UINT32(1u, health_of(f).resampled);
    TEST_ASSERT_TRUE(ut_same_posterior(ut_snapshot(calm), ut_snapshot(f), pfl_snapshot_bytes(f)));
}

/* A second measurement after a deferral waits for the next cycle, and nothing is lost. */
void test_a_second_update_in_a_spent_cycle_is_refused_unchanged(void)
{
    const pfl_config_t c = budgeted(BUDGET, 1.0f);
    pfl_t *f = ready(&c);
    leap(7u, BUDGET + 1u);
    TEST_ASSERT_EQUAL_INT(PFL_DEFERRED, pfl_update(f, 0u, 100000u, &measured));
    const unsigned char *before = ut_snapshot(f);
    TEST_ASSERT_EQUAL_INT(PFL_ERR_BUDGET, pfl_update(f, 0u, 100000u, &measured));
    TEST_ASSERT_TRUE(ut_same_posterior(before, ut_snapshot(f), pfl_snapshot_bytes(f)));
    TEST_ASSERT_EQUAL_UINT32(1u, health_of(f).overruns); /* once a cycle */
}

static bool spoil;

static void spoiled_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    ut_linear_predict(user, u, dt_s, p);
    for (uint32_t i = 0u; spoil && (i < p->n); i++) {
        PFL_STATE(p, 0)[i] = ut_nan(false);
    }
}

/* "PFL_ERR_NONFINITE ...: undone, nothing changed" - also when the predict began with what was put off. */
void test_a_failed_predict_after_a_deferral_changes_nothing(void)
{
    pfl_config_t c = budgeted(BUDGET, 1.0f);
    c.predict = spoiled_predict;
    spoil = false;
    pfl_t *f = ready(&c);
    leap(7u, BUDGET + 1u);
    TEST_ASSERT_EQUAL_INT(PFL_DEFERRED, pfl_update(f, 0u, 100000u, &measured));
    jump_at = 0u;
    const unsigned char *before = ut_snapshot(f);
    spoil = true;
    TEST_ASSERT_EQUAL_INT(PFL_ERR_NONFINITE, pfl_predict(f, 200000u, NULL));
    spoil = false;
    TEST_ASSERT_TRUE(ut_same_posterior(before, ut_snapshot(f), pfl_snapshot_bytes(f)));
}

void test_predict_runs_to_its_end_whatever_the_budget(void)
{
    pfl_view_t spent;
    pfl_view_t calm;
    const pfl_config_t c = budgeted(1u, 0.5f);
    pfl_t *f = ut_filter(&c);
    stride = 100u;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(f, 100000u, NULL));
    TEST_ASSERT_EQUAL_UINT32(1u, health_of(f).overruns);
    stride = 0u;
    pfl_t *g = ready(&c);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_particles(f, &spent, NULL));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_particles(g, &calm, NULL));
    TEST_ASSERT_EQUAL_MEMORY(calm.x, spent.x, sizeof(float) * N);
}

void test_without_a_budget_nothing_is_cut(void)
{
    const pfl_config_t c = budgeted(0u, 0.5f);
    pfl_t *f = ut_filter(&c);
    stride = 0x10000000u;
    (void)ut_fly_linear(f, 100000u, 0.0f, 0u);
    TEST_ASSERT_EQUAL_UINT32(0u, health_of(f).overruns);
    TEST_ASSERT_TRUE(health_of(f).cycles_last > 0u);
}

/* ---- Counters ----------------------------------------------------------------------------------------------------------------- */

void test_cycles_of_a_cycle_are_counted(void)
{
    const pfl_config_t c = budgeted(0u, 1.0f);
    pfl_t *f = ut_filter(&c);
    TEST_ASSERT_TRUE(health_of(f).counter_usable);
    stride = 10u;
    reads = 0u;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(f, 100000u, NULL));
    TEST_ASSERT_EQUAL_UINT32(10u * (reads - 1u), health_of(f).cycles_last);
    const uint32_t predicted = health_of(f).cycles_last;
    reads = 0u;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(f, 0u, 100000u, &measured));
    TEST_ASSERT_EQUAL_UINT32(predicted + (10u * (reads - 1u)), health_of(f).cycles_last);
    TEST_ASSERT_EQUAL_UINT32(10u, health_of(f).cycles_resample); /* from its start to its end */
    TEST_ASSERT_TRUE(health_of(f).cycles_resample < health_of(f).cycles_last);
    TEST_ASSERT_EQUAL_UINT32(health_of(f).cycles_last, health_of(f).cycles_max);
    const uint32_t most = health_of(f).cycles_max;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(f, 200000u, NULL));
    TEST_ASSERT_TRUE(health_of(f).cycles_last < most); /* a new cycle begins */
    TEST_ASSERT_EQUAL_UINT32(0u, health_of(f).cycles_resample);
    TEST_ASSERT_EQUAL_UINT32(most, health_of(f).cycles_max);
}

/* "largest cycles_last so far", with a budget too. */
void test_cycles_max_is_never_below_cycles_last(void)
{
    const pfl_config_t c = budgeted(1000000u, 1.0f);
    pfl_t *f = ut_filter(&c);
    stride = 10u;
    for (uint32_t k = 1u; k <= 5u; k++) {
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(f, k * 100000u, NULL));
        TEST_ASSERT_GREATER_OR_EQUAL_UINT32(health_of(f).cycles_last, health_of(f).cycles_max);
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(f, 0u, k * 100000u, &measured));
        TEST_ASSERT_GREATER_OR_EQUAL_UINT32(health_of(f).cycles_last, health_of(f).cycles_max);
    }
}

void test_a_stuck_counter_neither_hangs_nor_overruns(void)
{
    static const uint32_t values[] = {0u, 7u, 0xFFFFFFFFu};
    for (size_t k = 0u; k < 3u; k++) {
        const pfl_config_t c = budgeted(1u, 1.0f);
        now = values[k];
        pfl_t *f = ut_filter(&c);
        for (uint32_t step = 1u; step <= 10u; step++) {
            (void)ut_fly_linear(f, step * 100000u, 0.0f, 0u);
        }
        TEST_ASSERT_EQUAL_UINT32(0u, health_of(f).overruns);
        TEST_ASSERT_EQUAL_UINT32(0u, health_of(f).cycles_last + health_of(f).cycles_max);
    }
}

static uint32_t elapsed_from(uint32_t start, uint32_t mask)
{
    const pfl_config_t c = budgeted(500u, 1.0f);
    width_mask = mask;
    now = start;
    stride = 13u;
    pfl_t *f = ut_filter(&c);
    now = start;
    (void)ut_fly_linear(f, 100000u, 0.0f, 0u);
    TEST_ASSERT_EQUAL_UINT32(0u, health_of(f).overruns);
    return health_of(f).cycles_last;
}

void test_a_wrapping_counter_gives_the_same_cycles_at_24_and_32_bits(void)
{
    static const uint32_t masks[] = {0x00FFFFFFu, 0xFFFFFFFFu};
    for (size_t k = 0u; k < 2u; k++) {
        const uint32_t plain = elapsed_from(0u, masks[k]);
        TEST_ASSERT_TRUE(plain > 0u);
        for (uint32_t before = 0u; before <= plain; before++) { /* wraps at every place of the cycle */
            TEST_ASSERT_EQUAL_UINT32(plain, elapsed_from(masks[k] - before, masks[k]));
            ut_arenas_end();
        }
    }
}

/* A cycle longer than 2^32 counts reads as the longest there is. */
void test_cycles_stay_at_the_end_of_their_range(void)
{
    const float z = 0.0f;
    pfl_health_t health;
    pfl_config_t c = ut_linear_config(N);
    c.budget_cycles = UINT32_MAX - 1u;
    pfl_t *f = ut_filter(&c);
    stride = 0x7FFFFFFFu;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(f, 100000u, NULL));
    (void)pfl_update(f, 0u, 100000u, &z);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_health(f, &health));
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX, health.cycles_last);
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX, health.cycles_max);
    TEST_ASSERT_EQUAL_UINT32(1u, health.overruns);
}

void test_a_counter_that_jumps_back_counts_nothing_for_it(void)
{
    const pfl_config_t c = budgeted(BUDGET, 1.0f);
    stride = 5u;
    pfl_t *calm = ut_filter(&c);
    reads = 0u;
    (void)ut_fly_linear(calm, 100000u, 0.0f, 0u);
    const uint32_t last = reads;
    const uint32_t plain = health_of(calm).cycles_last;
    for (uint32_t k = 1u; k <= last; k++) {
        for (uint32_t w = 0u; w < 2u; w++) {
            width_mask = (w == 0u) ? 0x00FFFFFFu : 0xFFFFFFFFu;
            now = 12345u;
            pfl_t *f = ut_filter(&c);
            leap(k, 0u - 3000u);
            (void)ut_fly_linear(f, 100000u, 0.0f, 0u);
            TEST_ASSERT_EQUAL_UINT32(0u, health_of(f).overruns);
            TEST_ASSERT_TRUE(health_of(f).cycles_last <= plain);
            TEST_ASSERT_TRUE(health_of(f).cycles_max <= plain);
            ut_arenas_end();
        }
    }
}

static void flies_without_counter(void)
{
    const pfl_config_t c = budgeted(1u, 1.0f);
    stride = 1000u;
    pfl_t *f = ut_filter(&c);
    reads = 0u;
    (void)ut_fly_linear(f, 100000u, 0.0f, 0u);
    TEST_ASSERT_FALSE(health_of(f).counter_usable);
    TEST_ASSERT_EQUAL_UINT32(0u, health_of(f).overruns);
    TEST_ASSERT_EQUAL_UINT32(0u, health_of(f).cycles_last + health_of(f).cycles_max + health_of(f).cycles_resample);
    TEST_ASSERT_EQUAL_UINT32(0u, reads);
}

void test_a_failed_self_test_switches_times_and_budgets_off(void)
{
    healthy = false;
    flies_without_counter();
}

void test_a_mask_of_zero_switches_times_and_budgets_off(void)
{
    width_mask = 0u;
    flies_without_counter();
}

void test_the_counter_does_not_change_the_results(void)
{
    uint64_t hash[2];
    for (uint32_t k = 0u; k < 2u; k++) {
        const pfl_config_t c = budgeted((k == 0u) ? 0u : 100000u, 0.5f);
        stride = (k == 0u) ? 0u : 3u;
        pfl_t *f = ut_filter(&c);
        hash[k] = UT_FNV_SEED;
        for (uint32_t step = 1u; step <= 20u; step++) {
            hash[k] = ut_fly_linear(f, step * 100000u, 0.3f, hash[k]);
        }
    }
    TEST_ASSERT_TRUE(hash[0] == hash[1]);
}

/* ---- Fault hook ---------------------------------------------------------------------------------------------------------------- */

static float dictated[N];

static void hooked_once(pfl_status_t expected, pfl_status_t got)
{
    TEST_ASSERT_EQUAL_INT(expected, got);
    TEST_ASSERT_EQUAL_UINT32(1u, faults);
    TEST_ASSERT_EQUAL_INT32(expected, last_fault);
    faults = 0u;
}

static void huge_draw(void *user, const pfl_batch_t *p)
{
    for (uint32_t i = 0u; i < p->n; i++) {
        PFL_STATE(p, 0)[i] = *(const float *)user * (((i & 1u) != 0u) ? 1.0f : -1.0f);
    }
}

void test_each_fault_calls_the_hook_once_with_its_status(void)
{
    float scale = 3.0e38f;
    float mean[2];
    pfl_config_t c = ut_dictated_config(N, 1u);
    memset(dictated, 0, sizeof dictated);
    pfl_t *f = ut_filter(&c);
    dictated[150] = ut_nan(true);
    hooked_once(PFL_ERR_NONFINITE, pfl_update(f, 0u, 0u, dictated));
    dictated[150] = 1.0f;
    hooked_once(PFL_ERR_LOGLIK, pfl_update(f, 0u, 0u, dictated));

    pfl_config_t spoiled = budgeted(0u, 0.5f);
    spoiled.predict = spoiled_predict;
    spoil = false;
    f = ready(&spoiled);
    spoil = true;
    hooked_once(PFL_ERR_NONFINITE, pfl_predict(f, 200000u, NULL));
    spoil = false;

    c.draw = huge_draw;
    c.user = &scale;
    f = ut_filter(&c);
    hooked_once(PFL_ERR_NONFINITE, pfl_estimate(f, mean, NULL));
    scale = ut_infinity();
    hooked_once(PFL_ERR_NONFINITE, pfl_reset(f, 0u));
    size_t bytes = 0u;
    void *arena = ut_arena_for(&c, &bytes);
    hooked_once(PFL_ERR_NONFINITE, pfl_init(arena, bytes, &c, 0u, &f));
}

void test_refusals_that_are_no_faults_do_not_call_the_hook(void)
{
    const pfl_config_t c = budgeted(0u, 0.5f);
    pfl_t *f = ready(&c);
    TEST_ASSERT_EQUAL_INT(PFL_ERR_TIME, pfl_predict(f, 0u, NULL));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_SENSOR, pfl_update(f, 9u, 100000u, &measured));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_update(f, 0u, 100000u, NULL));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(f, 0u, 100000u, &measured));
    TEST_ASSERT_EQUAL_UINT32(0u, faults);
}

/* ---- A watch and its budget ------------------------------------------------------------------------------------------------- */

/* Moments that were put off say nothing about the width of the cloud: the mode stays, and so does the phase. */
void test_deferred_moments_leave_the_verdict_on_the_width(void)
{
    static const float narrow[2] = {1.0e-6f, 1.0e-6f};
    static const pfl_watch_t watch = {.keep = pfl_watch_keep, .ok_sigma = narrow};
    pfl_config_t c = budgeted(BUDGET, 1.0f);
    c.watch = &watch;
    pfl_t *f = ready(&c);
    leap(7u, BUDGET + 1u);
    TEST_ASSERT_EQUAL_INT(PFL_DEFERRED, pfl_update(f, 0u, 100000u, &measured));
    TEST_ASSERT_EQUAL_UINT32(0u, health_of(f).mode & PFL_MODE_WIDE);
    jump_at = 0u;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(f, 200000u, NULL));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(f, 0u, 200000u, &measured));
    TEST_ASSERT_TRUE((health_of(f).mode & PFL_MODE_WIDE) != 0u);
}

/* The overrun of a cycle in which everything else is well. */
void test_an_overrun_degrades(void)
{
    static const pfl_watch_t watch = {.keep = pfl_watch_keep};
    pfl_config_t c = budgeted(BUDGET, 1.0f);
    c.watch = &watch;
    pfl_t *f = ut_filter(&c);
    uint64_t t_us = 0u;
    for (uint32_t k = 0u; k < 12u; k++) {
        t_us += 100000u;
        (void)ut_fly_linear(f, t_us, 0.0f, 0u);
    }
    TEST_ASSERT_EQUAL_INT(PFL_PHASE_TRACKING, health_of(f).phase);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(f, t_us + 100000u, NULL));
    leap(7u, BUDGET + 1u);
    TEST_ASSERT_EQUAL_INT(PFL_DEFERRED, pfl_update(f, 0u, t_us + 100000u, &measured));
    TEST_ASSERT_EQUAL_INT(PFL_PHASE_DEGRADED, health_of(f).phase);
    TEST_ASSERT_EQUAL_UINT32(0u, health_of(f).fault);
}
