/* Are the library's normals normal and independent? Ten million of them from a fixed seed against exact theory. Each
 * assertion fails a perfect generator with odds of at most 1e-6 (five standard errors: 5.7e-7; else as stated). */
#include "pflight/rng.h"
#include "unity.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#define COUNT 10000000u
#define GROUP (2u * PFL_RNG_LANES)
#define FINE 1000000u /* equal shares of probability for the Kolmogorov-Smirnov test */
#define COARSE 1000u  /* and for the chi-square test */
#define SIDE 32u      /* parts of radius and angle in the test of their independence */
#define WINDOWS 5u    /* into their bits */
#define SIGMAS 5.0

static float *z;

void setUp(void)
{
    if (z == NULL) {
        pfl_rng_t rng;
        z = malloc(sizeof(float) * COUNT); /* kept for all tests of the file */
        TEST_ASSERT_NOT_NULL(z);
        pfl_rng_seed(&rng, 20260301u);
        pfl_rng_normals(&rng, z, COUNT / GROUP);
    }
}

void tearDown(void)
{
}

static void assert_within(double want, double got, double standard_error, const char *what)
{
    TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(SIGMAS * standard_error, want, got, what);
}

void test_moments_one_to_six(void)
{
    /* E z^k, and Var z^k = E z^2k - (E z^k)^2 with E z^2k = 1 3 5 .. (2k-1) */
    static const double mean[7] = {1.0, 0.0, 1.0, 0.0, 3.0, 0.0, 15.0};
    static const double variance[7] = {0.0, 1.0, 2.0, 15.0, 96.0, 945.0, 10170.0};
    static const char *const names[7] = {"", "mean", "variance", "third", "fourth", "fifth", "sixth"};
    double sum[7] = {0.0};
    for (uint32_t i = 0u; i < COUNT; i++) {
        double power = 1.0;
        for (uint32_t k = 1u; k <= 6u; k++) {
            power *= (double)z[i];
            sum[k] += power;
        }
    }
    for (uint32_t k = 1u; k <= 6u; k++) {
        assert_within(mean[k], sum[k] / COUNT, sqrt(variance[k] / COUNT), names[k]);
    }
}

/* Counts the normals in FINE cells of equal probability. */
static uint32_t *fine_counts(void)
{
    uint32_t *cells = calloc(FINE, sizeof *cells);
    TEST_ASSERT_NOT_NULL(cells);
    for (uint32_t i = 0u; i < COUNT; i++) {
        const double below = 0.5 * erfc(-(double)z[i] * 0.70710678118654752);
        const uint32_t cell = (uint32_t)(below * FINE);
        cells[(cell < FINE) ? cell : (FINE - 1u)]++;
    }
    return cells;
}

/* Sup over the cells' edges only, which is never above the true statistic. P(sqrt(n) D > t) <= 2 exp(-2 t^2)
 * (Massart 1990): t = 2.7 has odds of 9.3e-7. */
void test_kolmogorov_smirnov(void)
{
    uint32_t *cells = fine_counts();
    double most = 0.0;
    uint64_t below = 0u;
    for (uint32_t k = 0u; k < FINE; k++) {
        below += cells[k];
        const double distance = fabs(((double)below / COUNT) - (((double)k + 1.0) / FINE));
        most = (distance > most) ? distance : most;
    }
    free(cells);
    TEST_ASSERT_TRUE_MESSAGE(sqrt((double)COUNT) * most < 2.7, "the distribution is not normal");
    TEST_ASSERT_TRUE_MESSAGE(sqrt((double)COUNT) * most > 0.1, "too even to be random"); /* odds < 1e-40 */
}

/* 999 degrees of freedom: 790.9 .. 1238.6 are five standard deviations after Wilson and Hilferty's cube root. */
void test_chi_square(void)
{
    uint32_t *cells = fine_counts();
    const double expected = (double)COUNT / COARSE;
    double sum = 0.0;
    for (uint32_t k = 0u; k < COARSE; k++) {
        double found = 0.0;
        for (uint32_t j = 0u; j < (FINE / COARSE); j++) {
            found += (double)cells[(k * (FINE / COARSE)) + j];
        }
        sum += ((found - expected) * (found - expected)) / expected;
    }
    free(cells);
    TEST_ASSERT_TRUE_MESSAGE(sum < 1238.6, "the distribution is not normal");
    TEST_ASSERT_TRUE_MESSAGE(sum > 790.9, "too even to be random");
}

/* Uncorrelated, and uncorrelated in their squares: (z^2 - 1) has variance 2. */
static void assert_uncorrelated(uint32_t lag, bool pairs_only, const char *what)
{
    double product = 0.0;
    double squares = 0.0;
    double n = 0.0;
    for (uint32_t i = 0u; (i + lag) < COUNT; i++) {
        if (!pairs_only || ((i % GROUP) < PFL_RNG_LANES)) {
            const double a = (double)z[i];
            const double b = (double)z[i + lag];
            product += a * b;
            squares += ((a * a) - 1.0) * ((b * b) - 1.0);
            n += 1.0;
        }
    }
    assert_within(0.0, product / n, 1.0 / sqrt(n), what);
    assert_within(0.0, squares / n, 2.0 / sqrt(n), what);
}

void test_the_two_of_a_radius_are_uncorrelated(void)
{
    assert_uncorrelated(PFL_RNG_LANES, true, "l and l + 8");
}

void test_successive_normals_are_uncorrelated(void)
{
    assert_uncorrelated(1u, false, "neighbours");
    assert_uncorrelated(2u, false, "next but one");
    assert_uncorrelated(PFL_RNG_LANES, false, "eight apart");
    assert_uncorrelated(GROUP, false, "successive draws of a lane");
    assert_uncorrelated(64u, false, "successive batches");
}

/* Five standard deviations either way, after Wilson and Hilferty's cube root. */
static void assert_chi_square(double sum, double freedom, const char *what)
{
    const double spread = 2.0 / (9.0 * freedom);
    TEST_ASSERT_TRUE_MESSAGE(sum < (freedom * pow((1.0 - spread) + (SIGMAS * sqrt(spread)), 3.0)), what);
    TEST_ASSERT_TRUE_MESSAGE(sum > (freedom * pow((1.0 - spread) - (SIGMAS * sqrt(spread)), 3.0)), what);
}

/* Two uniform numbers of a pair, if it is what it should be: of its radius, and of its angle. */
static void uniforms_of_pair(uint32_t pair, double *of_radius, double *of_angle)
{
    const uint32_t i = ((pair / PFL_RNG_LANES) * GROUP) + (pair % PFL_RNG_LANES);
    const double x = (double)z[i];
    const double y = (double)z[i + PFL_RNG_LANES];
    *of_radius = exp(-0.5 * ((x * x) + (y * y)));
    *of_angle = (atan2(y, x) * 0.159154943091895336) + 0.5;
}

/* Which of SIDE equal parts of the unit interval u is in, when only its bits after the first `skip` are looked at. */
static uint32_t part(double u, uint32_t skip)
{
    const double scaled = u * (double)(1u << skip);
    const uint32_t k = (uint32_t)((scaled - floor(scaled)) * SIDE);
    return (k < SIDE) ? k : (SIDE - 1u);
}

/* Radius and angle are independent, also where one shows its leading bits and the other some later ones: an angle made
 * from the radius' bits, however shifted, does not pass. Windows of five bits overlap by one. */
void test_radius_and_angle_are_independent(void)
{
    static double cells[2u * WINDOWS][SIDE * SIDE];
    const double expected = (COUNT / 2.0) / (SIDE * SIDE);
    memset(cells, 0, sizeof cells);
    for (uint32_t pair = 0u; pair < (COUNT / 2u); pair++) {
        double of_radius;
        double of_angle;
        uniforms_of_pair(pair, &of_radius, &of_angle);
        for (uint32_t w = 0u; w < WINDOWS; w++) {
            cells[w][(part(of_radius, 0u) * SIDE) + part(of_angle, 4u * w)] += 1.0;
            cells[WINDOWS + w][(part(of_radius, 4u * w) * SIDE) + part(of_angle, 0u)] += 1.0;
        }
    }
    for (uint32_t w = 0u; w < (2u * WINDOWS); w++) {
        double sum = 0.0;
        for (uint32_t k = 0u; k < (SIDE * SIDE); k++) {
            sum += ((cells[w][k] - expected) * (cells[w][k] - expected)) / expected;
        }
        assert_chi_square(sum, (SIDE * SIDE) - 1.0, "radius and angle share bits");
    }
}

/* The radius comes from one polynomial for every octave of its uniform number: ten octaves in eight parts each, and all
 * beyond. 80 degrees of freedom; at least 400 pairs a cell are expected. */
void test_every_octave_of_the_radius_has_its_share(void)
{
    double cells[81];
    double sum = 0.0;
    memset(cells, 0, sizeof cells);
    for (uint32_t pair = 0u; pair < (COUNT / 2u); pair++) {
        double of_radius;
        double of_angle;
        uniforms_of_pair(pair, &of_radius, &of_angle);
        const double eighths = -8.0 * log2(of_radius);
        cells[(eighths < 80.0) ? (uint32_t)eighths : 80u] += 1.0;
    }
    for (uint32_t k = 0u; k < 81u; k++) {
        const double beyond = (k < 80u) ? pow(0.5, (k + 1.0) / 8.0) : 0.0;
        const double expected = (COUNT / 2.0) * (pow(0.5, k / 8.0) - beyond);
        sum += ((cells[k] - expected) * (cells[k] - expected)) / expected;
    }
    assert_chi_square(sum, 80.0, "octaves of the radius");
}

static void count_beyond(double limit, double *above, double *below)
{
    *above = 0.0;
    *below = 0.0;
    for (uint32_t i = 0u; i < COUNT; i++) {
        *above += ((double)z[i] > limit) ? 1.0 : 0.0;
        *below += ((double)z[i] < -limit) ? 1.0 : 0.0;
    }
}

void test_tails(void)
{
    double above;
    double below;
    for (double limit = 3.0; limit < 4.5; limit += 1.0) {
        const double share = 0.5 * erfc(limit * 0.70710678118654752);
        const double error = sqrt(COUNT * share);
        count_beyond(limit, &above, &below);
        assert_within(COUNT * share, above, error, "upper tail");
        assert_within(COUNT * share, below, error, "lower tail");
    }
    /* Beyond 5 sigma 5.73 are expected, Poisson: 22 or more have odds of 2e-7, and none has 3e-3. */
    count_beyond(5.0, &above, &below);
    TEST_ASSERT_TRUE_MESSAGE((above + below) < 22.0, "too many beyond 5 sigma");
    count_beyond(6.56, &above, &below); /* rng.h: |z| < 6.56 */
    TEST_ASSERT_TRUE_MESSAGE((above + below) < 0.5, "beyond the stated end of the distribution");
}

/* A larger part of the tail, from many small seeds: 1e8 normals, of which 57.3 lie beyond 5 sigma (Poisson). Outside of
 * 22 .. 100 has odds of 3e-7. */
void test_far_tail_is_there(void)
{
    static float some[GROUP * 1000u];
    uint32_t beyond = 0u;
    pfl_rng_t rng;
    for (uint64_t seed = 0u; seed < 100u; seed++) {
        pfl_rng_seed(&rng, seed);
        for (uint32_t k = 0u; k < 63u; k++) {
            pfl_rng_normals(&rng, some, 1000u);
            for (uint32_t i = 0u; i < (GROUP * 1000u); i++) {
                beyond += (fabsf(some[i]) > 5.0f) ? 1u : 0u;
            }
        }
    }
    TEST_ASSERT_TRUE_MESSAGE((beyond >= 22u) && (beyond <= 100u), "5 sigma tail");
}
