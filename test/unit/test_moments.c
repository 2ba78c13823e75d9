/* What a filter answers about its cloud, against references in double: moments, angles, quantiles, best particle. */
#include "support.h"

#include "pflight/math.h"

#include "unity.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define N 213u
#define D_MAX PFL_STATES_MAX
#define PI 3.14159265358979323846

static float x[D_MAX * N];
static float ll[N];
static float log_weights[N];
static double weight[N];
static double mean_ref[D_MAX];
static double cov_ref[D_MAX * D_MAX];
static float mean[D_MAX];
static float cov[D_MAX * D_MAX];
static uint64_t dice;
static ut_table_t table;

void setUp(void)
{
    dice = 12345u;
    memset(ll, 0, sizeof ll);
}

void tearDown(void)
{
    ut_arenas_end();
}

/* ---- References ----------------------------------------------------------------------------------------------------- */

static double wrapped(double a)
{
    return a - (2.0 * PI * floor((a + PI) / (2.0 * PI)));
}

/* Weights in double from the log-likelihoods. */
static void reference_weights(uint32_t n)
{
    double sum = 0.0;
    for (uint32_t i = 0u; i < n; i++) {
        weight[i] = exp((double)ll[i]);
        sum += weight[i];
    }
    for (uint32_t i = 0u; i < n; i++) {
        weight[i] /= sum;
    }
}

static double reference_mean(const float *column, uint32_t n, bool circular)
{
    double s = 0.0;
    double c = 0.0;
    double m = 0.0;
    for (uint32_t i = 0u; i < n; i++) {
        m += weight[i] * (double)column[i];
        s += weight[i] * sin((double)column[i]);
        c += weight[i] * cos((double)column[i]);
    }
    return circular ? atan2(s, c) : m;
}

static void reference(uint32_t n, uint32_t states, uint32_t circular_mask)
{
    reference_weights(n);
    for (uint32_t d = 0u; d < states; d++) {
        mean_ref[d] = reference_mean(&x[d * n], n, ((circular_mask >> d) & 1u) != 0u);
    }
    for (uint32_t d = 0u; d < states; d++) {
        for (uint32_t e = 0u; e < states; e++) {
            double sum = 0.0;
            for (uint32_t i = 0u; i < n; i++) {
                double a = (double)x[(d * n) + i] - mean_ref[d];
                double b = (double)x[(e * n) + i] - mean_ref[e];
                a = (((circular_mask >> d) & 1u) != 0u) ? wrapped(a) : a;
                b = (((circular_mask >> e) & 1u) != 0u) ? wrapped(b) : b;
                sum += weight[i] * a * b;
            }
            cov_ref[(d * states) + e] = sum;
        }
    }
}

/* A filter that holds the table x, weighed by ll. */
static pfl_t *weighed(uint32_t n, uint16_t states, uint32_t circular_mask, pfl_moments_t moments)
{
    table.x = x;
    table.particles = n;
    table.states = states;
    pfl_config_t *c = (pfl_config_t *)ut_arena(sizeof *c);
    *c = ut_dictated_config(n, states);
    c->circular_mask = circular_mask;
    c->circular = pfl_circular_means;
    c->moments = (uint16_t)moments;
    c->draw = ut_table_draw;
    c->user = &table;
    pfl_t *f = ut_filter(c);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(f, 0u, 0u, ll));
    return f;
}

static void make_cloud(uint32_t n, uint32_t states, double centre, double spread)
{
    for (uint32_t k = 0u; k < (n * states); k++) {
        const double shared = (k < n) ? 0.0 : ((double)x[k - n] - centre) * 0.4; /* correlated columns */
        x[k] = (float)(centre + shared + (spread * ut_gaussian(&dice)));
    }
    for (uint32_t i = 0u; i < n; i++) {
        ll[i] = (float)(-6.0 * ut_uniform(&dice));
    }
}

static void compare(uint32_t states, double mean_slack, double cov_slack)
{
    for (uint32_t d = 0u; d < states; d++) {
        TEST_ASSERT_DOUBLE_WITHIN(mean_slack, 0.0, wrapped((double)mean[d] - mean_ref[d]));
        for (uint32_t e = 0u; e < states; e++) {
            TEST_ASSERT_DOUBLE_WITHIN(cov_slack, cov_ref[(d * states) + e], (double)cov[(d * states) + e]);
        }
    }
}

/* ---- Moments --------------------------------------------------------------------------------------------------------- */

void test_mean_and_covariance_for_every_number_of_states(void)
{
    static const uint32_t counts[] = {1u, 2u, 7u, 8u, 9u, 64u, 65u, N};
    for (uint16_t states = 1u; states <= D_MAX; states++) {
        for (size_t k = 0u; k < (sizeof counts / sizeof counts[0]); k++) {
            make_cloud(counts[k], states, 0.0, 0.3);
            reference(counts[k], states, 0u);
            pfl_t *f = weighed(counts[k], states, 0u, PFL_MOMENTS_FULL);
            TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(f, mean, cov));
            compare(states, 2.0e-6, 2.0e-6);
            ut_arenas_end();
        }
    }
}

void test_covariance_is_symmetric_with_no_negative_variance(void)
{
    make_cloud(N, 6u, 1.0e6, 0.0);
    pfl_t *f = weighed(N, 6u, 0u, PFL_MOMENTS_FULL);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(f, mean, cov));
    for (uint32_t d = 0u; d < 6u; d++) {
        TEST_ASSERT_TRUE(cov[7u * d] >= 0.0f);
        for (uint32_t e = 0u; e < 6u; e++) {
            TEST_ASSERT_EQUAL_HEX32(ut_bits(cov[(6u * d) + e]), ut_bits(cov[(6u * e) + d]));
        }
    }
}

/* 1e6 away with a spread of 10: the float grid there is 1/16. */
void test_a_small_cloud_far_from_the_origin_keeps_its_covariance(void)
{
    make_cloud(N, 3u, 1.0e6, 10.0);
    reference(N, 3u, 0u);
    pfl_t *f = weighed(N, 3u, 0u, PFL_MOMENTS_FULL);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(f, mean, cov));
    for (uint32_t d = 0u; d < 3u; d++) {
        TEST_ASSERT_DOUBLE_WITHIN(0.07, mean_ref[d], (double)mean[d]);
        TEST_ASSERT_DOUBLE_WITHIN(1.0e-3 * cov_ref[4u * d], cov_ref[4u * d], (double)cov[4u * d]);
    }
}

void test_mean_only_gives_the_same_mean_and_refuses_covariance(void)
{
    make_cloud(N, 4u, 2.0, 0.5);
    reference(N, 4u, 2u);
    pfl_t *f = weighed(N, 4u, 2u, PFL_MOMENTS_MEAN);
    memset(cov, 0x77, sizeof cov);
    memset(mean, 0x77, sizeof mean);
    TEST_ASSERT_EQUAL_INT(PFL_ERR_CONFIG, pfl_estimate(f, mean, cov));
    TEST_ASSERT_EACH_EQUAL_HEX8(0x77, mean, sizeof mean);
    TEST_ASSERT_EACH_EQUAL_HEX8(0x77, cov, sizeof cov);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(f, mean, NULL));
    for (uint32_t d = 0u; d < 4u; d++) {
        TEST_ASSERT_DOUBLE_WITHIN(3.0e-6, 0.0, wrapped((double)mean[d] - mean_ref[d]));
    }
}

void test_moments_beyond_single_precision_are_refused_untouched(void)
{
    for (uint32_t i = 0u; i < N; i++) {
        x[i] = ((i & 1u) != 0u) ? 3.0e38f : -3.0e38f;
    }
    pfl_t *f = weighed(N, 1u, 0u, PFL_MOMENTS_FULL);
    memset(mean, 0x77, sizeof mean);
    memset(cov, 0x77, sizeof cov);
    TEST_ASSERT_EQUAL_INT(PFL_ERR_NONFINITE, pfl_estimate(f, mean, cov));
    TEST_ASSERT_EACH_EQUAL_HEX8(0x77, mean, sizeof mean);
    TEST_ASSERT_EACH_EQUAL_HEX8(0x77, cov, sizeof cov);
    make_cloud(N, 2u, 0.0, 1.0); /* any of the states is enough */
    for (uint32_t i = 0u; i < N; i++) {
        x[i] = ((i & 1u) != 0u) ? 3.0e38f : -3.0e38f;
    }
    f = weighed(N, 2u, 0u, PFL_MOMENTS_FULL);
    TEST_ASSERT_EQUAL_INT(PFL_ERR_NONFINITE, pfl_estimate(f, mean, cov));
    f = weighed(N, 2u, 0u, PFL_MOMENTS_MEAN);
    TEST_ASSERT_EQUAL_INT(PFL_ERR_NONFINITE, pfl_estimate(f, mean, NULL));
}

void test_effective_sample_size_matches_its_formula(void)
{
    for (uint32_t round = 0u; round < 20u; round++) {
        double squares = 0.0;
        make_cloud(N, 1u, 0.0, 1.0);
        for (uint32_t i = 0u; i < N; i++) {
            ll[i] *= 0.3f * (float)round;
        }
        reference_weights(N);
        for (uint32_t i = 0u; i < N; i++) {
            squares += weight[i] * weight[i];
        }
        pfl_t *f = weighed(N, 1u, 0u, PFL_MOMENTS_FULL);
        TEST_ASSERT_DOUBLE_WITHIN(1.0e-5 / squares, 1.0 / squares, (double)pfl_effective_sample_size(f));
    }
}

void test_effective_sample_size_stays_between_one_and_n(void)
{
    for (uint32_t giants = 1u; giants <= N; giants++) {
        for (uint32_t i = 0u; i < N; i++) {
            ll[i] = (i < giants) ? 0.0f : -200.0f;
        }
        pfl_t *f = weighed(N, 1u, 0u, PFL_MOMENTS_FULL);
        const float ess = pfl_effective_sample_size(f);
        TEST_ASSERT_TRUE((ess >= 1.0f) && (ess <= (float)N));
        TEST_ASSERT_FLOAT_WITHIN(1.0e-3f, (float)giants, ess);
        ut_arenas_end();
    }
}

/* ---- Angles ----------------------------------------------------------------------------------------------------------- */

void test_circular_moments_near_the_seam_and_anywhere(void)
{
    static const double centres[] = {0.0, 1.0, 3.1, PI, -PI, -3.1, 3.5, 6.2, -7.0, 40.0, -500.0};
    for (size_t k = 0u; k < (sizeof centres / sizeof centres[0]); k++) {
        make_cloud(N, 2u, centres[k], 0.2);
        reference(N, 2u, 1u);
        pfl_t *f = weighed(N, 2u, 1u, PFL_MOMENTS_FULL);
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(f, mean, cov));
        TEST_ASSERT_TRUE((mean[0] >= -PFL_PI) && (mean[0] <= PFL_PI));
        TEST_ASSERT_DOUBLE_WITHIN(2.0e-5, 0.0, wrapped((double)mean[0] - mean_ref[0]));
        TEST_ASSERT_DOUBLE_WITHIN(2.0e-3, cov_ref[0], (double)cov[0]); /* two definitions of the mean, same spread */
        TEST_ASSERT_DOUBLE_WITHIN(2.0e-3, cov_ref[1], (double)cov[1]);
    }
}

/* Two heaps of angles on either side of the seam. */
void test_circular_mean_across_the_seam(void)
{
    for (uint32_t i = 0u; i < 10u; i++) {
        x[i] = ((i & 1u) != 0u) ? 3.0f : -3.0f;
    }
    pfl_t *f = weighed(10u, 1u, 1u, PFL_MOMENTS_FULL);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(f, mean, cov));
    TEST_ASSERT_FLOAT_WITHIN(1.0e-5f, PFL_PI, fabsf(mean[0]));
    TEST_ASSERT_FLOAT_WITHIN(1.0e-4f, 0.1415927f * 0.1415927f, cov[0]);
}

/* "[-pi, pi)": pi itself is told as -pi. */
void test_circular_mean_lies_in_the_half_open_interval(void)
{
    for (int32_t ulps = -40; ulps <= 40; ulps++) {
        for (uint32_t turn = 0u; turn < 6u; turn++) {
            const float seam = (float)((double)turn * PI);
            const float at = (turn == 0u) ? 0.0f : ut_float(ut_bits(seam) + (uint32_t)ulps);
            for (uint32_t i = 0u; i < 9u; i++) {
                x[i] = ((ulps & 1) != 0) ? -at : at;
            }
            pfl_t *f = weighed(9u, 1u, 1u, PFL_MOMENTS_FULL);
            char text[64];
            TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(f, mean, cov));
            (void)snprintf(text, sizeof text, "all at %.9g: mean %.9g", (double)x[0], (double)mean[0]);
            TEST_ASSERT_TRUE_MESSAGE((mean[0] >= -PFL_PI) && (mean[0] < PFL_PI), text);
            ut_arenas_end();
        }
    }
}

void test_a_uniform_circle_has_a_finite_mean(void)
{
    static const uint32_t counts[] = {2u, 3u, 4u, 8u, 12u, 64u, 200u};
    for (size_t k = 0u; k < (sizeof counts / sizeof counts[0]); k++) {
        const uint32_t n = counts[k];
        for (uint32_t i = 0u; i < n; i++) {
            x[i] = (float)(2.0 * PI * (double)i / (double)n);
        }
        pfl_t *f = weighed(n, 1u, 1u, PFL_MOMENTS_FULL);
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(f, mean, cov));
        TEST_ASSERT_TRUE(ut_finite(mean[0]) && (mean[0] >= -PFL_PI) && (mean[0] <= PFL_PI));
        TEST_ASSERT_TRUE(ut_finite(cov[0]) && (cov[0] >= 0.0f) && (cov[0] <= 9.87f));
    }
}

/* "covariance of the wrapped deviations": of a wide cloud too, wherever in it the most likely particle lies. */
void test_circular_covariance_does_not_depend_on_the_most_likely_particle(void)
{
    for (uint32_t k = 0u; k < 8u; k++) {
        char text[64];
        for (uint32_t i = 0u; i < N; i++) { /* evenly over +-2 rad */
            x[i] = (float)(-2.0 + (4.0 * (double)i / (double)(N - 1u)));
            ll[i] = -0.001f;
        }
        const uint32_t best = (k * (N - 1u)) / 7u;
        ll[best] = 0.0f;
        reference(N, 1u, 1u);
        pfl_t *f = weighed(N, 1u, 1u, PFL_MOMENTS_FULL);
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(f, mean, cov));
        TEST_ASSERT_DOUBLE_WITHIN(1.0e-4, mean_ref[0], (double)mean[0]);
        (void)snprintf(text, sizeof text, "best at %.3g rad", (double)x[best]);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(0.02, cov_ref[0], (double)cov[0], text);
    }
}

/* "Wrapped in estimates, never in the particles". */
void test_angles_are_not_wrapped_in_the_particles(void)
{
    pfl_view_t view;
    make_cloud(N, 1u, 100.0, 0.1);
    pfl_t *f = weighed(N, 1u, 1u, PFL_MOMENTS_FULL);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(f, mean, cov));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_particles(f, &view, NULL));
    TEST_ASSERT_EQUAL_MEMORY(x, view.x, sizeof(float) * N);
}

/* ---- Most likely, cloud ------------------------------------------------------------------------------------------------ */

void test_most_likely_is_the_particle_of_the_largest_weight(void)
{
    float best[3];
    for (uint32_t k = 0u; k < N; k++) {
        make_cloud(N, 3u, 0.0, 1.0);
        for (uint32_t i = 0u; i < N; i++) {
            ll[i] -= 1.0f;
        }
        ll[k] = -0.5f;
        pfl_t *f = weighed(N, 3u, 0u, PFL_MOMENTS_FULL);
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_most_likely(f, best));
        for (uint32_t d = 0u; d < 3u; d++) {
            TEST_ASSERT_EQUAL_HEX32(ut_bits(x[(d * N) + k]), ut_bits(best[d]));
        }
        ut_arenas_end();
    }
}

void test_log_weights_are_the_log_likelihoods_less_the_best(void)
{
    float top = -100.0f;
    pfl_view_t view;
    make_cloud(N, 2u, 0.0, 1.0);
    ll[4] = -ut_infinity();
    pfl_t *f = weighed(N, 2u, 0u, PFL_MOMENTS_FULL);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_particles(f, &view, log_weights));
    TEST_ASSERT_EQUAL_UINT32(0u, view.first);
    TEST_ASSERT_EQUAL_UINT32(N, view.n);
    for (uint32_t i = 0u; i < N; i++) {
        top = (ll[i] > top) ? ll[i] : top;
    }
    for (uint32_t i = 0u; i < N; i++) {
        if (i == 4u) {
            TEST_ASSERT_EQUAL_HEX32(0xFF800000u, ut_bits(log_weights[i]));
        } else {
            TEST_ASSERT_FLOAT_WITHIN(3.0e-6f, ll[i] - top, log_weights[i]);
        }
    }
    TEST_ASSERT_EQUAL_MEMORY(x, view.x, sizeof(float) * N);
}

/* ---- Quantiles --------------------------------------------------------------------------------------------------------- */

static float reference_quantile(uint32_t n, double p)
{
    float best = INFINITY;
    for (uint32_t i = 0u; i < n; i++) {
        double below = 0.0;
        for (uint32_t k = 0u; k < n; k++) {
            below += (x[k] <= x[i]) ? weight[k] : 0.0;
        }
        if ((below >= p) && (x[i] < best)) {
            best = x[i];
        }
    }
    return best;
}

/* Shares that fall within quantisation of a step could go either way: they are not asked for. */
static bool is_between_steps(uint32_t n, double p)
{
    for (uint32_t i = 0u; i < n; i++) {
        double below = 0.0;
        for (uint32_t k = 0u; k < n; k++) {
            below += (x[k] <= x[i]) ? weight[k] : 0.0;
        }
        if (fabs(below - p) < 2.0e-6) {
            return false;
        }
    }
    return true;
}

static void quantiles_match(uint32_t n)
{
    uint32_t asked = 0u;
    reference_weights(n);
    pfl_t *f = weighed(n, 1u, 0u, PFL_MOMENTS_FULL);
    for (uint32_t k = 0u; k < 40u; k++) {
        float value = 0.0f;
        const float p = (float)((1.0 + (double)k) / 41.3);
        if (is_between_steps(n, (double)p)) {
            TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_quantile(f, 0u, p, &value));
            TEST_ASSERT_EQUAL_HEX32(ut_bits(reference_quantile(n, (double)p)), ut_bits(value));
            asked++;
        }
    }
    TEST_ASSERT_TRUE(asked > 30u);
}

void test_quantiles_match_a_sorted_reference(void)
{
    static const uint32_t counts[] = {1u, 2u, 3u, 8u, 65u, N};
    for (size_t k = 0u; k < (sizeof counts / sizeof counts[0]); k++) {
        make_cloud(counts[k], 1u, -0.1, 1.0);
        quantiles_match(counts[k]);
    }
}

void test_quantiles_with_equal_values_match(void)
{
    make_cloud(N, 1u, 0.0, 1.0);
    for (uint32_t i = 0u; i < N; i++) {
        x[i] = floorf(x[i] * 2.0f) + 0.5f;
    }
    quantiles_match(N);
}

void test_quantiles_of_huge_and_tiny_values_match(void)
{
    make_cloud(N, 1u, 0.0, 1.0);
    for (uint32_t i = 0u; i < N; i++) {
        x[i] *= ((i % 3u) == 0u) ? 1.0e37f : (((i % 3u) == 1u) ? 1.0e-38f : 1.0f);
    }
    table.x = x;
    quantiles_match(N);
}

void test_quantile_one_is_the_largest_with_weight_and_a_tiny_one_the_smallest(void)
{
    float value = 0.0f;
    for (uint32_t i = 0u; i < 20u; i++) {
        x[i] = (float)i;
        ll[i] = ((i < 3u) || (i > 15u)) ? -ut_infinity() : -0.01f * (float)i;
    }
    pfl_t *f = weighed(20u, 1u, 0u, PFL_MOMENTS_FULL);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_quantile(f, 0u, 1.0f, &value));
    TEST_ASSERT_FLOAT_WITHIN(0.0f, 15.0f, value);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_quantile(f, 0u, 1.0e-30f, &value));
    TEST_ASSERT_FLOAT_WITHIN(0.0f, 3.0f, value);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_quantile(f, 0u, ut_float(1u), &value));
    TEST_ASSERT_FLOAT_WITHIN(0.0f, 3.0f, value);
}

void test_quantile_refuses_shares_out_of_range(void)
{
    const float bad[] = {0.0f, -0.1f, 1.0000001f, 2.0f, ut_infinity(), -ut_infinity(), ut_nan(false), ut_nan(true)};
    float value = 77.0f;
    make_cloud(N, 1u, 0.0, 1.0);
    pfl_t *f = weighed(N, 1u, 0u, PFL_MOMENTS_FULL);
    for (size_t k = 0u; k < (sizeof bad / sizeof bad[0]); k++) {
        TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_quantile(f, 0u, bad[k], &value));
    }
    TEST_ASSERT_FLOAT_WITHIN(0.0f, 77.0f, value);
}

void test_quantile_takes_every_state_and_changes_nothing(void)
{
    float value = 0.0f;
    make_cloud(N, 4u, 3.0, 1.0);
    pfl_t *f = weighed(N, 4u, 15u, PFL_MOMENTS_FULL); /* angles "as they stand in the particles" */
    const unsigned char *before = ut_snapshot(f);
    reference_weights(N);
    for (uint16_t d = 0u; d < 4u; d++) {
        float column[N];
        memcpy(column, &x[d * N], sizeof column);
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_quantile(f, d, 0.5f, &value));
        double below = 0.0;
        double upto = 0.0;
        for (uint32_t i = 0u; i < N; i++) {
            below += (column[i] < value) ? weight[i] : 0.0;
            upto += (column[i] <= value) ? weight[i] : 0.0;
        }
        TEST_ASSERT_TRUE((below < 0.500001) && (upto > 0.499999));
    }
    TEST_ASSERT_TRUE(ut_same_bytes(before, ut_snapshot(f), pfl_snapshot_bytes(f)));
}

/* A quantile uses the weights' column for itself; a resampling afterwards must not notice. */
void test_resampling_after_a_quantile_gives_the_same_bits(void)
{
    float value = 0.0f;
    make_cloud(N, 2u, 0.0, 1.0);
    pfl_t *a = weighed(N, 2u, 0u, PFL_MOMENTS_FULL);
    pfl_t *b = weighed(N, 2u, 0u, PFL_MOMENTS_FULL);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_quantile(a, 0u, 0.3f, &value));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_resample(a));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_resample(b));
    TEST_ASSERT_TRUE(ut_same_bytes(ut_snapshot(a), ut_snapshot(b), pfl_snapshot_bytes(a)));
}

/* A million particles at one place, and the one about which moments are taken at another: nearly all of the second moment
 * is taken off again, and rounding alone would leave less than nothing. */
static float elsewhere;

static void two_places_draw(void *user, const pfl_batch_t *p)
{
    (void)user;
    for (uint32_t i = 0u; i < p->n; i++) {
        PFL_STATE(p, 0)[i] = ((p->first + i) == 0u) ? 0.0f : elsewhere;
        PFL_STATE(p, 1)[i] = -PFL_STATE(p, 0)[i];
    }
}

void test_no_rounding_makes_a_variance_negative(void)
{
#ifdef PFL_TEST_ON_TARGET
    TEST_IGNORE_MESSAGE("rounding is not larger than the variance of fewer particles than the board has memory for");
#endif
    float m[2];
    float v[4];
    uint32_t zero = 0u;
    pfl_config_t c = ut_dictated_config(PFL_PARTICLES_MAX, 2u);
    c.draw = two_places_draw;
    for (uint32_t k = 0u; k < 6u; k++) {
        elsewhere = 1.1f + (0.1234567f * (float)k);
        pfl_t *f = ut_filter(&c);
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(f, m, v));
        TEST_ASSERT_TRUE((v[0] >= 0.0f) && (v[3] >= 0.0f));
        zero += (v[0] > 0.0f) ? 0u : 1u;
        ut_arenas_end();
    }
    TEST_ASSERT_TRUE_MESSAGE(zero > 0u, "this cloud no longer tests what it was made for");
}
