/* Fault matrix, row C1, of filters that live on a copy of their configuration (-DPFL_GUARD_CONFIG=2): what changes while a
 * callback runs, in the original or in the copy, does no harm to the call. */
#include "fault_support.h"

#include "unity.h"

#include <string.h>

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

/* One cycle that flips a bit within predict or within the log-likelihood of a batch that is not the last. */
static unsigned char *struck;
static size_t struck_bit;
static bool in_predict;

static void strike(bool here)
{
    if (here && (struck != NULL)) {
        flip(struck, struck_bit);
        struck = NULL;
    }
}

static void struck_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    ut_linear_predict(user, u, dt_s, p);
    strike(in_predict && (p->first == 0u));
}

static void struck_loglik(void *user, const void *z, const pfl_view_t *p, float *ll)
{
    ut_linear_loglik(user, z, p, ll);
    strike(!in_predict && (p->first == 0u));
}

static void start(void)
{
    static const float lo[2] = {-1.0e6f, -1.0e6f};
    static const float hi[2] = {1.0e6f, 1.0e6f};
    static const float sigma[2] = {10.0f, 10.0f};
    ft_configure(&t);
    t.config.particles = 300u;
    t.config.predict = struck_predict;
    t.config.lo = lo;
    t.config.hi = hi;
    t.sensors[0].loglik = struck_loglik;
    t.watch.ok_sigma = sigma;
    struck = NULL;
    ft_start(&t);
    ft_cycles(&t, 5u, 0.0f);
}

/* One more cycle from an image of the filter: the image afterwards. A configuration that was struck is put right again
 * once the call it was struck in is over, and *told counts the next call's answer. */
static void cycle_from(const unsigned char *image, unsigned char *after, size_t bytes, uint32_t *told)
{
    static ft_t whole;
    const float z = 0.1f;
    float best[2];
    whole = t;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_restore(t.f, image, bytes));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(t.f, t.now_us + FT_STEP_US, NULL));
    if (in_predict) {
        *told += (pfl_most_likely(t.f, best) == PFL_ERR_CONFIG) ? 1u : 0u;
        t = whole;
    }
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(t.f, 0u, t.now_us + FT_STEP_US, &z));
    if (!in_predict) {
        *told += (pfl_most_likely(t.f, best) == PFL_ERR_CONFIG) ? 1u : 0u;
        t = whole;
    }
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_snapshot(t.f, after, bytes));
}

/* How many of all the bits the next call told of, first with those struck in a predict. */
static uint32_t strike_every_bit(const unsigned char *image, unsigned char *at, size_t bytes)
{
    const size_t image_bytes = pfl_snapshot_bytes(t.f);
    unsigned char *clean = ut_snapshot(t.f);
    unsigned char *after = ut_snapshot(t.f);
    uint32_t told = 0u;
    cycle_from(image, clean, image_bytes, &told);
    for (size_t bit = 0u; bit < (16u * bytes); bit++) {
        in_predict = bit < (8u * bytes);
        struck = at;
        struck_bit = bit % (8u * bytes);
        cycle_from(image, after, image_bytes, &told);
        TEST_ASSERT_NULL(struck);
        TEST_ASSERT_TRUE(ut_same_posterior(clean, after, image_bytes));
    }
    return told;
}

void test_C1_any_bit_of_the_original_flipped_while_a_callback_runs_is_survived_and_told(void)
{
    start();
    const unsigned char *image = ut_snapshot(t.f);
    uint32_t told = strike_every_bit(image, (unsigned char *)&t.config, FT_CONFIG_BYTES);
    told += strike_every_bit(image, (unsigned char *)t.sensors, sizeof t.sensors);
    told += strike_every_bit(image, (unsigned char *)&t.watch, sizeof t.watch);
    TEST_ASSERT_EQUAL_UINT32(16u * (FT_CONFIG_BYTES + sizeof t.sensors + sizeof t.watch), told);
}

static unsigned char *copy_of(pfl_t *f)
{
    return (unsigned char *)f + ((const unsigned char *)f->config - (const unsigned char *)f);
}

void test_C1_any_bit_of_the_copy_flipped_while_a_callback_runs_leaves_no_trace(void)
{
    start();
    TEST_ASSERT_EQUAL_UINT32(0u, strike_every_bit(ut_snapshot(t.f), copy_of(t.f), pfl_config_copy_bytes(&t.config)));
}

void test_C1_any_bit_of_the_copy_flipped_between_calls_is_not_used_and_mended(void)
{
    start();
    float mean[2];
    const unsigned char *before = ut_snapshot(t.f);
    for (size_t bit = 0u; bit < (8u * pfl_config_copy_bytes(&t.config)); bit++) {
        flip(copy_of(t.f), bit);
        TEST_ASSERT_EQUAL_INT(PFL_ERR_CORRUPT, pfl_most_likely(t.f, mean));
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(t.f, mean, NULL));
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_most_likely(t.f, mean));
    }
    TEST_ASSERT_TRUE(ut_same_posterior(before, ut_snapshot(t.f), pfl_snapshot_bytes(t.f)));
}

void test_C1_a_fork_has_a_copy_of_its_own(void)
{
    start();
    size_t bytes = 0u;
    void *arena = ut_arena_for(&t.config, &bytes);
    pfl_t *fork = NULL;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_fork(t.f, arena, bytes, &fork));
    memset(copy_of(t.f), 0xA5, pfl_config_copy_bytes(&t.config));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(fork, t.now_us + FT_STEP_US, NULL));
    TEST_ASSERT_TRUE(pfl_invariants_hold(fork));
    TEST_ASSERT_EQUAL_INT(PFL_OK, ft_cycle(&t, 0.0f));
}
