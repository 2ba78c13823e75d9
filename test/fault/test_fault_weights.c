/* Fault matrix, rows W1 to W6: what log-likelihoods and callbacks can do. W4's trials of cumulative sums, ten million of
 * them, are those of test_resample. */
#include "fault_support.h"

#include "unity.h"

#include <math.h>
#include <string.h>

static ft_t t;
static float dictated[FT_N];

void setUp(void)
{
    memset(dictated, 0, sizeof dictated);
}

void tearDown(void)
{
    ut_arenas_end();
}

static void start_dictated(void)
{
    ft_configure(&t);
    t.sensors[1].loglik = ut_dictated_loglik;
    ft_start(&t);
    ft_cycles(&t, 12u, 0.0f);
}

static void fill(float value)
{
    for (uint32_t i = 0u; i < FT_N; i++) {
        dictated[i] = value;
    }
}

/* ---- W1 ----------------------------------------------------------------------------------------------------------- */

static void impossible_for(uint32_t cycles)
{
    start_dictated();
    fill(-INFINITY);
    for (uint32_t k = 0u; k < cycles; k++) {
        t.now_us += FT_STEP_US;
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(t.f, t.now_us, NULL));
        const float before = ft_finite_mean(t.f);
        TEST_ASSERT_EQUAL_INT(PFL_REJECTED, pfl_update(t.f, 1u, t.now_us, dictated));
        const float after = ft_finite_mean(t.f);
        TEST_ASSERT_TRUE((ft_health(t.f).resets != 0u) || (ut_bits(before) == ut_bits(after)));
    }
    TEST_ASSERT_EQUAL_INT(cycles >= 3u, ft_health(t.f).resets > 0u);
    fill(0.0f);
    for (uint32_t k = 0u; k < 25u; k++) {
        ft_cycles(&t, 1u, 0.0f);
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(t.f, 1u, t.now_us, dictated));
    }
    TEST_ASSERT_TRUE(fabsf(ft_finite_mean(t.f)) < 1.0f);
    TEST_ASSERT_EQUAL_INT(PFL_PHASE_TRACKING, ft_health(t.f).phase);
}

void test_W1_impossible_once_keeps_the_posterior(void)
{
    impossible_for(1u);
}

void test_W1_impossible_for_ever_reinjects_and_recovers_within_fifty_updates(void)
{
    impossible_for(3u);
    ut_arenas_end();
    impossible_for(100u);
}

/* ---- W2 ----------------------------------------------------------------------------------------------------------- */

void test_W2_any_bad_number_of_any_particle_refuses_the_update_to_the_byte(void)
{
    const float bad[4] = {ut_nan(false), ut_nan(true), ut_infinity(), 0.01f};
    start_dictated();
    const unsigned char *before = ut_snapshot(t.f);
    for (uint32_t k = 0u; k <= FT_N; k++) {
        for (uint32_t b = 0u; b < 4u; b++) {
            fill((k == FT_N) ? bad[b] : -1.0f);
            dictated[k % FT_N] = bad[b];
            TEST_ASSERT_EQUAL_INT((b < 3u) ? PFL_ERR_NONFINITE : PFL_ERR_LOGLIK,
                                  pfl_update(t.f, 1u, t.now_us, dictated));
        }
        (void)ft_finite_mean(t.f);
    }
    TEST_ASSERT_TRUE(ut_same_posterior(before, ut_snapshot(t.f), pfl_snapshot_bytes(t.f)));
    TEST_ASSERT_EQUAL_UINT32(4u * (FT_N + 1u), ft_health(t.f).faulted);
}

/* Particle `spoilt` comes out as `with`; FT_N: all do. */
static uint32_t spoilt;
static float with;

static void spoiling_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    ut_linear_predict(user, u, dt_s, p);
    for (uint32_t i = 0u; i < p->n; i++) {
        if ((spoilt == FT_N) || ((p->first + i) == spoilt)) {
            PFL_STATE(p, i % 2u)[i] = with;
        }
    }
}

void test_W2_any_particle_that_is_not_finite_is_quarantined(void)
{
    const float bad[3] = {ut_nan(false), ut_infinity(), -ut_infinity()};
    ft_configure(&t);
    t.config.predict = spoiling_predict;
    spoilt = FT_N + 1u;
    ft_start(&t);
    ft_cycles(&t, 3u, 0.0f);
    for (uint32_t k = 0u; k < FT_N; k++) {
        spoilt = k;
        with = bad[k % 3u];
        t.now_us += FT_STEP_US;
        TEST_ASSERT_EQUAL_INT(PFL_QUARANTINED, pfl_predict(t.f, t.now_us, NULL));
        (void)ft_finite_mean(t.f);
        TEST_ASSERT_TRUE(pfl_invariants_hold(t.f));
        spoilt = FT_N + 1u;
        ft_cycles(&t, 1u, 0.0f);
    }
    TEST_ASSERT_EQUAL_UINT32(FT_N, ft_health(t.f).quarantined);
    spoilt = FT_N;
    const unsigned char *before = ut_snapshot(t.f);
    TEST_ASSERT_EQUAL_INT(PFL_ERR_NONFINITE, pfl_predict(t.f, t.now_us + FT_STEP_US, NULL));
    TEST_ASSERT_TRUE(ut_same_posterior(before, ut_snapshot(t.f), pfl_snapshot_bytes(t.f)));
}

/* ---- W3 ----------------------------------------------------------------------------------------------------------- */

static void expect_sound_weights(void)
{
    static float log_weights[FT_N];
    pfl_view_t view;
    double sum = 0.0;
    double squares = 0.0;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_particles(t.f, &view, log_weights));
    for (uint32_t i = 0u; i < FT_N; i++) {
        TEST_ASSERT_TRUE(log_weights[i] <= 0.0f);
        sum += exp((double)log_weights[i]);
        squares += exp(2.0 * (double)log_weights[i]);
    }
    const double ess = (sum * sum) / squares;
    const pfl_health_t h = ft_health(t.f);
    TEST_ASSERT_TRUE((h.ess >= 1.0f) && (h.ess <= (float)FT_N));
    TEST_ASSERT_TRUE(fabs((double)h.ess - ess) < (2.0e-5 * ess));
    TEST_ASSERT_TRUE(pfl_invariants_hold(t.f));
}

static void weigh(void)
{
    start_dictated();
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_resample(t.f));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(t.f, 1u, t.now_us, dictated));
    (void)ft_finite_mean(t.f);
    ut_arenas_end();
}

void test_W3_extreme_spreads_keep_weights_and_ess_sound(void)
{
    ft_configure(&t);
    t.config.ess_ratio = 0.0f;
    t.sensors[1].loglik = ut_dictated_loglik;
    const float spread[6] = {0.0f, 1.0e-40f, 1.0f, 80.0f, 1.0e4f, 1.0e30f};
    for (uint32_t s = 0u; s < 6u; s++) {
        ft_start(&t);
        for (uint32_t i = 0u; i < FT_N; i++) {
            dictated[i] = -spread[s] * (float)((i * 37u) % FT_N);
        }
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(t.f, 1u, 0u, dictated));
        expect_sound_weights();
        (void)ft_finite_mean(t.f);
        ut_arenas_end();
    }
}

void test_W3_a_single_survivor_is_resampled_to_all(void)
{
    for (uint32_t k = 0u; k < FT_N; k += 5u) {
        fill(-INFINITY);
        dictated[k] = 0.0f;
        weigh();
    }
}

/* ---- W4 ----------------------------------------------------------------------------------------------------------- */

void test_W4_one_two_and_many_particles_resample_by_any_scheme(void)
{
    static const pfl_scheme_fn schemes[4] = {pfl_systematic, pfl_stratified, pfl_residual, pfl_multinomial};
    static const uint32_t counts[6] = {1u, 2u, 7u, 63u, 65u, 1000u};
    static float weights[1000];
    uint64_t state = 4u;
    for (uint32_t c = 0u; c < 6u; c++) {
        pfl_config_t config = ut_dictated_config(counts[c], 1u);
        for (uint32_t scheme = 0u; scheme < 4u; scheme++) {
            config.resampling = schemes[scheme];
            config.ess_ratio = 1.0f;
            pfl_t *f = ut_filter(&config);
            for (uint32_t trial = 0u; trial < 50u; trial++) {
                for (uint32_t i = 0u; i < counts[c]; i++) {
                    weights[i] = (float)(-30.0 * ut_uniform(&state) * ut_uniform(&state));
                }
                TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(f, 0u, 0u, weights));
                TEST_ASSERT_TRUE(pfl_invariants_hold(f));
            }
            ut_arenas_end(); /* the red zones stand */
        }
    }
}

/* ---- W5 ----------------------------------------------------------------------------------------------------------- */

void test_W5_a_target_kidnapped_anywhere_is_found_in_ten_seconds(void)
{
    for (uint32_t trial = 0u; trial < 100u; trial++) {
        ft_configure(&t);
        t.config.seed = trial;
        ft_start(&t);
        ft_cycles(&t, 12u, 0.0f);
        const float far = ((trial % 2u) == 0u) ? 50.0f * (float)(trial + 1u) : -20.0f * (float)(trial + 1u);
        ft_cycles(&t, 100u, far);
        TEST_ASSERT_TRUE(fabsf(ft_finite_mean(t.f) - far) < 1.5f);
        ut_arenas_end();
    }
}

/* Position and speed are seen apart: the speed goes on fitting wherever the position is. */
static void speed_loglik(void *user, const void *z, const pfl_view_t *p, float *ll)
{
    (void)user;
    for (uint32_t i = 0u; i < p->n; i++) {
        const float e = p->x[p->stride + i] - *(const float *)z;
        ll[i] = -0.5f * e * e;
    }
}

void test_W5_a_sensor_that_agrees_everywhere_does_not_hide_that_the_cloud_is_misplaced(void)
{
    ft_configure(&t);
    t.sensors[1].loglik = speed_loglik;
    t.sensors[1].gate = 9.0f;
    ft_start(&t);
    const float still = 0.0f;
    bool lost = false;
    ft_cycles(&t, 12u, 0.0f);
    for (uint32_t k = 0u; k < 100u; k++) {
        (void)ft_cycle(&t, 400.0f);
        lost = lost || ((ft_health(t.f).event & PFL_EVENT_LOST) != 0u);
        (void)pfl_update(t.f, 1u, t.now_us, &still);
    }
    TEST_ASSERT_TRUE(lost);
    TEST_ASSERT_TRUE(fabsf(ft_finite_mean(t.f) - 400.0f) < 1.5f);
}

void test_W5_one_distinct_particle_spreads_again(void)
{
    start_dictated();
    fill(-INFINITY);
    dictated[17] = 0.0f;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(t.f, 1u, t.now_us, dictated));
    TEST_ASSERT_TRUE(ft_health(t.f).ess < 1.01f);
    ft_cycles(&t, 50u, 0.0f);
    TEST_ASSERT_TRUE(fabsf(ft_finite_mean(t.f)) < 1.0f);
    TEST_ASSERT_TRUE(ft_health(t.f).ess > 2.0f);
}

/* ---- W6 ----------------------------------------------------------------------------------------------------------- */

static pfl_t *own;
static uint32_t trick; /* 0: none */
static pfl_status_t answers[4];

static void tricky_loglik(void *user, const void *z, const pfl_view_t *p, float *ll)
{
    float mean[2];
    ut_linear_loglik(user, z, p, ll);
    if (trick == 1u) {
        ll[p->n - 1u] = ut_nan(false); /* one too few: what was there is NaN */
    } else if ((trick == 2u) && (p->n < PFL_BATCH)) {
        ll[p->n] = 0.0f;
    } else if (trick == 3u) {
        answers[0] = pfl_predict(own, 1u, NULL);
        answers[1] = pfl_update(own, 0u, 0u, z);
        answers[2] = pfl_estimate(own, mean, NULL);
        answers[3] = pfl_reset(own, 0u);
    } else {
        /* does as it should */
    }
}

void test_W6_a_callback_that_misbehaves_is_caught_and_the_next_cycle_is_sound(void)
{
    static const pfl_status_t expected[4] = {PFL_OK, PFL_ERR_NONFINITE, PFL_ERR_CORRUPT, PFL_OK};
    const float z = 0.0f;
    ft_configure(&t);
    t.sensors[0].loglik = tricky_loglik;
    trick = 0u;
    ft_start(&t);
    own = t.f;
    ft_cycles(&t, 12u, 0.0f);
    for (uint32_t k = 0u; k < 4u; k++) {
        const unsigned char *before = ut_snapshot(t.f);
        trick = k;
        TEST_ASSERT_EQUAL_INT(expected[k], pfl_update(t.f, 0u, t.now_us, &z));
        if (expected[k] != PFL_OK) {
            TEST_ASSERT_TRUE(ut_same_posterior(before, ut_snapshot(t.f), pfl_snapshot_bytes(t.f)));
        }
        trick = 0u;
        ft_cycles(&t, 1u, 0.0f);
        TEST_ASSERT_TRUE(pfl_invariants_hold(t.f));
    }
    for (uint32_t k = 0u; k < 4u; k++) {
        TEST_ASSERT_EQUAL_INT(PFL_ERR_BUSY, answers[k]);
    }
}
