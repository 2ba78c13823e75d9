/* Resampling through the public API. First of all: the index never leaves the array, over PFL_UT_WEIGHT_SETS
 * adversarial weight sets. A weight set is one set of N log-likelihoods, resampled once; particles carry their index
 * in state 0. Then: offspring in proportion to the weights, for every scheme. */
#include "support.h"

#include "../../lib/src/core.h" /* for the random numbers at the ends of their range */

#include "unity.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#ifndef PFL_UT_WEIGHT_SETS
#define PFL_UT_WEIGHT_SETS 10000000u
#endif

#define N_MAX 4096u
#define KINDS 12u

enum { SYSTEMATIC, STRATIFIED, RESIDUAL, MULTINOMIAL, SCHEMES };

static const pfl_scheme_fn schemes[SCHEMES] = {pfl_systematic, pfl_stratified, pfl_residual, pfl_multinomial};

static float ll[N_MAX];
static float log_weights[N_MAX];
static uint32_t offspring[N_MAX];
static double share[N_MAX];
static uint64_t dice;

void setUp(void)
{
    dice = 0x9E3779B97F4A7C15u;
}

void tearDown(void)
{
    ut_arenas_end();
}

/* ---- Weight sets ------------------------------------------------------------------------------------------------ */

/* A finite float <= 0 of random bits. */
static float negative_bits(void)
{
    const uint32_t u = 0x80000000u | ut_random(&dice);
    return ut_float(((u & 0x7F800000u) == 0x7F800000u) ? (u & ~0x40000000u) : u);
}

static void all_but_one(uint32_t n, uint32_t one, float others, float its)
{
    for (uint32_t i = 0u; i < n; i++) {
        ll[i] = others;
    }
    ll[one] = its;
}

/* Weights whose running sum falls on multiples of 1/N, give or take an ulp or two. */
static void sums_on_the_teeth(uint32_t n)
{
    for (uint32_t i = 0u; i < n; i++) {
        const uint32_t pick = ut_random(&dice) % 3u;
        const float base = (pick == 0u) ? -0.693147181f : ((pick == 1u) ? -1.38629436f : 0.0f);
        const uint32_t bits = ut_bits(base);
        ll[i] = (bits == 0u) ? base : ut_float(bits + (ut_random(&dice) % 5u) - 2u);
    }
}

/* Kinds 0 .. 7 leave someone within reach of a perfect match; the rest need not. */
static void make_spread_set(uint32_t kind, uint32_t n)
{
    for (uint32_t i = 0u; i < n; i++) {
        const float u = (float)ut_uniform(&dice);
        switch (kind) {
        case 8u: /* a spread of 1e30 */
            ll[i] = (ut_random(&dice) & 1u) ? -1.0e30f * u : -u;
            break;
        case 9u:
            ll[i] = negative_bits();
            break;
        case 10u: /* some impossible, some huge */
            ll[i] = (ut_random(&dice) & 1u) ? -ut_infinity() : negative_bits();
            break;
        default: /* a smooth cloud */
            ll[i] = -8.0f * u * u;
            break;
        }
    }
    if (kind == 10u) {
        ll[ut_random(&dice) % n] = -1.0f;
    }
}

static void make_set(uint32_t kind, uint32_t n)
{
    const uint32_t one = ut_random(&dice) % n;
    switch (kind) {
    case 0u: /* all equal */
        all_but_one(n, one, -3.0f, -3.0f);
        break;
    case 1u: /* one dominant */
        all_but_one(n, one, -80.0f, 0.0f);
        break;
    case 2u: /* two equal giants */
        all_but_one(n, one, -60.0f, 0.0f);
        ll[ut_random(&dice) % n] = 0.0f;
        break;
    case 3u: /* only one is possible */
        all_but_one(n, one, -ut_infinity(), -0.5f);
        break;
    case 4u: /* the last is impossible, and others at random */
        all_but_one(n, n - 1u, 0.0f, (n > 1u) ? -ut_infinity() : 0.0f);
        break;
    case 5u: /* the first */
        all_but_one(n, 0u, -0.25f, (n > 1u) ? -ut_infinity() : 0.0f);
        break;
    case 6u: /* differences that are subnormal */
        for (uint32_t i = 0u; i < n; i++) {
            ll[i] = ut_float(0x80000000u | (ut_random(&dice) & 0x7FFFFFu));
        }
        break;
    case 7u:
        sums_on_the_teeth(n);
        break;
    default:
        make_spread_set(kind, n);
        break;
    }
}

/* ---- One set, resampled ------------------------------------------------------------------------------------------ */

static pfl_config_t indexed(uint32_t n, uint32_t scheme, float ess_ratio)
{
    pfl_config_t c = ut_dictated_config(n, 1u);
    c.predict = ut_index_predict;
    c.resampling = schemes[scheme];
    c.moments = (uint16_t)PFL_MOMENTS_MEAN;
    c.ess_ratio = ess_ratio;
    return c;
}

/* Every particle is one of those before, and none that was impossible. Counts the offspring. */
static bool cloud_is_sound(const pfl_t *f, uint32_t n)
{
    pfl_view_t view;
    if ((pfl_particles(f, &view, NULL) != PFL_OK) || (view.n != n) || (view.first != 0u)) {
        return false;
    }
    memset(offspring, 0, sizeof(uint32_t) * n);
    for (uint32_t i = 0u; i < n; i++) {
        const float x = view.x[i];
        if (!(x >= 0.0f) || !(x < (float)n)) {
            return false;
        }
        const uint32_t from = (uint32_t)x;
        if ((ut_bits((float)from) != ut_bits(x)) || (ut_bits(ll[from]) == 0xFF800000u)) {
            return false;
        }
        offspring[from]++;
    }
    return true;
}

static uint64_t clock_us;

/* The next random number of the resampling: the largest (u just under 1), or 0. xoshiro128++ from s0 = 0 answers
 * rotl(s3, 7). A comb that is off by one in 2^29 errs at these only. */
static void force_next_draw(pfl_t *f, uint32_t value)
{
    f->rng.one[0] = 0u;
    f->rng.one[1] |= 1u;
    f->rng.one[3] = value;
}

/* Numbers the particles, weighs them with ll, resamples. */
static void resample_once(pfl_t *f, bool by_hand)
{
    clock_us++;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(f, clock_us, NULL));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(f, 0u, clock_us, ll));
    if (by_hand) {
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_resample(f));
    }
}

/* `sets` weight sets of all kinds on one filter. */
static void hammer(uint32_t n, uint32_t scheme, uint32_t sets, bool by_hand)
{
    char text[96];
    pfl_config_t c = indexed(n, scheme, by_hand ? 0.0f : 1.0f);
    c.seed = ((uint64_t)n << 8) | scheme;
    pfl_t *f = ut_filter(&c);
    clock_us = 0u;
    for (uint32_t k = 0u; k < sets; k++) {
        const uint32_t kind = k % KINDS;
        make_set(kind, n);
        if (((k / KINDS) % 3u) != 0u) { /* each kind of set meets each end, and the middle */
            force_next_draw(f, (((k / KINDS) % 3u) == 1u) ? 0xFFFFFFFFu : 0u);
        }
        resample_once(f, by_hand);
        if (!cloud_is_sound(f, n)) {
            (void)snprintf(text, sizeof text, "N %lu, scheme %lu, set %lu of kind %lu", (unsigned long)n,
                           (unsigned long)scheme, (unsigned long)k, (unsigned long)kind);
            TEST_FAIL_MESSAGE(text);
        }
    }
    TEST_ASSERT_TRUE_MESSAGE(ut_red_zones_intact(), "written outside the arena");
}

/* ---- The first test of all --------------------------------------------------------------------------------------- */

typedef struct {
    uint32_t n;
    uint32_t per_mille; /* of the weight sets */
} mix_t;

void test_index_never_leaves_the_array(void)
{
    static const mix_t mix[] = {{1u, 40u},  {2u, 160u}, {3u, 120u}, {4u, 100u}, {5u, 100u},  {7u, 140u},
                                {8u, 140u}, {9u, 100u}, {15u, 30u}, {16u, 30u}, {17u, 20u},  {63u, 4u},
                                {64u, 4u},  {65u, 4u},  {127u, 3u}, {129u, 3u}, {1000u, 1u}, {N_MAX, 1u}};
    uint32_t done = 0u;
    for (size_t row = 0u; row < (sizeof mix / sizeof mix[0]); row++) {
        const uint32_t sets = (PFL_UT_WEIGHT_SETS / 1000u) * mix[row].per_mille / (2u * SCHEMES);
        for (uint32_t scheme = 0u; scheme < SCHEMES; scheme++) {
            hammer(mix[row].n, scheme, sets, true);
            hammer(mix[row].n, scheme, sets, false);
            done += 2u * sets;
        }
    }
    TEST_ASSERT_GREATER_OR_EQUAL_UINT32(PFL_UT_WEIGHT_SETS, done);
}

void test_index_never_leaves_the_array_for_any_particle_count(void)
{
    for (uint32_t k = 0u; k < 100u; k++) {
        const uint32_t n = 1u + (ut_random(&dice) % N_MAX);
        hammer(n, k % SCHEMES, 6u * KINDS, (k & 4u) != 0u);
    }
}

/* ---- Offspring in proportion ------------------------------------------------------------------------------------- */

/* Exact shares N w_i in double from the log-weights that the filter tells. */
static void shares_of(const pfl_t *f, uint32_t n)
{
    pfl_view_t view;
    double top = (double)-INFINITY;
    double sum = 0.0;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_particles(f, &view, log_weights));
    for (uint32_t i = 0u; i < n; i++) {
        top = ((double)log_weights[i] > top) ? (double)log_weights[i] : top;
    }
    for (uint32_t i = 0u; i < n; i++) {
        share[i] = exp((double)log_weights[i] - top);
        sum += share[i];
    }
    for (uint32_t i = 0u; i < n; i++) {
        share[i] *= (double)n / sum;
    }
}

/* Weights are floats (3e-7) and then integers (2e-9 of the whole). */
static double slack_of(uint32_t n, double s)
{
    return (2.0e-9 * (double)n) + (4.0e-7 * s);
}

typedef enum { FLOOR_OR_CEIL, AT_LEAST_FLOOR, WITHIN_TWO } rule_t;

static bool count_fits(rule_t rule, uint32_t n, uint32_t i)
{
    const double slack = slack_of(n, share[i]);
    const double count = (double)offspring[i];
    if (count < ((rule == WITHIN_TWO) ? (share[i] - slack - 2.0) : floor(share[i] - slack))) {
        return false;
    }
    if (rule == WITHIN_TWO) {
        return count <= (share[i] + slack + 2.0);
    }
    return (rule == AT_LEAST_FLOOR) || (count <= ceil(share[i] + slack));
}

static void counts_follow(uint32_t scheme, rule_t rule)
{
    static const uint32_t sizes[] = {1u, 2u, 7u, 8u, 9u, 63u, 64u, 65u, 1000u, N_MAX};
    char text[128];
    for (size_t row = 0u; row < (sizeof sizes / sizeof sizes[0]); row++) {
        const uint32_t n = sizes[row];
        const uint32_t sets = (n < 100u) ? 1200u : 120u;
        pfl_config_t c = indexed(n, scheme, 0.0f);
        pfl_t *f = ut_filter(&c);
        clock_us = 0u;
        for (uint32_t k = 0u; k < sets; k++) {
            make_set(k % KINDS, n);
            clock_us++;
            TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(f, clock_us, NULL));
            TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(f, 0u, clock_us, ll));
            shares_of(f, n);
            TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_resample(f));
            TEST_ASSERT_TRUE(cloud_is_sound(f, n));
            for (uint32_t i = 0u; i < n; i++) {
                if (!count_fits(rule, n, i)) {
                    (void)snprintf(text, sizeof text, "N %lu, kind %lu: particle %lu, share %.9g, %lu copies",
                                   (unsigned long)n, (unsigned long)(k % KINDS), (unsigned long)i, share[i],
                                   (unsigned long)offspring[i]);
                    TEST_FAIL_MESSAGE(text);
                }
            }
        }
    }
}

void test_systematic_counts_are_floor_or_ceiling_of_the_share(void)
{
    counts_follow(SYSTEMATIC, FLOOR_OR_CEIL);
}

void test_stratified_counts_are_within_two_of_the_share(void)
{
    counts_follow(STRATIFIED, WITHIN_TWO);
}

void test_residual_counts_are_at_least_the_floor_of_the_share(void)
{
    counts_follow(RESIDUAL, AT_LEAST_FLOOR);
}

/* Mean counts over many resamplings against the shares, 5 standard errors of the multinomial. */
void test_every_scheme_is_unbiased(void)
{
    enum { N = 12, ROUNDS = 40000 };
    for (uint32_t scheme = 0u; scheme < SCHEMES; scheme++) {
        double total[N] = {0.0};
        pfl_config_t c = indexed(N, scheme, 0.0f);
        pfl_t *f = ut_filter(&c);
        clock_us = 0u;
        for (uint32_t i = 0u; i < N; i++) {
            ll[i] = -0.3f * (float)i;
        }
        for (uint32_t k = 0u; k < ROUNDS; k++) {
            clock_us++;
            TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(f, clock_us, NULL));
            TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(f, 0u, clock_us, ll));
            shares_of(f, N);
            TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_resample(f));
            TEST_ASSERT_TRUE(cloud_is_sound(f, N));
            for (uint32_t i = 0u; i < N; i++) {
                total[i] += (double)offspring[i];
            }
        }
        for (uint32_t i = 0u; i < N; i++) {
            const double error = (total[i] / (double)ROUNDS) - share[i];
            TEST_ASSERT_TRUE(fabs(error) < (5.0 * sqrt(share[i] / (double)ROUNDS)));
        }
    }
}

/* The schemes differ in their random numbers, and so in their clouds. */
void test_the_configured_scheme_is_used(void)
{
    enum { N = 200 };
    uint64_t hash[SCHEMES];
    for (uint32_t scheme = 0u; scheme < SCHEMES; scheme++) {
        pfl_config_t c = indexed(N, scheme, 0.0f);
        pfl_t *f = ut_filter(&c);
        clock_us = 0u;
        for (uint32_t i = 0u; i < N; i++) {
            ll[i] = -0.02f * (float)i;
        }
        resample_once(f, true);
        TEST_ASSERT_TRUE(cloud_is_sound(f, N));
        hash[scheme] = ut_fnv(UT_FNV_SEED, offspring, sizeof(uint32_t) * N);
        for (uint32_t other = 0u; other < scheme; other++) {
            TEST_ASSERT_TRUE(hash[other] != hash[scheme]);
        }
    }
}

/* ---- What a resampling leaves ------------------------------------------------------------------------------------ */

void test_weights_are_equal_afterwards(void)
{
    enum { N = 37 };
    for (uint32_t scheme = 0u; scheme < SCHEMES; scheme++) {
        pfl_view_t view;
        pfl_config_t c = indexed(N, scheme, 0.0f);
        pfl_t *f = ut_filter(&c);
        clock_us = 0u;
        make_set(11u, N);
        resample_once(f, true);
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_particles(f, &view, log_weights));
        for (uint32_t i = 0u; i < N; i++) {
            TEST_ASSERT_EQUAL_HEX32(ut_bits(log_weights[0]), ut_bits(log_weights[i]));
            TEST_ASSERT_FLOAT_WITHIN(1.0e-6f, 0.0f, log_weights[i]);
        }
        TEST_ASSERT_TRUE(pfl_invariants_hold(f));
    }
}

void test_survivors_keep_their_slots(void)
{
    enum { N = 300 };
    for (uint32_t scheme = 0u; scheme < SCHEMES; scheme++) {
        pfl_view_t view;
        pfl_config_t c = indexed(N, scheme, 0.0f);
        pfl_t *f = ut_filter(&c);
        clock_us = 0u;
        make_set(11u, N);
        resample_once(f, true);
        TEST_ASSERT_TRUE(cloud_is_sound(f, N));
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_particles(f, &view, NULL));
        for (uint32_t i = 0u; i < N; i++) {
            if (offspring[i] > 0u) {
                TEST_ASSERT_EQUAL_HEX32(ut_bits((float)i), ut_bits(view.x[i]));
            }
        }
    }
}

/* All states of a particle travel together. */
void test_particles_are_copied_whole(void)
{
    enum { N = 130, D = 5 };
    static float x[D * N];
    const ut_table_t table = {x, N, D};
    for (uint32_t i = 0u; i < (D * N); i++) {
        x[i] = (float)((i % N) + (1000u * (i / N)));
    }
    for (uint32_t scheme = 0u; scheme < SCHEMES; scheme++) {
        pfl_view_t view;
        pfl_config_t c = ut_dictated_config(N, D);
        c.resampling = schemes[scheme];
        c.draw = ut_table_draw;
        c.user = (void *)(uintptr_t)&table;
        pfl_t *f = ut_filter(&c);
        make_set(11u, N);
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(f, 0u, 0u, ll));
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_resample(f));
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_particles(f, &view, NULL));
        for (uint32_t i = 0u; i < (D * N); i++) {
            const float expected = view.x[i % N] + (float)(1000u * (i / N));
            TEST_ASSERT_EQUAL_HEX32(ut_bits(expected), ut_bits(PFL_STATE(&view, i / N)[i % N]));
        }
    }
}

/* Counts that no scheme gives, only damaged memory: too few, too many, none, and so large that sums of them wrap. */
static uint32_t wrong_counts[6];

static void wrong_scheme(pfl_t *f)
{
    for (uint32_t i = 0u; i < f->config->particles; i++) {
        const uint32_t count = wrong_counts[(i < 2u) ? i : (2u + (i % 4u))];
        memcpy(&f->scratch[i], &count, sizeof count);
    }
}

/* The arena's ends are watched by the sanitizers where they are on, its canaries by the library. */
void test_wrong_counts_write_nothing_outside(void)
{
    static const uint32_t counts[] = {0u, 1u, 2u, 3u, 7u, 100u, 0x7FFFFFFFu, 0x80000000u, 0x80000001u, 0xFFFFFFFFu};
    enum { KINDS_OF_COUNT = sizeof counts / sizeof counts[0] };
    for (uint32_t trial = 0u; trial < 20000u; trial++) {
        const uint32_t n = 1u + (ut_random(&dice) % 40u);
        const uint16_t states = (uint16_t)(1u + (trial % PFL_STATES_MAX));
        pfl_config_t c = ut_dictated_config(n, states);
        c.resampling = wrong_scheme;
        pfl_t *f = ut_filter(&c);
        for (uint32_t k = 0u; k < 6u; k++) {
            wrong_counts[k] = counts[ut_random(&dice) % KINDS_OF_COUNT];
        }
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_resample(f));
        TEST_ASSERT_TRUE(pfl_invariants_hold(f));
        ut_arenas_end();
    }
}

void test_resampling_is_counted(void)
{
    enum { N = 20 };
    pfl_health_t health;
    pfl_config_t c = indexed(N, SYSTEMATIC, 0.0f);
    pfl_t *f = ut_filter(&c);
    for (uint32_t k = 1u; k <= 3u; k++) {
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_resample(f));
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_health(f, &health));
        TEST_ASSERT_EQUAL_UINT32(k, health.resampled);
    }
}

/* ess_ratio: 0 never, 1 always, between: when the effective sample size is below its share of N. */
static uint32_t resamplings(float ess_ratio, uint32_t kind, uint32_t n)
{
    pfl_health_t health;
    pfl_config_t c = indexed(n, SYSTEMATIC, ess_ratio);
    pfl_t *f = ut_filter(&c);
    make_set(kind, n);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(f, 0u, 0u, ll));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_health(f, &health));
    return health.resampled;
}

void test_ess_ratio_zero_never_resamples(void)
{
    TEST_ASSERT_EQUAL_UINT32(0u, resamplings(0.0f, 3u, 50u)); /* not even with one survivor */
}

void test_ess_ratio_decides_on_the_effective_sample_size(void)
{
    enum { N = 100 };
    for (uint32_t giants = 1u; giants < N; giants++) {
        pfl_health_t health;
        pfl_config_t c = indexed(N, SYSTEMATIC, 0.505f);
        pfl_t *f = ut_filter(&c);
        for (uint32_t i = 0u; i < N; i++) {
            ll[i] = (i < giants) ? 0.0f : -ut_infinity();
        }
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(f, 0u, 0u, ll));
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_health(f, &health));
        TEST_ASSERT_FLOAT_WITHIN(1.0e-3f, (float)giants, health.ess);
        TEST_ASSERT_EQUAL_UINT32((giants <= 50u) ? 1u : 0u, health.resampled);
    }
}

void test_ess_ratio_one_always_resamples(void)
{
    TEST_ASSERT_EQUAL_UINT32(1u, resamplings(1.0f, 11u, 50u));
    TEST_ASSERT_EQUAL_UINT32(1u, resamplings(1.0f, 0u, 50u)); /* equal weights too: "always" */
    TEST_ASSERT_EQUAL_UINT32(1u, resamplings(1.0f, 0u, 64u));
    TEST_ASSERT_EQUAL_UINT32(1u, resamplings(1.0f, 0u, 1u));
}

/* A measurement far off for everyone (a gate left open) must still prefer the nearest, and never the impossible. */
void test_far_off_measurement_keeps_the_order_of_particles(void)
{
    enum { N = 40 };
    static const float nearest[] = {-1.0e3f, -1.0e6f, -1.0e8f, -1.0e10f, -1.0e15f, -1.0e30f};
    for (size_t row = 0u; row < (sizeof nearest / sizeof nearest[0]); row++) {
        char text[48];
        pfl_config_t c = indexed(N, SYSTEMATIC, 0.0f);
        pfl_t *f = ut_filter(&c);
        clock_us = 0u;
        (void)snprintf(text, sizeof text, "nearest at ll = %g", (double)nearest[row]);
        all_but_one(N, 17u, 2.0f * nearest[row], nearest[row]);
        resample_once(f, true);
        TEST_ASSERT_TRUE(cloud_is_sound(f, N));
        TEST_ASSERT_EQUAL_UINT32_MESSAGE(N, offspring[17], text);
        all_but_one(N, 17u, -ut_infinity(), nearest[row]);
        resample_once(f, true);
        TEST_ASSERT_TRUE_MESSAGE(cloud_is_sound(f, N), text);
        TEST_ASSERT_EQUAL_UINT32_MESSAGE(N, offspring[17], text);
    }
}

/* ---- Many particles ------------------------------------------------------------------------------------------------ */

static void dead_loglik(void *user, const void *z, const pfl_view_t *p, float *out)
{
    (void)user;
    for (uint32_t i = 0u; i < p->n; i++) {
        out[i] = ((p->first + i) < *(const uint32_t *)z) ? -INFINITY : 0.0f;
    }
}

/* Copies of each particle after one resampling, the first `dead` of which are impossible. */
static void resample_many(uint32_t n, uint32_t scheme, uint32_t dead, uint32_t *copies)
{
    static const pfl_sensor_t sensor = {.loglik = dead_loglik};
    pfl_view_t view;
    pfl_config_t c = indexed(n, scheme, 0.0f);
    c.sensors = &sensor;
    pfl_t *f = ut_filter(&c);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(f, 1u, NULL));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(f, 0u, 1u, &dead));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_resample(f));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_particles(f, &view, NULL));
    memset(copies, 0, sizeof *copies * n);
    for (uint32_t i = 0u; i < n; i++) {
        TEST_ASSERT_TRUE((view.x[i] >= 0.0f) && (view.x[i] < (float)n));
        copies[(uint32_t)view.x[i]]++;
    }
}

static uint32_t copies_of[65536];

/* The integer weights are 32768 each here, and the teeth of the comb fall on them without a rest. */
void test_equal_weights_keep_every_particle_where_the_comb_divides_them_evenly(void)
{
    enum { EVEN = 61035 };
    for (uint32_t scheme = 0u; scheme < SCHEMES; scheme++) {
        resample_many(EVEN, scheme, 0u, copies_of);
        for (uint32_t i = 0u; (scheme != MULTINOMIAL) && (i < EVEN); i++) {
            const uint32_t slack = (scheme == SYSTEMATIC) ? 0u : 1u;
            TEST_ASSERT_TRUE((copies_of[i] + slack >= 1u) && (copies_of[i] <= 1u + slack));
        }
    }
}

/* Each share is 1 + 2^-16, a remainder too small to be drawn from: what is left goes to those that have copies. */
void test_residual_gives_away_what_remainders_cannot_draw(void)
{
    resample_many(65536u, RESIDUAL, 1u, copies_of);
    TEST_ASSERT_EQUAL_UINT32(0u, copies_of[0]);
    TEST_ASSERT_EQUAL_UINT32(2u, copies_of[1]);
    for (uint32_t i = 2u; i < 65536u; i++) {
        TEST_ASSERT_EQUAL_UINT32(1u, copies_of[i]);
    }
}
