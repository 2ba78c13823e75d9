/* Predict and update: time rules, callbacks that misbehave, fusion, re-entrancy, and that a refusal changes nothing. */
#include "support.h"

#include "unity.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define N 140u

static float ll[300];
static uint32_t faults;
static int32_t last_fault;

/* Replaces the weak hook of port/null. */
void pfl_port_fault(int32_t status)
{
    last_fault = status;
    faults++;
}

void setUp(void)
{
    memset(ll, 0, sizeof ll);
    faults = 0u;
    last_fault = 0;
}

void tearDown(void)
{
    ut_arenas_end();
}

/* ---- Helpers ------------------------------------------------------------------------------------------------------ */

/* The call gave `expected` and left the posterior as in `before`, to the bit. */
static void unchanged_after(pfl_status_t expected, pfl_status_t got, pfl_t *f, const unsigned char *before)
{
    const size_t bytes = pfl_snapshot_bytes(f);
    TEST_ASSERT_EQUAL_INT(expected, got);
    TEST_ASSERT_TRUE_MESSAGE(ut_same_posterior(before, ut_snapshot(f), bytes), pfl_status_string(expected));
    TEST_ASSERT_TRUE(pfl_invariants_hold(f));
}

static pfl_health_t health_of(const pfl_t *f)
{
    pfl_health_t h;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_health(f, &h));
    return h;
}

/* A linear filter after some cycles. */
static pfl_t *flown(const pfl_config_t *c)
{
    pfl_t *f = ut_filter(c);
    for (uint32_t k = 1u; k <= 3u; k++) {
        (void)ut_fly_linear(f, k * 100000u, 0.1f * (float)k, 0u);
    }
    return f;
}

/* ---- Time --------------------------------------------------------------------------------------------------------- */

typedef struct {
    uint32_t calls;
    uint32_t steps; /* calls for the first particle */
    uint64_t us;    /* sum of their dt */
    float longest_s;
    const void *u;
} watch_t;

static void watching_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    watch_t *w = (watch_t *)user;
    w->calls++;
    w->u = u;
    if (p->first == 0u) {
        w->steps++;
        w->us += (uint64_t)llround((double)dt_s * 1.0e6);
        w->longest_s = (dt_s > w->longest_s) ? dt_s : w->longest_s;
    }
}

static pfl_config_t watched(watch_t *w, uint32_t dt_max_us)
{
    pfl_config_t c = ut_dictated_config(N, 1u);
    memset(w, 0, sizeof *w);
    c.predict = watching_predict;
    c.user = w;
    c.dt_max_us = dt_max_us;
    return c;
}

void test_predict_moves_the_time_and_hands_over_the_input(void)
{
    watch_t w;
    const pfl_config_t c = watched(&w, 0u);
    pfl_t *f = ut_filter(&c);
    const int input = 3;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(f, 250000u, &input));
    TEST_ASSERT_TRUE(w.u == &input);
    TEST_ASSERT_EQUAL_UINT32(1u, w.steps);
    TEST_ASSERT_TRUE(w.us == 250000u);
    TEST_ASSERT_TRUE(health_of(f).t_us == 250000u);
}

void test_equal_time_is_a_no_op(void)
{
    watch_t w;
    const pfl_config_t c = watched(&w, 0u);
    pfl_t *f = ut_filter(&c);
    const unsigned char *before = ut_snapshot(f);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(f, 0u, NULL));
    TEST_ASSERT_EQUAL_UINT32(0u, w.calls);
    TEST_ASSERT_TRUE(ut_same_bytes(before, ut_snapshot(f), pfl_snapshot_bytes(f)));
}

void test_time_before_the_filter_is_refused(void)
{
    const pfl_config_t c = ut_linear_config(N);
    pfl_t *f = flown(&c);
    const unsigned char *before = ut_snapshot(f);
    unchanged_after(PFL_ERR_TIME, pfl_predict(f, 299999u, NULL), f, before);
    unchanged_after(PFL_ERR_TIME, pfl_predict(f, 0u, NULL), f, before);
}

void test_update_at_another_time_is_refused(void)
{
    const float z = 0.0f;
    const pfl_config_t c = ut_linear_config(N);
    pfl_t *f = flown(&c);
    const unsigned char *before = ut_snapshot(f);
    unchanged_after(PFL_ERR_TIME, pfl_update(f, 0u, 299999u, &z), f, before);
    unchanged_after(PFL_ERR_TIME, pfl_update(f, 0u, 300001u, &z), f, before);
    unchanged_after(PFL_ERR_TIME, pfl_update(f, 0u, UINT64_MAX, &z), f, before);
}

void test_long_steps_are_cut_and_their_sum_is_exact(void)
{
    static const uint32_t steps_us[] = {1u,     9999u,  10000u,  10001u,  19999u,  20000u,
                                        20001u, 33333u, 100003u, 123457u, 159999u, 160000u};
    for (size_t k = 0u; k < (sizeof steps_us / sizeof steps_us[0]); k++) {
        watch_t w;
        const pfl_config_t c = watched(&w, 10000u);
        pfl_t *f = ut_filter(&c);
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(f, steps_us[k], NULL));
        TEST_ASSERT_EQUAL_UINT32((steps_us[k] + 9999u) / 10000u, w.steps);
        TEST_ASSERT_TRUE(w.us == steps_us[k]);
        TEST_ASSERT_TRUE((double)w.longest_s <= 0.01000001);
        TEST_ASSERT_TRUE(health_of(f).t_us == steps_us[k]);
    }
}

void test_a_gap_beyond_sixteen_pieces_is_refused(void)
{
    watch_t w;
    const pfl_config_t c = watched(&w, 10000u);
    pfl_t *f = ut_filter(&c);
    const unsigned char *before = ut_snapshot(f);
    unchanged_after(PFL_ERR_GAP, pfl_predict(f, (PFL_SUBSTEPS_MAX * 10000u) + 1u, NULL), f, before);
    unchanged_after(PFL_ERR_GAP, pfl_predict(f, 0x100000000u, NULL), f, before);
    unchanged_after(PFL_ERR_GAP, pfl_predict(f, UINT64_MAX, NULL), f, before);
    TEST_ASSERT_EQUAL_UINT32(0u, w.calls);
}

void test_without_dt_max_a_step_may_last_71_minutes(void)
{
    watch_t w;
    const pfl_config_t c = watched(&w, 0u);
    pfl_t *f = ut_filter(&c);
    TEST_ASSERT_EQUAL_INT(PFL_ERR_GAP, pfl_predict(f, 0x100000000u, NULL));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(f, 0xFFFFFFFFu, NULL));
    TEST_ASSERT_EQUAL_UINT32(1u, w.steps);
}

void test_time_near_its_end_works(void)
{
    pfl_config_t c = ut_linear_config(N);
    size_t bytes = 0u;
    void *arena = ut_arena_for(&c, &bytes);
    pfl_t *f = NULL;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_init(arena, bytes, &c, UINT64_MAX - 1000u, &f));
    (void)ut_fly_linear(f, UINT64_MAX, 0.0f, 0u);
    TEST_ASSERT_EQUAL_INT(PFL_ERR_TIME, pfl_predict(f, 0u, NULL)); /* time never wraps */
}

static void counting_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    uint32_t *next = (uint32_t *)user;
    (void)u;
    (void)dt_s;
    TEST_ASSERT_EQUAL_UINT32((p->first == 0u) ? 0u : *next, p->first);
    TEST_ASSERT_TRUE((p->n >= 1u) && (p->n <= PFL_BATCH));
    *next = p->first + p->n;
}

void test_every_particle_is_predicted_exactly_once(void)
{
    for (uint32_t n = 1u; n <= 200u; n++) {
        uint32_t next = 0u;
        pfl_config_t c = ut_dictated_config(n, 1u);
        c.predict = counting_predict;
        c.user = &next;
        pfl_t *f = ut_filter(&c);
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(f, 5u, NULL));
        TEST_ASSERT_EQUAL_UINT32(n, next);
    }
}

/* ---- Arguments ---------------------------------------------------------------------------------------------------- */

void test_bad_arguments_are_refused(void)
{
    float x[2];
    const float z = 0.0f;
    const pfl_config_t c = ut_linear_config(N);
    pfl_t *f = flown(&c);
    const unsigned char *before = ut_snapshot(f);
    unchanged_after(PFL_ERR_SENSOR, pfl_update(f, 1u, 300000u, &z), f, before);
    unchanged_after(PFL_ERR_SENSOR, pfl_update(f, UINT16_MAX, 300000u, &z), f, before);
    unchanged_after(PFL_ERR_ARG, pfl_update(f, 0u, 300000u, NULL), f, before);
    unchanged_after(PFL_ERR_ARG, pfl_estimate(f, NULL, NULL), f, before);
    unchanged_after(PFL_ERR_ARG, pfl_most_likely(f, NULL), f, before);
    unchanged_after(PFL_ERR_ARG, pfl_particles(f, NULL, ll), f, before);
    unchanged_after(PFL_ERR_ARG, pfl_health(f, NULL), f, before);
    unchanged_after(PFL_ERR_ARG, pfl_quantile(f, 0u, 0.5f, NULL), f, before);
    unchanged_after(PFL_ERR_ARG, pfl_quantile(f, 2u, 0.5f, x), f, before);
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_predict(NULL, 0u, NULL));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_update(NULL, 0u, 0u, &z));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_resample(NULL));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_estimate(NULL, x, NULL));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_most_likely(NULL, x));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_quantile(NULL, 0u, 0.5f, x));
    TEST_ASSERT_FALSE(pfl_invariants_hold(NULL));
    TEST_ASSERT_EQUAL_UINT32(0u, faults);
}

/* ---- Log-likelihoods that are faults -------------------------------------------------------------------------------- */

void test_non_finite_loglik_of_any_particle_is_refused_unchanged(void)
{
    const float bad[] = {ut_nan(false), ut_infinity(), ut_nan(true), ut_float(0x7F800001u), ut_float(0xFFFFFFFFu)};
    for (uint32_t k = 0u; k < N; k++) {
        pfl_config_t c = ut_dictated_config(N, 1u);
        pfl_t *f = ut_filter(&c);
        for (size_t b = 0u; b < (sizeof bad / sizeof bad[0]); b++) {
            for (uint32_t i = 0u; i < N; i++) {
                ll[i] = -0.1f * (float)i;
            }
            const unsigned char *before = ut_snapshot(f);
            const uint32_t faulted = health_of(f).faulted;
            faults = 0u;
            ll[k] = bad[b];
            unchanged_after(PFL_ERR_NONFINITE, pfl_update(f, 0u, 0u, ll), f, before);
            TEST_ASSERT_EQUAL_UINT32(1u, faults);
            TEST_ASSERT_EQUAL_INT32(PFL_ERR_NONFINITE, last_fault);
            TEST_ASSERT_EQUAL_UINT32(faulted + 1u, health_of(f).faulted);
        }
        ut_arenas_end();
    }
}

void test_positive_loglik_of_any_particle_is_refused_unchanged(void)
{
    const float bad[] = {ut_float(ut_bits(PFL_LOGLIK_MAX) + 1u), 0.5f, 3.4e38f};
    pfl_config_t c = ut_dictated_config(N, 1u);
    for (uint32_t k = 0u; k < N; k++) {
        pfl_t *f = ut_filter(&c);
        const unsigned char *before = ut_snapshot(f);
        for (size_t b = 0u; b < (sizeof bad / sizeof bad[0]); b++) {
            ll[k] = bad[b];
            unchanged_after(PFL_ERR_LOGLIK, pfl_update(f, 0u, 0u, ll), f, before);
            TEST_ASSERT_EQUAL_INT32(PFL_ERR_LOGLIK, last_fault);
        }
        ll[k] = 0.0f;
        ut_arenas_end();
    }
}

/* "a value above PFL_LOGLIK_MAX [is] a fault": the slack itself is not. */
void test_loglik_up_to_the_slack_is_accepted(void)
{
    pfl_config_t c = ut_dictated_config(N, 1u);
    pfl_t *f = ut_filter(&c);
    ll[3] = ut_float(ut_bits(PFL_LOGLIK_MAX) - 1u);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(f, 0u, 0u, ll));
    ll[3] = PFL_LOGLIK_MAX;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(f, 0u, 0u, ll));
}

void test_impossible_for_every_particle_is_rejected_unchanged(void)
{
    pfl_config_t c = ut_dictated_config(N, 1u);
    pfl_t *f = ut_filter(&c);
    const unsigned char *before = ut_snapshot(f);
    for (uint32_t i = 0u; i < N; i++) {
        ll[i] = -ut_infinity();
    }
    unchanged_after(PFL_REJECTED, pfl_update(f, 0u, 0u, ll), f, before);
    TEST_ASSERT_EQUAL_UINT32(1u, health_of(f).rejected);
    TEST_ASSERT_EQUAL_UINT32(0u, health_of(f).fused);
    TEST_ASSERT_EQUAL_UINT32(0u, faults);
}

/* Survivors of one update that are all impossible in the next. */
void test_contradicting_measurements_are_rejected_unchanged(void)
{
    pfl_config_t c = ut_dictated_config(N, 1u);
    pfl_t *f = ut_filter(&c);
    for (uint32_t i = 0u; i < N; i++) {
        ll[i] = (i < 10u) ? 0.0f : -ut_infinity();
    }
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(f, 0u, 0u, ll));
    const unsigned char *before = ut_snapshot(f);
    for (uint32_t i = 0u; i < N; i++) {
        ll[i] = (i < 10u) ? -ut_infinity() : 0.0f;
    }
    unchanged_after(PFL_REJECTED, pfl_update(f, 0u, 0u, ll), f, before);
}

void test_impossible_particles_get_no_weight(void)
{
    float mean = 0.0f;
    float weights[N];
    pfl_view_t view;
    pfl_config_t c = ut_dictated_config(N, 1u);
    pfl_t *f = ut_filter(&c);
    for (uint32_t i = 0u; i < N; i++) {
        ll[i] = ((i == 20u) || (i == 30u)) ? -0.5f : -ut_infinity();
    }
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(f, 0u, 0u, ll));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_particles(f, &view, weights));
    for (uint32_t i = 0u; i < N; i++) {
        TEST_ASSERT_EQUAL_INT((i != 20u) && (i != 30u), ut_bits(weights[i]) == 0xFF800000u);
    }
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(f, &mean, NULL));
    TEST_ASSERT_FLOAT_WITHIN(1.0e-5f, 25.0f, mean);
    TEST_ASSERT_FLOAT_WITHIN(1.0e-4f, 2.0f, pfl_effective_sample_size(f));
}

/* No weight means none, however far away the particle is. */
void test_an_impossible_particle_far_away_does_not_move_the_mean(void)
{
    static float x[8] = {1.0f, 1.0f, 1.0f, 1.0f, 1.0f, 1.0f, 1.0f, 1.0e20f};
    const ut_table_t table = {x, 8u, 1u};
    float mean = 0.0f;
    pfl_config_t c = ut_dictated_config(8u, 1u);
    c.moments = (uint16_t)PFL_MOMENTS_MEAN;
    c.draw = ut_table_draw;
    c.user = (void *)(uintptr_t)&table;
    pfl_t *f = ut_filter(&c);
    ll[7] = -ut_infinity();
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(f, 0u, 0u, ll));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(f, &mean, NULL));
    TEST_ASSERT_FLOAT_WITHIN(1.0e-5f, 1.0f, mean);
}

/* ---- Gate --------------------------------------------------------------------------------------------------------- */

static pfl_t *gated(pfl_config_t *c)
{
    static const pfl_sensor_t sensor = {.loglik = ut_dictated_loglik, .gate = 8.0f};
    *c = ut_dictated_config(N, 1u);
    c->sensors = &sensor;
    return ut_filter(c);
}

void test_gate_refuses_beyond_it_and_tells_the_ratio(void)
{
    pfl_config_t c;
    pfl_t *f = gated(&c);
    for (uint32_t i = 0u; i < N; i++) {
        ll[i] = -3.96f - (float)i;
    }
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(f, 0u, 0u, ll));
    TEST_ASSERT_FLOAT_WITHIN(1.0e-3f, 0.99f, health_of(f).test_ratio);
    const unsigned char *before = ut_snapshot(f);
    ll[0] = -4.04f;
    unchanged_after(PFL_REJECTED, pfl_update(f, 0u, 0u, ll), f, before);
    TEST_ASSERT_FLOAT_WITHIN(1.0e-3f, 1.01f, health_of(f).test_ratio);
    ll[0] = 0.0f;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(f, 0u, 0u, ll));
    TEST_ASSERT_FLOAT_WITHIN(1.0e-3f, 0.0f, health_of(f).test_ratio);
    for (uint32_t i = 0u; i < N; i++) {
        ll[i] = -ut_infinity();
    }
    TEST_ASSERT_EQUAL_INT(PFL_REJECTED, pfl_update(f, 0u, 0u, ll));
    TEST_ASSERT_TRUE(ut_finite(health_of(f).test_ratio) && (health_of(f).test_ratio > 1.0f));
    TEST_ASSERT_EQUAL_UINT32(2u, health_of(f).rejected);
    TEST_ASSERT_EQUAL_UINT32(2u, health_of(f).fused);
}

/* -2 times the best log-likelihood equals the gate: the ratio is one to the bit, and within. */
void test_the_gate_itself_is_within(void)
{
    pfl_config_t c;
    pfl_t *f = gated(&c);
    for (uint32_t i = 0u; i < N; i++) {
        ll[i] = -4.0f;
    }
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(f, 0u, 0u, ll));
    TEST_ASSERT_EQUAL_HEX32(ut_bits(1.0f), ut_bits(health_of(f).test_ratio));
}

/* Within the rounding slack a log-likelihood may be positive: its ratio is zero, never negative. */
void test_the_ratio_of_a_match_better_than_perfect_is_zero(void)
{
    pfl_config_t c;
    pfl_t *f = gated(&c);
    for (uint32_t i = 0u; i < N; i++) {
        ll[i] = 0.5f * PFL_LOGLIK_MAX;
    }
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(f, 0u, 0u, ll));
    TEST_ASSERT_EQUAL_HEX32(0u, ut_bits(health_of(f).test_ratio));
}

void test_without_gate_the_ratio_is_zero(void)
{
    pfl_config_t c = ut_dictated_config(N, 1u);
    pfl_t *f = ut_filter(&c);
    for (uint32_t i = 0u; i < N; i++) {
        ll[i] = -1000.0f;
    }
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(f, 0u, 0u, ll));
    TEST_ASSERT_FLOAT_WITHIN(0.0f, 0.0f, health_of(f).test_ratio);
}

/* ---- Models that are faults ----------------------------------------------------------------------------------------- */

typedef struct {
    uint32_t from, to; /* particles that come out bad */
    uint32_t step;     /* in this model step and later ones */
    uint32_t steps;    /* seen so far */
    float bad;
} sabotage_t;

static void sabotaged_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    sabotage_t *s = (sabotage_t *)user;
    ut_linear_predict(NULL, u, dt_s, p);
    s->steps += (p->first == 0u) ? 1u : 0u;
    for (uint32_t i = 0u; i < p->n; i++) {
        const uint32_t k = p->first + i;
        if ((s->steps >= s->step) && (k >= s->from) && (k < s->to)) {
            PFL_STATE(p, k & 1u)[i] = s->bad;
        }
    }
}

static pfl_config_t sabotaged(sabotage_t *s, uint32_t from, uint32_t to, float bad)
{
    pfl_config_t c = ut_linear_config(N);
    memset(s, 0, sizeof *s);
    s->from = from;
    s->to = to;
    s->step = UINT32_MAX;
    s->bad = bad;
    c.predict = sabotaged_predict;
    c.user = s;
    c.ess_ratio = 0.0f;
    return c;
}

void test_a_model_that_gives_nothing_finite_is_undone(void)
{
    const float bad[] = {ut_nan(false), ut_nan(true), ut_infinity(), -ut_infinity()};
    for (size_t b = 0u; b < (sizeof bad / sizeof bad[0]); b++) {
        sabotage_t s;
        const pfl_config_t c = sabotaged(&s, 0u, N, bad[b]);
        pfl_t *f = flown(&c);
        const unsigned char *before = ut_snapshot(f);
        s.step = 0u;
        faults = 0u;
        unchanged_after(PFL_ERR_NONFINITE, pfl_predict(f, 400000u, NULL), f, before);
        TEST_ASSERT_EQUAL_UINT32(1u, faults);
        TEST_ASSERT_EQUAL_INT32(PFL_ERR_NONFINITE, last_fault);
        s.step = UINT32_MAX;
        (void)ut_fly_linear(f, 400000u, 0.0f, 0u); /* and works again afterwards */
    }
}

static void all_finite(pfl_t *f)
{
    pfl_view_t view;
    float mean[2];
    float cov[4];
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_particles(f, &view, NULL));
    for (uint32_t i = 0u; i < view.n; i++) {
        TEST_ASSERT_TRUE(ut_finite(PFL_STATE(&view, 0)[i]) && ut_finite(PFL_STATE(&view, 1)[i]));
    }
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(f, mean, cov));
    TEST_ASSERT_TRUE(ut_finite(mean[0]) && ut_finite(mean[1]) && ut_finite(cov[0]) && ut_finite(cov[3]));
    TEST_ASSERT_TRUE(pfl_invariants_hold(f));
}

void test_any_particle_that_comes_out_non_finite_is_quarantined(void)
{
    const float bad[] = {ut_nan(false), ut_nan(true), ut_infinity(), -ut_infinity()};
    for (uint32_t k = 0u; k < N; k++) {
        float weights[N];
        pfl_view_t view;
        sabotage_t s;
        const pfl_config_t c = sabotaged(&s, k, k + 1u, bad[k % 4u]);
        pfl_t *f = flown(&c);
        s.step = 0u;
        faults = 0u;
        TEST_ASSERT_EQUAL_INT(PFL_QUARANTINED, pfl_predict(f, 400000u, NULL));
        TEST_ASSERT_EQUAL_UINT32(1u, faults);
        TEST_ASSERT_EQUAL_INT32(PFL_QUARANTINED, last_fault);
        TEST_ASSERT_TRUE(health_of(f).t_us == 400000u);
        TEST_ASSERT_EQUAL_UINT32(1u, health_of(f).quarantined);
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_particles(f, &view, weights));
        for (uint32_t i = 0u; i < N; i++) {
            TEST_ASSERT_EQUAL_INT(i == k, ut_bits(weights[i]) == 0xFF800000u);
        }
        all_finite(f);
        s.step = UINT32_MAX;
        (void)ut_fly_linear(f, 500000u, 0.0f, 0u);
        ut_arenas_end();
    }
}

/* The heavy one is lost: what the others weigh among themselves must still count, and the lost one must not. */
void test_losing_the_heaviest_particle_keeps_the_order_of_the_rest(void)
{
    float mean[2];
    float weights[N];
    float top = -1.0e30f;
    pfl_view_t view;
    sabotage_t s;
    pfl_config_t c = sabotaged(&s, 0u, 1u, ut_nan(false));
    const pfl_sensor_t dictated = {.loglik = ut_dictated_loglik};
    c.sensors = &dictated;
    pfl_t *f = ut_filter(&c);
    for (uint32_t i = 0u; i < N; i++) {
        ll[i] = (i == 0u) ? 0.0f : ((i == 5u) ? -60.0f : -90.0f);
    }
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(f, 0u, 0u, ll));
    s.step = 0u;
    TEST_ASSERT_EQUAL_INT(PFL_QUARANTINED, pfl_predict(f, 1000u, NULL));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_particles(f, &view, weights));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(f, mean, NULL));
    TEST_ASSERT_FLOAT_WITHIN(1.0e-4f, view.x[5], mean[0]);
    for (uint32_t i = 0u; i < N; i++) {
        top = (weights[i] > top) ? weights[i] : top;
    }
    TEST_ASSERT_FLOAT_WITHIN(1.0f, 0.0f, top); /* "the largest near 0" */
}

/* All particles come out non-finite, but only in a later piece of a long step. Whatever the answer, a filter whose
 * particles have all lost their weight could never fuse again. */
void test_a_model_that_fails_late_in_a_long_step_leaves_a_filter_that_works(void)
{
    sabotage_t s;
    const float z = 0.0f;
    pfl_config_t c = sabotaged(&s, 0u, N, ut_nan(false));
    c.dt_max_us = 100000u;
    pfl_t *f = flown(&c);
    s.step = s.steps + 3u;
    const pfl_status_t status = pfl_predict(f, 300000u + 400000u, NULL);
    TEST_ASSERT_TRUE((status == PFL_ERR_NONFINITE) || (status == PFL_QUARANTINED));
    all_finite(f);
    s.step = UINT32_MAX;
    const uint64_t t_us = health_of(f).t_us + 100000u;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(f, t_us, NULL));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(f, 0u, t_us, &z));
}

/* One particle had all the weight, and is the one that is lost. */
void test_losing_the_only_weight_leaves_a_filter_that_works(void)
{
    sabotage_t s;
    pfl_config_t c = sabotaged(&s, 9u, 10u, ut_nan(false));
    const pfl_sensor_t dictated = {.loglik = ut_dictated_loglik};
    c.sensors = &dictated;
    pfl_t *f = ut_filter(&c);
    for (uint32_t i = 0u; i < N; i++) {
        ll[i] = (i == 9u) ? 0.0f : -ut_infinity();
    }
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(f, 0u, 0u, ll));
    s.step = 0u;
    TEST_ASSERT_EQUAL_INT(PFL_QUARANTINED, pfl_predict(f, 1000u, NULL));
    all_finite(f);
    memset(ll, 0, sizeof ll);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(f, 0u, 1000u, ll));
}

/* ---- Equal weights -------------------------------------------------------------------------------------------------- */

/* A filter marks them with a flag; one restored from its snapshot holds a column of zeros. Nobody may see which. */
static pfl_t *with_column(const pfl_t *f, const pfl_config_t *c)
{
    pfl_t *g = ut_filter(c);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_restore(g, ut_snapshot(f), pfl_snapshot_bytes(f)));
    return g;
}

static void same_filters(const pfl_t *f, const pfl_t *g)
{
    float of_f[N];
    float of_g[N];
    pfl_view_t view;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_particles(f, &view, of_f));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_particles(g, &view, of_g));
    TEST_ASSERT_EQUAL_MEMORY(of_f, of_g, sizeof of_f);
    TEST_ASSERT_TRUE(ut_same_bytes(ut_snapshot(f), ut_snapshot(g), pfl_snapshot_bytes(f)));
    TEST_ASSERT_TRUE(pfl_invariants_hold(f) && pfl_invariants_hold(g));
}

void test_equal_weights_are_a_column_of_zeros_to_an_update(void)
{
    const float special[] = {0.0f, -ut_infinity(), ut_nan(false), ut_nan(true), ut_infinity(), 0.5f};
    for (uint32_t k = 0u; k < (N * 12u); k++) {
        const pfl_sensor_t sensor = {.loglik = ut_dictated_loglik, .gate = ((k % 2u) != 0u) ? 3.0f : 0.0f};
        pfl_config_t c = ut_dictated_config(N, 2u);
        c.sensors = &sensor;
        c.ess_ratio = 1.0f; /* equal again after every update */
        pfl_t *f = ut_filter(&c);
        for (uint32_t round = 0u; round < 2u; round++) {
            pfl_t *g = with_column(f, &c);
            for (uint32_t i = 0u; i < N; i++) {
                ll[i] = -0.2f - (0.01f * (float)((i * 7u) % N));
            }
            ll[k % N] = special[(k / 2u) % 6u];
            TEST_ASSERT_EQUAL_INT(pfl_update(g, 0u, 0u, ll), pfl_update(f, 0u, 0u, ll));
            TEST_ASSERT_EQUAL_HEX32(ut_bits(health_of(g).test_ratio), ut_bits(health_of(f).test_ratio));
            same_filters(f, g);
        }
        ut_arenas_end();
    }
}

void test_equal_weights_are_a_column_of_zeros_to_what_else_reads_them(void)
{
    for (uint32_t k = 0u; k < N; k++) {
        float value[2];
        sabotage_t s;
        const pfl_config_t c = sabotaged(&s, k, k + 1u, ut_nan(false));
        pfl_t *f = ut_filter(&c);
        pfl_t *g = with_column(f, &c);
        if ((k % 2u) == 0u) {
            TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_quantile(f, 0u, 0.3f, &value[0]));
            TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_quantile(g, 0u, 0.3f, &value[1]));
            TEST_ASSERT_EQUAL_HEX32(ut_bits(value[0]), ut_bits(value[1]));
            TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_resample(f));
            TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_resample(g));
            same_filters(f, g);
        }
        s.step = 0u;
        TEST_ASSERT_EQUAL_INT(PFL_QUARANTINED, pfl_predict(f, 100000u, NULL));
        TEST_ASSERT_EQUAL_INT(PFL_QUARANTINED, pfl_predict(g, 100000u, NULL));
        same_filters(f, g);
        ut_arenas_end();
    }
}

/* ---- Calls from inside callbacks ------------------------------------------------------------------------------------- */

static pfl_t *own;
static pfl_t *other;
static uint32_t self_calls;
static unsigned char scratch[65536];

static void call_everything(void)
{
    float x[4] = {0.0f, 0.0f, 0.0f, 0.0f};
    pfl_t *out = NULL;
    TEST_ASSERT_EQUAL_INT(PFL_ERR_BUSY, pfl_predict(own, UINT64_MAX, NULL));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_BUSY, pfl_update(own, 0u, 0u, x));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_BUSY, pfl_estimate(own, x, NULL));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_BUSY, pfl_resample(own));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_BUSY, pfl_reset(own, 0u));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_BUSY, pfl_quantile(own, 0u, 0.5f, x));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_BUSY, pfl_snapshot(own, scratch, sizeof scratch));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_BUSY, pfl_restore(own, scratch, sizeof scratch));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_BUSY, pfl_fork(own, scratch, sizeof scratch, &out));
    self_calls += 9u;
    if (other != NULL) {
        (void)ut_fly_linear(other, health_of(other).t_us + 1000u, 0.0f, 0u);
    }
}

static void selfish_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    (void)user;
    if (own != NULL) {
        call_everything();
    }
    ut_linear_predict(NULL, u, dt_s, p);
}

static void selfish_loglik(void *user, const void *z, const pfl_view_t *p, float *out)
{
    if (own != NULL) {
        call_everything();
    }
    ut_linear_loglik(user, z, p, out);
}

static void selfish_draw(void *user, const pfl_batch_t *p)
{
    if (own != NULL) {
        call_everything();
    }
    ut_linear_draw(user, p);
}

static pfl_config_t selfish(void)
{
    static const pfl_sensor_t sensor = {.loglik = selfish_loglik};
    pfl_config_t c = ut_linear_config(N);
    c.predict = selfish_predict;
    c.draw = selfish_draw;
    c.sensors = &sensor;
    own = NULL;
    other = NULL;
    self_calls = 0u;
    return c;
}

void test_calls_on_the_own_filter_from_a_callback_are_busy_and_harmless(void)
{
    const pfl_config_t c = selfish();
    pfl_t *quiet = flown(&c);
    pfl_t *busy = ut_filter(&c);
    own = busy;
    for (uint32_t k = 1u; k <= 3u; k++) {
        (void)ut_fly_linear(busy, k * 100000u, 0.1f * (float)k, 0u);
    }
    own = NULL;
    TEST_ASSERT_TRUE(self_calls >= (9u * 3u * 4u));
    TEST_ASSERT_TRUE(ut_same_posterior(ut_snapshot(quiet), ut_snapshot(busy), pfl_snapshot_bytes(busy)));
    own = busy;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_reset(busy, 0u));
    own = NULL;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(busy, 1u, NULL));
}

/* pfl_health_t: "calls that ended in a fault: non-finite, log-likelihood > 0, self-call". */
void test_self_calls_are_counted_as_faults(void)
{
    const pfl_config_t c = selfish();
    pfl_t *f = ut_filter(&c);
    own = f;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(f, 1000u, NULL));
    own = NULL;
    TEST_ASSERT_TRUE(self_calls > 0u);
    TEST_ASSERT_TRUE(health_of(f).faulted > 0u);
}

void test_calls_on_another_filter_from_a_callback_work(void)
{
    const pfl_config_t c = selfish();
    const pfl_config_t quiet = ut_linear_config(N);
    pfl_t *f = ut_filter(&c);
    pfl_t *inner = ut_filter(&quiet);
    pfl_t *alone = ut_filter(&quiet);
    own = f;
    other = inner;
    (void)ut_fly_linear(f, 100000u, 0.0f, 0u);
    own = NULL;
    for (uint64_t t = 1000u; t <= health_of(inner).t_us; t += 1000u) {
        (void)ut_fly_linear(alone, t, 0.0f, 0u);
    }
    TEST_ASSERT_TRUE(health_of(alone).t_us >= 4000u);
    TEST_ASSERT_TRUE(ut_same_bytes(ut_snapshot(inner), ut_snapshot(alone), pfl_snapshot_bytes(alone)));
}

/* ---- Fusion ---------------------------------------------------------------------------------------------------------- */

static void fill_ll(float *a, uint64_t seed)
{
    for (uint32_t i = 0u; i < N; i++) {
        a[i] = -4.0f * (float)ut_uniform(&seed);
    }
}

static void moments_agree(pfl_t *a, pfl_t *b)
{
    float mean[2];
    float cov[2];
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(a, &mean[0], &cov[0]));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(b, &mean[1], &cov[1]));
    TEST_ASSERT_FLOAT_WITHIN(2.0e-4f, mean[0], mean[1]);
    TEST_ASSERT_FLOAT_WITHIN(1.0e-2f, cov[0], cov[1]);
    TEST_ASSERT_FLOAT_WITHIN(1.0e-3f, pfl_effective_sample_size(a), pfl_effective_sample_size(b));
}

void test_two_sensors_equal_one_with_the_summed_loglik(void)
{
    float one[N];
    float two[N];
    const pfl_sensor_t sensors[2] = {{.loglik = ut_dictated_loglik}, {.loglik = ut_dictated_loglik}};
    pfl_config_t c = ut_dictated_config(N, 1u);
    c.sensors = sensors;
    c.sensor_count = 2u;
    pfl_t *a = ut_filter(&c);
    pfl_t *b = ut_filter(&c);
    pfl_t *ba = ut_filter(&c);
    fill_ll(one, 11u);
    fill_ll(two, 12u);
    for (uint32_t i = 0u; i < N; i++) {
        ll[i] = one[i] + two[i];
    }
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(a, 0u, 0u, one));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(a, 1u, 0u, two));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(b, 0u, 0u, ll));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(ba, 1u, 0u, two));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(ba, 0u, 0u, one));
    moments_agree(a, b);
    moments_agree(a, ba);
    TEST_ASSERT_EQUAL_UINT32(2u, health_of(a).fused);
}

static void user_loglik(void *user, const void *z, const pfl_view_t *p, float *out)
{
    (void)z;
    for (uint32_t i = 0u; i < p->n; i++) {
        out[i] = (float)((p->first + i) % *(const uint32_t *)user) * -1.0f;
    }
}

void test_a_sensor_without_user_gets_the_configurations(void)
{
    uint32_t three = 3u;
    uint32_t five = 5u;
    float weights[N];
    pfl_view_t view;
    const pfl_sensor_t sensors[2] = {{.loglik = user_loglik}, {.loglik = user_loglik, .user = &five}};
    pfl_config_t c = ut_dictated_config(N, 1u);
    c.sensors = sensors;
    c.sensor_count = 2u;
    c.user = &three;
    for (uint16_t k = 0u; k < 2u; k++) {
        const uint32_t period = (k == 0u) ? 3u : 5u;
        pfl_t *f = ut_filter(&c);
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(f, k, 0u, &three));
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_particles(f, &view, weights));
        for (uint32_t i = 0u; i < N; i++) {
            TEST_ASSERT_FLOAT_WITHIN(1.0e-5f, -(float)(i % period), weights[i]);
        }
    }
}

void test_health_tells_when_and_how_much_was_fused(void)
{
    const pfl_config_t c = ut_linear_config(N);
    pfl_t *f = flown(&c);
    TEST_ASSERT_EQUAL_UINT32(3u, health_of(f).fused);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(f, 700000u, NULL));
    TEST_ASSERT_TRUE(health_of(f).t_us == 700000u);
    TEST_ASSERT_TRUE(health_of(f).t_fused_us == 300000u);
    TEST_ASSERT_FLOAT_WITHIN(0.0f, pfl_effective_sample_size(f), health_of(f).ess);
}

/* ---- Two filters, box, long runs -------------------------------------------------------------------------------------- */

void test_two_interleaved_filters_compute_the_bits_they_compute_alone(void)
{
    pfl_config_t first = ut_linear_config(N);
    pfl_config_t second = ut_linear_config(131u);
    uint64_t hash[4] = {UT_FNV_SEED, UT_FNV_SEED, UT_FNV_SEED, UT_FNV_SEED};
    second.seed = 7u;
    pfl_t *alone_a = ut_filter(&first);
    for (uint32_t k = 1u; k <= 60u; k++) {
        hash[0] = ut_fly_linear(alone_a, k * 20000u, 0.2f, hash[0]);
    }
    pfl_t *alone_b = ut_filter(&second);
    for (uint32_t k = 1u; k <= 60u; k++) {
        hash[1] = ut_fly_linear(alone_b, k * 30000u, -0.2f, hash[1]);
    }
    pfl_t *a = ut_filter(&first);
    pfl_t *b = ut_filter(&second);
    for (uint32_t k = 1u; k <= 60u; k++) {
        hash[2] = ut_fly_linear(a, k * 20000u, 0.2f, hash[2]);
        hash[3] = ut_fly_linear(b, k * 30000u, -0.2f, hash[3]);
    }
    TEST_ASSERT_TRUE(hash[0] == hash[2]);
    TEST_ASSERT_TRUE(hash[1] == hash[3]);
    TEST_ASSERT_TRUE(hash[0] != hash[1]);
}

void test_the_seed_decides_the_run(void)
{
    uint64_t hash[2];
    for (uint32_t k = 0u; k < 2u; k++) {
        pfl_config_t c = ut_linear_config(N);
        c.seed = k;
        hash[k] = ut_fly_linear(ut_filter(&c), 1000u, 0.0f, UT_FNV_SEED);
    }
    TEST_ASSERT_TRUE(hash[0] != hash[1]);
}

void test_particles_stay_in_the_box(void)
{
    static const float lo[2] = {-0.5f, 0.2f};
    static const float hi[2] = {0.25f, 3.0e38f};
    pfl_config_t c = ut_linear_config(200u);
    c.lo = lo;
    c.hi = hi;
    pfl_t *f = ut_filter(&c);
    for (uint32_t k = 1u; k <= 50u; k++) {
        pfl_view_t view;
        uint32_t at_limit = 0u;
        (void)ut_fly_linear(f, k * 100000u, 0.0f, 0u);
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_particles(f, &view, NULL));
        for (uint32_t i = 0u; i < view.n; i++) {
            const float x = PFL_STATE(&view, 0)[i];
            TEST_ASSERT_TRUE((x >= lo[0]) && (x <= hi[0]) && (PFL_STATE(&view, 1)[i] >= lo[1]));
            at_limit += (ut_bits(x) == ut_bits(hi[0])) ? 1u : 0u;
        }
        TEST_ASSERT_TRUE((k == 1u) || (at_limit > 0u)); /* clipped, not dropped */
    }
}

/* Ten thousand updates without resampling: plain weights would have died of underflow after a few. */
void test_log_weights_survive_ten_thousand_steps_without_resampling(void)
{
    enum { STEPS = 10000 };
    float weights[N];
    double sum[N] = {0.0};
    double top = -1.0e300;
    uint64_t dice = 77u;
    pfl_view_t view;
    pfl_config_t c = ut_dictated_config(N, 1u);
    pfl_t *f = ut_filter(&c);
    for (uint32_t k = 0u; k < STEPS; k++) {
        for (uint32_t i = 0u; i < N; i++) {
            ll[i] = -30.0f + (0.001f * (float)i) - (float)(ut_uniform(&dice) * 0.01);
            sum[i] += (double)ll[i];
        }
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(f, 0u, 0u, ll));
    }
    for (uint32_t i = 0u; i < N; i++) {
        top = (sum[i] > top) ? sum[i] : top;
    }
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_particles(f, &view, weights));
    for (uint32_t i = 0u; i < N; i++) {
        TEST_ASSERT_FLOAT_WITHIN(0.5f, (float)(sum[i] - top), weights[i]);
    }
    TEST_ASSERT_EQUAL_UINT32(STEPS, health_of(f).fused);
    TEST_ASSERT_TRUE(pfl_invariants_hold(f));
}

/* ---- Estimates --------------------------------------------------------------------------------------------------------- */

void test_the_estimate_is_the_one_before_resampling(void)
{
    float plain[2][2];
    float cov[2][4];
    for (uint32_t k = 0u; k < 2u; k++) {
        pfl_config_t c = ut_linear_config(N);
        const float z = 1.5f;
        c.ess_ratio = (k == 0u) ? 0.0f : 1.0f;
        pfl_t *f = ut_filter(&c);
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(f, 0u, 0u, &z));
        TEST_ASSERT_EQUAL_UINT32(k, health_of(f).resampled);
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(f, plain[k], cov[k]));
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_resample(f));
        float again[2];
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(f, again, NULL));
        TEST_ASSERT_EQUAL_MEMORY(plain[k], again, sizeof again);
    }
    TEST_ASSERT_EQUAL_MEMORY(plain[0], plain[1], sizeof plain[0]);
    TEST_ASSERT_EQUAL_MEMORY(cov[0], cov[1], sizeof cov[0]);
}

static void shift_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    (void)user;
    (void)dt_s;
    for (uint32_t i = 0u; i < p->n; i++) {
        PFL_STATE(p, 0)[i] += *(const float *)u;
    }
}

void test_the_estimate_after_predict_is_fresh(void)
{
    float before = 0.0f;
    float after = 0.0f;
    const float shift = 3.0f;
    pfl_config_t c = ut_linear_config(N);
    c.predict = shift_predict;
    pfl_t *f = ut_filter(&c);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(f, (float[2]){0.0f, 0.0f}, NULL));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(f, 10u, &shift));
    float mean[2];
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(f, mean, NULL));
    after = mean[0];
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(f, 20u, &shift));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(f, mean, NULL));
    before = after;
    TEST_ASSERT_FLOAT_WITHIN(1.0e-5f, before + shift, mean[0]);
}

/* Dead reckoning: a cloud of spread 1 that has moved far since the last update keeps its covariance. */
void test_the_covariance_survives_a_long_way_without_update(void)
{
    static const float ways[] = {10.0f, 100.0f, 1.0e3f, 1.0e4f, 1.0e5f};
    float mean[2];
    float before[4];
    float after[4];
    for (size_t k = 0u; k < (sizeof ways / sizeof ways[0]); k++) {
        char text[48];
        pfl_config_t c = ut_linear_config(300u);
        c.predict = shift_predict;
        pfl_t *f = ut_filter(&c);
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(f, mean, before));
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(f, 10u, &ways[k]));
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(f, mean, after));
        (void)snprintf(text, sizeof text, "moved by %g", (double)ways[k]);
        TEST_ASSERT_FLOAT_WITHIN_MESSAGE(0.02f, before[0], after[0], text);
        TEST_ASSERT_FLOAT_WITHIN_MESSAGE(0.02f, before[1], after[1], text);
    }
}

void test_the_effective_sample_size_stays_that_of_the_last_update(void)
{
    const float z = 1.5f;
    pfl_config_t c = ut_linear_config(N);
    c.ess_ratio = 1.0f;
    pfl_t *f = ut_filter(&c);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(f, 0u, 0u, &z));
    const float ess = pfl_effective_sample_size(f);
    TEST_ASSERT_TRUE((ess > 1.0f) && (ess < (0.95f * (float)N))); /* the one before its resampling */
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(f, 1000u, NULL));
    float mean[2];
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(f, mean, NULL));
    TEST_ASSERT_FLOAT_WITHIN(0.0f, ess, pfl_effective_sample_size(f));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_resample(f));
    TEST_ASSERT_FLOAT_WITHIN(0.0f, ess, pfl_effective_sample_size(f));
}
