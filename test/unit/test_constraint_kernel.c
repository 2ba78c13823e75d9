/* The bounded acceptance-rejection, the kernel step, and the reach of the cloud. */
#include "support.h"
#include "unity.h"

#include <math.h>
#include <stdlib.h>

void setUp(void)
{
}

void tearDown(void)
{
    ut_arenas_end();
}

/* ---- A half line x >= 0, and a model that jumps by standard normals ------------------------------------------- */

static uint32_t predicted; /* particles that went through the model */
static uint32_t projections;

static void jump(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    (void)user;
    (void)u;
    (void)dt_s;
    predicted += p->n;
    for (uint32_t i = 0u; i < p->n; i++) {
        PFL_STATE(p, 0)[i] += PFL_NOISE(p, 0)[i];
        PFL_STATE(p, 1)[i] += 1.0f; /* counts the moves of a particle */
    }
}

static void inside(void *user, const pfl_view_t *p, uint32_t *is_inside)
{
    (void)user;
    for (uint32_t i = 0u; i < p->n; i++) {
        is_inside[i] = p->x[i] >= 0.0f ? 1u : 0u;
    }
}

static void inside_nowhere(void *user, const pfl_view_t *p, uint32_t *is_inside)
{
    (void)user;
    for (uint32_t i = 0u; i < p->n; i++) {
        is_inside[i] = 0u;
    }
}

static void project(void *user, const pfl_batch_t *p)
{
    (void)user;
    projections++;
    for (uint32_t i = 0u; i < p->n; i++) {
        float *x = PFL_STATE(p, 0);
        x[i] = x[i] < 0.0f ? 0.0f : x[i];
    }
}

static pfl_config_t config_of(uint32_t particles, const pfl_constraint_t *constraint)
{
    const pfl_config_t config = {.abi = PFL_ABI,
                                 .particles = particles,
                                 .states = 2u,
                                 .noises = 1u,
                                 .seed = 11u,
                                 .constraint = constraint,
                                 .predict = jump};
    return config;
}

static pfl_t *fly(const pfl_config_t *config)
{
    const size_t bytes = pfl_arena_bytes(config);
    void *arena = ut_arena(bytes);
    pfl_t *f = NULL;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_init(arena, bytes, config, 0u, &f));
    predicted = 0u;
    projections = 0u;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(f, 1000u, NULL));
    return f;
}

/* From 0 half of the draws land outside: M draws leave about N / 2^M to be projected, and no others. */
static void check_tries(uint32_t tries, uint32_t particles)
{
    const pfl_constraint_t constraint = {inside, project, NULL, tries, 0u, pfl_constraint_keep};
    const pfl_config_t config = config_of(particles, &constraint);
    pfl_t *f = fly(&config);
    pfl_view_t view;
    pfl_health_t health;
    uint32_t at_zero = 0u;

    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_particles(f, &view, NULL));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_health(f, &health));
    for (uint32_t i = 0u; i < particles; i++) {
        TEST_ASSERT_TRUE(view.x[i] >= 0.0f);
        TEST_ASSERT_TRUE(view.x[view.stride + i] > 0.5f && view.x[view.stride + i] < 1.5f); /* moved once, not twice */
        at_zero += view.x[i] > 0.0f ? 0u : 1u;
    }
    TEST_ASSERT_EQUAL_UINT32(at_zero, health.projected);
    TEST_ASSERT_EQUAL_UINT32(predicted, particles + health.redrawn);
    TEST_ASSERT_TRUE(predicted <= tries * particles);
    const double share = pow(0.5, (double)tries);
    /* 6 standard deviations: 2e-9 */
    TEST_ASSERT_DOUBLE_WITHIN(6.0 * sqrt(share * (double)particles) + 1e-9, share * (double)particles, (double)at_zero);
}

void test_draws_are_bounded_and_only_the_rest_is_projected(void)
{
    static const uint32_t counts[] = {1u, 7u, 16u, 17u, 80u, 1000u};

    for (size_t k = 0u; k < sizeof counts / sizeof counts[0]; k++) {
        check_tries(1u, counts[k]);
        check_tries(2u, counts[k]);
        check_tries(4u, counts[k]);
        check_tries(16u, counts[k]);
    }
}

void test_nothing_inside_still_ends(void)
{
    const pfl_constraint_t constraint = {inside_nowhere, project, NULL, PFL_TRIES_MAX, 0u, pfl_constraint_keep};
    const pfl_config_t config = config_of(100u, &constraint);
    pfl_t *f = fly(&config);
    pfl_health_t health;

    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_health(f, &health));
    TEST_ASSERT_EQUAL_UINT32(100u * PFL_TRIES_MAX, predicted);
    TEST_ASSERT_EQUAL_UINT32(100u, health.projected);
    TEST_ASSERT_TRUE(pfl_invariants_hold(f));
}

/* The accepted draws follow the truncated normal: mean sqrt(2/pi), variance 1 - 2/pi. */
void test_accepted_draws_follow_the_truncated_law(void)
{
    const uint32_t n = 100000u;
    const pfl_constraint_t constraint = {inside, project, NULL, 64u, 0u, pfl_constraint_keep};
    const pfl_config_t config = config_of(n, &constraint);
    pfl_t *f = fly(&config);
    pfl_view_t view;
    double sum = 0.0;

    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_particles(f, &view, NULL));
    for (uint32_t i = 0u; i < n; i++) {
        sum += (double)view.x[i];
    }
    const double pi = 3.14159265358979;
    /* 5.5 standard errors: 4e-8 */
    TEST_ASSERT_DOUBLE_WITHIN(5.5 * sqrt((1.0 - 2.0 / pi) / (double)n), sqrt(2.0 / pi), sum / (double)n);
}

void test_retries_need_their_memory_and_a_single_draw_needs_none(void)
{
    pfl_constraint_t constraint = {inside, project, NULL, 2u, 0u, pfl_constraint_keep};
    const pfl_config_t config = config_of(50u, &constraint);
    const size_t plain = PFL_ARENA_BYTES(50, 2, 1);
    pfl_t *f;

    TEST_ASSERT_EQUAL_INT(PFL_ERR_MEMORY, pfl_init(ut_arena(plain), plain, &config, 0u, &f));
    const size_t more = plain + PFL_RETRY_BYTES(2);
    TEST_ASSERT_EQUAL_size_t(more, pfl_arena_bytes(&config));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_init(ut_arena(more), more, &config, 0u, &f));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(f, 1000u, NULL));
    constraint.tries = 1u;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_init(ut_arena(plain), plain, &config, 0u, &f));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(f, 1000u, NULL));
}

void test_wrong_constraints_and_kernels_are_refused(void)
{
    pfl_constraint_t constraint = {inside, project, NULL, 0u, 0u, pfl_constraint_keep};
    pfl_config_t config = config_of(8u, &constraint);
    const size_t bytes = PFL_ARENA_BYTES(8, 2, 1) + PFL_RETRY_BYTES(2);
    void *arena = ut_arena(bytes);
    pfl_t *f;

    TEST_ASSERT_EQUAL_INT(PFL_ERR_CONFIG, pfl_init(arena, bytes, &config, 0u, &f));
    constraint.tries = PFL_TRIES_MAX + 1u;
    TEST_ASSERT_EQUAL_INT(PFL_ERR_CONFIG, pfl_init(arena, bytes, &config, 0u, &f));
    constraint = (pfl_constraint_t){NULL, project, NULL, 1u, 0u, pfl_constraint_keep};
    TEST_ASSERT_EQUAL_INT(PFL_ERR_CONFIG, pfl_init(arena, bytes, &config, 0u, &f));
    constraint = (pfl_constraint_t){inside, NULL, NULL, 1u, 0u, pfl_constraint_keep};
    TEST_ASSERT_EQUAL_INT(PFL_ERR_CONFIG, pfl_init(arena, bytes, &config, 0u, &f));
    constraint = (pfl_constraint_t){inside, project, NULL, 1u, 0u, NULL};
    TEST_ASSERT_EQUAL_INT(PFL_ERR_CONFIG, pfl_init(arena, bytes, &config, 0u, &f));
    config.constraint = NULL;
    const pfl_kernel_t kernels[] = {{0.0f, 0u, pfl_kernel_move},  {1.0f, 0u, pfl_kernel_move},
                                    {-0.5f, 0u, pfl_kernel_move}, {ut_nan(false), 0u, pfl_kernel_move},
                                    {0.5f, 4u, pfl_kernel_move},  {0.5f, 0u, NULL}};
    for (size_t k = 0u; k < sizeof kernels / sizeof kernels[0]; k++) {
        config.kernel = &kernels[k];
        TEST_ASSERT_EQUAL_INT(PFL_ERR_CONFIG, pfl_init(arena, bytes, &config, 0u, &f));
    }
    const pfl_kernel_t good = {0.5f, 3u, pfl_kernel_move};
    config.kernel = &good;
    config.moments = PFL_MOMENTS_MEAN;
    TEST_ASSERT_EQUAL_INT(PFL_ERR_CONFIG, pfl_init(arena, bytes, &config, 0u, &f));
    TEST_ASSERT_TRUE(ut_untouched(arena, bytes));
}

/* ---- Kernel --------------------------------------------------------------------------------------------------- */

#define KERNEL_N 20000u

static void correlated(void *user, const pfl_batch_t *p)
{
    (void)user;
    for (uint32_t i = 0u; i < p->n; i++) {
        const float a = PFL_NOISE(p, 0)[i];
        PFL_STATE(p, 0)[i] = 10.0f + 2.0f * a;
        PFL_STATE(p, 1)[i] = -3.0f + a + 0.5f * PFL_NOISE(p, 1)[i];
        PFL_STATE(p, 2)[i] = 7.0f; /* without spread */
    }
}

static pfl_t *kernel_filter(const pfl_kernel_t *kernel, pfl_config_t *config)
{
    *config = ut_dictated_config(KERNEL_N, 3u);
    config->draw = correlated;
    config->user = NULL;
    config->kernel = kernel;
    return ut_filter(config);
}

void test_kernel_keeps_mean_and_covariance_and_separates_copies(void)
{
    const pfl_kernel_t kernel = {0.5f, 0u, pfl_kernel_move};
    pfl_config_t config;
    pfl_t *f = kernel_filter(&kernel, &config);
    float before[3];
    float mean[3];
    float cov_before[9];
    float cov[9];
    pfl_view_t view;

    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(f, before, cov_before));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_resample(f));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_particles(f, &view, NULL));
    const float first = view.x[0];
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(f, 1000u, NULL)); /* holds still, and makes the moments be taken anew */
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(f, mean, cov));
    /* 6 standard errors of b L n: 2e-9 */
    TEST_ASSERT_FLOAT_WITHIN(6.0f * 0.5f * 2.0f / sqrtf((float)KERNEL_N), before[0], mean[0]);
    TEST_ASSERT_FLOAT_WITHIN(6.0f * 0.5f * 1.12f / sqrtf((float)KERNEL_N), before[1], mean[1]);
    TEST_ASSERT_FLOAT_WITHIN(1e-5f, 7.0f, mean[2]);
    TEST_ASSERT_FLOAT_WITHIN(0.05f * cov_before[0], cov_before[0], cov[0]);
    TEST_ASSERT_FLOAT_WITHIN(0.05f * cov_before[1], cov_before[1], cov[1]);
    TEST_ASSERT_FLOAT_WITHIN(0.05f * cov_before[4], cov_before[4], cov[4]);
    TEST_ASSERT_FLOAT_WITHIN(1e-6f, 0.0f, cov[8]);
    TEST_ASSERT_TRUE(fabsf(view.x[0] - first) <= 0.0f);
    for (uint32_t i = 1u; i < 1000u; i++) {
        TEST_ASSERT_TRUE(fabsf(view.x[i] - view.x[i - 1u]) > 0.0f);
    }
}

void test_kernel_moves_the_masked_states_only(void)
{
    const pfl_kernel_t kernel = {0.3f, 2u, pfl_kernel_move};
    pfl_config_t config;
    pfl_t *f = kernel_filter(&kernel, &config);
    pfl_view_t view;
    float x0[16];
    float x1[16];

    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_particles(f, &view, NULL));
    for (uint32_t i = 0u; i < 16u; i++) {
        x0[i] = view.x[i];
        x1[i] = view.x[view.stride + i];
    }
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_resample(f)); /* equal weights: systematic keeps every particle in its place */
    for (uint32_t i = 0u; i < 16u; i++) {
        TEST_ASSERT_TRUE(fabsf(view.x[i] - x0[i]) <= 0.0f);
        TEST_ASSERT_TRUE(fabsf(view.x[view.stride + i] - x1[i]) > 0.0f);
    }
}

void test_estimate_stays_that_before_resampling_with_a_kernel_too(void)
{
    const pfl_kernel_t kernel = {0.5f, 0u, pfl_kernel_move};
    pfl_config_t config;
    pfl_t *f = kernel_filter(&kernel, &config);
    float before[3];
    float after[3];
    float cov_before[9];
    float cov_after[9];

    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(f, before, cov_before));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_resample(f));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(f, after, cov_after));
    TEST_ASSERT_EQUAL_MEMORY(before, after, sizeof before);
    TEST_ASSERT_EQUAL_MEMORY(cov_before, cov_after, sizeof cov_before);
}

/* A cloud whose covariance overflows, as a line and on the circle, is resampled and otherwise left alone. */
void test_kernel_leaves_a_cloud_alone_that_is_too_wide(void)
{
    const float x[] = {3.0e38f, -3.0e38f, 1.0e20f, -2.0e20f};
    const ut_table_t table = {x, 4u, 1u};
    const pfl_kernel_t kernel = {.width = 0.5f, .move = pfl_kernel_move};

    for (uint32_t circular = 0u; circular < 2u; circular++) {
        pfl_config_t config = ut_dictated_config(4u, 1u);
        config.draw = ut_table_draw;
        config.user = (void *)(uintptr_t)&table;
        config.kernel = &kernel;
        config.circular_mask = circular;
        config.circular = pfl_circular_means;
        pfl_t *f = ut_filter(&config);
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_resample(f));
        TEST_ASSERT_TRUE(pfl_invariants_hold(f));
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_restore(f, ut_snapshot(f), pfl_snapshot_bytes(f)));
    }
}

/* ---- Reach ---------------------------------------------------------------------------------------------------- */

void test_farthest_is_the_largest_distance(void)
{
    const float x[] = {0.0f, 3.0f, -6.0f, 1.0f, 0.0f, 4.0f, 8.0f, 1.0f};
    const ut_table_t table = {x, 4u, 2u};
    pfl_config_t config = ut_dictated_config(4u, 2u);
    float distance = 0.0f;

    config.draw = ut_table_draw;
    config.user = (void *)(uintptr_t)&table;
    pfl_t *f = ut_filter(&config);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_farthest(f, 0u, 1u, 0.0f, 0.0f, &distance));
    TEST_ASSERT_FLOAT_WITHIN(1e-5f, 10.0f, distance);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_farthest(f, 1u, 0u, 8.0f, -6.0f, &distance));
    TEST_ASSERT_FLOAT_WITHIN(1e-5f, 10.0f, distance);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_farthest(f, 0u, 1u, -3.0e38f, 3.0e38f, &distance));
    TEST_ASSERT_TRUE(ut_finite(distance) && (distance > 1.0e38f));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_farthest(f, 2u, 0u, 0.0f, 0.0f, &distance));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_farthest(f, 0u, 1u, ut_nan(false), 0.0f, &distance));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_farthest(f, 0u, 1u, 0.0f, 0.0f, NULL));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_farthest(NULL, 0u, 1u, 0.0f, 0.0f, &distance));
}

/* ---- Both, in a copy and on a circle --------------------------------------------------------------------------------- */

/* A fork has retry memory of its own: it draws anew there, and the original does not notice. */
void test_a_fork_retries_in_its_own_memory(void)
{
    const pfl_constraint_t constraint = {inside, project, NULL, 8u, 0u, pfl_constraint_keep};
    const pfl_config_t config = config_of(100u, &constraint);
    pfl_t *f = fly(&config);
    const size_t bytes = pfl_arena_bytes(&config);
    void *arena = ut_arena(bytes);
    pfl_t *copy = NULL;
    pfl_health_t health;
    pfl_view_t view;

    const unsigned char *before = ut_snapshot(f);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_fork(f, arena, bytes, &copy));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_health(copy, &health));
    const uint32_t redrawn = health.redrawn;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(copy, 2000u, NULL));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_health(copy, &health));
    TEST_ASSERT_TRUE(health.redrawn > redrawn);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_particles(copy, &view, NULL));
    for (uint32_t i = 0u; i < view.n; i++) {
        TEST_ASSERT_TRUE(view.x[i] >= 0.0f);
    }
    TEST_ASSERT_TRUE(ut_same_bytes(before, ut_snapshot(f), pfl_snapshot_bytes(f)));
}

/* A cloud across the seam: the kernel draws each angle towards the circular mean, the short way round. */
static void draw_at_the_seam(void *user, const pfl_batch_t *p)
{
    (void)user;
    for (uint32_t i = 0u; i < p->n; i++) {
        const float side = ((i & 1u) != 0u) ? -3.0415927f : 3.0415927f; /* 0.1 on either side of pi */
        PFL_STATE(p, 0)[i] = side;
    }
}

void test_kernel_goes_the_short_way_round_the_circle(void)
{
    const pfl_kernel_t kernel = {.width = 0.2f, .move = pfl_kernel_move};
    pfl_config_t config = ut_dictated_config(1000u, 1u);
    pfl_view_t view;

    config.kernel = &kernel;
    config.circular_mask = 1u;
    config.circular = pfl_circular_means;
    config.draw = draw_at_the_seam;
    pfl_t *f = ut_filter(&config);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_resample(f));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_particles(f, &view, NULL));
    for (uint32_t i = 0u; i < view.n; i++) {
        /* 0.1 from pi, moved by at most 0.2 x 0.1 x 6.67 */
        const float off = 3.14159265f - fabsf(remainderf(view.x[i], 6.2831853f));
        TEST_ASSERT_TRUE(off < 0.1f + 0.14f);
    }
}

/* The kernel's scratch moments of a copy are its own: the red zones and the original tell. */
void test_a_fork_moves_its_kernel_in_its_own_memory(void)
{
    const pfl_kernel_t kernel = {.width = 0.5f, .states_mask = 0u, .move = pfl_kernel_move};
    pfl_config_t config;
    pfl_t *f = kernel_filter(&kernel, &config);
    const size_t bytes = pfl_arena_bytes(&config);
    unsigned char *arena = (unsigned char *)ut_arena(bytes);
    const unsigned char *before = ut_snapshot(f);
    pfl_t *copy = NULL;
    pfl_view_t view;
    pfl_view_t moved;

    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_fork(f, arena, bytes, &copy));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_resample(copy));
    TEST_ASSERT_TRUE(ut_red_zones_intact());
    TEST_ASSERT_TRUE(ut_same_bytes(before, ut_snapshot(f), pfl_snapshot_bytes(f)));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_particles(f, &view, NULL));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_particles(copy, &moved, NULL));
    TEST_ASSERT_TRUE(fabsf(view.x[0] - moved.x[0]) > 0.0f);
    TEST_ASSERT_TRUE(pfl_invariants_hold(copy));
}

void test_a_restored_filter_has_the_counters_of_its_constraint(void)
{
    const pfl_constraint_t constraint = {inside, project, NULL, 2u, 0u, pfl_constraint_keep};
    const pfl_config_t config = config_of(100u, &constraint);
    pfl_t *f = fly(&config);
    pfl_t *other = fly(&config);
    pfl_health_t kept;
    pfl_health_t now;

    for (uint32_t k = 2u; k < 5u; k++) {
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(f, 1000u * k, NULL));
    }
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_health(f, &kept));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_restore(other, ut_snapshot(f), pfl_snapshot_bytes(f)));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_health(other, &now));
    TEST_ASSERT_TRUE((kept.redrawn > 50u) && (kept.projected > 25u));
    TEST_ASSERT_EQUAL_UINT32(kept.redrawn, now.redrawn);
    TEST_ASSERT_EQUAL_UINT32(kept.projected, now.projected);
}
