/* The watch at its limits: each complaint alone, each limit of the configuration, reinjection without room or source,
 * a log-likelihood callback that writes too far, and what snapshots and forks keep of all that. White box where only
 * a damaged filter has what is to be tested. */
#include "guard.h"
#include "support.h"

#include "unity.h"

#include <float.h>
#include <math.h>
#include <string.h>

#define N 96u
#define STEP_US 100000u

static pfl_watch_t watch;
static pfl_sensor_t sensors[2];
static pfl_config_t config;
static float dictated[N];
static uint64_t now_us;

void setUp(void)
{
    memset(dictated, 0, sizeof dictated);
    memset(&watch, 0, sizeof watch);
    memset(sensors, 0, sizeof sensors);
    now_us = 0u;
    watch.keep = pfl_watch_keep;
    sensors[0].loglik = ut_linear_loglik;
    sensors[0].gate = 9.0f;
    sensors[1].loglik = ut_dictated_loglik;
    config = ut_linear_config(N);
    config.sensors = sensors;
    config.sensor_count = 2u;
    config.watch = &watch;
}

void tearDown(void)
{
    ut_arenas_end();
}

static pfl_health_t health_of(const pfl_t *f)
{
    pfl_health_t h;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_health(f, &h));
    return h;
}

static void move(pfl_t *f)
{
    now_us += STEP_US;
    TEST_ASSERT_TRUE(pfl_predict(f, now_us, NULL) >= PFL_OK);
}

static pfl_status_t cycle(pfl_t *f, float z)
{
    move(f);
    return pfl_update(f, 0u, now_us, &z);
}

static void cycles(pfl_t *f, uint32_t n)
{
    for (uint32_t k = 0u; k < n; k++) {
        TEST_ASSERT_EQUAL_INT(PFL_OK, cycle(f, 0.0f));
    }
}

static pfl_t *tracking(void)
{
    pfl_t *f = ut_filter(&config);
    cycles(f, 12u);
    TEST_ASSERT_EQUAL_INT(PFL_PHASE_TRACKING, health_of(f).phase);
    return f;
}

/* ---- Each complaint alone ---------------------------------------------------------------------------------------- */

static uint32_t spoilt; /* particles of each batch's start */

static void spoiling_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    ut_linear_predict(user, u, dt_s, p);
    for (uint32_t i = 0u; (p->first == 0u) && (i < spoilt); i++) {
        PFL_STATE(p, 0)[i] = ut_nan(false);
    }
}

void test_many_quarantined_particles_degrade_and_few_do_not(void)
{
    config.particles = 200u;
    config.predict = spoiling_predict;
    spoilt = 0u;
    pfl_t *f = tracking();
    spoilt = 2u; /* 1 % */
    move(f);
    TEST_ASSERT_EQUAL_INT(PFL_PHASE_TRACKING, health_of(f).phase);
    TEST_ASSERT_TRUE((health_of(f).event & PFL_EVENT_QUARANTINED) != 0u);
    spoilt = 3u;
    move(f);
    TEST_ASSERT_EQUAL_INT(PFL_PHASE_DEGRADED, health_of(f).phase);
    TEST_ASSERT_EQUAL_HEX32(0u, health_of(f).fault);
}

void test_what_the_scrub_mended_degrades(void)
{
    const float z = 0.0f;
    pfl_t *f = tracking();
    move(f);
    f->log_weight[5] = ut_nan(false);
    f->x[5] = ut_nan(false);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_scrub(f, NULL));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(f, 0u, now_us, &z));
    TEST_ASSERT_EQUAL_HEX32(0u, health_of(f).fault);
    TEST_ASSERT_EQUAL_INT(PFL_PHASE_DEGRADED, health_of(f).phase);
}

void test_a_cloud_beyond_single_precision_is_wide(void)
{
    static const float sigma[2] = {1.0e30f, 1.0e30f};
    watch.ok_sigma = sigma;
    config.ess_ratio = 0.0f;
    pfl_t *f = tracking();
    f->x[0] = 3.0e38f;
    f->x[1] = -3.0e38f;
    move(f);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(f, 1u, now_us, dictated));
    TEST_ASSERT_TRUE((health_of(f).mode & PFL_MODE_WIDE) != 0u);
    TEST_ASSERT_EQUAL_INT(PFL_PHASE_DEGRADED, health_of(f).phase);
}

/* ---- Limits of the configuration --------------------------------------------------------------------------------- */

void test_the_configured_share_of_a_lean_cloud_counts(void)
{
    watch.lean_ratio = 1.0f;
    pfl_t *f = ut_filter(&config);
    cycles(f, 1u);
    TEST_ASSERT_EQUAL_HEX32(0u, health_of(f).mode & PFL_MODE_LEAN);
    cycles(f, 1u);
    TEST_ASSERT_TRUE((health_of(f).mode & PFL_MODE_LEAN) != 0u);
}

void test_the_configured_number_of_updates_settles(void)
{
    watch.settle_updates = 2u;
    pfl_t *f = tracking();
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_reset(f, now_us));
    cycles(f, 1u);
    TEST_ASSERT_EQUAL_INT(PFL_PHASE_SETTLING, health_of(f).phase);
    cycles(f, 1u);
    TEST_ASSERT_EQUAL_INT(PFL_PHASE_TRACKING, health_of(f).phase);
}

void test_it_settles_after_a_second_without_so_many_updates(void)
{
    pfl_t *f = tracking();
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_reset(f, now_us));
    for (uint32_t k = 0u; k < 9u; k++) {
        move(f);
        TEST_ASSERT_EQUAL_INT(PFL_PHASE_SETTLING, health_of(f).phase);
    }
    move(f);
    TEST_ASSERT_EQUAL_INT(PFL_PHASE_TRACKING, health_of(f).phase);
}

void test_settled_with_a_complaint_is_converging(void)
{
    pfl_t *f = tracking();
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_reset(f, now_us));
    cycles(f, 8u);
    TEST_ASSERT_EQUAL_INT(PFL_REJECTED, cycle(f, 100.0f));
    TEST_ASSERT_EQUAL_INT(PFL_PHASE_SETTLING, health_of(f).phase);
    move(f); /* a second after the reset */
    TEST_ASSERT_EQUAL_INT(PFL_PHASE_CONVERGING, health_of(f).phase);
}

void test_the_configured_refusals_and_times_count(void)
{
    watch.lost_rejects = 1u;
    watch.confirm_us = 300000u;
    pfl_t *f = ut_filter(&config);
    cycles(f, 4u);
    TEST_ASSERT_EQUAL_INT(PFL_PHASE_TRACKING, health_of(f).phase);
    TEST_ASSERT_EQUAL_INT(PFL_REJECTED, cycle(f, 100.0f));
    TEST_ASSERT_EQUAL_INT(PFL_PHASE_LOST, health_of(f).phase);
}

/* Only a sensor that could place the cloud anew tells by its own refusals that it is misplaced. */
void test_the_refusals_of_one_sensor_without_redraw_do_not_lose_it(void)
{
    pfl_t *f = tracking();
    for (uint32_t k = 0u; k < 6u; k++) {
        TEST_ASSERT_EQUAL_INT(PFL_REJECTED, cycle(f, 100.0f));
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(f, 1u, now_us, dictated));
        TEST_ASSERT_TRUE(health_of(f).phase != PFL_PHASE_LOST);
    }
}

void test_a_reset_before_anything_was_fused_is_no_news(void)
{
    pfl_t *f = ut_filter(&config);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_reset(f, 7u));
    TEST_ASSERT_EQUAL_INT(PFL_PHASE_INIT, health_of(f).phase);
    TEST_ASSERT_EQUAL_UINT32(1u, health_of(f).resets);
}

/* Its FNV-1a hash is zero, as is that of a sensor that was never heard. */
void test_the_first_measurement_is_never_a_repetition(void)
{
    static const unsigned char hash_zero[4] = {0xCCu, 0x24u, 0x31u, 0xC4u};
    sensors[0].gate = 0.0f;
    sensors[0].z_bytes = sizeof hash_zero;
    pfl_t *f = ut_filter(&config);
    float z;
    memcpy(&z, hash_zero, sizeof z);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(f, 0u, 0u, &z));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_TIME, pfl_update(f, 0u, 0u, &z));
}

/* ---- Reinjection ------------------------------------------------------------------------------------------------- */

static const void *redrawn_by;
static uint32_t redrawn;

static void counting_redraw(void *user, const void *z, const pfl_batch_t *p)
{
    redrawn_by = user;
    redrawn += p->n;
    for (uint32_t i = 0u; i < p->n; i++) {
        PFL_STATE(p, 0)[i] = *(const float *)z;
        PFL_STATE(p, 1)[i] = 0.0f;
    }
}

static pfl_t *kidnapped(float share, void *user)
{
    redrawn = 0u;
    redrawn_by = NULL;
    watch.reinject = share;
    sensors[0].redraw = counting_redraw;
    sensors[0].user = user;
    pfl_t *f = tracking();
    for (uint32_t k = 0u; k < 3u; k++) {
        TEST_ASSERT_EQUAL_INT(PFL_REJECTED, cycle(f, 100.0f));
    }
    return f;
}

void test_a_tiny_share_reinjects_one_particle(void)
{
    (void)kidnapped(0.001f, &now_us);
    TEST_ASSERT_EQUAL_UINT32(1u, redrawn);
    TEST_ASSERT_EQUAL_PTR(&now_us, redrawn_by); /* the sensor's own user before the configuration's */
}

void test_the_share_of_all_reinjects_the_whole_cloud(void)
{
    float mean[2];
    config.user = &dictated;
    pfl_t *f = kidnapped(1.0f, NULL);
    TEST_ASSERT_EQUAL_UINT32(N, redrawn);
    TEST_ASSERT_EQUAL_PTR(&dictated, redrawn_by);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(f, mean, NULL));
    TEST_ASSERT_EQUAL_FLOAT(100.0f, mean[0]);
    TEST_ASSERT_TRUE(pfl_invariants_hold(f));
}

void test_more_than_a_batch_is_reinjected_batch_by_batch(void)
{
    config.particles = PFL_BATCH + 72u;
    config.sensor_count = 1u; /* the other dictates N only */
    pfl_t *f = kidnapped(0.9f, NULL);
    TEST_ASSERT_EQUAL_UINT32(180u, redrawn); /* 90 % of 200 */
    for (uint32_t i = 0u; i < config.particles; i++) {
        TEST_ASSERT_TRUE((f->x[i] >= 99.0f) == (i >= 20u));
    }
}

void test_without_any_source_of_states_nothing_is_reinjected(void)
{
    config.draw = NULL;
    watch.reinject = 0.5f;
    pfl_t *f = ut_filter(&config);
    cycles(f, 12u);
    for (uint32_t k = 0u; k < 4u; k++) {
        TEST_ASSERT_EQUAL_INT(PFL_REJECTED, cycle(f, 100.0f));
    }
    TEST_ASSERT_EQUAL_INT(PFL_PHASE_LOST, health_of(f).phase);
    TEST_ASSERT_EQUAL_UINT32(0u, health_of(f).resets);
}

/* ---- A callback that writes behind its log-likelihoods ----------------------------------------------------------- */

static uint32_t too_many;

/* Only behind the second batch: behind a full one the workspace ends. */
static void overrunning_loglik(void *user, const void *z, const pfl_view_t *p, float *ll)
{
    ut_linear_loglik(user, z, p, ll);
    for (uint32_t i = 0u; (p->n < PFL_BATCH) && (i < too_many); i++) {
        ll[p->n + i] = -1.0f;
    }
}

void test_a_loglik_written_behind_the_last_is_refused_unchanged(void)
{
    const float z = 0.0f;
    sensors[0].loglik = overrunning_loglik;
    too_many = 0u;
    pfl_t *f = tracking();
    move(f);
    const unsigned char *before = ut_snapshot(f);
    too_many = 1u;
    TEST_ASSERT_EQUAL_INT(PFL_ERR_CORRUPT, pfl_update(f, 0u, now_us, &z));
    TEST_ASSERT_TRUE(ut_same_posterior(before, ut_snapshot(f), pfl_snapshot_bytes(f)));
    TEST_ASSERT_TRUE((health_of(f).fault & PFL_FAULT_CANARY) != 0u);
    too_many = 0u;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(f, 0u, now_us, &z));
}

/* ---- Damage ------------------------------------------------------------------------------------------------------ */

void test_block_and_copy_damaged_at_different_places_are_beyond_repair(void)
{
    pfl_t *f = tracking();
    f->fused ^= 4u;
    f->copy[(offsetof(struct pfl, rejected)) / 4u] ^= 8u;
    float mean[2];
    TEST_ASSERT_EQUAL_INT(PFL_ERR_CORRUPT, pfl_estimate(f, mean, NULL));
    f->fused ^= 4u;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(f, mean, NULL)); /* block and seal agree: the copy is made anew */
    f->rejected ^= 8u;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(f, mean, NULL));
}

void test_scrub_counts_what_lies_below_its_box_and_mends_without_one(void)
{
    static const float lo[2] = {-100.0f, -100.0f};
    static const float hi[2] = {100.0f, 100.0f};
    uint32_t mended = 0u;
    pfl_t *f = tracking();
    f->x[3] = -1.0e20f; /* there is no box */
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_scrub(f, &mended));
    TEST_ASSERT_EQUAL_UINT32(0u, mended);
    setUp();
    config.lo = lo;
    config.hi = hi;
    f = tracking();
    f->x[3] = -1.0e20f;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_scrub(f, &mended));
    TEST_ASSERT_EQUAL_UINT32(1u, mended);
    TEST_ASSERT_EQUAL_FLOAT(-100.0f, f->x[3]);
    f->best[0] = ut_nan(false);
    f->mean[0] = ut_infinity(); /* nothing left to stand in */
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_scrub(f, &mended));
    TEST_ASSERT_EQUAL_UINT32(1u, mended);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, f->best[0]);
}

void test_a_damaged_ratio_of_a_sensor_is_told_as_the_worst_there_is(void)
{
    pfl_sensor_health_t health;
    pfl_t *f = tracking();
    f->sensor[0].test_ratio = ut_nan(false);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_sensor_health(f, 0u, &health));
    TEST_ASSERT_EQUAL_HEX32(ut_bits(FLT_MAX), ut_bits(health.test_ratio));
}

/* ---- Snapshots and forks ----------------------------------------------------------------------------------------- */

void test_a_snapshot_keeps_what_the_watch_knows(void)
{
    pfl_sensor_health_t a;
    pfl_sensor_health_t b;
    sensors[0].z_bytes = sizeof(float);
    pfl_t *f = tracking();
    TEST_ASSERT_EQUAL_INT(PFL_REJECTED, cycle(f, 100.0f));
    const unsigned char *kept = ut_snapshot(f);
    pfl_t *g = ut_filter(&config);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_restore(g, kept, pfl_snapshot_bytes(g)));
    TEST_ASSERT_TRUE(ut_same_bytes(kept, ut_snapshot(g), pfl_snapshot_bytes(g)));
    for (uint16_t k = 0u; k < 2u; k++) {
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_sensor_health(f, k, &a));
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_sensor_health(g, k, &b));
        TEST_ASSERT_EQUAL_UINT64(a.t_fused_us, b.t_fused_us);
        TEST_ASSERT_EQUAL_HEX32(ut_bits(a.test_ratio), ut_bits(b.test_ratio));
        TEST_ASSERT_EQUAL_UINT32(a.refused, b.refused);
        TEST_ASSERT_EQUAL_UINT32(a.same, b.same);
    }
    const float z = 100.0f; /* known to both */
    TEST_ASSERT_EQUAL_INT(pfl_update(f, 0u, now_us, &z), pfl_update(g, 0u, now_us, &z));
}

/* No two words alike, so that each is missed. */
void test_a_snapshot_keeps_every_counter(void)
{
    pfl_t *f = tracking();
    uint32_t *const counters[] = {&f->fused,        &f->rejected,        &f->faulted,
                                  &f->resampled,    &f->quarantined,     &f->resets,
                                  &f->overruns,     &f->mended,          &f->redrawn,
                                  &f->projected,    &f->watched.fault,   &f->watched.reject,
                                  &f->watched.mode, &f->watched.event,   &f->watched.refused,
                                  &f->watched.lean, &f->watched.settled, &f->watched.quarantined};
    for (uint32_t k = 0u; k < (sizeof counters / sizeof counters[0]); k++) {
        *counters[k] = 1000u + k;
    }
    f->watched.reject = 1u; /* of sensors that are there */
    f->reset_t_us = 0x123456789Au;
    f->watched.since_us = 0x987654321u;
    f->watched.phase = (uint32_t)PFL_PHASE_DEGRADED;
    f->watched.best_loglik = -3.5f;
    f->watched.ratio_before = 1.25f;
    (void)pfl_guard_close(f, PFL_OK);
    const unsigned char *kept = ut_snapshot(f);
    pfl_t *g = ut_filter(&config);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_restore(g, kept, pfl_snapshot_bytes(g)));
    TEST_ASSERT_TRUE(ut_same_bytes(kept, ut_snapshot(g), pfl_snapshot_bytes(g)));
}

void test_a_snapshot_whose_ratio_of_a_sensor_is_not_finite_is_refused(void)
{
    pfl_t *f = tracking();
    for (uint32_t k = 0u; k < 2u; k++) {
        const float kept = f->sensor[k].test_ratio;
        f->sensor[k].test_ratio = ut_nan(false); /* the seal covers the block, not the tracks */
        const unsigned char *lie = ut_snapshot(f);
        f->sensor[k].test_ratio = kept;
        TEST_ASSERT_EQUAL_INT(PFL_ERR_CORRUPT, pfl_restore(f, lie, pfl_snapshot_bytes(f)));
    }
}

/* The mask of refused sensors has a bit for each, and the last is the word's last. */
void test_a_snapshot_of_as_many_sensors_as_there_can_be_is_restored(void)
{
    static pfl_sensor_t many[32];
    const float far_off = 100.0f;
    for (uint32_t k = 0u; k < 32u; k++) {
        many[k] = sensors[0];
    }
    config.sensors = many;
    config.sensor_count = 32u;
    pfl_t *f = tracking();
    move(f);
    TEST_ASSERT_EQUAL_INT(PFL_REJECTED, pfl_update(f, 31u, now_us, &far_off));
    TEST_ASSERT_EQUAL_HEX32(0x80000000u, health_of(f).reject);
    const unsigned char *kept = ut_snapshot(f);
    pfl_t *g = ut_filter(&config);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_restore(g, kept, pfl_snapshot_bytes(g)));
    TEST_ASSERT_EQUAL_HEX32(0x80000000u, health_of(g).reject);
}

void test_a_fork_has_tracks_of_its_own(void)
{
    pfl_sensor_health_t a;
    pfl_sensor_health_t b;
    pfl_t *f = tracking();
    pfl_t *copy = NULL;
    const size_t bytes = pfl_arena_bytes(&config);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_fork(f, ut_arena(bytes), bytes, &copy));
    TEST_ASSERT_EQUAL_INT(PFL_REJECTED, cycle(copy, 100.0f));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_sensor_health(f, 0u, &a));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_sensor_health(copy, 0u, &b));
    TEST_ASSERT_EQUAL_UINT32(0u, a.refused);
    TEST_ASSERT_EQUAL_UINT32(1u, b.refused);
}
