/* pfl_init at the door: memory that is not fit, configurations out of range, and that nothing is written then. */
#include "support.h"

#include "unity.h"

#include <float.h>
#include <string.h>

#define N 20u
#define D 3u

/* An integer constant expression, or this does not compile. */
typedef char arena_bytes_is_constant[(PFL_ARENA_BYTES(100, 4, 2) > 512u) ? 1 : -1];
enum { ARENA_BYTES_AS_ENUMERATOR = PFL_ARENA_BYTES(7, 1, 0) };
PFL_ARENA(static_arena, N, D, 0);

static pfl_config_t config;
static pfl_sensor_t sensors[PFL_SENSORS_MAX + 1u];
static float lo[PFL_STATES_MAX];
static float hi[PFL_STATES_MAX];

void setUp(void)
{
    const pfl_sensor_t sensor = {.loglik = ut_dictated_loglik};
    for (uint32_t k = 0u; k <= PFL_SENSORS_MAX; k++) {
        sensors[k] = sensor;
    }
    for (uint32_t d = 0u; d < PFL_STATES_MAX; d++) {
        lo[d] = -1000.0f;
        hi[d] = 1000.0f;
    }
    config = ut_dictated_config(N, D);
    config.sensors = sensors;
    config.lo = lo;
    config.hi = hi;
}

void tearDown(void)
{
    ut_arenas_end();
}

/* ---- Helpers ----------------------------------------------------------------------------------------------------- */

static pfl_status_t init_in(void *arena, size_t bytes, pfl_t **out)
{
    static unsigned char somewhere;
    *out = (pfl_t *)(void *)&somewhere; /* must become null on an error */
    return pfl_init(arena, bytes, &config, 0u, out);
}

/* The configuration is refused: *out null, no byte of a good arena touched. */
static void refused_as(pfl_status_t expected)
{
    const size_t bytes = PFL_ARENA_BYTES(N, D, 0) + 4096u;
    void *arena = ut_arena(bytes);
    pfl_t *f = NULL;
    TEST_ASSERT_EQUAL_INT(expected, init_in(arena, bytes, &f));
    TEST_ASSERT_NULL(f);
    TEST_ASSERT_TRUE(ut_untouched(arena, bytes));
    TEST_ASSERT_TRUE(ut_red_zones_intact());
    setUp();
}

static void accepted(void)
{
    size_t bytes = 0u;
    void *arena = ut_arena_for(&config, &bytes);
    pfl_t *f = NULL;
    TEST_ASSERT_EQUAL_INT(PFL_OK, init_in(arena, bytes, &f));
    TEST_ASSERT_NOT_NULL(f);
    TEST_ASSERT_TRUE(pfl_invariants_hold(f));
    setUp();
}

/* ---- Memory ------------------------------------------------------------------------------------------------------ */

void test_null_arena_is_refused(void)
{
    pfl_t *f = NULL;
    TEST_ASSERT_EQUAL_INT(PFL_ERR_MEMORY, init_in(NULL, 1u << 20, &f));
    TEST_ASSERT_NULL(f);
}

void test_arena_short_by_one_byte_is_refused_untouched(void)
{
    const size_t bytes = PFL_ARENA_BYTES(N, D, 0);
    void *arena = ut_arena(bytes);
    pfl_t *f = NULL;
    TEST_ASSERT_EQUAL_INT(PFL_ERR_MEMORY, init_in(arena, bytes - 1u, &f));
    TEST_ASSERT_NULL(f);
    TEST_ASSERT_TRUE(ut_untouched(arena, bytes));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_MEMORY, init_in(arena, 0u, &f));
    TEST_ASSERT_TRUE(ut_untouched(arena, bytes));
}

void test_misaligned_arena_is_refused_untouched(void)
{
    const size_t bytes = PFL_ARENA_BYTES(N, D, 0) + 8u;
    unsigned char *arena = (unsigned char *)ut_arena(bytes);
    for (size_t offset = 1u; offset < 8u; offset++) {
        pfl_t *f = NULL;
        TEST_ASSERT_EQUAL_INT(PFL_ERR_MEMORY, init_in(arena + offset, bytes - offset, &f));
        TEST_ASSERT_NULL(f);
        TEST_ASSERT_TRUE(ut_untouched(arena, bytes));
    }
}

/* ut_filter makes arenas of exactly PFL_ARENA_BYTES between red zones: each call of the API stays inside. */
static void fly_in_exact_arena(uint32_t n, uint16_t states, uint16_t noises, uint32_t circular)
{
    static float zeros[300];
    float mean[PFL_STATES_MAX];
    float cov[PFL_STATES_MAX * PFL_STATES_MAX];
    float value = 0.0f;
    pfl_config_t c = ut_dictated_config(n, states);
    c.noises = noises;
    c.circular_mask = circular;
    c.circular = pfl_circular_means;
    pfl_t *f = ut_filter(&c);
    for (uint32_t i = 0u; i < n; i++) {
        zeros[i] = -0.01f * (float)i;
    }
    for (uint32_t k = 0u; k < 3u; k++) {
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(f, 10u * (k + 1u), NULL));
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(f, 0u, 10u * (k + 1u), zeros));
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(f, mean, cov));
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_quantile(f, (uint16_t)(states - 1u), 0.5f, &value));
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_resample(f));
    }
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_reset(f, 5u));
    TEST_ASSERT_TRUE(pfl_invariants_hold(f));
    TEST_ASSERT_TRUE_MESSAGE(ut_red_zones_intact(), "PFL_ARENA_BYTES is too small");
    ut_arenas_end();
}

void test_arena_bytes_are_enough_for_every_shape(void)
{
    static const uint32_t counts[] = {1u, 7u, 8u, 9u, 15u, 16u, 17u, 63u, 64u, 65u, 129u};
    for (size_t k = 0u; k < (sizeof counts / sizeof counts[0]); k++) {
        for (uint16_t states = 1u; states <= PFL_STATES_MAX; states++) {
            fly_in_exact_arena(counts[k], states, 0u, 0u);
            fly_in_exact_arena(counts[k], states, PFL_NOISES_MAX, (1u << states) - 1u);
        }
    }
}

void test_static_arena_has_the_right_size_and_alignment(void)
{
    pfl_t *f = NULL;
    TEST_ASSERT_EQUAL_UINT(PFL_ARENA_BYTES(N, D, 0), sizeof static_arena);
    TEST_ASSERT_EQUAL_UINT(0u, (uintptr_t)&static_arena & 7u);
    TEST_ASSERT_EQUAL_UINT(PFL_ARENA_BYTES(7, 1, 0), ARENA_BYTES_AS_ENUMERATOR);
    TEST_ASSERT_EQUAL_INT(PFL_OK, init_in(&static_arena, sizeof static_arena, &f));
    TEST_ASSERT_TRUE((void *)f == (void *)&static_arena); /* "it lives at the front of its arena" */
}

/* At most 36 bytes a particle at 4 states is promised; the macro says 4 (D + 2). */
void test_arena_grows_by_four_bytes_a_column(void)
{
    TEST_ASSERT_EQUAL_UINT(4u * 6u * 800u, PFL_ARENA_BYTES(1000, 4, 2) - PFL_ARENA_BYTES(200, 4, 2));
    TEST_ASSERT_TRUE(PFL_ARENA_BYTES(1000, 4, 2) <= (36u * 1000u));
}

/* ---- Configuration ----------------------------------------------------------------------------------------------- */

void test_null_arguments_are_refused(void)
{
    const size_t bytes = PFL_ARENA_BYTES(N, D, 0);
    void *arena = ut_arena(bytes);
    pfl_t *f = NULL;
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_init(arena, bytes, NULL, 0u, &f));
    TEST_ASSERT_NULL(f);
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_init(arena, bytes, &config, 0u, NULL));
    TEST_ASSERT_TRUE(ut_untouched(arena, bytes));
}

void test_the_good_configuration_is_accepted(void)
{
    accepted();
}

void test_other_abi_is_refused(void)
{
    for (uint32_t bit = 0u; bit < 32u; bit++) {
        config.abi = PFL_ABI ^ (1u << bit);
        refused_as(PFL_ERR_ABI);
    }
    config.abi = 0u;
    refused_as(PFL_ERR_ABI);
}

void test_sizes_out_of_range_are_refused(void)
{
    config.particles = 0u;
    refused_as(PFL_ERR_CONFIG);
    config.particles = PFL_PARTICLES_MAX + 1u;
    refused_as(PFL_ERR_CONFIG);
    config.particles = UINT32_MAX;
    refused_as(PFL_ERR_CONFIG);
    config.states = 0u;
    refused_as(PFL_ERR_CONFIG);
    config.states = PFL_STATES_MAX + 1u;
    refused_as(PFL_ERR_CONFIG);
    config.states = UINT16_MAX;
    refused_as(PFL_ERR_CONFIG);
    config.noises = PFL_NOISES_MAX + 1u;
    refused_as(PFL_ERR_CONFIG);
    config.noises = UINT16_MAX;
    refused_as(PFL_ERR_CONFIG);
}

void test_largest_sizes_are_in_range(void)
{
    config.particles = PFL_PARTICLES_MAX; /* in range, but not in this arena */
    refused_as(PFL_ERR_MEMORY);
    config.states = PFL_STATES_MAX;
    config.noises = PFL_NOISES_MAX;
    accepted();
    config.particles = 1u;
    config.states = 1u;
    accepted();
}

void test_choices_out_of_range_are_refused(void)
{
    config.moments = (uint16_t)PFL_MOMENTS_MEAN + 1u;
    refused_as(PFL_ERR_CONFIG);
    config.moments = UINT16_MAX;
    refused_as(PFL_ERR_CONFIG);
    config.circular = pfl_circular_means;
    config.circular_mask = 1u << D;
    refused_as(PFL_ERR_CONFIG);
    config.circular = pfl_circular_means;
    config.circular_mask = 0x80000000u;
    refused_as(PFL_ERR_CONFIG);
    config.circular = pfl_circular_means;
    config.circular_mask = (1u << D) - 1u;
    accepted();
}

void test_angles_without_what_averages_them_are_refused(void)
{
    config.circular_mask = 1u;
    refused_as(PFL_ERR_CONFIG);
    config.circular = pfl_circular_means;
    accepted();
    config.circular_mask = 0u;
    accepted();
}

void test_ess_ratio_out_of_range_is_refused(void)
{
    const float bad[] = {-0.01f, 1.01f, -FLT_MAX, FLT_MAX, ut_infinity(), -ut_infinity(), ut_nan(false), ut_nan(true)};
    for (size_t k = 0u; k < (sizeof bad / sizeof bad[0]); k++) {
        config.ess_ratio = bad[k];
        refused_as(PFL_ERR_CONFIG);
    }
    config.ess_ratio = 0.0f;
    accepted();
    config.ess_ratio = 1.0f;
    accepted();
}

void test_null_predict_is_refused(void)
{
    config.predict = NULL;
    refused_as(PFL_ERR_CONFIG);
}

void test_bad_sensors_are_refused(void)
{
    config.sensors = NULL;
    refused_as(PFL_ERR_CONFIG);
    config.sensor_count = PFL_SENSORS_MAX + 1u;
    refused_as(PFL_ERR_CONFIG);
    config.sensor_count = UINT16_MAX;
    refused_as(PFL_ERR_CONFIG);
    for (uint32_t k = 0u; k < PFL_SENSORS_MAX; k++) {
        config.sensor_count = PFL_SENSORS_MAX;
        sensors[k].loglik = NULL;
        refused_as(PFL_ERR_CONFIG);
    }
    config.sensor_count = PFL_SENSORS_MAX;
    accepted();
    config.sensor_count = 0u;
    config.sensors = NULL;
    accepted();
}

void test_bad_gate_is_refused(void)
{
    const float bad[] = {-0.5f, -FLT_MAX, ut_infinity(), -ut_infinity(), ut_nan(false), ut_nan(true)};
    for (size_t k = 0u; k < (sizeof bad / sizeof bad[0]); k++) {
        config.sensor_count = 3u;
        sensors[2].gate = bad[k];
        refused_as(PFL_ERR_CONFIG);
    }
    sensors[0].gate = 11.3f;
    accepted();
}

void test_half_a_box_is_refused(void)
{
    config.hi = NULL;
    refused_as(PFL_ERR_CONFIG);
    config.lo = NULL;
    refused_as(PFL_ERR_CONFIG);
    config.lo = NULL;
    config.hi = NULL;
    accepted();
}

void test_an_empty_or_nan_box_is_refused(void)
{
    for (uint32_t d = 0u; d < D; d++) {
        lo[d] = hi[d];
        refused_as(PFL_ERR_CONFIG);
        lo[d] = hi[d] + 1.0f;
        refused_as(PFL_ERR_CONFIG);
        lo[d] = ut_nan(false);
        refused_as(PFL_ERR_CONFIG);
        lo[d] = ut_nan(true);
        refused_as(PFL_ERR_CONFIG);
        hi[d] = ut_nan(false);
        refused_as(PFL_ERR_CONFIG);
        lo[d] = ut_infinity();
        refused_as(PFL_ERR_CONFIG);
        hi[d] = -ut_infinity();
        refused_as(PFL_ERR_CONFIG);
    }
}

void test_box_limits_beyond_the_states_are_not_looked_at(void)
{
    lo[D] = ut_nan(false);
    hi[D] = ut_nan(false);
    accepted();
}

void test_an_infinite_box_is_accepted(void)
{
    lo[0] = -ut_infinity();
    hi[1] = ut_infinity();
    accepted();
    lo[0] = -ut_infinity();
    hi[0] = ut_infinity();
    accepted();
}

/* ---- What a new filter is ----------------------------------------------------------------------------------------- */

static void nan_draw(void *user, const pfl_batch_t *p)
{
    const uint32_t bad = *(const uint32_t *)user;
    ut_index_draw(user, p);
    if ((bad >= p->first) && (bad < (p->first + p->n))) {
        PFL_STATE(p, D - 1u)[bad - p->first] = ut_nan((bad & 1u) != 0u);
    }
}

void test_non_finite_draw_gives_no_filter(void)
{
    const size_t bytes = PFL_ARENA_BYTES(70, D, 0);
    for (uint32_t bad = 0u; bad < 70u; bad++) {
        pfl_t *f = NULL;
        void *arena = ut_arena(bytes);
        config.particles = 70u;
        config.draw = nan_draw;
        config.user = &bad;
        TEST_ASSERT_EQUAL_INT(PFL_ERR_NONFINITE, init_in(arena, bytes, &f));
        TEST_ASSERT_NULL(f);
        /* "no filter is there": the arena does not pass for one */
        TEST_ASSERT_EQUAL_INT(PFL_ERR_CORRUPT, pfl_predict((pfl_t *)arena, 1u, NULL));
        TEST_ASSERT_FALSE(pfl_invariants_hold((const pfl_t *)arena));
    }
}

void test_without_draw_all_particles_start_at_zero(void)
{
    pfl_view_t view;
    config.draw = NULL;
    pfl_t *f = ut_filter(&config);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_particles(f, &view, NULL));
    TEST_ASSERT_EQUAL_UINT32(N, view.n);
    TEST_ASSERT_EQUAL_UINT(PFL_CEIL8(N), view.stride);
    for (uint32_t i = 0u; i < (D * N); i++) {
        TEST_ASSERT_EQUAL_HEX32(0u, ut_bits(PFL_STATE(&view, i / N)[i % N]));
    }
}

void test_a_new_filter_answers_for_its_prior(void)
{
    pfl_health_t health;
    float mean[D];
    float cov[D * D];
    float best[D];
    const pfl_health_t clean = {0};
    size_t bytes = 0u;
    void *arena = ut_arena_for(&config, &bytes);
    pfl_t *f = NULL;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_init(arena, bytes, &config, 123456789012345u, &f));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_health(f, &health));
    TEST_ASSERT_TRUE(health.t_us == 123456789012345u);
    TEST_ASSERT_EQUAL_UINT32(clean.fused + clean.rejected, health.fused + health.rejected);
    TEST_ASSERT_EQUAL_UINT32(0u, health.faulted + health.resampled + health.quarantined + health.resets);
    TEST_ASSERT_FALSE(health.counter_usable);
    TEST_ASSERT_EQUAL_UINT32(0u, health.cycles_last + health.cycles_max + health.overruns);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(f, mean, cov));
    TEST_ASSERT_FLOAT_WITHIN(1.0e-4f, 9.5f, mean[0]);
    TEST_ASSERT_FLOAT_WITHIN(1.0e-3f, 33.25f, cov[0]); /* of 0 .. 19 */
    TEST_ASSERT_FLOAT_WITHIN(0.0f, 0.0f, mean[1]);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_most_likely(f, best));
    TEST_ASSERT_TRUE((best[0] >= 0.0f) && (best[0] <= 19.0f));
}

void test_effective_sample_size_is_n_before_the_first_update(void)
{
    static const uint32_t counts[] = {1u, 2u, 3u, 7u, 20u, 100u, 300u, 1000u, 5000u, 30000u};
    for (size_t k = 0u; k < (sizeof counts / sizeof counts[0]); k++) {
        pfl_config_t c = ut_dictated_config(counts[k], 1u);
        pfl_t *f = ut_filter(&c);
        TEST_ASSERT_FLOAT_WITHIN(0.0f, (float)counts[k], pfl_effective_sample_size(f));
    }
    TEST_ASSERT_FLOAT_WITHIN(0.0f, 0.0f, pfl_effective_sample_size(NULL));
}

void test_calls_on_an_arena_without_filter_are_refused(void)
{
    const size_t bytes = PFL_ARENA_BYTES(N, D, 0);
    pfl_t *f = (pfl_t *)ut_arena(bytes);
    float x[D];
    pfl_view_t view;
    pfl_health_t health;
    pfl_t *out = NULL;
    TEST_ASSERT_EQUAL_INT(PFL_ERR_CORRUPT, pfl_predict(f, 1u, NULL));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_CORRUPT, pfl_update(f, 0u, 0u, x));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_CORRUPT, pfl_resample(f));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_CORRUPT, pfl_reset(f, 0u));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_CORRUPT, pfl_last_reset(f, NULL, NULL, NULL));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_CORRUPT, pfl_estimate(f, x, NULL));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_CORRUPT, pfl_most_likely(f, x));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_CORRUPT, pfl_quantile(f, 0u, 0.5f, x));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_CORRUPT, pfl_particles(f, &view, NULL));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_CORRUPT, pfl_health(f, &health));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_CORRUPT, pfl_fork(f, NULL, 0u, &out));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_CORRUPT, pfl_snapshot(f, x, sizeof x));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_CORRUPT, pfl_restore(f, x, sizeof x));
    TEST_ASSERT_EQUAL_UINT(0u, pfl_snapshot_bytes(f));
    TEST_ASSERT_FALSE(pfl_invariants_hold(f));
    TEST_ASSERT_TRUE(ut_untouched(f, bytes));
}
