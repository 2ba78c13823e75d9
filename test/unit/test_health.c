/* Health: phases and masks of the watch, guards against damaged memory, reinjection, scrub, and the record of a cycle. */
#include "core.h"
#include "rng_kernels.h"
#include "support.h"

#include "unity.h"

#include <math.h>
#include <string.h>

#define N 96u
#define STEP_US 100000u

static float dictated[N];
static uint64_t now_us;

void setUp(void)
{
    memset(dictated, 0, sizeof dictated);
    now_us = 0u;
}

void tearDown(void)
{
    ut_arenas_end();
}

/* ---- A filter under watch --------------------------------------------------------------------------------------- */

typedef struct {
    pfl_watch_t watch;
    pfl_sensor_t sensors[2];
    pfl_config_t config;
} watched_t;

static void near_z(void *user, const void *z, const pfl_batch_t *p)
{
    (void)user;
    for (uint32_t i = 0u; i < p->n; i++) {
        PFL_STATE(p, 0)[i] = *(const float *)z + (0.5f * PFL_NOISE(p, 0)[i]);
        PFL_STATE(p, 1)[i] = PFL_NOISE(p, 1)[i];
    }
}

static void make_watched(watched_t *w)
{
    memset(w, 0, sizeof *w);
    w->config = ut_linear_config(N);
    w->sensors[0].loglik = ut_linear_loglik;
    w->sensors[0].gate = 9.0f;
    w->sensors[0].timeout_us = 1000000u;
    w->sensors[1] = w->sensors[0];
    w->sensors[1].timeout_us = 0u;
    w->config.sensors = w->sensors;
    w->config.sensor_count = 2u;
    w->config.ess_ratio = 0.5f;
    w->watch.keep = pfl_watch_keep;
    w->config.watch = &w->watch;
}

static pfl_health_t health_of(const pfl_t *f)
{
    pfl_health_t h;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_health(f, &h));
    return h;
}

/* One cycle with z on sensor 0. */
static pfl_status_t cycle(pfl_t *f, float z)
{
    now_us += STEP_US;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(f, now_us, NULL));
    return pfl_update(f, 0u, now_us, &z);
}

static void cycles(pfl_t *f, uint32_t n)
{
    for (uint32_t k = 0u; k < n; k++) {
        TEST_ASSERT_EQUAL_INT(PFL_OK, cycle(f, 0.01f * (float)k));
    }
}

static void expect_phase(const pfl_t *f, pfl_phase_t phase)
{
    const pfl_health_t h = health_of(f);
    TEST_ASSERT_EQUAL_INT(phase, h.phase);
    const bool usable = (phase == PFL_PHASE_TRACKING) || (phase == PFL_PHASE_DEGRADED);
    TEST_ASSERT_EQUAL_INT(usable, (h.mode & PFL_MODE_USABLE) != 0u);
}

/* Tracking, then three refusals in a row. */
static void lose(pfl_t *f)
{
    cycles(f, 12u);
    for (uint32_t k = 0u; k < 3u; k++) {
        TEST_ASSERT_EQUAL_INT(PFL_REJECTED, cycle(f, 100.0f));
    }
    expect_phase(f, PFL_PHASE_LOST);
}

/* ---- Phases ------------------------------------------------------------------------------------------------------ */

/* With a watch the best log-likelihood is told for sensors without a gate, too. */
void test_a_watch_knows_the_best_log_likelihood_without_a_gate(void)
{
    watched_t gated;
    watched_t watched;
    make_watched(&gated);
    make_watched(&watched);
    gated.config.watch = NULL;
    gated.sensors[0].gate = 1.0e6f;
    watched.sensors[0].gate = 0.0f;
    gated.config.ess_ratio = watched.config.ess_ratio = 0.0f; /* weights differ from the second update on */
    pfl_t *a = ut_filter(&gated.config);
    pfl_t *b = ut_filter(&watched.config);
    const uint64_t begin_us = now_us;
    cycles(a, 3u);
    now_us = begin_us;
    cycles(b, 3u);
    TEST_ASSERT_TRUE(health_of(a).best_loglik < 0.0f);
    TEST_ASSERT_EQUAL_HEX32(ut_bits(health_of(a).best_loglik), ut_bits(health_of(b).best_loglik));
}

void test_without_a_watch_no_phase_is_judged(void)
{
    const pfl_config_t c = ut_linear_config(N);
    pfl_t *f = ut_filter(&c);
    (void)cycle(f, 0.0f);
    expect_phase(f, PFL_PHASE_INIT);
    pfl_sensor_health_t sensor;
    TEST_ASSERT_EQUAL_INT(PFL_ERR_CONFIG, pfl_sensor_health(f, 0u, &sensor));
}

void test_it_converges_and_tracks_after_a_second_of_calm(void)
{
    watched_t w;
    make_watched(&w);
    pfl_t *f = ut_filter(&w.config);
    expect_phase(f, PFL_PHASE_INIT);
    cycles(f, 1u);
    expect_phase(f, PFL_PHASE_CONVERGING);
    cycles(f, 9u);
    expect_phase(f, PFL_PHASE_CONVERGING);
    cycles(f, 1u);
    expect_phase(f, PFL_PHASE_TRACKING);
}

void test_it_does_not_track_while_the_cloud_is_wide(void)
{
    watched_t w;
    make_watched(&w);
    const float never[2] = {1.0e-6f, INFINITY};
    w.watch.ok_sigma = never;
    pfl_t *f = ut_filter(&w.config);
    cycles(f, 40u);
    expect_phase(f, PFL_PHASE_CONVERGING);
    TEST_ASSERT_TRUE((health_of(f).mode & PFL_MODE_WIDE) != 0u);
}

void test_a_refused_measurement_degrades_and_calm_brings_it_back(void)
{
    watched_t w;
    make_watched(&w);
    pfl_t *f = ut_filter(&w.config);
    cycles(f, 12u);
    TEST_ASSERT_EQUAL_INT(PFL_REJECTED, cycle(f, 100.0f));
    expect_phase(f, PFL_PHASE_DEGRADED);
    TEST_ASSERT_EQUAL_HEX32(1u, health_of(f).reject);
    TEST_ASSERT_TRUE(health_of(f).test_ratio > 1.0f);
    cycles(f, 5u);
    expect_phase(f, PFL_PHASE_DEGRADED);
    TEST_ASSERT_EQUAL_HEX32(0u, health_of(f).reject);
    cycles(f, 6u);
    expect_phase(f, PFL_PHASE_TRACKING);
}

void test_three_refusals_in_a_row_lose_it_and_fusing_again_settles_it(void)
{
    watched_t w;
    make_watched(&w);
    pfl_t *f = ut_filter(&w.config);
    lose(f);
    TEST_ASSERT_TRUE((health_of(f).event & PFL_EVENT_LOST) != 0u);
    const float before = health_of(f).test_ratio;
    cycles(f, 1u);
    expect_phase(f, PFL_PHASE_SETTLING);
    TEST_ASSERT_TRUE_MESSAGE(health_of(f).test_ratio >= before, "a better score than before");
    cycles(f, 9u);
    expect_phase(f, PFL_PHASE_SETTLING);
    cycles(f, 1u);
    expect_phase(f, PFL_PHASE_TRACKING);
    TEST_ASSERT_TRUE(health_of(f).test_ratio < 1.0f);
}

/* A lost filter that is reset keeps the score by which it was lost, whatever was refused after. */
void test_the_reset_of_a_lost_filter_keeps_the_score_of_its_loss(void)
{
    watched_t w;
    make_watched(&w);
    pfl_t *f = ut_filter(&w.config);
    lose(f);
    const float at_loss = health_of(f).test_ratio;
    TEST_ASSERT_EQUAL_INT(PFL_REJECTED, cycle(f, 50.0f));
    TEST_ASSERT_TRUE(health_of(f).test_ratio < at_loss);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_reset(f, now_us));
    expect_phase(f, PFL_PHASE_SETTLING);
    TEST_ASSERT_EQUAL_FLOAT(at_loss, health_of(f).test_ratio);
}

void test_a_stale_sensor_degrades_and_nothing_fused_for_long_loses(void)
{
    watched_t w;
    make_watched(&w);
    pfl_t *f = ut_filter(&w.config);
    cycles(f, 12u);
    for (uint32_t k = 0u; k < 11u; k++) {
        now_us += STEP_US;
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(f, now_us, NULL));
        expect_phase(f, (k < 10u) ? PFL_PHASE_TRACKING : PFL_PHASE_DEGRADED);
    }
    TEST_ASSERT_TRUE((health_of(f).mode & PFL_MODE_STALE) != 0u);
    for (uint32_t k = 11u; k < 51u; k++) {
        now_us += STEP_US;
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(f, now_us, NULL));
    }
    expect_phase(f, PFL_PHASE_LOST);
}

/* Of two sensors the worse one counts, whichever spoke last. */
void test_the_ratio_told_is_the_worst_of_all_sensors(void)
{
    watched_t w;
    make_watched(&w);
    pfl_t *f = ut_filter(&w.config);
    const float far = 5.0f;
    const float near = 0.0f;
    cycles(f, 3u);
    (void)pfl_update(f, 1u, now_us, &far);
    (void)pfl_update(f, 0u, now_us, &near);
    pfl_sensor_health_t one;
    pfl_sensor_health_t two;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_sensor_health(f, 0u, &one));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_sensor_health(f, 1u, &two));
    TEST_ASSERT_TRUE(two.test_ratio > one.test_ratio);
    TEST_ASSERT_EQUAL_FLOAT(two.test_ratio, health_of(f).test_ratio);
}

void test_a_reset_settles_and_its_score_is_no_better_than_before(void)
{
    watched_t w;
    make_watched(&w);
    pfl_t *f = ut_filter(&w.config);
    cycles(f, 12u);
    (void)cycle(f, 100.0f);
    const float before = health_of(f).test_ratio;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_reset(f, now_us));
    expect_phase(f, PFL_PHASE_SETTLING);
    TEST_ASSERT_TRUE(health_of(f).test_ratio >= before);
    TEST_ASSERT_TRUE((health_of(f).event & PFL_EVENT_RESET) != 0u);
    cycles(f, 10u);
    expect_phase(f, PFL_PHASE_TRACKING);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_reset(f, now_us));
    (void)cycle(f, 10000.0f);
    expect_phase(f, PFL_PHASE_SETTLING);
    TEST_ASSERT_TRUE(health_of(f).test_ratio > (2.0f * before)); /* and what is worse than before is told */
}

void test_a_lean_cloud_degrades_at_the_second_update(void)
{
    watched_t w;
    make_watched(&w);
    w.sensors[1].loglik = ut_dictated_loglik;
    w.config.ess_ratio = 0.0f;
    pfl_t *f = ut_filter(&w.config);
    cycles(f, 12u);
    expect_phase(f, PFL_PHASE_TRACKING);
    for (uint32_t i = 1u; i < N; i++) {
        dictated[i] = -50.0f;
    }
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(f, 1u, now_us, dictated));
    expect_phase(f, PFL_PHASE_TRACKING);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(f, 1u, now_us, dictated));
    expect_phase(f, PFL_PHASE_DEGRADED);
    TEST_ASSERT_TRUE((health_of(f).mode & PFL_MODE_LEAN) != 0u);
}

void test_a_watch_out_of_range_is_refused(void)
{
    watched_t w;
    const float bad_sigma[2] = {1.0f, 0.0f};
    size_t bytes = 0u;
    make_watched(&w);
    void *arena = ut_arena_for(&w.config, &bytes);
    pfl_t *f = NULL;
    const float wrong[] = {-0.1f, 1.1f, NAN, INFINITY};
    for (uint32_t k = 0u; k < 4u; k++) {
        make_watched(&w);
        w.watch.lean_ratio = wrong[k];
        TEST_ASSERT_EQUAL_INT(PFL_ERR_CONFIG, pfl_init(arena, bytes, &w.config, 0u, &f));
        make_watched(&w);
        w.watch.reinject = wrong[k];
        TEST_ASSERT_EQUAL_INT(PFL_ERR_CONFIG, pfl_init(arena, bytes, &w.config, 0u, &f));
    }
    make_watched(&w);
    w.watch.keep = NULL;
    TEST_ASSERT_EQUAL_INT(PFL_ERR_CONFIG, pfl_init(arena, bytes, &w.config, 0u, &f));
    make_watched(&w);
    w.watch.ok_sigma = bad_sigma;
    TEST_ASSERT_EQUAL_INT(PFL_ERR_CONFIG, pfl_init(arena, bytes, &w.config, 0u, &f));
    make_watched(&w);
    const float good_sigma[2] = {1.0f, 1.0f};
    w.watch.ok_sigma = good_sigma;
    w.config.moments = (uint16_t)PFL_MOMENTS_MEAN;
    TEST_ASSERT_EQUAL_INT(PFL_ERR_CONFIG, pfl_init(arena, bytes, &w.config, 0u, &f));
}

/* ---- Reinjection ------------------------------------------------------------------------------------------------- */

static uint32_t cycles_until_near(pfl_t *f, float z, uint32_t most)
{
    for (uint32_t k = 1u; k <= most; k++) {
        float mean[2];
        (void)cycle(f, z);
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(f, mean, NULL));
        if (fabsf(mean[0] - z) < 1.0f) {
            return k;
        }
    }
    return most + 1u;
}

void test_a_kidnapped_target_is_found_by_redraw(void)
{
    watched_t w;
    make_watched(&w);
    w.watch.reinject = 0.25f;
    w.sensors[0].redraw = near_z;
    pfl_t *f = ut_filter(&w.config);
    cycles(f, 12u);
    TEST_ASSERT_TRUE(cycles_until_near(f, 500.0f, 50u) <= 5u);
    TEST_ASSERT_EQUAL_UINT32(1u, health_of(f).resets);
    uint32_t count = 0u;
    float delta[2];
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_last_reset(f, &count, NULL, delta));
    TEST_ASSERT_TRUE(delta[0] > 50.0f); /* a quarter of the cloud went 500 m away */
    TEST_ASSERT_TRUE(pfl_invariants_hold(f));
}

void test_without_reinjection_a_kidnapped_target_stays_lost_and_says_so(void)
{
    watched_t w;
    make_watched(&w);
    w.sensors[0].redraw = near_z;
    pfl_t *f = ut_filter(&w.config);
    cycles(f, 12u);
    TEST_ASSERT_EQUAL_UINT32(51u, cycles_until_near(f, 500.0f, 50u));
    expect_phase(f, PFL_PHASE_LOST);
    TEST_ASSERT_EQUAL_UINT32(0u, health_of(f).resets);
}

void test_impossible_for_ever_reinjects_by_draw_and_recovers(void)
{
    watched_t w;
    make_watched(&w);
    w.watch.reinject = 0.1f;
    w.sensors[1].loglik = ut_dictated_loglik;
    pfl_t *f = ut_filter(&w.config);
    cycles(f, 12u);
    for (uint32_t i = 0u; i < N; i++) {
        dictated[i] = -INFINITY;
    }
    for (uint32_t k = 0u; k < 20u; k++) {
        now_us += STEP_US;
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(f, now_us, NULL));
        TEST_ASSERT_EQUAL_INT(PFL_REJECTED, pfl_update(f, 1u, now_us, dictated));
    }
    TEST_ASSERT_TRUE(health_of(f).resets > 0u);
    TEST_ASSERT_TRUE(cycles_until_near(f, 0.0f, 50u) <= 50u);
}

/* ---- Content ----------------------------------------------------------------------------------------------------- */

void test_the_same_measurement_twice_is_fused_once(void)
{
    watched_t w;
    make_watched(&w);
    w.sensors[0].z_bytes = sizeof(float);
    pfl_t *f = ut_filter(&w.config);
    cycles(f, 3u);
    const unsigned char *before = ut_snapshot(f);
    const float again = 0.02f;
    TEST_ASSERT_EQUAL_INT(PFL_ERR_TIME, pfl_update(f, 0u, now_us, &again));
    TEST_ASSERT_TRUE(ut_same_posterior(before, ut_snapshot(f), pfl_snapshot_bytes(f)));
    TEST_ASSERT_TRUE((health_of(f).fault & PFL_FAULT_TIME) != 0u);
    const float other = 0.03f;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(f, 0u, now_us, &other));
}

void test_a_frozen_sensor_is_refused_until_it_moves(void)
{
    watched_t w;
    make_watched(&w);
    w.sensors[0].z_bytes = sizeof(float);
    w.sensors[0].frozen_after = 3u;
    pfl_t *f = ut_filter(&w.config);
    cycles(f, 2u);
    for (uint32_t k = 0u; k < 6u; k++) {
        TEST_ASSERT_EQUAL_INT((k < 3u) ? PFL_OK : PFL_REJECTED, cycle(f, 0.5f));
    }
    pfl_sensor_health_t sensor;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_sensor_health(f, 0u, &sensor));
    TEST_ASSERT_EQUAL_UINT32(5u, sensor.same);
    TEST_ASSERT_EQUAL_UINT32(3u, sensor.refused);
    TEST_ASSERT_TRUE((health_of(f).event & PFL_EVENT_FROZEN) != 0u);
    TEST_ASSERT_EQUAL_INT(PFL_OK, cycle(f, 0.51f));
}

void test_sensor_health_refuses_what_is_not_there(void)
{
    watched_t w;
    make_watched(&w);
    pfl_t *f = ut_filter(&w.config);
    pfl_sensor_health_t sensor;
    pfl_record_t record;
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_sensor_health(f, 0u, NULL));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_sensor_health(NULL, 0u, &sensor));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_SENSOR, pfl_sensor_health(f, 2u, &sensor));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_record(f, NULL));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_record(NULL, &record));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_scrub(NULL, NULL));
}

/* ---- Guards ------------------------------------------------------------------------------------------------------ */

static void flip(void *bytes, size_t bit)
{
    ((unsigned char *)bytes)[bit / 8u] ^= (unsigned char)(1u << (bit % 8u));
}

/* One cycle of two twins; true when they answer the same, bit for bit. */
static bool twins_agree(pfl_t *a, pfl_t *b)
{
    const uint64_t t_us = now_us + STEP_US;
    const uint64_t one = ut_fly_linear(a, t_us, 0.1f, UT_FNV_SEED);
    const uint64_t two = ut_fly_linear(b, t_us, 0.1f, UT_FNV_SEED);
    now_us = t_us;
    return one == two;
}

void test_any_flipped_bit_of_the_control_block_its_copy_or_its_seal_is_mended(void)
{
    watched_t w;
    make_watched(&w);
    pfl_t *a = ut_filter(&w.config);
    pfl_t *b = ut_filter(&w.config);
    const size_t bits = 8u * offsetof(struct pfl, rng);
    for (size_t bit = 0u; bit < bits; bit++) {
        flip(b, bit);
        TEST_ASSERT_TRUE_MESSAGE(twins_agree(a, b), "a flipped bit changed an answer");
    }
    TEST_ASSERT_TRUE(health_of(b).mended >= (8u * offsetof(struct pfl, seal)));
    TEST_ASSERT_EQUAL_UINT32(0u, health_of(a).mended);
}

/* Two words with the same bit flipped: a sum of products would lose the top ones against each other. */
void test_the_same_bit_flipped_in_any_two_words_of_the_block_is_mended(void)
{
    static const uint32_t places[] = {0u, 18u, 30u, 31u}; /* of the word; the rotation brings bit 18 to the top */
    watched_t w;
    make_watched(&w);
    pfl_t *a = ut_filter(&w.config);
    pfl_t *b = ut_filter(&w.config);
    const size_t words = offsetof(struct pfl, seal) / 4u;
    uint32_t flips = 0u;
    for (size_t one = 0u; one < words; one++) {
        for (size_t other = one + 1u; other < words; other++) {
            const size_t place = places[flips % 4u];
            flip(b, (32u * one) + place);
            flip(b, (32u * other) + place);
            flips++;
            TEST_ASSERT_TRUE_MESSAGE(twins_agree(a, b), "two flipped bits changed an answer");
        }
    }
    TEST_ASSERT_TRUE(health_of(b).mended >= flips);
    TEST_ASSERT_EQUAL_UINT32(0u, health_of(a).mended);
}

void test_a_block_beyond_repair_is_corrupt(void)
{
    watched_t w;
    make_watched(&w);
    pfl_t *f = ut_filter(&w.config);
    flip(&f->t_us, 3u);
    flip(f->copy, 11u);
    float mean[2];
    TEST_ASSERT_EQUAL_INT(PFL_ERR_CORRUPT, pfl_predict(f, STEP_US, NULL));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_CORRUPT, pfl_estimate(f, mean, NULL));
    memset(f, 0, sizeof *f);
    TEST_ASSERT_EQUAL_INT(PFL_ERR_CORRUPT, pfl_predict(f, STEP_US, NULL));
}

static void every_bit_of(void *bytes, size_t n, pfl_t *f)
{
    const unsigned char *before = ut_snapshot(f);
    for (size_t bit = 0u; bit < (8u * n); bit++) {
        const float z = 0.0f;
        float mean[2];
        flip(bytes, bit);
        TEST_ASSERT_EQUAL_INT(PFL_ERR_CONFIG, pfl_predict(f, now_us + STEP_US, NULL));
        TEST_ASSERT_EQUAL_INT(PFL_ERR_CONFIG, pfl_update(f, 0u, now_us, &z));
        TEST_ASSERT_EQUAL_INT(PFL_ERR_CONFIG, pfl_estimate(f, mean, NULL));
        TEST_ASSERT_TRUE((f->watched.fault & PFL_FAULT_CONFIG) != 0u);
        flip(bytes, bit);
    }
    TEST_ASSERT_TRUE(ut_same_posterior(before, ut_snapshot(f), pfl_snapshot_bytes(f)));
}

void test_every_flipped_bit_of_the_configuration_is_seen_before_use(void)
{
    watched_t w;
    make_watched(&w);
    const float lo[2] = {-1000.0f, -1000.0f};
    float hi[2] = {1000.0f, 1000.0f};
    float sigma[2] = {10.0f, 10.0f};
    w.config.lo = lo;
    w.config.hi = hi;
    w.watch.ok_sigma = sigma;
    pfl_t *f = ut_filter(&w.config);
    cycles(f, 3u);
    every_bit_of(&w.config, sizeof w.config, f);
    every_bit_of(w.sensors, sizeof w.sensors, f);
    every_bit_of(&w.watch, sizeof w.watch, f);
    every_bit_of(hi, sizeof hi, f);
    every_bit_of(sigma, sizeof sigma, f);
    cycles(f, 1u);
    TEST_ASSERT_EQUAL_UINT32(0u, health_of(f).fault);
}

/* Runs over the end of its batch by one, where `user` says so. */
static uint32_t run_over;

static void careless_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    ut_linear_predict(user, u, dt_s, p);
    if ((p->first + p->n) == N) {
        PFL_STATE(p, 1)[p->n + run_over - 1u] = (run_over != 0u) ? 7.0f : PFL_STATE(p, 1)[p->n - 1u];
    }
}

void test_a_callback_that_writes_behind_its_column_is_caught(void)
{
    watched_t w;
    make_watched(&w);
    w.config.predict = careless_predict;
    run_over = 0u;
    pfl_t *f = ut_filter(&w.config);
    cycles(f, 2u);
    run_over = 1u;
    TEST_ASSERT_EQUAL_INT(PFL_ERR_CORRUPT, pfl_predict(f, now_us + STEP_US, NULL));
    TEST_ASSERT_TRUE((health_of(f).fault & PFL_FAULT_CANARY) != 0u);
    run_over = 0u;
    now_us += STEP_US;
    cycles(f, 2u);
    TEST_ASSERT_TRUE(pfl_invariants_hold(f));
}

/* A bit flips while a callback runs. */
static size_t flip_at;
static pfl_t *flipped;

static void flipping_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    ut_linear_predict(user, u, dt_s, p);
    if ((flipped != NULL) && (p->first != 0u)) {
        flip(flipped, flip_at);
        flipped = NULL;
    }
}

void test_pointers_and_sizes_survive_a_flip_inside_a_callback(void)
{
    watched_t w;
    make_watched(&w);
    w.config.predict = flipping_predict;
    flipped = NULL;
    pfl_t *a = ut_filter(&w.config);
    pfl_t *b = ut_filter(&w.config);
    for (flip_at = 0u; flip_at < (8u * offsetof(struct pfl, reset_t_us)); flip_at++) {
        flipped = b;
        const uint64_t t_us = now_us + STEP_US;
        const uint64_t two = ut_fly_linear(b, t_us, 0.1f, UT_FNV_SEED);
        const uint64_t one = ut_fly_linear(a, t_us, 0.1f, UT_FNV_SEED);
        now_us = t_us;
        TEST_ASSERT_TRUE(one == two);
    }
}

/* ---- Scrub and random streams ------------------------------------------------------------------------------------- */

void test_scrub_mends_particles_weights_and_streams(void)
{
    watched_t w;
    make_watched(&w);
    const float lo[2] = {-100.0f, -100.0f};
    const float hi[2] = {100.0f, 100.0f};
    w.config.lo = lo;
    w.config.hi = hi;
    pfl_t *f = ut_filter(&w.config);
    cycles(f, 3u);
    uint32_t mended = 1u;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_scrub(f, &mended));
    TEST_ASSERT_EQUAL_UINT32(0u, mended);
    f->x[5] = ut_nan(false);
    f->x[6] = 1.0e20f;
    f->log_weight[7] = ut_nan(true);
    f->log_weight[8] = f->log_weight_top + 5.0f;
    f->best[0] = ut_infinity();
    memset(&f->rng, 0, sizeof f->rng);
    TEST_ASSERT_FALSE(pfl_invariants_hold(f));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_scrub(f, &mended));
    TEST_ASSERT_EQUAL_UINT32(6u, mended);
    TEST_ASSERT_TRUE(pfl_invariants_hold(f));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_scrub(f, NULL));
    cycles(f, 3u);
}

/* What a resampling leaves in the column of weights is no damage. */
void test_scrub_mends_nothing_after_a_resampling(void)
{
    watched_t w;
    make_watched(&w);
    pfl_t *f = ut_filter(&w.config);
    cycles(f, 3u);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_resample(f));
    uint32_t mended = 1u;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_scrub(f, &mended));
    TEST_ASSERT_EQUAL_UINT32(0u, mended);
    TEST_ASSERT_EQUAL_UINT32(0u, health_of(f).event & PFL_EVENT_MENDED);
}

/* Nothing is above the top then, and nothing at it. */
void test_scrub_finds_the_heaviest_particle_anew_when_its_weight_has_dropped(void)
{
    watched_t w;
    make_watched(&w);
    w.config.ess_ratio = 0.0f;
    pfl_t *f = ut_filter(&w.config);
    cycles(f, 3u);
    const uint32_t heaviest = f->best_index;
    f->log_weight[heaviest] -= 100.0f;
    TEST_ASSERT_FALSE(pfl_invariants_hold(f));
    uint32_t mended = 0u;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_scrub(f, &mended));
    TEST_ASSERT_EQUAL_UINT32(1u, mended);
    TEST_ASSERT_TRUE(pfl_invariants_hold(f));
    TEST_ASSERT_TRUE(f->best_index != heaviest);
}

void test_dead_streams_are_seeded_anew_by_the_next_predict(void)
{
    watched_t w;
    make_watched(&w);
    pfl_t *f = ut_filter(&w.config);
    cycles(f, 3u);
    memset(&f->rng, 0, sizeof f->rng);
    cycles(f, 1u);
    TEST_ASSERT_TRUE((health_of(f).fault & PFL_FAULT_RANDOM) != 0u);
    TEST_ASSERT_TRUE(pfl_invariants_hold(f));
}

/* ---- The record --------------------------------------------------------------------------------------------------- */

/* Dead streams come back in the midst of a flight, and not in step with each other. */
void test_revived_streams_live_and_differ(void)
{
    for (uint32_t seed = 0u; seed < 100000u; seed++) {
        pfl_rng_t rng;
        memset(&rng, 0, sizeof rng);
        pfl_rng_revive(&rng, seed * 100003u);
        TEST_ASSERT_TRUE(pfl_rng_alive(&rng));
        for (uint32_t lane = 0u; lane < PFL_RNG_LANES; lane++) {
            const uint32_t next = (lane + 1u) % PFL_RNG_LANES;
            TEST_ASSERT_TRUE((rng.s[0][lane] != rng.s[0][next]) || (rng.s[1][lane] != rng.s[1][next]));
            TEST_ASSERT_TRUE((rng.s[0][lane] != rng.one[0]) || (rng.s[1][lane] != rng.one[1]));
        }
    }
}

void test_the_record_tells_the_cycle_in_32_bytes(void)
{
    watched_t w;
    make_watched(&w);
    pfl_t *f = ut_filter(&w.config);
    cycles(f, 12u);
    TEST_ASSERT_EQUAL_INT(PFL_REJECTED, cycle(f, 100.0f));
    pfl_record_t record;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_record(f, &record));
    const pfl_health_t h = health_of(f);
    TEST_ASSERT_EQUAL_UINT(32u, sizeof record);
    TEST_ASSERT_EQUAL_UINT64(now_us, record.t_us);
    TEST_ASSERT_EQUAL_UINT32(N, record.active);
    TEST_ASSERT_EQUAL_UINT32(ut_bits(h.ess), ut_bits(record.ess));
    TEST_ASSERT_EQUAL_UINT32(ut_bits(h.best_loglik), ut_bits(record.best_loglik));
    TEST_ASSERT_EQUAL_UINT(1u, record.reject);
    TEST_ASSERT_EQUAL_UINT((unsigned)PFL_PHASE_DEGRADED | (PFL_MODE_USABLE << 4), record.state);
    TEST_ASSERT_EQUAL_UINT(255u, record.ratio); /* far beyond 7.97 */
    cycles(f, 1u);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_record(f, &record));
    TEST_ASSERT_EQUAL_UINT((unsigned)(h.test_ratio >= 0.0f) * (unsigned)(health_of(f).test_ratio * 32.0f),
                           record.ratio);
}

/* None can be without damage; the conversion of such a number to an integer would be undefined. */
void test_the_record_of_a_ratio_that_is_none_is_full_scale(void)
{
    static const uint32_t ratios[] = {0xBF800000u, 0xFF800000u, 0x7FC00000u, 0x7F800000u};
    watched_t w;
    make_watched(&w);
    pfl_t *f = ut_filter(&w.config);
    for (size_t k = 0u; k < (sizeof ratios / sizeof ratios[0]); k++) {
        pfl_record_t record;
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_begin(f));
        f->test_ratio = ut_float(ratios[k]);
        for (uint32_t s = 0u; s < w.config.sensor_count; s++) {
            f->sensor[s].test_ratio = f->test_ratio;
        }
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_end(f, PFL_OK));
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_record(f, &record));
        TEST_ASSERT_EQUAL_UINT(255u, record.ratio);
    }
}
