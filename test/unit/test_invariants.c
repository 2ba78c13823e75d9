/* pfl_invariants_hold sees every damage on its own, the random generator knows when it is dead, and counters stay at the
 * end of their range. White box: the only tests that reach into the control block. */
#include "support.h"

#include "guard.h"
#include "rng_kernels.h"

#include "unity.h"

#include <string.h>

#define N 21u

static pfl_config_t config;
static pfl_t *f;

void setUp(void)
{
    config = ut_linear_config(N);
    f = ut_filter(&config);
    (void)ut_fly_linear(f, 100000u, 0.3f, 0u);
    TEST_ASSERT_TRUE(pfl_invariants_hold(f));
}

void tearDown(void)
{
    ut_arenas_end();
}

static void seen_in_word(void *word, uint32_t damage)
{
    uint32_t kept;
    memcpy(&kept, word, sizeof kept);
    memcpy(word, &damage, sizeof damage);
    TEST_ASSERT_FALSE(pfl_invariants_hold(f));
    memcpy(word, &kept, sizeof kept);
    TEST_ASSERT_TRUE(pfl_invariants_hold(f));
}

static void seen_in_float(float *number, float damage)
{
    seen_in_word(number, ut_bits(damage));
}

void test_damage_of_the_control_block_is_seen(void)
{
    seen_in_word(&f->alive, 0u);
    seen_in_word(&f->stride, f->stride + 8u);
    seen_in_word(&f->busy, 1u);
    seen_in_float(&f->log_weight_top, ut_infinity());
    seen_in_float(&f->log_weight_top, ut_nan(false));
    seen_in_float(&f->log_weight_top, f->log_weight_top + 1.0f); /* no log-weight reaches it */
    seen_in_float(&f->ess, 0.5f);
    seen_in_float(&f->ess, (float)N + 0.5f);
    seen_in_float(&f->ess, ut_nan(false));
}

void test_damage_of_the_configuration_is_seen(void)
{
#if PFL_GUARD_CONTROL /* nothing else knows that a pointer is wrong */
    const pfl_config_t *good = f->config;
    f->config = NULL;
    TEST_ASSERT_FALSE(pfl_invariants_hold(f));
    f->config = good;
#endif
    seen_in_word(&config.particles, 0u);
}

void test_damage_of_any_particle_and_weight_is_seen(void)
{
    for (uint32_t i = 0u; i < N; i++) {
        seen_in_float(&f->x[i], ut_nan((i & 1u) != 0u));
        seen_in_float(&f->x[f->stride + i], ut_infinity());
        seen_in_float(&f->log_weight[i], ut_nan(false));
        seen_in_float(&f->log_weight[i], f->log_weight_top + 1.0f);
    }
}

void test_a_dead_stream_is_seen(void)
{
    for (uint32_t lane = 0u; lane <= PFL_RNG_LANES; lane++) {
        const pfl_rng_t kept = f->rng;
        for (uint32_t k = 0u; k < 4u; k++) {
            *((lane < PFL_RNG_LANES) ? &f->rng.s[k][lane] : &f->rng.one[k]) = 0u;
        }
        TEST_ASSERT_FALSE(pfl_rng_alive(&f->rng));
        TEST_ASSERT_FALSE(pfl_invariants_hold(f));
        for (uint32_t k = 0u; k < 4u; k++) { /* one bit is life */
            uint32_t *word = (lane < PFL_RNG_LANES) ? &f->rng.s[k][lane] : &f->rng.one[k];
            *word = 1u << k;
            TEST_ASSERT_TRUE(pfl_rng_alive(&f->rng));
            *word = 0u;
        }
        f->rng = kept;
        TEST_ASSERT_TRUE(pfl_rng_alive(&f->rng));
    }
}

void test_counters_stay_at_the_end_of_their_range(void)
{
    uint32_t counter = UINT32_MAX - 3u;
    pfl_count(&counter, 2u);
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX - 1u, counter);
    pfl_count(&counter, 1u);
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX, counter);
    pfl_count(&counter, 1u);
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX, counter);
    counter = 7u;
    pfl_count(&counter, UINT32_MAX - 6u);
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX, counter);
    counter = 7u;
    pfl_count(&counter, 0u);
    TEST_ASSERT_EQUAL_UINT32(7u, counter);
}

void test_answers_refuse_each_bad_argument_alone(void)
{
    float x[2];
    pfl_view_t view;
    pfl_health_t health;
    pfl_t *dead = (pfl_t *)ut_arena(PFL_ARENA_BYTES(N, 2, 2));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_particles(NULL, &view, NULL));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_health(NULL, &health));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_farthest(NULL, 0u, 1u, 0.0f, 0.0f, x));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_farthest(f, 0u, 1u, 0.0f, 0.0f, NULL));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_CORRUPT, pfl_farthest(dead, 0u, 1u, 0.0f, 0.0f, x));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_farthest(f, 2u, 1u, 0.0f, 0.0f, x));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_farthest(f, 0u, 2u, 0.0f, 0.0f, x));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_farthest(f, 0u, 1u, ut_nan(false), 0.0f, x));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_farthest(f, 0u, 1u, 0.0f, ut_infinity(), x));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_farthest(f, 0u, 1u, 0.0f, 0.0f, x));
    TEST_ASSERT_EQUAL_HEX32(0u, ut_bits(pfl_effective_sample_size(dead)));
    TEST_ASSERT_EQUAL_UINT(0u, pfl_arena_bytes(NULL));
    config.particles = 0u;
    TEST_ASSERT_EQUAL_UINT(0u, pfl_arena_bytes(&config));
    config.particles = N;
    TEST_ASSERT_EQUAL_UINT(PFL_ARENA_BYTES(N, 2, 2), pfl_arena_bytes(&config));
}

/* Every column of a copy lies where the original's lies, in the copy's own arena. */
void test_a_fork_points_into_its_own_arena(void)
{
    const size_t bytes = pfl_arena_bytes(&config);
    pfl_t *copy = NULL;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_fork(f, ut_arena(bytes), bytes, &copy));
    const float *const from[] = {f->mean,       f->best,  f->centre, f->delta, f->cov,        f->kernel_mean,
                                 f->kernel_cov, f->lanes, f->work,   f->x,     f->log_weight, f->scratch};
    const float *const to[] = {copy->mean, copy->best,        copy->centre,     copy->delta,
                               copy->cov,  copy->kernel_mean, copy->kernel_cov, copy->lanes,
                               copy->work, copy->x,           copy->log_weight, copy->scratch};
    for (size_t k = 0u; k < (sizeof from / sizeof from[0]); k++) {
        TEST_ASSERT_EQUAL_INT64((const char *)from[k] - (const char *)f, (const char *)to[k] - (const char *)copy);
    }
}

/* A top that memory errors took away: the search for its particle ends at the last one. */
void test_the_search_for_a_lost_top_stays_in_the_array(void)
{
    f->log_weight_top = 1234.5f;
    pfl_set_best(f, 0u);
    TEST_ASSERT_EQUAL_UINT32(N - 1u, f->best_index);
    TEST_ASSERT_EQUAL_HEX32(ut_bits(f->x[N - 1u]), ut_bits(f->best[0]));
}

/* A log-weight that a memory error set far above the top weighs nothing. */
void test_a_damaged_log_weight_weighs_nothing(void)
{
    (void)pfl_moments(f, false);
    const float whole = f->ess;
    f->log_weight[5] = f->log_weight_top + 80.0f;
    (void)pfl_moments(f, false);
    TEST_ASSERT_TRUE((f->ess >= 1.0f) && (f->ess < whole));
    TEST_ASSERT_EQUAL_HEX32(0u, ut_bits(f->scratch[5]));
}

/* ---- What lies in the arena without a copy, damaged there -------------------------------------------------------- */

void test_damaged_moments_are_computed_anew(void)
{
    float mean[2];
    float cov[4];
    float again[2];
    float again_cov[4];
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(f, mean, cov));
    float *const places[] = {&f->mean[0], &f->mean[1], &f->cov[0], &f->cov[1], &f->cov[2]};
    for (uint32_t k = 0u; k < 5u; k++) {
        *places[k] = ((k & 1u) != 0u) ? ut_infinity() : ut_nan(false);
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(f, again, again_cov));
        TEST_ASSERT_EQUAL_MEMORY(mean, again, sizeof mean);
        TEST_ASSERT_EQUAL_MEMORY(cov, again_cov, sizeof cov);
    }
}

/* A number that no longer means anything does not disturb those that do. */
void test_without_a_covariance_nobody_looks_at_its_place(void)
{
    float mean[2];
    config.moments = (uint16_t)PFL_MOMENTS_MEAN;
    f = ut_filter(&config);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(f, mean, NULL));
    f->mean[0] = 123.0f; /* handed out as long as nothing asks for new ones */
    f->cov[0] = ut_nan(false);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(f, mean, NULL));
    TEST_ASSERT_EQUAL_FLOAT(123.0f, mean[0]);
}

void test_a_damaged_most_likely_particle_is_not_handed_out(void)
{
    float state[2] = {7.0f, 8.0f};
    for (uint32_t d = 0u; d < 2u; d++) {
        const float kept = f->best[d];
        f->best[d] = ut_nan(d != 0u);
        TEST_ASSERT_EQUAL_INT(PFL_ERR_CORRUPT, pfl_most_likely(f, state));
        TEST_ASSERT_EQUAL_FLOAT(7.0f, state[0]);
        TEST_ASSERT_EQUAL_FLOAT(8.0f, state[1]);
        f->best[d] = kept;
    }
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_most_likely(f, state));
    TEST_ASSERT_EQUAL_MEMORY(f->best, state, sizeof state);
}

void test_a_quantile_at_a_damaged_particle_is_refused(void)
{
    float value = 7.0f;
    f->x[4] = ut_nan(false); /* sorts behind all others */
    TEST_ASSERT_EQUAL_INT(PFL_ERR_NONFINITE, pfl_quantile(f, 0u, 1.0f, &value));
    TEST_ASSERT_EQUAL_FLOAT(7.0f, value);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_quantile(f, 0u, 0.5f, &value));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_quantile(f, 1u, 1.0f, &value));
}

/* All weights lost: the quantiles are those of equal ones. */
void test_quantiles_survive_the_loss_of_every_weight(void)
{
    pfl_health_t health;
    for (uint32_t i = 0u; i < N; i++) {
        f->x[i] = (float)i;
        f->log_weight[i] = ut_nan((i & 1u) != 0u);
    }
    for (uint32_t i = 1u; i <= N; i++) {
        float value = -1.0f;
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_quantile(f, 0u, ((float)i - 0.5f) / (float)N, &value));
        TEST_ASSERT_EQUAL_FLOAT((float)(i - 1u), value);
    }
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_health(f, &health));
    TEST_ASSERT_EQUAL_UINT32(N + 1u, health.mended); /* and their top */
    TEST_ASSERT_TRUE((health.event & PFL_EVENT_MENDED) != 0u);
    TEST_ASSERT_TRUE(pfl_invariants_hold(f));
}

void test_a_damaged_jump_is_not_handed_out(void)
{
    float delta[2] = {7.0f, 8.0f};
    uint32_t count = 9u;
    for (uint32_t d = 0u; d < 2u; d++) {
        f->delta[d] = ut_infinity();
        TEST_ASSERT_EQUAL_INT(PFL_ERR_CORRUPT, pfl_last_reset(f, &count, NULL, delta));
        f->delta[d] = 0.0f;
    }
    TEST_ASSERT_EQUAL_UINT32(9u, count);
    TEST_ASSERT_EQUAL_FLOAT(7.0f, delta[0]);
    TEST_ASSERT_EQUAL_FLOAT(8.0f, delta[1]);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_last_reset(f, &count, NULL, delta));
}
