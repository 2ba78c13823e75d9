/* Fault matrix, rows M1, M3, C1, C2 and R1 to R4: memory that is wrong from the start, or changes by itself. M2, the
 * stack, is painted and measured by tools/target; F1, wrong compiler flags, stands in test/checks/target; Z1 is flown by
 * tools/survival soak; tools/survival strikes the regions at random and many times over. */
#include "fault_support.h"

#include "unity.h"

#include <math.h>
#include <string.h>

#ifdef PFL_TEST_ON_TARGET /* emulated */
#define RESAMPLINGS 2000u
#define TRIALS 5u /* at each place */
#else
#define RESAMPLINGS 20000u
#define TRIALS 25u
#endif

static ft_t t;

void setUp(void)
{
}

void tearDown(void)
{
    ut_arenas_end();
}

static void flip(void *bytes, size_t bit)
{
    ((unsigned char *)bytes)[bit / 8u] ^= (unsigned char)(1u << (bit % 8u));
}

/* ---- M1 ----------------------------------------------------------------------------------------------------------- */

void test_M1_an_arena_that_will_not_do_is_refused_untouched(void)
{
    ft_configure(&t);
    size_t bytes = 0u;
    unsigned char *arena = (unsigned char *)ut_arena_for(&t.config, &bytes);
    pfl_t *f = NULL;
    TEST_ASSERT_EQUAL_INT(PFL_ERR_MEMORY, pfl_init(NULL, bytes, &t.config, 0u, &f));
    for (size_t less = 1u; less <= bytes; less += 1u + (less / 8u)) {
        TEST_ASSERT_EQUAL_INT(PFL_ERR_MEMORY, pfl_init(arena, bytes - less, &t.config, 0u, &f));
    }
    for (size_t off = 1u; off < 8u; off++) {
        TEST_ASSERT_EQUAL_INT(PFL_ERR_MEMORY, pfl_init(arena + off, bytes, &t.config, 0u, &f));
    }
    TEST_ASSERT_TRUE(ut_untouched(arena, bytes));
    const uint32_t wrong[3] = {0u, PFL_PARTICLES_MAX + 1u, UINT32_MAX};
    for (uint32_t k = 0u; k < 3u; k++) {
        t.config.particles = wrong[k];
        TEST_ASSERT_EQUAL_INT(PFL_ERR_CONFIG, pfl_init(arena, bytes, &t.config, 0u, &f));
        TEST_ASSERT_EQUAL_size_t(0u, pfl_arena_bytes(&t.config));
    }
    TEST_ASSERT_TRUE(ut_untouched(arena, bytes));
    TEST_ASSERT_NULL(f);
}

/* ---- M3 ----------------------------------------------------------------------------------------------------------- */

void test_M3_two_filters_share_nothing_whatever_one_suffers(void)
{
    ft_configure(&t);
    pfl_t *alone = ut_filter(&t.config);
    pfl_t *b = ut_filter(&t.config);
    ft_t other;
    ft_configure(&other);
    other.config.seed = 99u;
    ft_start(&other);
    for (uint64_t k = 1u; k <= 200u; k++) {
        const uint64_t one = ut_fly_linear(alone, k * FT_STEP_US, 0.1f, UT_FNV_SEED);
        other.now_us = (k - 1u) * FT_STEP_US;
        (void)pfl_predict(other.f, k * FT_STEP_US, NULL);
        flip(other.f->x, (size_t)(k * 977u) % (32u * FT_N));
        const float z = (k % 7u == 0u) ? ut_nan(false) : 0.5f;
        const uint64_t two = ut_fly_linear(b, k * FT_STEP_US, 0.1f, UT_FNV_SEED);
        (void)pfl_update(other.f, 0u, k * FT_STEP_US, &z);
        pfl_health_t seen; /* as an interrupt would, between any two calls */
        (void)pfl_health(other.f, &seen);
        TEST_ASSERT_TRUE(one == two);
    }
}

/* ---- C1 ----------------------------------------------------------------------------------------------------------- */

static void every_bit_is_seen(void *bytes, size_t n)
{
    for (size_t bit = 0u; bit < (8u * n); bit++) {
        const float z = 0.0f;
        float mean[2];
        flip(bytes, bit);
        TEST_ASSERT_EQUAL_INT(PFL_ERR_CONFIG, pfl_predict(t.f, t.now_us + FT_STEP_US, NULL));
        TEST_ASSERT_EQUAL_INT(PFL_ERR_CONFIG, pfl_update(t.f, 0u, t.now_us, &z));
        TEST_ASSERT_EQUAL_INT(PFL_ERR_CONFIG, pfl_estimate(t.f, mean, NULL));
        TEST_ASSERT_EQUAL_INT(PFL_ERR_CONFIG, pfl_most_likely(t.f, mean));
        TEST_ASSERT_EQUAL_INT(PFL_ERR_CONFIG, pfl_last_reset(t.f, NULL, NULL, mean));
        TEST_ASSERT_TRUE((ft_health(t.f).fault & PFL_FAULT_CONFIG) != 0u);
        flip(bytes, bit);
    }
}

void test_C1_every_flipped_bit_of_configuration_sensors_and_watch_is_seen_before_use(void)
{
    ft_configure(&t);
    ft_start(&t);
    ft_cycles(&t, 5u, 0.0f);
    const unsigned char *before = ut_snapshot(t.f);
    every_bit_is_seen(&t.config, FT_CONFIG_BYTES);
    every_bit_is_seen(t.sensors, sizeof t.sensors);
    every_bit_is_seen(&t.watch, sizeof t.watch);
    TEST_ASSERT_TRUE(ut_same_posterior(before, ut_snapshot(t.f), pfl_snapshot_bytes(t.f)));
    TEST_ASSERT_EQUAL_INT(PFL_OK, ft_cycle(&t, 0.0f));
}

/* ---- C2 ----------------------------------------------------------------------------------------------------------- */

void test_C2_wrong_configurations_are_refused(void)
{
    const float inverted[2] = {1.0f, -1.0f};
    const float level[2] = {-1.0f, 1.0f};
    const float none[2] = {ut_nan(false), 1.0f};
    for (uint32_t k = 0u; k < 9u; k++) {
        pfl_status_t expected = PFL_ERR_CONFIG;
        ft_configure(&t);
        size_t bytes = 0u;
        void *arena = ut_arena_for(&t.config, &bytes);
        pfl_t *f = NULL;
        switch (k) {
        case 0u:
            t.config.abi = PFL_ABI - 1u;
            expected = PFL_ERR_ABI;
            break;
        case 1u:
            t.config.abi = 0u;
            expected = PFL_ERR_ABI;
            break;
        case 2u:
            t.config.predict = NULL;
            break;
        case 3u:
            t.sensors[1].loglik = NULL;
            break;
        case 4u:
            t.config.lo = inverted;
            t.config.hi = level;
            break;
        case 5u:
            t.config.lo = level;
            break;
        case 6u:
            t.config.lo = none;
            t.config.hi = level;
            break;
        case 7u:
            t.sensors[0].gate = ut_nan(false);
            break;
        default:
            t.watch.keep = NULL;
            break;
        }
        TEST_ASSERT_EQUAL_INT(expected, pfl_init(arena, bytes, &t.config, 0u, &f));
        TEST_ASSERT_NULL(f);
        TEST_ASSERT_TRUE(ut_untouched(arena, bytes));
    }
}

/* ---- R1, R2, R3 --------------------------------------------------------------------------------------------------- */

typedef enum { HEADER, STATES, WEIGHTS, SCRATCH, WORK, MOMENTS, RANDOM, TRACKS, PLACES } place_t;

static void *place_of(pfl_t *f, place_t place, size_t *bytes)
{
    switch (place) {
    case HEADER:
        *bytes = offsetof(struct pfl, rng);
        return f;
    case STATES:
        *bytes = sizeof(float) * FT_N;
        return f->x;
    case WEIGHTS:
        *bytes = sizeof(float) * FT_N;
        return f->log_weight;
    case SCRATCH:
        *bytes = sizeof(float) * FT_N;
        return f->scratch;
    case WORK:
        *bytes = sizeof(float) * PFL_WORK_FLOATS(2u, 2u);
        return f->work;
    case MOMENTS:
        *bytes = sizeof(float) * (PFL_MOMENT_FLOATS(2u) + PFL_LANE_FLOATS(2u));
        return f->mean;
    case RANDOM:
        *bytes = sizeof f->rng;
        return &f->rng;
    default:
        *bytes = PFL_WATCH_BYTES(2u);
        return f->sensor;
    }
}

static void damage(pfl_t *f, place_t place, uint32_t pattern, uint64_t *state)
{
    size_t bytes = 0u;
    void *at = place_of(f, place, &bytes);
    const size_t bit = ut_random(state) % (8u * bytes);
    flip(at, bit);
    if (pattern == 1u) {
        flip(at, ut_random(state) % (8u * bytes));
    }
    for (size_t k = 1u; (pattern == 2u) && (k < 8u); k++) {
        flip(at, (bit + k) % (8u * bytes));
    }
    if ((pattern == 3u) && (place != HEADER)) {
        memset(at, 0, bytes);
    }
}

static void expect_recovery(void)
{
    const float z = 0.0f;
    for (uint32_t k = 0u; k < 100u; k++) {
        t.now_us += FT_STEP_US;
        const pfl_status_t moved = pfl_predict(t.f, t.now_us, NULL);
        if (moved == PFL_ERR_CORRUPT) { /* beyond repair: two bits may hit both copies, and that is told */
            ft_start(&t);
            t.now_us = 0u;
            continue;
        }
        float mean[2] = {0.0f};
        (void)pfl_update(t.f, 0u, t.now_us, &z);
        const pfl_status_t answered = pfl_estimate(t.f, mean, NULL);
        TEST_ASSERT_TRUE(ut_finite(mean[0]) && ut_finite(mean[1]));
        TEST_ASSERT_TRUE((answered == PFL_OK) || (k < 11u));
        (void)pfl_scrub(t.f, NULL);
    }
    TEST_ASSERT_TRUE(pfl_invariants_hold(t.f));
    TEST_ASSERT_TRUE(fabsf(ft_finite_mean(t.f)) < 2.0f);
}

/* Bits flipped while the callback runs. */
static place_t struck_place;
static uint32_t struck_pattern;
static uint64_t struck_state;
static pfl_t *struck;

static void struck_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    ut_linear_predict(user, u, dt_s, p);
    if ((struck != NULL) && (p->first != 0u)) {
        damage(struck, struck_place, struck_pattern, &struck_state);
        struck = NULL;
    }
}

static void strike(uint32_t pattern, bool inside)
{
    uint64_t state = 1000u + pattern;
    for (uint32_t trial = 0u; trial < (TRIALS * (uint32_t)PLACES); trial++) {
        const place_t place = (place_t)(trial % (uint32_t)PLACES);
        if (inside && (place == HEADER) && (pattern != 0u)) {
            continue; /* two flips in block and copy within one callback: tools/survival counts them */
        }
        ft_configure(&t);
        t.config.predict = struck_predict;
        struck = NULL;
        ft_start(&t);
        ft_cycles(&t, 12u, 0.0f);
        if (inside) {
            struck = t.f;
            struck_place = place;
            struck_pattern = pattern;
            struck_state = state + trial;
        } else {
            damage(t.f, place, pattern, &state);
        }
        expect_recovery();
        ut_arenas_end();
    }
}

void test_R1_one_flipped_bit_anywhere_is_survived(void)
{
    strike(0u, false);
}

void test_R2_two_bits_a_burst_and_zeroed_memory_are_survived(void)
{
    strike(1u, false);
    strike(2u, false);
    strike(3u, false);
}

void test_R3_the_same_while_a_callback_runs(void)
{
    strike(0u, true);
    strike(1u, true);
    strike(2u, true);
    strike(3u, true);
}

void test_R2_damaged_log_weights_of_any_bits_never_make_a_resampling_leave_its_arena(void)
{
    uint64_t state = 77u;
    ft_configure(&t);
    ft_start(&t);
    ft_cycles(&t, 3u, 0.0f);
    for (uint32_t k = 0u; k < RESAMPLINGS; k++) {
        pfl_weights_settle(t.f);
        const float bad = ut_float(ut_random(&state));
        t.f->log_weight[ut_random(&state) % FT_N] = bad;
        t.f->scratch[ut_random(&state) % FT_N] = ut_float(ut_random(&state));
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_resample(t.f));
        TEST_ASSERT_TRUE(ut_red_zones_intact());
        if ((k % 50u) == 0u) {
            ft_cycles(&t, 1u, 0.0f);
            (void)ft_finite_mean(t.f);
        }
    }
}

/* ---- R4 ----------------------------------------------------------------------------------------------------------- */

void test_R4_damaged_truncated_and_foreign_snapshots_are_refused(void)
{
    ft_configure(&t);
    ft_start(&t);
    ft_cycles(&t, 12u, 0.0f);
    const size_t bytes = pfl_snapshot_bytes(t.f);
    unsigned char *blob = ut_snapshot(t.f);
    const unsigned char *before = ut_snapshot(t.f);
    for (size_t bit = 0u; bit < (8u * bytes); bit += 7u) {
        flip(blob, bit);
        TEST_ASSERT_EQUAL_INT(PFL_ERR_CORRUPT, pfl_restore(t.f, blob, bytes));
        flip(blob, bit);
    }
    for (size_t less = 1u; less < bytes; less += 13u) {
        TEST_ASSERT_EQUAL_INT(PFL_ERR_CORRUPT, pfl_restore(t.f, blob, bytes - less));
    }
    for (size_t k = 0u; (k + 4u) <= bytes; k += 4u) { /* the other endianness */
        const unsigned char word[4] = {blob[k + 3u], blob[k + 2u], blob[k + 1u], blob[k]};
        memcpy(&blob[k], word, 4u);
    }
    TEST_ASSERT_EQUAL_INT(PFL_ERR_CORRUPT, pfl_restore(t.f, blob, bytes));
    TEST_ASSERT_TRUE(ut_same_posterior(before, ut_snapshot(t.f), bytes));
}

void test_R4_a_restored_filter_of_any_size_resamples_as_the_original_does(void)
{
    static const uint32_t counts[4] = {1u, 90u, 95u, 96u}; /* with and without padding */
    for (uint32_t k = 0u; k < 4u; k++) {
        ft_configure(&t);
        t.config.particles = counts[k];
        t.config.ess_ratio = 0.0f;
        pfl_t *a = ut_filter(&t.config);
        pfl_t *b = ut_filter(&t.config);
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_resample(a)); /* equal weights, and lists where the log-weights were */
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_resample(b));
        memset(b->log_weight, 0, sizeof(float) * PFL_CEIL8(counts[k])); /* a list may hold any index */
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_restore(b, ut_snapshot(a), pfl_snapshot_bytes(a)));
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_resample(a));
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_resample(b));
        TEST_ASSERT_TRUE(ut_same_bytes(ut_snapshot(a), ut_snapshot(b), pfl_snapshot_bytes(a)));
        ut_arenas_end();
    }
}
