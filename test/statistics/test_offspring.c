/* Resampling is unbiased: over many resamplings of one fixed set of weights the mean offspring of particle i is N w_i,
 * for every scheme, the last particle and those without weight included; and the variances are those of the theory.
 *
 * Bounds on means are Bernstein's, not asymptotic: P(|S - E S| >= t) <= 2 exp(-t^2 / (2 (V + c t / 3))) with the exact
 * variance V and single steps of at most c. Each comparison fails a perfect resampler with odds of 1e-10, all 2912 of
 * them together with 3e-7. Seeds are fixed. */
#include "pflight/filter.h"
#include "unity.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define N_MAX 300u
#define ROUNDS 40000u
#define ROUNDING 1.0e-5 /* of an offspring: weights are floats, cut to 2e9 quanta */

enum { SYSTEMATIC, STRATIFIED, RESIDUAL, MULTINOMIAL, SCHEMES };

static const pfl_scheme_fn schemes[SCHEMES] = {pfl_systematic, pfl_stratified, pfl_residual, pfl_multinomial};

static union {
    uint64_t align;
    unsigned char bytes[PFL_ARENA_BYTES(N_MAX, 1, 1)];
} arena;

static float log_weight[N_MAX]; /* the fixed weights */
static double share[N_MAX];     /* N w_i */
static double mean[N_MAX];
static double variance[N_MAX];

void setUp(void)
{
}

void tearDown(void)
{
}

static void stay(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    (void)user;
    (void)u;
    (void)dt_s;
    (void)p;
}

/* The state of a particle is its index, so that the cloud tells who its parents were. */
static void number_them(void *user, const pfl_batch_t *p)
{
    (void)user;
    for (uint32_t i = 0u; i < p->n; i++) {
        p->x[i] = (float)(p->first + i);
    }
}

static void weigh(void *user, const void *z, const pfl_view_t *p, float *ll)
{
    (void)user;
    (void)z;
    memcpy(ll, &log_weight[p->first], sizeof(float) * p->n);
}

/* Weights over five decades in an order without pattern; every eleventh is zero. The last particle is a heavy one, or,
 * with `dead_end`, has no weight like its neighbour. */
static void choose_weights(uint32_t n, bool dead_end)
{
    double sum = 0.0;
    for (uint32_t i = 0u; i < n; i++) {
        const double heavy = exp(-11.5 * (double)((i * 37u) % n) / (double)n);
        const bool dead = ((i % 11u) == 5u) || (dead_end && (i >= (n - 2u)));
        log_weight[i] = dead ? -INFINITY : (float)log(heavy);
        if (!dead_end && (i == (n - 1u))) {
            log_weight[i] = -0.25f;
        }
        sum += exp((double)log_weight[i]);
    }
    for (uint32_t i = 0u; i < n; i++) {
        share[i] = ((double)n * exp((double)log_weight[i])) / sum;
    }
}

/* Resamples ROUNDS times from the same weights; leaves mean and variance of every particle's offspring. */
static void resample_often(uint32_t n, uint16_t scheme)
{
    static uint64_t count[N_MAX], square[N_MAX];
    const pfl_sensor_t sensor = {.loglik = weigh};
    const float z = 0.0f;
    pfl_config_t c;
    pfl_view_t view;
    pfl_t *f = NULL;
    memset(count, 0, sizeof count);
    memset(square, 0, sizeof square);
    memset(&c, 0, sizeof c);
    c.abi = PFL_ABI;
    c.particles = n;
    c.states = 1u;
    c.sensor_count = 1u;
    c.resampling = schemes[scheme];
    c.moments = PFL_MOMENTS_MEAN;
    c.seed = ((uint64_t)n << 8) + scheme;
    c.sensors = &sensor;
    c.predict = stay;
    c.draw = number_them;
    TEST_ASSERT_EQUAL(PFL_OK, pfl_init(&arena, sizeof arena, &c, 0u, &f));
    for (uint32_t round = 0u; round < ROUNDS; round++) {
        uint32_t offspring[N_MAX] = {0u};
        TEST_ASSERT_EQUAL(PFL_OK, pfl_reset(f, 0u));
        TEST_ASSERT_EQUAL(PFL_OK, pfl_update(f, 0u, 0u, &z));
        TEST_ASSERT_EQUAL(PFL_OK, pfl_resample(f));
        TEST_ASSERT_EQUAL(PFL_OK, pfl_particles(f, &view, NULL));
        for (uint32_t i = 0u; i < n; i++) {
            const uint32_t parent = (uint32_t)(int32_t)view.x[i];
            TEST_ASSERT_TRUE(parent < n);
            offspring[parent]++;
        }
        for (uint32_t i = 0u; i < n; i++) {
            count[i] += offspring[i];
            square[i] += (uint64_t)offspring[i] * offspring[i];
        }
    }
    for (uint32_t i = 0u; i < n; i++) {
        mean[i] = (double)count[i] / ROUNDS;
        variance[i] = ((double)square[i] / ROUNDS) - (mean[i] * mean[i]);
    }
}

/* ---- Theory --------------------------------------------------------------------------------------------------- */

static double spread(double p)
{
    return p * (1.0 - p);
}

/* The parts of particle i's interval [from, from + a) that lie in strata it does not fill. */
static double stratified_variance(double from, double a)
{
    const double to = from + a;
    const double first = floor(from) + 1.0; /* end of the first stratum */
    if (to <= first) {
        return spread(a);
    }
    return spread(first - from) + spread(to - floor(to));
}

/* Exact variance of the offspring of each particle under a scheme. */
static void exact_variances(uint32_t n, uint16_t scheme, double *v)
{
    double rest = 0.0;
    double from = 0.0;
    for (uint32_t i = 0u; i < n; i++) {
        rest += share[i] - floor(share[i]);
    }
    for (uint32_t i = 0u; i < n; i++) {
        const double fraction = share[i] - floor(share[i]);
        switch (scheme) {
        case SYSTEMATIC:
            v[i] = spread(fraction);
            break;
        case STRATIFIED:
            v[i] = stratified_variance(from, share[i]);
            break;
        case RESIDUAL:
            v[i] = rest * spread(fraction / rest);
            break;
        default:
            v[i] = (double)n * spread(share[i] / (double)n);
            break;
        }
        from += share[i];
    }
}

/* Bernstein's bound on the mean of ROUNDS counts, odds 1e-10: ln(2e10) = 23.72. A count moves by less than 2 (it lies
 * within that of its expectation), or is a sum of single draws. */
static double bound_on_mean(double one_variance)
{
    const double odds = 23.72;
    const double linear = (2.0 / 3.0) * odds;
    const double sum = linear + sqrt((linear * linear) + (2.0 * (double)ROUNDS * one_variance * odds));
    return (sum / ROUNDS) + ROUNDING;
}

/* Sum of the variances found; checks every mean and the sum of variances against theory. */
static double check(uint32_t n, uint16_t scheme)
{
    static double exact[N_MAX];
    double found_sum = 0.0;
    double exact_sum = 0.0;
    resample_often(n, scheme);
    exact_variances(n, scheme, exact);
    for (uint32_t i = 0u; i < n; i++) {
        char what[64];
        (void)snprintf(what, sizeof what, "scheme %u, N = %u, particle %u", (unsigned)scheme, (unsigned)n, (unsigned)i);
        if (share[i] > 0.0) {
            TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(bound_on_mean(exact[i]), share[i], mean[i], what);
        } else {
            TEST_ASSERT_TRUE_MESSAGE(mean[i] <= 0.0, what); /* never any offspring without weight */
        }
        found_sum += variance[i];
        exact_sum += exact[i];
    }
    /* 5 %: some ten standard errors of the sum (about 0.5 % from 40 000 rounds), odds far below 1e-6 */
    TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(0.05 * exact_sum, exact_sum, found_sum, "summed variance of the offspring");
    return found_sum;
}

static void check_all(uint32_t n, bool dead_end)
{
    double sum[SCHEMES];
    choose_weights(n, dead_end);
    for (uint16_t scheme = 0u; scheme < SCHEMES; scheme++) {
        sum[scheme] = check(n, scheme);
    }
    TEST_ASSERT_TRUE(sum[SYSTEMATIC] <= sum[STRATIFIED]);
    TEST_ASSERT_TRUE(sum[STRATIFIED] <= sum[MULTINOMIAL]);
    TEST_ASSERT_TRUE(sum[RESIDUAL] <= sum[MULTINOMIAL]);
}

void test_64_particles(void)
{
    check_all(64u, false);
}

void test_64_particles_with_a_dead_end(void)
{
    check_all(64u, true);
}

void test_300_particles(void)
{
    check_all(300u, false);
}

void test_300_particles_with_a_dead_end(void)
{
    check_all(300u, true);
}
