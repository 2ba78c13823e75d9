/* Jump Markov systems: the odds of jumps, each particle by its own model, the minimum in each regime with the right weights,
 * and the probabilities that Bayes' rule gives. */
#include "support.h"

#include "pflight/jump.h"
#include "pflight/rng.h"

#include "unity.h"

#include <math.h>
#include <string.h>

#define N 600u

enum { X, REGIME, STATES };

static float room[PFL_JUMP_FLOATS(STATES, 1u)];
static pfl_jump_t jump;

/* Regime by regime: x + 1, 2 x, x + w. */
static void add(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    (void)user;
    (void)u;
    (void)dt_s;
    for (uint32_t i = 0u; i < p->n; i++) {
        PFL_STATE(p, X)[i] += 1.0f;
    }
}

static void twice(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    (void)user;
    (void)u;
    (void)dt_s;
    for (uint32_t i = 0u; i < p->n; i++) {
        PFL_STATE(p, X)[i] *= 2.0f;
    }
}

static void shake(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    (void)u;
    (void)dt_s;
    for (uint32_t i = 0u; i < p->n; i++) {
        PFL_STATE(p, X)[i] += *(const float *)user * PFL_NOISE(p, 0)[i];
    }
}

static float quiet = 0.1f;
static float wild = 1.0f;

void setUp(void)
{
    memset(&jump, 0, sizeof jump);
    jump.regimes = 3u;
    jump.regime[0].predict = add;
    jump.regime[1].predict = twice;
    jump.regime[2] = (pfl_regime_t){shake, &wild};
    jump.states = STATES;
    jump.noises = 1u;
    jump.state = REGIME;
    jump.ess_ratio = 1.0f;
    jump.room = room;
}

void tearDown(void)
{
    ut_arenas_end();
}

/* ---- Jumps and moves ---------------------------------------------------------------------------------------------- */

/* 51 200 particles of each regime, half a second: the shares that left, to 5.5 deviations (4e-8 each, 9 of them). */
void test_the_odds_of_jumps(void)
{
    static const float rates[3][3] = {{9.0f, 0.2f, 0.6f}, {2.0f, 9.0f, 0.0f}, {0.0f, 0.0f, 9.0f}};
    float x[STATES * PFL_BATCH];
    float noise[2u * PFL_BATCH];
    const uint32_t batches = 400u;
    pfl_rng_t rng;
    pfl_rng_seed(&rng, 6u);
    for (uint32_t i = 0u; i < 3u; i++) {
        memcpy(jump.rate_hz[i], rates[i], sizeof rates[i]);
    }
    for (uint32_t from = 0u; from < 3u; from++) {
        uint32_t reached[3] = {0u};
        for (uint32_t k = 0u; k < batches; k++) {
            const pfl_batch_t batch = {x, PFL_BATCH, noise, 0u, PFL_BATCH};
            pfl_rng_normals(&rng, noise, 2u * PFL_BATCH / 16u);
            for (uint32_t i = 0u; i < PFL_BATCH; i++) {
                x[i] = 0.0f;
                x[PFL_BATCH + i] = (float)(int32_t)from;
            }
            pfl_jump_predict(&jump, NULL, 0.5f, &batch);
            for (uint32_t i = 0u; i < PFL_BATCH; i++) {
                reached[(uint32_t)x[PFL_BATCH + i]]++;
            }
        }
        const double n = (double)(batches * PFL_BATCH);
        double rate = 0.0;
        for (uint32_t to = 0u; to < 3u; to++) {
            rate += (to != from) ? (double)rates[from][to] : 0.0;
        }
        for (uint32_t to = 0u; to < 3u; to++) {
            const double left = 1.0 - exp(-0.5 * rate);
            const double p =
                (to == from) ? (1.0 - left) : ((rate > 0.0) ? (left * (double)rates[from][to] / rate) : 0.0);
            TEST_ASSERT_DOUBLE_WITHIN((5.5 * sqrt(n * p * (1.0 - p))) + 1e-9, n * p, (double)reached[to]);
        }
    }
}

static void count_calls(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    (void)u;
    (void)dt_s;
    (void)p;
    (*(uint32_t *)user)++;
}

void test_a_model_without_particles_is_not_called(void)
{
    float x[STATES * PFL_BATCH] = {0.0f};
    float noise[2u * PFL_BATCH] = {0.0f};
    uint32_t calls[2] = {0u, 0u};
    const pfl_batch_t batch = {x, PFL_BATCH, noise, 0u, PFL_BATCH};
    jump.regime[0] = (pfl_regime_t){count_calls, &calls[0]};
    jump.regime[1] = (pfl_regime_t){count_calls, &calls[1]};
    pfl_jump_predict(&jump, NULL, 0.5f, &batch);
    TEST_ASSERT_EQUAL_UINT32(1u, calls[0]);
    TEST_ASSERT_EQUAL_UINT32(0u, calls[1]);
}

void test_each_particle_moves_by_its_own_model(void)
{
    float x[STATES * PFL_BATCH];
    float before[PFL_BATCH];
    float noise[2u * PFL_BATCH];
    uint64_t dice = 7u;
    for (uint32_t n = 1u; n <= PFL_BATCH; n += (n < 5u) ? 1u : 41u) {
        const pfl_batch_t batch = {x, PFL_BATCH, noise, 0u, n};
        for (uint32_t i = 0u; i < PFL_BATCH; i++) {
            before[i] = (float)ut_gaussian(&dice);
            x[i] = before[i];
            x[PFL_BATCH + i] = (float)(int32_t)(ut_random(&dice) % 3u);
            noise[i] = (float)ut_gaussian(&dice);
            noise[PFL_BATCH + i] = (float)ut_gaussian(&dice);
        }
        pfl_jump_predict(&jump, NULL, 0.5f, &batch);
        for (uint32_t i = 0u; i < n; i++) {
            const float by_regime[3] = {before[i] + 1.0f, before[i] * 2.0f, before[i] + noise[i]};
            TEST_ASSERT_EQUAL_UINT32(ut_bits(by_regime[(uint32_t)x[PFL_BATCH + i]]), ut_bits(x[i]));
        }
        for (uint32_t i = n; i < PFL_BATCH; i++) {
            TEST_ASSERT_EQUAL_UINT32(ut_bits(before[i]), ut_bits(x[i]));
        }
    }
}

/* ---- Resampling by regimes ------------------------------------------------------------------------------------------ */

static float table[STATES * N];
static ut_table_t drawn = {table, N, STATES};

/* 400, 150 and 50 particles of the three regimes, and weights that leave some to each. */
static pfl_t *weighted(pfl_config_t *config, float *loglik)
{
    uint64_t dice = 11u;
    for (uint32_t i = 0u; i < N; i++) {
        table[i] = (float)i;
        table[N + i] = (i % 12u == 11u) ? 2.0f : ((i % 4u == 1u) ? 1.0f : 0.0f);
        loglik[i] = -(float)(4.0 * ut_uniform(&dice)) - ((table[N + i] > 1.5f) ? 6.0f : 0.0f);
    }
    *config = ut_dictated_config(N, STATES);
    config->draw = ut_table_draw;
    config->user = &drawn;
    pfl_t *f = ut_filter(config);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(f, 0u, 0u, loglik));
    return f;
}

static void check_shares(uint32_t least)
{
    float loglik[N];
    float before[3];
    float after[3];
    float weights[N];
    uint32_t count[3] = {0u};
    uint32_t copies[N] = {0u};
    double exact[3] = {0.0};
    double sum = 0.0;
    pfl_config_t config;
    pfl_t *f = weighted(&config, loglik);
    jump.least = least;
    for (uint32_t i = 0u; i < N; i++) {
        exact[(uint32_t)table[N + i]] += exp((double)loglik[i]);
        sum += exp((double)loglik[i]);
    }
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_jump_probabilities(f, &jump, before));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_jump_resample(f, &jump));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_jump_probabilities(f, &jump, after));
    pfl_view_t view;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_particles(f, &view, weights));
    for (uint32_t i = 0u; i < N; i++) {
        count[(uint32_t)view.x[view.stride + i]]++;
        copies[(uint32_t)view.x[i]]++;
        TEST_ASSERT_EQUAL_UINT32(ut_bits(table[N + (uint32_t)view.x[i]]), ut_bits(view.x[view.stride + i]));
    }
    TEST_ASSERT_TRUE(pfl_invariants_hold(f));
    for (uint32_t r = 0u; r < 3u; r++) {
        TEST_ASSERT_DOUBLE_WITHIN(1e-6, exact[r] / sum, (double)before[r]);
        TEST_ASSERT_FLOAT_WITHIN(2e-6f, before[r], after[r]);
        TEST_ASSERT_TRUE(count[r] >= least && count[r] > 0u);
    }
    for (uint32_t i = 0u; i < N; i++) { /* systematic: rounded down or up */
        const uint32_t r = (uint32_t)table[N + i];
        const double expected = exp((double)loglik[i]) / exact[r] * (double)count[r];
        TEST_ASSERT_TRUE((double)copies[i] > (expected - 1.001) && (double)copies[i] < (expected + 1.001));
    }
}

void test_each_regime_keeps_its_probability_and_its_minimum(void)
{
    check_shares(0u);
    check_shares(1u);
    check_shares(60u);
    check_shares(N / 9u);
}

void test_an_impossible_regime_gets_none(void)
{
    float loglik[N];
    float p[3];
    pfl_config_t config;
    pfl_t *f = weighted(&config, loglik);
    for (uint32_t i = 0u; i < N; i++) {
        loglik[i] = (table[N + i] > 1.5f) ? -ut_infinity() : loglik[i];
    }
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(f, 0u, 0u, loglik));
    jump.least = 60u;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_jump_resample(f, &jump));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_jump_probabilities(f, &jump, p));
    TEST_ASSERT_EQUAL_FLOAT(0.0f, p[2]);
    pfl_view_t view;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_particles(f, &view, NULL));
    for (uint32_t i = 0u; i < N; i++) {
        TEST_ASSERT_TRUE(view.x[view.stride + i] < 1.5f);
    }
}

void test_it_waits_until_it_is_due(void)
{
    float loglik[N];
    pfl_config_t config;
    pfl_t *f = weighted(&config, loglik);
    unsigned char *before = ut_snapshot(f);
    jump.ess_ratio = 0.01f;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_jump_resample(f, &jump));
    TEST_ASSERT_TRUE(ut_same_posterior(before, ut_snapshot(f), pfl_snapshot_bytes(f)));
}

/* ---- Bayes ------------------------------------------------------------------------------------------------------------ */

/* x from 0, seen to 1; quiet or wild for good, with even odds. */
static void draw_either(void *user, const pfl_batch_t *p)
{
    (void)user;
    for (uint32_t i = 0u; i < p->n; i++) {
        PFL_STATE(p, X)[i] = 0.0f;
        PFL_STATE(p, REGIME)[i] = (float)(int32_t)((p->first + i) & 1u);
    }
}

typedef struct {
    double m, p, log_evidence;
} kalman_t;

static void kalman_step(kalman_t *k, double sigma, double z)
{
    const double prior = k->p + (sigma * sigma);
    const double s = prior + 1.0;
    k->log_evidence -= 0.5 * (((z - k->m) * (z - k->m) / s) + log(s));
    k->m += (prior / s) * (z - k->m);
    k->p = prior / s;
}

/* The probability of the wild regime after twelve measurements, by two Kalman filters and by 600 particles. Mean and mean
 * square of the difference over 100 seeds; the minimum of 100 particles does not bend it. */
static void against_bayes(uint32_t least)
{
    double bias = 0.0;
    double square = 0.0;
    for (uint64_t seed = 1u; seed <= 100u; seed++) {
        uint64_t dice = seed * 17u;
        kalman_t k[2] = {{0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}};
        double x = 0.0;
        float p[2];
        pfl_config_t config = ut_linear_config(N);
        config.ess_ratio = 0.0f;
        config.seed = seed;
        config.predict = pfl_jump_predict;
        config.user = &jump;
        config.draw = draw_either;
        jump.regimes = 2u;
        jump.regime[0] = (pfl_regime_t){shake, &quiet};
        jump.regime[1] = (pfl_regime_t){shake, &wild};
        jump.least = least;
        jump.ess_ratio = 0.5f;
        pfl_t *f = ut_filter(&config);
        for (uint32_t step = 1u; step <= 12u; step++) {
            x += (((seed & 1u) != 0u) ? 0.1 : 1.0) * ut_gaussian(&dice);
            const float z = (float)(x + ut_gaussian(&dice));
            kalman_step(&k[0], (double)quiet, (double)z);
            kalman_step(&k[1], (double)wild, (double)z);
            TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(f, step * 1000000ull, NULL));
            TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(f, 0u, step * 1000000ull, &z));
            TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_jump_resample(f, &jump));
        }
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_jump_probabilities(f, &jump, p));
        const double wanted = 1.0 / (1.0 + exp(k[0].log_evidence - k[1].log_evidence));
        bias += ((double)p[1] - wanted) / 100.0;
        square += ((double)p[1] - wanted) * ((double)p[1] - wanted) / 100.0;
        ut_arenas_end();
    }
    TEST_ASSERT_DOUBLE_WITHIN(0.02, 0.0, bias);
    TEST_ASSERT_TRUE(sqrt(square) < 0.08);
}

void test_the_probability_of_a_regime_is_that_of_bayes(void)
{
    against_bayes(0u);
    against_bayes(100u);
}

/* ---- Wrong calls -------------------------------------------------------------------------------------------------------- */

void test_wrong_calls_are_refused(void)
{
    float loglik[N];
    float p[PFL_REGIMES_MAX];
    pfl_config_t config;
    pfl_t *f = weighted(&config, loglik);
    const pfl_jump_t good = jump;
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_jump_resample(f, NULL));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_jump_resample(NULL, &jump));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_jump_probabilities(f, &jump, NULL));
    jump.least = (N / 9u) + 1u;
    TEST_ASSERT_EQUAL_INT(PFL_ERR_CONFIG, pfl_jump_resample(f, &jump));
    jump = good;
    jump.regimes = 0u;
    TEST_ASSERT_EQUAL_INT(PFL_ERR_CONFIG, pfl_jump_probabilities(f, &jump, p));
    jump.regimes = PFL_REGIMES_MAX + 1u;
    TEST_ASSERT_EQUAL_INT(PFL_ERR_CONFIG, pfl_jump_resample(f, &jump));
    jump = good;
    jump.state = STATES;
    TEST_ASSERT_EQUAL_INT(PFL_ERR_CONFIG, pfl_jump_resample(f, &jump));
    jump = good;
    jump.states = STATES + 1u;
    TEST_ASSERT_EQUAL_INT(PFL_ERR_CONFIG, pfl_jump_resample(f, &jump));
    jump.state = X;
    jump.states = STATES - 1u;
    TEST_ASSERT_EQUAL_INT(PFL_ERR_CONFIG, pfl_jump_resample(f, &jump));
}

/* ---- Few particles ---------------------------------------------------------------------------------------------------- */

#define FEW 13u /* which fill no whole group */

static float few_loglik[FEW];

/* A filter of that many with a regime each in turn, and log-likelihoods to update it by. */
static pfl_t *few_particles(pfl_config_t *config)
{
    static const ut_table_t few = {table, FEW, STATES};
    for (uint32_t i = 0u; i < FEW; i++) {
        table[i] = (float)(int32_t)i;
        table[FEW + i] = (float)(int32_t)(i % 3u);
        few_loglik[i] = -0.3f * (float)(int32_t)i;
    }
    *config = ut_dictated_config(FEW, STATES);
    config->draw = ut_table_draw;
    config->user = (void *)(uintptr_t)&few;
    jump.least = 1u;
    return ut_filter(config);
}

static void resampling_keeps_probabilities(pfl_t *f)
{
    float before[3];
    float after[3];
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_jump_probabilities(f, &jump, before));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_jump_resample(f, &jump));
    TEST_ASSERT_TRUE(pfl_invariants_hold(f));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_jump_probabilities(f, &jump, after));
    for (uint32_t r = 0u; r < 3u; r++) {
        TEST_ASSERT_FLOAT_WITHIN(2e-6f, before[r], after[r]);
    }
}

/* Shares stay, and what lies behind the last particle weighs nothing. */
void test_thirteen_particles_are_enough(void)
{
    pfl_config_t config;
    pfl_t *f = few_particles(&config);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(f, 0u, 0u, few_loglik));
    resampling_keeps_probabilities(f);
}

/* An ordinary resampling leaves its lists in the column of weights, behind the last particle too; they are long where
 * the parents are few. */
void test_what_an_ordinary_resampling_left_behind_weighs_nothing(void)
{
    pfl_config_t config;
    pfl_t *f = few_particles(&config);
    for (uint32_t i = 3u; i < FEW; i++) {
        few_loglik[i] = -20.0f;
    }
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(f, 0u, 0u, few_loglik));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_resample(f));
    resampling_keeps_probabilities(f);
}

void test_fewer_particles_than_regimes_times_regimes_are_refused(void)
{
    const pfl_config_t eight = ut_dictated_config(8u, STATES);
    const pfl_config_t nine = ut_dictated_config(9u, STATES);
    TEST_ASSERT_EQUAL_INT(PFL_ERR_CONFIG, pfl_jump_resample(ut_filter(&eight), &jump));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_jump_resample(ut_filter(&nine), &jump));
}
