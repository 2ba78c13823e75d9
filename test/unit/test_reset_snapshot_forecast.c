/* Starting anew, keeping a filter as bytes, copying it, and looking ahead on a copy. */
#include "support.h"

#include "pflight/math.h"

#include "unity.h"

#include <float.h>
#include <math.h>
#include <string.h>

#define N 90u

static float ll[N];

void setUp(void)
{
    memset(ll, 0, sizeof ll);
}

void tearDown(void)
{
    ut_arenas_end();
}

static pfl_t *flown(const pfl_config_t *c, uint32_t cycles)
{
    pfl_t *f = ut_filter(c);
    for (uint32_t k = 1u; k <= cycles; k++) {
        (void)ut_fly_linear(f, k * 100000u, 0.1f * (float)k, 0u);
    }
    return f;
}

static pfl_health_t health_of(const pfl_t *f)
{
    pfl_health_t h;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_health(f, &h));
    return h;
}

/* ---- Reset ------------------------------------------------------------------------------------------------------------ */

void test_last_reset_is_zero_before_the_first(void)
{
    uint32_t count = 9u;
    uint64_t t_us = 9u;
    float delta[2] = {9.0f, 9.0f};
    const pfl_config_t c = ut_linear_config(N);
    pfl_t *f = flown(&c, 2u);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_last_reset(f, &count, &t_us, delta));
    TEST_ASSERT_EQUAL_UINT32(0u, count);
    TEST_ASSERT_TRUE(t_us == 0u);
    TEST_ASSERT_EQUAL_HEX32(0u, ut_bits(delta[0]) | ut_bits(delta[1]));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_last_reset(f, NULL, NULL, NULL));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_last_reset(NULL, &count, &t_us, delta));
}

void test_reset_draws_anew_counts_and_keeps_the_jump(void)
{
    float before[2];
    float after[2];
    float delta[2];
    const pfl_config_t c = ut_linear_config(N);
    pfl_t *f = flown(&c, 12u);
    for (uint32_t k = 1u; k <= 4u; k++) {
        uint32_t count = 0u;
        uint64_t t_us = 0u;
        const uint64_t to_us = ((k & 1u) != 0u) ? 5u : (5000000u * k); /* before the filter's time, and after */
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(f, before, NULL));
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_reset(f, to_us));
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(f, after, NULL));
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_last_reset(f, &count, &t_us, delta));
        TEST_ASSERT_EQUAL_UINT32(k, count);
        TEST_ASSERT_EQUAL_UINT32(k, health_of(f).resets);
        TEST_ASSERT_TRUE((t_us == to_us) && (health_of(f).t_us == to_us));
        TEST_ASSERT_FLOAT_WITHIN(1.0e-6f, after[0] - before[0], delta[0]);
        TEST_ASSERT_FLOAT_WITHIN(1.0e-6f, after[1] - before[1], delta[1]);
        TEST_ASSERT_FLOAT_WITHIN(0.0f, (float)N, pfl_effective_sample_size(f));
        TEST_ASSERT_TRUE(fabsf(after[0]) < 0.5f); /* the prior's mean, +-1/sqrt(90) */
        TEST_ASSERT_TRUE(pfl_invariants_hold(f));
    }
    (void)ut_fly_linear(f, 5000000u * 4u + 1000u, 0.0f, 0u);
}

void test_reset_gives_equal_weights(void)
{
    float weights[N];
    pfl_view_t view;
    pfl_config_t c = ut_linear_config(N);
    c.ess_ratio = 0.0f;
    pfl_t *f = flown(&c, 5u);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_reset(f, 0u));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_particles(f, &view, weights));
    for (uint32_t i = 0u; i < N; i++) {
        TEST_ASSERT_FLOAT_WITHIN(1.0e-6f, 0.0f, weights[i]);
    }
}

/* Angles: the jump is wrapped. */
static void seam_draw(void *user, const pfl_batch_t *p)
{
    for (uint32_t i = 0u; i < p->n; i++) {
        PFL_STATE(p, 0)[i] = *(const float *)user;
    }
}

void test_the_jump_of_an_angle_is_wrapped(void)
{
    float angle = 3.0f;
    float delta = 0.0f;
    pfl_config_t c = ut_dictated_config(N, 1u);
    c.circular_mask = 1u;
    c.circular = pfl_circular_means;
    c.draw = seam_draw;
    c.user = &angle;
    pfl_t *f = ut_filter(&c);
    angle = -3.0f;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_reset(f, 0u));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_last_reset(f, NULL, NULL, &delta));
    TEST_ASSERT_FLOAT_WITHIN(1.0e-5f, 0.28318531f, delta);
}

void test_reset_without_draw_is_refused_unchanged(void)
{
    pfl_config_t c = ut_linear_config(N);
    c.draw = NULL;
    pfl_t *f = flown(&c, 3u);
    const unsigned char *before = ut_snapshot(f);
    TEST_ASSERT_EQUAL_INT(PFL_ERR_NO_DRAW, pfl_reset(f, 0u));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_reset(NULL, 0u));
    TEST_ASSERT_TRUE(ut_same_bytes(before, ut_snapshot(f), pfl_snapshot_bytes(f)));
}

static bool spoil;

static void spoiled_draw(void *user, const pfl_batch_t *p)
{
    ut_linear_draw(user, p);
    if (spoil && ((p->first + p->n) == N)) {
        PFL_STATE(p, 1)[p->n - 1u] = ut_nan(false);
    }
}

void test_a_draw_that_fails_leaves_all_particles_at_the_last_mean(void)
{
    float mean[2];
    pfl_view_t view;
    pfl_config_t c = ut_linear_config(N);
    c.draw = spoiled_draw;
    spoil = false;
    pfl_t *f = flown(&c, 3u);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(f, mean, NULL));
    spoil = true;
    TEST_ASSERT_EQUAL_INT(PFL_ERR_NONFINITE, pfl_reset(f, 400000u));
    spoil = false;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_particles(f, &view, NULL));
    for (uint32_t i = 0u; i < N; i++) {
        TEST_ASSERT_EQUAL_HEX32(ut_bits(mean[0]), ut_bits(PFL_STATE(&view, 0)[i]));
        TEST_ASSERT_EQUAL_HEX32(ut_bits(mean[1]), ut_bits(PFL_STATE(&view, 1)[i]));
    }
    TEST_ASSERT_TRUE(pfl_invariants_hold(f));
    (void)ut_fly_linear(f, 500000u, 0.0f, 0u);
}

/* ---- A cloud whose moments do not fit a float --------------------------------------------------------------------------- */

static float drawn_at;

static void drawn_at_draw(void *user, const pfl_batch_t *p)
{
    (void)user;
    for (uint32_t i = 0u; i < p->n; i++) {
        PFL_STATE(p, 0)[i] = drawn_at;
        PFL_STATE(p, 1)[i] = -drawn_at;
    }
}

void test_a_jump_beyond_single_precision_is_the_largest_there_is(void)
{
    float delta[2];
    pfl_config_t c = ut_linear_config(N);
    c.draw = drawn_at_draw;
    drawn_at = -3.0e38f;
    pfl_t *f = ut_filter(&c);
    drawn_at = 3.0e38f;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_reset(f, 1000u));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_last_reset(f, NULL, NULL, delta));
    TEST_ASSERT_EQUAL_HEX32(ut_bits(FLT_MAX), ut_bits(delta[0]));
    TEST_ASSERT_EQUAL_HEX32(ut_bits(-FLT_MAX), ut_bits(delta[1]));
}

static float huge_draw_scale;

static void huge_draw(void *user, const pfl_batch_t *p)
{
    (void)user;
    for (uint32_t i = 0u; i < p->n; i++) {
        PFL_STATE(p, 0)[i] = ((i & 1u) != 0u) ? huge_draw_scale : -huge_draw_scale;
    }
}

static pfl_t *overflowed(void)
{
    static pfl_config_t c;
    c = ut_dictated_config(N, 1u);
    c.draw = huge_draw;
    huge_draw_scale = 3.0e38f;
    pfl_t *f = ut_filter(&c);
    TEST_ASSERT_EQUAL_INT(PFL_ERR_NONFINITE, pfl_estimate(f, ll, NULL));
    return f;
}

void test_a_filter_with_overflowed_moments_can_be_kept_and_restored(void)
{
    pfl_t *f = overflowed();
    TEST_ASSERT_TRUE(pfl_invariants_hold(f));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_restore(f, ut_snapshot(f), pfl_snapshot_bytes(f)));
}

void test_a_reset_out_of_overflowed_moments_tells_a_finite_jump(void)
{
    float delta = 0.0f;
    pfl_t *f = overflowed();
    huge_draw_scale = 1.0f;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_reset(f, 0u));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_last_reset(f, NULL, NULL, &delta));
    TEST_ASSERT_TRUE_MESSAGE(ut_finite(delta), "the jump of the mean is not finite");
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_restore(f, ut_snapshot(f), pfl_snapshot_bytes(f)));
}

void test_a_failed_reset_out_of_overflowed_moments_leaves_finite_particles(void)
{
    pfl_t *f = overflowed();
    huge_draw_scale = ut_infinity();
    TEST_ASSERT_EQUAL_INT(PFL_ERR_NONFINITE, pfl_reset(f, 0u));
    TEST_ASSERT_TRUE(pfl_invariants_hold(f));
}

/* ---- Snapshot ----------------------------------------------------------------------------------------------------------- */

static uint64_t fly_on(pfl_t *f, uint32_t from)
{
    uint64_t hash = UT_FNV_SEED;
    for (uint32_t k = from + 1u; k <= (from + 50u); k++) {
        hash = ut_fly_linear(f, k * 100000u, 0.1f * (float)(k % 7u), hash);
    }
    return hash;
}

void test_a_restored_filter_continues_with_the_same_bits(void)
{
    static const pfl_scheme_fn schemes[] = {pfl_systematic, pfl_stratified, pfl_residual, pfl_multinomial};
    for (size_t k = 0u; k < (sizeof schemes / sizeof schemes[0]); k++) {
        pfl_config_t c = ut_linear_config(N);
        c.resampling = schemes[k];
        pfl_t *f = flown(&c, 8u);
        const unsigned char *kept = ut_snapshot(f);
        const size_t bytes = pfl_snapshot_bytes(f);
        const uint64_t hash = fly_on(f, 8u);
        const unsigned char *end = ut_snapshot(f);
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_restore(f, kept, bytes));
        TEST_ASSERT_TRUE(ut_same_bytes(kept, ut_snapshot(f), bytes));
        TEST_ASSERT_TRUE(hash == fly_on(f, 8u));
        TEST_ASSERT_TRUE(ut_same_bytes(end, ut_snapshot(f), bytes));

        c.seed = 999u; /* another instance, which was elsewhere */
        pfl_t *twin = flown(&c, 3u);
        TEST_ASSERT_EQUAL_UINT(bytes, pfl_snapshot_bytes(twin));
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_restore(twin, kept, bytes));
        TEST_ASSERT_TRUE(hash == fly_on(twin, 8u));
        TEST_ASSERT_TRUE(ut_same_bytes(end, ut_snapshot(twin), bytes));
    }
}

/* Between predict and update, and with weights that have not been resampled. */
void test_a_snapshot_in_mid_cycle_continues_with_the_same_bits(void)
{
    const float z = 0.4f;
    float mean[2][2];
    float cov[2][4];
    pfl_config_t c = ut_linear_config(N);
    c.ess_ratio = 0.0f;
    pfl_t *f = flown(&c, 4u);
    pfl_t *twin = ut_filter(&c);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(f, 500000u, NULL));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_restore(twin, ut_snapshot(f), pfl_snapshot_bytes(f)));
    for (uint32_t k = 0u; k < 2u; k++) {
        pfl_t *g = (k == 0u) ? f : twin;
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(g, 0u, 500000u, &z));
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(g, mean[k], cov[k]));
    }
    TEST_ASSERT_EQUAL_MEMORY(mean[0], mean[1], sizeof mean[0]);
    TEST_ASSERT_EQUAL_MEMORY(cov[0], cov[1], sizeof cov[0]);
}

void test_restored_filter_answers_as_the_kept_one(void)
{
    float best[2][2];
    float mean[2][2];
    float cov[2][4];
    uint32_t count[2];
    const pfl_config_t c = ut_linear_config(N);
    pfl_t *f = flown(&c, 4u);
    pfl_t *twin = ut_filter(&c);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_reset(f, 77u));
    (void)ut_fly_linear(f, 100077u, 1.0f, 0u);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_restore(twin, ut_snapshot(f), pfl_snapshot_bytes(f)));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(f, mean[0], cov[0]));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(twin, mean[1], cov[1]));
    TEST_ASSERT_EQUAL_MEMORY(mean[0], mean[1], sizeof mean[0]);
    TEST_ASSERT_EQUAL_MEMORY(cov[0], cov[1], sizeof cov[0]);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_most_likely(f, best[0]));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_most_likely(twin, best[1]));
    TEST_ASSERT_EQUAL_MEMORY(best[0], best[1], sizeof best[0]);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_last_reset(f, &count[0], NULL, best[0]));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_last_reset(twin, &count[1], NULL, best[1]));
    TEST_ASSERT_EQUAL_MEMORY(best[0], best[1], sizeof best[0]);
    TEST_ASSERT_EQUAL_UINT32(count[0], count[1]);
    const pfl_health_t a = health_of(f);
    const pfl_health_t b = health_of(twin);
    TEST_ASSERT_EQUAL_MEMORY(&a, &b, sizeof a);
}

void test_every_flipped_bit_of_a_snapshot_is_refused(void)
{
    const pfl_config_t small = ut_linear_config(5u);
    pfl_t *f = flown(&small, 3u);
    const size_t bytes = pfl_snapshot_bytes(f);
    unsigned char *kept = ut_snapshot(f);
    (void)ut_fly_linear(f, 400000u, 0.0f, 0u);
    const unsigned char *before = ut_snapshot(f);
    unsigned char *now = ut_snapshot(f);
    for (size_t bit = 0u; bit < (8u * bytes); bit++) {
        kept[bit / 8u] ^= (unsigned char)(1u << (bit % 8u));
        TEST_ASSERT_EQUAL_INT(PFL_ERR_CORRUPT, pfl_restore(f, kept, bytes));
        kept[bit / 8u] ^= (unsigned char)(1u << (bit % 8u));
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_snapshot(f, now, bytes));
        TEST_ASSERT_TRUE(ut_same_bytes(before, now, bytes));
    }
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_restore(f, kept, bytes));
}

/* CRC-32 of the format, written anew: what follows must be refused for its contents, not for its checksum. */
static void seal(unsigned char *kept, size_t bytes)
{
    uint32_t crc = 0xFFFFFFFFu;
    for (size_t i = 0u; i < (bytes - 4u); i++) {
        crc ^= kept[i];
        for (uint32_t bit = 0u; bit < 8u; bit++) {
            crc = (crc >> 1) ^ (0xEDB88320u & (0u - (crc & 1u)));
        }
    }
    for (uint32_t k = 0u; k < 4u; k++) {
        kept[bytes - 4u + k] = (unsigned char)((~crc >> (8u * k)) & 0xFFu);
    }
}

static uint32_t word_at(const unsigned char *kept, size_t k)
{
    return (uint32_t)kept[4u * k] | ((uint32_t)kept[(4u * k) + 1u] << 8) | ((uint32_t)kept[(4u * k) + 2u] << 16) |
           ((uint32_t)kept[(4u * k) + 3u] << 24);
}

/* The answer to a snapshot with one word replaced, and its CRC right. */
static pfl_status_t restored_with(pfl_t *f, unsigned char *kept, size_t k, uint32_t word)
{
    const size_t bytes = pfl_snapshot_bytes(f);
    const uint32_t old = word_at(kept, k);
    for (uint32_t i = 0u; i < 2u; i++) {
        const uint32_t now = (i == 0u) ? word : old;
        for (uint32_t b = 0u; b < 4u; b++) {
            kept[(4u * k) + b] = (unsigned char)((now >> (8u * b)) & 0xFFu);
        }
        seal(kept, bytes);
        if (i == 0u) {
            const pfl_status_t status = pfl_restore(f, kept, bytes);
            if (status != PFL_ERR_CORRUPT) {
                return status;
            }
        }
    }
    return PFL_ERR_CORRUPT;
}

/* The words of a snapshot: head 0 .. 27, streams 28 .. 63, moments, states, log-weights, CRC. */
void test_a_snapshot_that_lies_under_a_right_checksum_is_refused(void)
{
    enum { STREAMS = 43, MOMENTS = 79, COUNT = 5 };
    static const struct {
        size_t at;
        uint32_t word;
    } lies[] = {
        {0, 0x73706671u},
        {1, 1u},
        {2, COUNT + 1u},
        {3, 3u},
        {4, 3u},
        {11, 0x7F800000u},
        {11, 0x43000000u}, /* a top that no log-weight reaches */
        {12, 0x7F800000u},
        {12, 0u},
        {12, 0xBF800000u},
        {12, 0x7FC00000u},
        {13, 0x7F800000u},
        {13, 0xBF800000u}, /* a test ratio below zero */
        {14, 0x7FC00000u},
        {14, 0x3F7FFFFFu},
        {14, 0x40A00001u},
        {15, 3u},
        {16, 2u},
        {24, 1u},
        {27, COUNT},
        {29, 1u},          /* sensors under watch */
        {32, 6u},          /* no such phase */
        {34, 2u},          /* a refusal by a sensor that is not there */
        {41, 0x7F800000u}, /* best log-likelihood */
        {42, 0x7FC00000u}, /* test ratio before */
        {42, 0xBF800000u},
        {MOMENTS, 0x7FC00000u},
        {MOMENTS + 4 * 2 + 3, 0xFF800000u}, /* a state */
    };
    const pfl_config_t small = ut_linear_config(COUNT);
    pfl_t *f = flown(&small, 3u);
    const size_t bytes = pfl_snapshot_bytes(f);
    const size_t weights = (bytes / 4u) - 1u - COUNT;
    unsigned char *kept = ut_snapshot(f);
    const unsigned char *before = ut_snapshot(f);
    for (size_t k = 0u; k < (sizeof lies / sizeof lies[0]); k++) {
        TEST_ASSERT_EQUAL_INT(PFL_ERR_CORRUPT, restored_with(f, kept, lies[k].at, lies[k].word));
    }
    for (size_t i = 0u; i < COUNT; i++) {
        TEST_ASSERT_EQUAL_INT(PFL_ERR_CORRUPT, restored_with(f, kept, weights + i, 0x7FC00000u)); /* NaN */
        TEST_ASSERT_EQUAL_INT(PFL_ERR_CORRUPT, restored_with(f, kept, weights + i, 0x7F000000u)); /* above the top */
    }
    TEST_ASSERT_TRUE(ut_same_bytes(before, ut_snapshot(f), bytes));
    /* every other stream alive, one dead */
    for (size_t lane = 0u; lane < 9u; lane++) {
        unsigned char *dead = ut_snapshot(f);
        for (size_t k = 0u; k < 4u; k++) {
            const size_t at = STREAMS + ((lane < 8u) ? ((k * 8u) + lane) : (32u + k));
            memset(&dead[4u * at], 0, 4u);
        }
        seal(dead, bytes);
        TEST_ASSERT_EQUAL_INT(PFL_ERR_CORRUPT, pfl_restore(f, dead, bytes));
    }
    TEST_ASSERT_TRUE(ut_same_bytes(before, ut_snapshot(f), bytes));
    TEST_ASSERT_EQUAL_INT(PFL_OK,
                          restored_with(f, kept, weights, 0xFF800000u)); /* a particle without weight is legal */
}

void test_a_truncated_snapshot_is_refused(void)
{
    const pfl_config_t c = ut_linear_config(5u);
    pfl_t *f = flown(&c, 3u);
    const size_t bytes = pfl_snapshot_bytes(f);
    const unsigned char *kept = ut_snapshot(f);
    for (size_t n = 0u; n < bytes; n++) {
        unsigned char *part = (unsigned char *)ut_arena(n); /* a sanitizer sees a read beyond it */
        memcpy(part, kept, n);
        TEST_ASSERT_EQUAL_INT(PFL_ERR_CORRUPT, pfl_restore(f, part, n));
    }
    TEST_ASSERT_TRUE(ut_same_bytes(kept, ut_snapshot(f), bytes));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_restore(f, NULL, bytes));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_restore(NULL, kept, bytes));
}

void test_a_snapshot_of_another_shape_is_refused(void)
{
    const pfl_config_t c = ut_linear_config(N);
    pfl_t *f = flown(&c, 3u);
    for (uint32_t k = 0u; k < 3u; k++) {
        pfl_config_t odd = ut_linear_config((k == 0u) ? (N - 1u) : N);
        odd.states = (k == 1u) ? 3u : 2u;
        odd.noises = (k == 2u) ? 3u : 2u;
        pfl_t *other = ut_filter(&odd);
        const unsigned char *kept = ut_snapshot(other);
        const unsigned char *before = ut_snapshot(f);
        TEST_ASSERT_EQUAL_INT(PFL_ERR_CORRUPT, pfl_restore(f, kept, pfl_snapshot_bytes(other)));
        TEST_ASSERT_TRUE(ut_same_bytes(before, ut_snapshot(f), pfl_snapshot_bytes(f)));
    }
}

void test_a_snapshot_needs_its_room(void)
{
    const pfl_config_t c = ut_linear_config(N);
    pfl_t *f = flown(&c, 1u);
    const size_t bytes = pfl_snapshot_bytes(f);
    unsigned char *buffer = (unsigned char *)ut_arena(bytes);
    TEST_ASSERT_EQUAL_INT(PFL_ERR_MEMORY, pfl_snapshot(f, buffer, bytes - 1u));
    TEST_ASSERT_TRUE(ut_untouched(buffer, bytes));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_snapshot(f, NULL, bytes));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_snapshot(NULL, buffer, bytes));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_snapshot(f, buffer, bytes));
    TEST_ASSERT_EQUAL_UINT(0u, pfl_snapshot_bytes(NULL));
    unsigned char *roomy = (unsigned char *)ut_arena(bytes + 24u); /* a larger buffer will do, both ways */
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_snapshot(f, roomy, bytes + 24u));
    TEST_ASSERT_TRUE(ut_same_bytes(buffer, roomy, bytes));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_restore(f, roomy, bytes + 24u));
}

void test_a_snapshot_is_little_endian_and_versioned(void)
{
    const pfl_config_t c = ut_linear_config(N);
    const unsigned char head[12] = {0x70u, 0x66u, 0x70u, 0x73u, 2u, 0u, 0u, 0u, (unsigned char)N, 0u, 0u, 0u};
    pfl_t *f = flown(&c, 1u);
    TEST_ASSERT_EQUAL_MEMORY(head, ut_snapshot(f), sizeof head);
}

/* ---- Fork ---------------------------------------------------------------------------------------------------------------- */

static pfl_t *fork_of(const pfl_t *f, const pfl_config_t *c)
{
    size_t bytes = 0u;
    void *arena = ut_arena_for(c, &bytes);
    pfl_t *copy = NULL;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_fork(f, arena, bytes, &copy));
    TEST_ASSERT_TRUE((void *)copy == arena);
    return copy;
}

void test_a_fork_holds_the_same_cloud_and_draws_other_numbers(void)
{
    float a[2];
    float b[2];
    pfl_view_t mine;
    pfl_view_t its;
    const pfl_config_t c = ut_linear_config(N);
    pfl_t *f = flown(&c, 6u);
    pfl_t *copy = fork_of(f, &c);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(f, a, NULL));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(copy, b, NULL));
    TEST_ASSERT_EQUAL_MEMORY(a, b, sizeof a);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_particles(f, &mine, NULL));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_particles(copy, &its, NULL));
    TEST_ASSERT_TRUE(mine.x != its.x);
    TEST_ASSERT_EQUAL_MEMORY(mine.x, its.x, sizeof(float) * N);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(f, 700000u, NULL));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(copy, 700000u, NULL));
    uint32_t same = 0u;
    for (uint32_t i = 0u; i < N; i++) {
        same += (ut_bits(mine.x[i]) == ut_bits(its.x[i])) ? 1u : 0u;
    }
    TEST_ASSERT_TRUE(same < 3u);
}

void test_a_fork_and_its_original_do_not_touch_each_other(void)
{
    const pfl_config_t c = ut_linear_config(N);
    pfl_t *f = flown(&c, 6u);
    const unsigned char *before = ut_snapshot(f);
    pfl_t *copy = fork_of(f, &c);
    TEST_ASSERT_TRUE(ut_same_bytes(before, ut_snapshot(f), pfl_snapshot_bytes(f)));
    const uint64_t hash = fly_on(copy, 6u);
    TEST_ASSERT_TRUE(ut_same_bytes(before, ut_snapshot(f), pfl_snapshot_bytes(f)));
    pfl_t *second = fork_of(f, &c);
    (void)fly_on(f, 6u);
    TEST_ASSERT_TRUE(hash == fly_on(second, 6u)); /* forks replay */
}

void test_a_fork_needs_another_good_arena(void)
{
    const pfl_config_t c = ut_linear_config(N);
    pfl_t *f = flown(&c, 2u);
    const size_t bytes = PFL_ARENA_BYTES(N, 2, 2);
    unsigned char *arena = (unsigned char *)ut_arena(bytes + 8u);
    pfl_t *out = f;
    TEST_ASSERT_EQUAL_INT(PFL_ERR_MEMORY, pfl_fork(f, arena, bytes - 1u, &out));
    TEST_ASSERT_NULL(out);
    TEST_ASSERT_EQUAL_INT(PFL_ERR_MEMORY, pfl_fork(f, arena + 4, bytes, &out));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_MEMORY, pfl_fork(f, NULL, bytes, &out));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_MEMORY, pfl_fork(f, f, bytes, &out));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_fork(f, arena, bytes, NULL));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_fork(NULL, arena, bytes, &out));
    TEST_ASSERT_TRUE(ut_untouched(arena, bytes + 8u));
}

/* ---- Forecast -------------------------------------------------------------------------------------------------------------- */

enum { STEPS = 40 };
static float path[2 * STEPS];
static float spread[4 * STEPS];

static pfl_status_t forecast(const pfl_t *f, const pfl_config_t *c, const pfl_horizon_t *h, pfl_t **out)
{
    size_t bytes = 0u;
    void *arena = ut_arena_for(c, &bytes);
    return pfl_forecast(f, arena, bytes, h, path, spread, out);
}

/* Closed form: P <- F P F' + Q at every step, m <- F m, from the filter's own moments. */
static void closed_form_matches(const float *m0, const float *p0, double dt)
{
    double m[2] = {(double)m0[0], (double)m0[1]};
    double p[3] = {(double)p0[0], (double)p0[1], (double)p0[3]};
    for (uint32_t k = 0u; k < STEPS; k++) {
        m[0] += dt * m[1];
        p[0] += (2.0 * dt * p[1]) + (dt * dt * p[2]) + 0.01;
        p[1] += dt * p[2];
        p[2] += 0.0025;
        const double sigma = sqrt(p[0] / 4000.0);
        TEST_ASSERT_DOUBLE_WITHIN(5.0 * sigma, m[0], (double)path[2u * k]);
        TEST_ASSERT_DOUBLE_WITHIN(5.0 * sqrt(p[2] / 4000.0), m[1], (double)path[(2u * k) + 1u]);
        TEST_ASSERT_DOUBLE_WITHIN(0.12 * p[0], p[0], (double)spread[4u * k]); /* 5 sqrt(2/4000) = 0.11 */
        TEST_ASSERT_DOUBLE_WITHIN(0.12 * sqrt(p[0] * p[2]), p[1], (double)spread[(4u * k) + 1u]);
        TEST_ASSERT_DOUBLE_WITHIN(0.12 * p[2], p[2], (double)spread[(4u * k) + 3u]);
    }
}

void test_a_forecast_of_a_linear_model_matches_its_closed_form(void)
{
    float mean[2];
    float cov[4];
    const pfl_horizon_t h = {500000u, STEPS, NULL, NULL, NULL, NULL};
    const pfl_config_t c = ut_linear_config(4000u);
    pfl_t *f = flown(&c, 10u);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(f, mean, cov));
    TEST_ASSERT_EQUAL_INT(PFL_OK, forecast(f, &c, &h, NULL));
    closed_form_matches(mean, cov, 0.5);
}

/* The same for a fast one: 300 m/s over 20 s. The cloud is far from where it was last updated. */
static void fast_draw(void *user, const pfl_batch_t *p)
{
    ut_linear_draw(user, p);
    for (uint32_t i = 0u; i < p->n; i++) {
        PFL_STATE(p, 1)[i] = 300.0f + (0.001f * PFL_STATE(p, 1)[i]);
    }
}

static void quiet_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    (void)user;
    (void)u;
    for (uint32_t i = 0u; i < p->n; i++) {
        PFL_STATE(p, 0)[i] += dt_s * PFL_STATE(p, 1)[i];
    }
}

void test_a_forecast_of_a_fast_vehicle_keeps_its_covariance(void)
{
    float mean[2];
    float cov[4];
    const pfl_horizon_t h = {500000u, STEPS, NULL, NULL, NULL, NULL};
    pfl_config_t c = ut_linear_config(500u);
    c.draw = fast_draw;
    c.predict = quiet_predict;
    pfl_t *f = ut_filter(&c);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(f, mean, cov));
    TEST_ASSERT_EQUAL_INT(PFL_OK, forecast(f, &c, &h, NULL));
    for (uint32_t k = 0u; k < STEPS; k++) {
        TEST_ASSERT_FLOAT_WITHIN(0.05f, cov[0], spread[4u * k]); /* speeds hardly differ: the spread stays */
    }
}

void test_a_forecast_leaves_the_filter_alone_and_replays(void)
{
    const pfl_horizon_t h = {500000u, STEPS, NULL, NULL, NULL, NULL};
    const pfl_config_t c = ut_linear_config(N);
    pfl_t *f = flown(&c, 10u);
    const unsigned char *before = ut_snapshot(f);
    TEST_ASSERT_EQUAL_INT(PFL_OK, forecast(f, &c, &h, NULL));
    const uint64_t hash = ut_fnv(ut_fnv(UT_FNV_SEED, path, sizeof path), spread, sizeof spread);
    TEST_ASSERT_TRUE(ut_same_bytes(before, ut_snapshot(f), pfl_snapshot_bytes(f)));
    TEST_ASSERT_EQUAL_INT(PFL_OK, forecast(f, &c, &h, NULL));
    TEST_ASSERT_TRUE(hash == ut_fnv(ut_fnv(UT_FNV_SEED, path, sizeof path), spread, sizeof spread));
}

void test_a_forecast_hands_out_the_fork_at_the_horizon(void)
{
    float mean[2];
    float value = 0.0f;
    pfl_t *out = NULL;
    const pfl_horizon_t h = {500000u, 3u, NULL, NULL, NULL, NULL};
    const pfl_config_t c = ut_linear_config(N);
    pfl_t *f = flown(&c, 10u);
    TEST_ASSERT_EQUAL_INT(PFL_OK, forecast(f, &c, &h, &out));
    TEST_ASSERT_NOT_NULL(out);
    TEST_ASSERT_TRUE(health_of(out).t_us == 2500000u);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(out, mean, NULL));
    TEST_ASSERT_EQUAL_MEMORY(&path[4], mean, sizeof mean);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_quantile(out, 0u, 0.5f, &value));
    TEST_ASSERT_FLOAT_WITHIN(2.0f, mean[0], value);
}

static uint64_t asked_t_us[4];

static const void *control(void *user, uint32_t step, uint64_t t_us)
{
    static float shifts[4];
    asked_t_us[step] = t_us;
    shifts[step] = *(const float *)user * (float)(step + 1u);
    return &shifts[step];
}

static void shift_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    (void)user;
    for (uint32_t i = 0u; (u != NULL) && (i < p->n); i++) {
        PFL_STATE(p, 0)[i] += dt_s * *(const float *)u;
    }
}

void test_a_forecast_asks_for_the_input_of_every_step(void)
{
    float unit = 10.0f;
    float mean[2];
    const pfl_horizon_t h = {250000u, 4u, control, &unit, NULL, NULL};
    pfl_config_t c = ut_linear_config(N);
    c.predict = shift_predict;
    pfl_t *f = ut_filter(&c);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(f, 1000000u, NULL));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(f, mean, NULL));
    TEST_ASSERT_EQUAL_INT(PFL_OK, forecast(f, &c, &h, NULL));
    float expected = path[0] - 2.5f;
    TEST_ASSERT_FLOAT_WITHIN(0.05f, mean[0], expected);
    for (uint32_t k = 0u; k < 4u; k++) {
        expected += 2.5f * (float)(k + 1u);
        TEST_ASSERT_FLOAT_WITHIN(1.0e-4f, expected, path[2u * k]);
        TEST_ASSERT_TRUE(asked_t_us[k] == (1000000u + (250000u * k)));
    }
}

void test_a_forecast_refuses_what_it_cannot_do(void)
{
    pfl_horizon_t h = {500000u, 3u, NULL, NULL, NULL, NULL};
    pfl_config_t c = ut_linear_config(N);
    const size_t bytes = PFL_ARENA_BYTES(N, 2, 2);
    void *arena = ut_arena(bytes);
    c.dt_max_us = 10000u;
    pfl_t *f = ut_filter(&c);
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_forecast(NULL, arena, bytes, &h, path, NULL, NULL));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_forecast(f, arena, bytes, NULL, path, NULL, NULL));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_forecast(f, arena, bytes, &h, NULL, NULL, NULL));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_MEMORY, pfl_forecast(f, arena, bytes - 1u, &h, path, NULL, NULL));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_MEMORY, pfl_forecast(f, f, bytes, &h, path, NULL, NULL));
    h.steps = 0u;
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_forecast(f, arena, bytes, &h, path, NULL, NULL));
    h.steps = 3u;
    h.step_us = 0u;
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_forecast(f, arena, bytes, &h, path, NULL, NULL));
    TEST_ASSERT_TRUE(ut_untouched(arena, bytes));
    h.step_us = 160001u; /* a gap */
    TEST_ASSERT_EQUAL_INT(PFL_ERR_GAP, pfl_forecast(f, arena, bytes, &h, path, NULL, NULL));
    pfl_config_t lean = c;
    lean.moments = (uint16_t)PFL_MOMENTS_MEAN;
    pfl_t *g = ut_filter(&lean);
    h.step_us = 1000u;
    TEST_ASSERT_EQUAL_INT(PFL_ERR_CONFIG, pfl_forecast(g, arena, bytes, &h, path, spread, NULL));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_forecast(g, arena, bytes, &h, path, NULL, NULL));
}

/* ---- A look at every step ------------------------------------------------------------------------------------------- */

typedef struct {
    uint32_t calls;
    uint32_t end_at;
    float median[STEPS];
    float reach[STEPS];
} looked_t;

static pfl_status_t look(void *user, uint32_t step, pfl_t *fork)
{
    looked_t *looked = (looked_t *)user;
    TEST_ASSERT_EQUAL_UINT32(looked->calls, step);
    looked->calls++;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_quantile(fork, 0u, 0.5f, &looked->median[step]));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_farthest(fork, 0u, 1u, looked->median[step], 0.0f, &looked->reach[step]));
    return (looked->calls == looked->end_at) ? PFL_ERR_ARG : PFL_OK;
}

void test_a_visit_sees_the_fork_after_every_step_and_changes_nothing(void)
{
    looked_t looked = {0u, 0u, {0.0f}, {0.0f}};
    float plain[2u * STEPS];
    pfl_horizon_t h = {500000u, STEPS, NULL, NULL, NULL, NULL};
    const pfl_config_t c = ut_linear_config(400u);
    pfl_t *f = ut_filter(&c);
    TEST_ASSERT_EQUAL_INT(PFL_OK, forecast(f, &c, &h, NULL));
    memcpy(plain, path, sizeof plain);
    h.visit = look;
    h.visit_user = &looked;
    TEST_ASSERT_EQUAL_INT(PFL_OK, forecast(f, &c, &h, NULL));
    TEST_ASSERT_EQUAL_UINT32(STEPS, looked.calls);
    TEST_ASSERT_EQUAL_MEMORY(plain, path, sizeof plain);
    for (uint32_t k = 0u; k < STEPS; k++) {
        TEST_ASSERT_FLOAT_WITHIN(0.25f * looked.reach[k], path[2u * k], looked.median[k]);
        TEST_ASSERT_TRUE(looked.reach[k] > 1.0f);
    }
}

void test_a_visit_can_end_the_forecast(void)
{
    looked_t looked = {0u, 3u, {0.0f}, {0.0f}};
    const pfl_horizon_t h = {500000u, STEPS, NULL, NULL, look, &looked};
    const pfl_config_t c = ut_linear_config(100u);
    pfl_t *f = ut_filter(&c);
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, forecast(f, &c, &h, NULL));
    TEST_ASSERT_EQUAL_UINT32(3u, looked.calls);
}

static void losing_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    ut_linear_predict(user, u, dt_s, p);
    PFL_STATE(p, 0)[p->n - 1u] = ut_nan(false);
}

/* A step that lost a few particles has a mean all the same. */
void test_a_forecast_that_loses_particles_says_so_and_goes_on(void)
{
    pfl_config_t c = ut_linear_config(N);
    const pfl_horizon_t h = {500000u, 3u, NULL, NULL, NULL, NULL};
    c.predict = losing_predict;
    pfl_t *f = ut_filter(&c);
    for (uint32_t k = 0u; k < 6u; k++) {
        path[k] = 1.0e9f;
    }
    TEST_ASSERT_EQUAL_INT(PFL_QUARANTINED, forecast(f, &c, &h, NULL));
    for (uint32_t k = 0u; k < 6u; k++) {
        TEST_ASSERT_TRUE((path[k] > -100.0f) && (path[k] < 100.0f));
    }
}
