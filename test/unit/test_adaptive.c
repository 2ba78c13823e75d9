/* A number of particles that changes: the filter stays whole, the counts are Fox's, the budget holds. The test is the port:
 * its counter grows with the particles that the callbacks see. */
#include "support.h"

#include "pflight/adaptive.h"
#include "pflight/port.h"
#include "pflight/regularised.h"
#include "pflight/tempered.h"

#include "unity.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define MOST 1000u

static uint32_t cycles;
static uint32_t price; /* cycles a particle and callback */
static uint32_t mask;  /* of the counter; 0: there is none */
static pfl_adaptive_t adaptive;
static uint32_t words[1024];

uint32_t pfl_port_cycles(void)
{
    cycles += 10u;
    return cycles;
}

uint32_t pfl_port_cycles_mask(void)
{
    return mask;
}

uint32_t pfl_port_cycles_hz(void)
{
    return 0u;
}

void pfl_port_fault(int32_t status)
{
    (void)status;
}

bool pfl_port_self_test(void)
{
    return true;
}

static void linear_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    cycles += price * p->n;
    ut_linear_predict(user, u, dt_s, p);
}

static void linear_loglik(void *user, const void *z, const pfl_view_t *p, float *ll)
{
    cycles += price * p->n;
    ut_linear_loglik(user, z, p, ll);
}

static const pfl_sensor_t sensor = {.loglik = linear_loglik};

void setUp(void)
{
    cycles = 0u;
    price = 100u;
    mask = 0xFFFFFFFFu;
    memset(&adaptive, 0, sizeof adaptive);
    adaptive.config = ut_linear_config(MOST);
    adaptive.config.ess_ratio = 0.0f;
    adaptive.config.predict = linear_predict;
    adaptive.config.sensors = &sensor;
    adaptive.most = MOST;
    adaptive.least = 50u;
    adaptive.ess_ratio = 0.5f;
    adaptive.bins = words;
    adaptive.bits = 32u * 1024u;
    adaptive.quantile = 2.33f;
    adaptive.dimensions = 2u;
    adaptive.state[1] = 1u;
    adaptive.inv_width[0] = 2.0f;
    adaptive.inv_width[1] = 2.0f;
}

void tearDown(void)
{
    ut_arenas_end();
}

static pfl_t *start(void)
{
    adaptive.config.particles = adaptive.most;
    const size_t bytes = pfl_arena_bytes(&adaptive.config);
    pfl_t *f = NULL;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_adaptive_init(ut_arena(bytes), bytes, &adaptive, 0u, &f));
    return f;
}

/* ---- The filter stays whole -------------------------------------------------------------------------------------------- */

static void draw_index(void *user, const pfl_batch_t *p)
{
    ut_index_draw(user, p);
    for (uint32_t i = 0u; i < p->n; i++) {
        PFL_STATE(p, 1)[i] = -PFL_STATE(p, 0)[i];
    }
}

/* From any N to any N, and each particle leaves as many copies as its share says, rounded down or up. */
static void check_change(uint32_t from, uint32_t to)
{
    uint32_t copies[MOST] = {0u};
    adaptive.config.draw = draw_index;
    adaptive.most = MOST;
    pfl_t *f = start();
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_set_particles(f, &adaptive, from));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_reset(f, 0u)); /* `from` different ones */
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_set_particles(f, &adaptive, to));
    pfl_view_t view;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_particles(f, &view, NULL));
    TEST_ASSERT_EQUAL_UINT32(to, view.n);
    for (uint32_t i = 0u; i < to; i++) {
        TEST_ASSERT_TRUE(view.x[i] >= 0.0f && view.x[i] < (float)from);
        TEST_ASSERT_EQUAL_FLOAT(-view.x[i], view.x[view.stride + i]);
        copies[(uint32_t)view.x[i]]++;
    }
    for (uint32_t i = 0u; i < from; i++) {
        TEST_ASSERT_TRUE(copies[i] >= (to / from) && copies[i] <= ((to + from - 1u) / from));
    }
    TEST_ASSERT_TRUE(pfl_invariants_hold(f));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_resample(f)); /* canaries and seal are where they belong */
    TEST_ASSERT_TRUE(pfl_invariants_hold(f));
    ut_arenas_end();
}

void test_any_number_to_any_number(void)
{
    static const uint32_t counts[] = {1u, 7u, 8u, 9u, 127u, 128u, 500u, 999u, 1000u};
    for (uint32_t k = 0u; k < 81u; k++) {
        check_change(counts[k / 9u], counts[k % 9u]);
    }
}

/* A filter that came to its N is, to the bit, one that began with it: also its watch and its constraint's memory. */
void test_nothing_tells_the_difference(void)
{
    const pfl_watch_t watch = {.keep = pfl_watch_keep, .lean_ratio = 1e-6f};
    static const uint32_t counts[] = {333u, 64u, 900u};
    for (uint32_t k = 0u; k < 3u; k++) {
        adaptive.most = MOST;
        adaptive.config.watch = &watch;
        pfl_t *f = start();
        uint64_t hash = UT_FNV_SEED;
        for (uint32_t step = 1u; step < 6u; step++) {
            hash = ut_fly_linear(f, step * 1000u, 0.5f, hash);
            TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_set_particles(f, &adaptive, counts[(k + step) % 3u]));
            pfl_sensor_health_t tracked;
            TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_sensor_health(f, 0u, &tracked));
            TEST_ASSERT_TRUE(tracked.t_fused_us == step * 1000u && tracked.refused == 0u && tracked.same == 0u);
        }
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_set_particles(f, &adaptive, counts[k]));
        pfl_config_t config = adaptive.config;
        TEST_ASSERT_EQUAL_UINT32(counts[k], config.particles);
        pfl_t *fresh = ut_filter(&config);
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_restore(fresh, ut_snapshot(f), pfl_snapshot_bytes(f)));
        for (uint32_t step = 6u; step < 12u; step++) {
            const float z = 0.1f * (float)(int32_t)step;
            TEST_ASSERT_TRUE(ut_fly_linear(f, step * 1000u, z, hash) == ut_fly_linear(fresh, step * 1000u, z, hash));
        }
        unsigned char *a = ut_snapshot(f);
        unsigned char *b = ut_snapshot(fresh);
        TEST_ASSERT_TRUE(ut_same_posterior(a, b, pfl_snapshot_bytes(f)));
        ut_arenas_end();
    }
}

/* Weighted particles to fewer and to more: the mean stays, to 5.5 standard errors of the copies' fractions. */
void test_weights_are_kept_on_average(void)
{
    double sum = 0.0;
    float mean[2];
    const float z = 1.0f;
    for (uint64_t seed = 1u; seed <= 200u; seed++) {
        adaptive.most = MOST;
        adaptive.config.seed = seed;
        pfl_t *f = start();
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(f, 0u, 0u, &z));
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(f, mean, NULL));
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_set_particles(f, &adaptive, ((seed & 1u) != 0u) ? 100u : 777u));
        pfl_view_t view;
        double after = 0.0;
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_particles(f, &view, NULL));
        for (uint32_t i = 0u; i < view.n; i++) {
            after += (double)view.x[i] / (double)view.n;
        }
        sum += after - (double)mean[0];
        ut_arenas_end();
    }
    /* at most the deviation of 100 independent draws, 0.071; systematic ones less */
    TEST_ASSERT_DOUBLE_WITHIN(5.5 * 0.071 / sqrt(200.0), 0.0, sum / 200.0);
}

/* ---- By need ---------------------------------------------------------------------------------------------------------- */

void test_counts_are_those_of_fox(void)
{
    TEST_ASSERT_EQUAL_UINT32(1u, pfl_kld_particles(0.0f, 0.05f, 2.33f));
    TEST_ASSERT_EQUAL_UINT32(1u, pfl_kld_particles(1.0f, 0.05f, 2.33f));
    TEST_ASSERT_EQUAL_UINT32(PFL_PARTICLES_MAX, pfl_kld_particles(1e8f, 0.05f, 2.33f));
    for (uint32_t k = 2u; k < 20000u; k += 1u + (k / 7u)) {
        const double rest = (double)k - 1.0;
        const double a = 2.0 / (9.0 * rest);
        const double n = (rest / 0.1) * pow((1.0 - a) + (sqrt(a) * (double)2.33f), 3.0);
        const double got = (double)pfl_kld_particles((float)k, 0.05f, 2.33f);
        TEST_ASSERT_TRUE(got >= (n * (1.0 - 1e-6)) && got <= ((n * (1.0 + 1e-6)) + 1.0));
    }
}

/* What the count promises: draws from 40 equal cells are further than `error` from them, by Kullback and Leibler, in 1 %
 * of all cases. Of 2000 at most 1 % and 5 deviations, 42: 1e-6 if the odds are just those. */
void test_the_promise_of_the_count(void)
{
    const uint32_t n = pfl_kld_particles(40.0f, 0.05f, 2.33f);
    uint32_t broken = 0u;
    uint64_t dice = 8u;
    for (uint32_t run = 0u; run < 2000u; run++) {
        uint32_t cell[40] = {0u};
        double distance = 0.0;
        for (uint32_t i = 0u; i < n; i++) {
            cell[ut_random(&dice) % 40u]++;
        }
        for (uint32_t k = 0u; k < 40u; k++) {
            const double share = (double)cell[k] / (double)n;
            distance += (cell[k] > 0u) ? (share * log(share * 40.0)) : 0.0;
        }
        broken += (distance > 0.05) ? 1u : 0u;
    }
    TEST_ASSERT_TRUE(broken <= 42u);
    TEST_ASSERT_TRUE(broken >= 4u); /* and not by far too many particles */
}

/* Cells of a cloud spread evenly, counted by the test: to 3 % where they are few for the bits, from below zero too. */
static void check_cells(uint32_t bits, double tolerance)
{
    static float x[2u * MOST];
    static unsigned char seen[100][100];
    uint32_t cells = 0u;
    uint64_t dice = bits;
    memset(seen, 0, sizeof seen);
    for (uint32_t i = 0u; i < MOST; i++) {
        const double a = (20.0 * ut_uniform(&dice)) - 10.0;
        const double b = (20.0 * ut_uniform(&dice)) - 10.0;
        x[i] = (float)a;
        x[MOST + i] = (float)b;
        unsigned char *one = &seen[(int)floor((double)x[i] * 2.0) + 50][(int)floor((double)x[MOST + i] * 2.0) + 50];
        cells += (*one == 0u) ? 1u : 0u;
        *one = 1u;
    }
    const ut_table_t table = {x, MOST, 2u};
    adaptive.config.draw = ut_table_draw;
    adaptive.config.user = (void *)(uintptr_t)&table;
    adaptive.error = 0.05f;
    adaptive.bits = bits;
    adaptive.ess_ratio = 1.0f;
    adaptive.config.predict = ut_hold_predict;
    pfl_t *f = start();
    float flat[MOST] = {0.0f};
    static const pfl_sensor_t dictated = {.loglik = ut_dictated_loglik};
    adaptive.config.sensors = &dictated;
    f = start();
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(f, 0u, 0u, flat));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_adapt(f, &adaptive));
    TEST_ASSERT_DOUBLE_WITHIN(tolerance * (double)cells, (double)cells, (double)adaptive.covered);
    TEST_ASSERT_EQUAL_UINT32(pfl_kld_particles((float)adaptive.covered, 0.05f, 2.33f), adaptive.wanted);
    ut_arenas_end();
}

void test_cells_are_counted(void)
{
    check_cells(32768u, 0.03);
    check_cells(2048u, 0.05);
    check_cells(512u, 0.15);
}

/* A prior of deviation 1 covers some 60 cells of 1/2, the cloud that has seen many measurements a dozen. */
void test_fewer_where_the_cloud_is_small(void)
{
    adaptive.error = 0.05f;
    pfl_t *f = start();
    uint64_t dice = 3u;
    uint32_t peak = 0u;
    uint64_t sum = 0u;
    for (uint32_t step = 1u; step <= 300u; step++) {
        const float z = (float)ut_gaussian(&dice);
        (void)ut_fly_linear(f, step * 100000u, z, 0u);
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_adapt(f, &adaptive));
        TEST_ASSERT_TRUE(adaptive.config.particles >= adaptive.least && adaptive.config.particles <= MOST);
        peak = (adaptive.wanted > peak) ? adaptive.wanted : peak;
        sum += (step > 100u) ? adaptive.config.particles : 0u;
    }
    TEST_ASSERT_TRUE(peak > 300u);
    TEST_ASSERT_TRUE((sum / 200u) < (peak / 2u));
    TEST_ASSERT_TRUE(pfl_invariants_hold(f));
}

/* ---- By time ---------------------------------------------------------------------------------------------------------- */

static uint32_t cost_of_full_cycles(void)
{
    pfl_health_t health;
    pfl_t *f = start();
    for (uint32_t step = 1u; step <= 20u; step++) {
        (void)ut_fly_linear(f, step * 100000u, 0.0f, 0u);
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_set_particles(f, &adaptive, MOST));
    }
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_health(f, &health));
    return health.cycles_max;
}

/* A budget of 60 % of the full cost: never overrun, and used to more than three quarters. Then the callbacks cost twice as
 * much: the number follows. */
void test_the_budget_holds(void)
{
    const uint32_t full = cost_of_full_cycles();
    pfl_health_t health;
    adaptive.config.budget_cycles = (full * 6u) / 10u;
    adaptive.budget_share = 0.9f;
    pfl_t *f = start();
    TEST_ASSERT_EQUAL_UINT32(adaptive.least, adaptive.config.particles);
    uint64_t dice = 3u;
    for (uint32_t step = 1u; step <= 400u; step++) {
        const float z = (float)ut_gaussian(&dice);
        (void)ut_fly_linear(f, step * 100000u, z, 0u);
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_adapt(f, &adaptive));
    }
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_health(f, &health));
    TEST_ASSERT_EQUAL_UINT32(0u, health.overruns);
    TEST_ASSERT_TRUE(adaptive.config.particles > 450u && adaptive.config.particles < 600u);
    price = 200u;
    for (uint32_t step = 401u; step <= 600u; step++) {
        const float z = (float)ut_gaussian(&dice);
        const pfl_status_t moved = pfl_predict(f, step * 100000u, NULL);
        const pfl_status_t fused = pfl_update(f, 0u, step * 100000u, &z); /* the first may be cut short */
        TEST_ASSERT_EQUAL_INT(PFL_OK, moved);
        TEST_ASSERT_TRUE((fused >= PFL_OK) || (step == 401u));
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_adapt(f, &adaptive));
    }
    pfl_health_t later;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_health(f, &later));
    TEST_ASSERT_TRUE(later.overruns <= 1u);
    TEST_ASSERT_TRUE(adaptive.config.particles > 200u && adaptive.config.particles < 320u);
    price = 100u; /* and back */
    for (uint32_t step = 601u; step <= 1000u; step++) {
        const float z = (float)ut_gaussian(&dice);
        (void)ut_fly_linear(f, step * 100000u, z, 0u);
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_adapt(f, &adaptive));
    }
    TEST_ASSERT_TRUE(adaptive.config.particles > 450u && adaptive.config.particles < 600u);
}

/* ---- A tempered update whose budget ends ------------------------------------------------------------------------------ */

static void sharp_loglik(void *user, const void *z, const pfl_view_t *p, float *ll)
{
    cycles += price * p->n;
    for (uint32_t i = 0u; i < p->n; i++) {
        const float e = (p->x[i] - *(const float *)z) * 20.0f;
        ll[i] = -0.5f * (e * e);
    }
    (void)user;
}

/* Wherever the budget ends: either nothing is fused, or all of the measurement. Where no resampling came in between, the
 * weights say so: they are those of the whole likelihood. Returns the steps taken. */
static uint32_t check_budget(uint32_t budget_cycles, uint32_t *deferred)
{
    static const pfl_kernel_t kernel = {0.5f, 0u, pfl_kernel_move};
    pfl_tempered_t tempered = {.loglik = sharp_loglik, .ess_share = 0.5f, .steps = 8u};
    const pfl_sensor_t sharp = {.loglik = pfl_tempered_loglik, .user = &tempered};
    pfl_config_t config = ut_linear_config(300u);
    const float z = 2.0f;
    float weights[300];
    pfl_view_t view;
    pfl_health_t health;
    config.sensors = &sharp;
    config.kernel = &kernel;
    config.predict = linear_predict;
    config.budget_cycles = budget_cycles;
    pfl_t *f = ut_filter(&config);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(f, 1000u, NULL));
    const pfl_status_t status = pfl_tempered_update(f, 0u, 1000u, &z);
    TEST_ASSERT_TRUE(status == PFL_OK || status == PFL_DEFERRED || status == PFL_ERR_BUDGET);
    TEST_ASSERT_TRUE(pfl_invariants_hold(f));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_health(f, &health));
    TEST_ASSERT_EQUAL_UINT32((status >= PFL_OK) ? 1u : 0u, health.fused);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_particles(f, &view, weights));
    if (status == PFL_DEFERRED && health.resampled == 0u) {
        float best = -1e30f;
        for (uint32_t i = 0u; i < 300u; i++) {
            const float e = (view.x[i] - z) * 20.0f;
            best = (-0.5f * e * e > best) ? (-0.5f * e * e) : best;
        }
        for (uint32_t i = 0u; i < 300u; i++) {
            const float e = (view.x[i] - z) * 20.0f;
            TEST_ASSERT_FLOAT_WITHIN(0.01f, (-0.5f * e * e) - best, weights[i]);
        }
    }
    *deferred += (status == PFL_DEFERRED) ? 1u : 0u;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(f, 2000u, NULL)); /* what was put off is done */
    TEST_ASSERT_TRUE(pfl_invariants_hold(f));
    ut_arenas_end();
    return tempered.taken;
}

void test_a_tempered_update_ends_with_its_budget(void)
{
    uint32_t deferred = 0u;
    uint32_t most = 0u;
    uint32_t fewest = 99u;
    for (uint32_t budget_cycles = 20000u; budget_cycles < 300000u; budget_cycles += 1500u) {
        const uint32_t taken = check_budget(budget_cycles, &deferred);
        most = (taken > most) ? taken : most;
        fewest = (taken < fewest) ? taken : fewest;
    }
    TEST_ASSERT_EQUAL_UINT32(0u, fewest);
    TEST_ASSERT_TRUE(most > 2u);
    TEST_ASSERT_TRUE(deferred > 2u);
}

/* ---- Wrong calls ------------------------------------------------------------------------------------------------------- */

void test_wrong_calls_are_refused(void)
{
    adaptive.error = 0.05f;
    adaptive.covered = 77u;
    pfl_t *f = start();
    TEST_ASSERT_EQUAL_UINT32(0u, adaptive.covered); /* nothing yet */
    pfl_adaptive_t other = adaptive;
    const pfl_adaptive_t good = adaptive;
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_adapt(NULL, &adaptive));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_adapt(f, NULL));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_CONFIG, pfl_adapt(f, &other));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_set_particles(f, &adaptive, 0u));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_set_particles(f, &adaptive, MOST + 1u));
    adaptive.least = 0u;
    TEST_ASSERT_EQUAL_INT(PFL_ERR_CONFIG, pfl_adapt(f, &adaptive));
    adaptive = good;
    adaptive.bits = 48u;
    TEST_ASSERT_EQUAL_INT(PFL_ERR_CONFIG, pfl_adapt(f, &adaptive));
    adaptive = good;
    adaptive.most = PFL_PARTICLES_MAX + 1u;
    TEST_ASSERT_EQUAL_INT(PFL_ERR_CONFIG, pfl_adapt(f, &adaptive));
    adaptive = good;
    adaptive.state[1] = 2u;
    TEST_ASSERT_EQUAL_INT(PFL_ERR_CONFIG, pfl_adapt(f, &adaptive));
    adaptive = good;
    adaptive.dimensions = PFL_BINS_DIMENSIONS + 1u;
    TEST_ASSERT_EQUAL_INT(PFL_ERR_CONFIG, pfl_adapt(f, &adaptive));
    adaptive = good;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_adapt(f, &adaptive));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_MEMORY, pfl_adaptive_init(words, 100u, &adaptive, 0u, &f));
    TEST_ASSERT_NULL(f);
    f = start();
    adaptive.least = MOST + 1u;
    TEST_ASSERT_EQUAL_INT(PFL_ERR_CONFIG, pfl_adaptive_init(words, 100u, &adaptive, 0u, &f));
    TEST_ASSERT_NULL(f);
}

static void check_refused(pfl_t *f, const pfl_adaptive_t *good)
{
    TEST_ASSERT_EQUAL_INT(PFL_ERR_CONFIG, pfl_adapt(f, &adaptive));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_CONFIG, pfl_set_particles(f, &adaptive, 60u));
    adaptive = *good;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_adapt(f, &adaptive));
}

void test_every_setting_is_judged(void)
{
    adaptive.error = 0.05f;
    pfl_t *f = start();
    const pfl_adaptive_t good = adaptive;
    adaptive.bins = NULL;
    check_refused(f, &good);
    adaptive.bits = 16u;
    check_refused(f, &good);
    adaptive.bits = 1u << 25;
    check_refused(f, &good);
    adaptive.dimensions = 0u;
    check_refused(f, &good);
    adaptive.most = MOST - 1u; /* fewer than there are */
    check_refused(f, &good);
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_set_particles(NULL, &adaptive, 60u));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_adaptive_init(words, sizeof words, NULL, 0u, &f));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_adaptive_init(words, sizeof words, &adaptive, 0u, NULL));
    adaptive.most = PFL_PARTICLES_MAX + 1u;
    TEST_ASSERT_EQUAL_INT(PFL_ERR_CONFIG, pfl_adaptive_init(words, sizeof words, &adaptive, 0u, &f));
}

/* ---- The limits of both --------------------------------------------------------------------------------------------- */

static uint32_t resampled(const pfl_t *f)
{
    pfl_health_t health;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_health(f, &health));
    TEST_ASSERT_EQUAL_UINT32(0u, health.overruns);
    return health.resampled;
}

void test_equal_weights_are_not_resampled(void)
{
    const float z = 0.3f;
    adaptive.ess_ratio = 1.0f;
    pfl_t *f = start();
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(f, 0u, 0u, &z));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_adapt(f, &adaptive));
    TEST_ASSERT_EQUAL_UINT32(1u, resampled(f));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_adapt(f, &adaptive));
    TEST_ASSERT_EQUAL_UINT32(1u, resampled(f));
}

void test_time_needs_a_budget_and_a_counter(void)
{
    adaptive.budget_share = 0.9f;
    (void)start();
    TEST_ASSERT_EQUAL_UINT32(MOST, adaptive.config.particles);
    adaptive.config.budget_cycles = 1000000u;
    mask = 0u;
    (void)start();
    TEST_ASSERT_EQUAL_UINT32(MOST, adaptive.config.particles);
    mask = 0xFFFFFFFFu;
    (void)start();
    TEST_ASSERT_EQUAL_UINT32(adaptive.least, adaptive.config.particles);
}

/* Two callbacks of 100 cycles a particle, and 10 cycles a look at the clock: time for all of `least` particles, but for
 * fewer by the share that may be used. They stay, and are not resampled again and again. */
void test_with_hardly_any_time_the_fewest_stay(void)
{
    const float z = 0.3f;
    adaptive.budget_share = 0.9f;
    adaptive.ess_ratio = 0.0f;
    adaptive.config.budget_cycles = 11000u;
    pfl_t *f = start();
    for (uint32_t step = 1u; step <= 20u; step++) {
        (void)ut_fly_linear(f, step * 100000u, z, 0u);
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_adapt(f, &adaptive));
        TEST_ASSERT_EQUAL_UINT32(adaptive.least, adaptive.config.particles);
    }
    TEST_ASSERT_EQUAL_UINT32(2u, resampled(f)); /* as it began, and in the first cycle, to learn its cost */
}

void test_with_all_the_time_there_are_the_most(void)
{
    const float z = 0.3f;
    adaptive.budget_share = 0.9f;
    adaptive.ess_ratio = 1.0f;
    adaptive.config.budget_cycles = 1000000000u;
    pfl_t *f = start();
    TEST_ASSERT_EQUAL_UINT32(adaptive.least, adaptive.config.particles);
    for (uint32_t step = 1u; step <= 3u; step++) {
        (void)ut_fly_linear(f, step * 100000u, z, 0u);
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_adapt(f, &adaptive));
    }
    TEST_ASSERT_EQUAL_UINT32(MOST, adaptive.config.particles);
}

/* Cells that a cloud held in place covers, by its first state alone. */
static uint32_t covered(const float *x, uint32_t bits, uint64_t circular_mask)
{
    static const pfl_sensor_t dictated = {.loglik = ut_dictated_loglik};
    static float flat[MOST];
    ut_table_t table = {x, MOST, 2u};
    adaptive.config.draw = ut_table_draw;
    adaptive.config.predict = ut_hold_predict;
    adaptive.config.user = &table;
    adaptive.config.sensors = &dictated;
    adaptive.config.circular_mask = (uint32_t)circular_mask;
    adaptive.config.circular = (circular_mask != 0u) ? pfl_circular_means : NULL;
    adaptive.error = 0.05f;
    adaptive.ess_ratio = 1.0f;
    adaptive.dimensions = 1u;
    adaptive.bits = bits;
    pfl_t *f = start();
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(f, 0u, 0u, flat));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_adapt(f, &adaptive));
    TEST_ASSERT_TRUE(pfl_invariants_hold(f));
    return adaptive.covered;
}

void test_cells_at_the_ends_of_the_numbers(void)
{
    static float x[2u * MOST];
    for (uint32_t i = 0u; i < MOST; i++) {
        x[i] = ((i & 1u) != 0u) ? 1.0e30f : -2.0e30f; /* beyond what an integer holds */
    }
    TEST_ASSERT_EQUAL_UINT32(2u, covered(x, 1024u, 0u));
    for (uint32_t i = 0u; i < MOST; i++) {
        x[i] = (float)(int32_t)i; /* a cell for each */
    }
    TEST_ASSERT_EQUAL_UINT32(111u, covered(x, 32u, 0u)); /* 32 log 32: all that these bits can tell */
}

void test_angles_are_counted_on_the_circle(void)
{
    static float x[2u * MOST];
    for (uint32_t i = 0u; i < MOST; i++) {
        x[i] = 0.2f + (6.2831853f * (float)(int32_t)(i % 5u));
    }
    TEST_ASSERT_EQUAL_UINT32(5u, covered(x, 4096u, 0u));
    TEST_ASSERT_EQUAL_UINT32(1u, covered(x, 4096u, 1u));
}

/* ---- With a constraint and a kernel step ---------------------------------------------------------------------------- */

static void inside_half(void *user, const pfl_view_t *p, uint32_t *inside)
{
    (void)user;
    for (uint32_t i = 0u; i < p->n; i++) {
        inside[i] = (p->x[i] > 0.0f) ? 1u : 0u;
    }
}

static void project_half(void *user, const pfl_batch_t *p)
{
    (void)user;
    for (uint32_t i = 0u; i < p->n; i++) {
        PFL_STATE(p, 0)[i] = fmaxf(PFL_STATE(p, 0)[i], 0.001f);
    }
}

/* The memory of redraws moves along: what follows is what a filter of that N does that began with it. */
void test_the_memory_of_redraws_moves_along(void)
{
    static const pfl_constraint_t constraint = {inside_half, project_half, NULL, 3u, 0u, pfl_constraint_keep};
    static const uint32_t counts[] = {333u, 900u};
    for (uint32_t k = 0u; k < 2u; k++) {
        adaptive.most = MOST;
        adaptive.config.constraint = &constraint;
        pfl_t *f = start();
        (void)ut_fly_linear(f, 1000u, 0.1f, 0u);
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_set_particles(f, &adaptive, counts[1u - k]));
        (void)ut_fly_linear(f, 2000u, 0.1f, 0u);
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_set_particles(f, &adaptive, counts[k]));
        const pfl_config_t config = adaptive.config;
        const size_t bytes = pfl_arena_bytes(&config);
        pfl_t *fresh = NULL;
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_init(ut_arena(bytes), bytes, &config, 0u, &fresh));
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_restore(fresh, ut_snapshot(f), pfl_snapshot_bytes(f)));
        for (uint32_t step = 3u; step < 9u; step++) {
            TEST_ASSERT_TRUE(ut_fly_linear(f, step * 1000u, 0.1f, 0u) == ut_fly_linear(fresh, step * 1000u, 0.1f, 0u));
        }
        pfl_health_t health;
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_health(f, &health));
        TEST_ASSERT_TRUE(health.redrawn > 0u);
        ut_arenas_end();
    }
}

/* Ten particles become five hundred: copies, but for a kernel step. */
void test_copies_are_moved_apart(void)
{
    static const pfl_kernel_t kernel = {0.3f, 0u, pfl_kernel_move};
    for (uint32_t with = 0u; with < 2u; with++) {
        pfl_view_t view;
        uint32_t different = 0u;
        adaptive.most = MOST;
        adaptive.config.kernel = (with != 0u) ? &kernel : NULL;
        pfl_t *f = start();
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_set_particles(f, &adaptive, 10u));
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_set_particles(f, &adaptive, 500u));
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_particles(f, &view, NULL));
        for (uint32_t i = 0u; i < view.n; i++) {
            uint32_t same = 0u;
            for (uint32_t j = 0u; j < i; j++) {
                same += (ut_bits(view.x[i]) == ut_bits(view.x[j])) ? 1u : 0u;
            }
            different += (same == 0u) ? 1u : 0u;
        }
        TEST_ASSERT_TRUE((with != 0u) ? (different > 490u) : (different == 10u));
        TEST_ASSERT_TRUE(pfl_invariants_hold(f));
    }
}
