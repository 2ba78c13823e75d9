/* The float functions: special cases, ULP against double libm on a stride over the bits, batches equal to scalars. The
 * measurement over every float is tools/ulp's. */
#include "support.h"

#include "pflight/math.h"

#include "../../lib/src/math_kernels.h"
#include "../../lib/src/sqrt_kernel.h"

#include "unity.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#ifdef PFL_TEST_ON_TARGET
#define STRIDE 20011u /* emulation and doubles in software take their time */
#define PAIRS 100000u
#else
#define STRIDE 1009u /* a prime: about 4 million floats over the whole line */
#define PAIRS 3000000u
#endif

void setUp(void)
{
}

void tearDown(void)
{
}

static void is_nan(float x)
{
    TEST_ASSERT_TRUE((ut_bits(x) & 0x7FFFFFFFu) > 0x7F800000u);
}

static void is_exactly(float expected, float got)
{
    TEST_ASSERT_EQUAL_HEX32(ut_bits(expected), ut_bits(got));
}

/* ---- Special cases ------------------------------------------------------------------------------------------------------ */

void test_nan_in_gives_nan_out(void)
{
    const float nans[] = {ut_nan(false), ut_nan(true), ut_float(0x7FFFFFFFu), ut_float(0xFFFFFFFFu)};
    for (size_t k = 0u; k < (sizeof nans / sizeof nans[0]); k++) {
        float s;
        float c;
        pfl_sincosf(nans[k], &s, &c);
        is_nan(s);
        is_nan(c);
        is_nan(pfl_sinf(nans[k]));
        is_nan(pfl_cosf(nans[k]));
        is_nan(pfl_tanf(nans[k]));
        is_nan(pfl_expf(nans[k]));
        is_nan(pfl_logf(nans[k]));
        is_nan(pfl_sqrtf(nans[k]));
        is_nan(pfl_wrap_pi(nans[k]));
        is_nan(pfl_atan2f(nans[k], 1.0f));
        is_nan(pfl_atan2f(1.0f, nans[k]));
        is_nan(pfl_atan2f(nans[k], 0.0f));
        is_nan(pfl_atan2f(0.0f, nans[k]));
    }
}

void test_exp_ends(void)
{
    is_exactly(1.0f, pfl_expf(0.0f));
    is_exactly(1.0f, pfl_expf(-0.0f));
    is_exactly(0.0f, pfl_expf(-87.34f));
    is_exactly(0.0f, pfl_expf(-1.0e30f));
    is_exactly(0.0f, pfl_expf(-ut_infinity()));
    is_exactly(ut_infinity(), pfl_expf(88.73f));
    is_exactly(ut_infinity(), pfl_expf(3.0e38f));
    is_exactly(ut_infinity(), pfl_expf(ut_infinity()));
    TEST_ASSERT_TRUE(pfl_expf(-87.33f) >= 1.17549435e-38f);
    TEST_ASSERT_TRUE(ut_finite(pfl_expf(88.72f)));
}

/* "0 below (no subnormal results)". */
void test_exp_is_never_subnormal(void)
{
    for (float x = -104.0f; x < -87.0f; x += 0.0007f) {
        const uint32_t bits = ut_bits(pfl_expf(x));
        TEST_ASSERT_TRUE((bits == 0u) || (bits >= 0x00800000u));
    }
}

void test_log_ends(void)
{
    is_exactly(0.0f, pfl_logf(1.0f));
    is_exactly(-ut_infinity(), pfl_logf(0.0f));
    is_exactly(-ut_infinity(), pfl_logf(-0.0f));
    is_exactly(-ut_infinity(), pfl_logf(ut_float(1u)));
    is_exactly(-ut_infinity(), pfl_logf(ut_float(0x007FFFFFu)));
    is_exactly(ut_infinity(), pfl_logf(ut_infinity()));
    is_nan(pfl_logf(-1.17549435e-38f));
    is_nan(pfl_logf(-0.3f));
    is_nan(pfl_logf(-1.0f));
    is_nan(pfl_logf(-ut_infinity()));
}

void test_sqrt_ends(void)
{
    is_exactly(0.0f, pfl_sqrtf(0.0f));
    is_exactly(ut_infinity(), pfl_sqrtf(ut_infinity()));
    is_exactly(2.0f, pfl_sqrtf(4.0f));
    is_nan(pfl_sqrtf(-1.0e-30f));
    is_nan(pfl_sqrtf(-ut_infinity()));
}

void test_atan2_axes_and_origin(void)
{
    TEST_ASSERT_FLOAT_WITHIN(0.0f, 0.0f, pfl_atan2f(0.0f, 0.0f));
    TEST_ASSERT_FLOAT_WITHIN(0.0f, 0.0f, pfl_atan2f(-0.0f, 0.0f));
    TEST_ASSERT_FLOAT_WITHIN(0.0f, 0.0f, pfl_atan2f(0.0f, -0.0f));
    TEST_ASSERT_FLOAT_WITHIN(0.0f, 0.0f, pfl_atan2f(-0.0f, -0.0f));
    is_exactly(0.0f, pfl_atan2f(0.0f, 2.0f));
    is_exactly(PFL_PI, pfl_atan2f(0.0f, -2.0f));
    is_exactly(-PFL_PI, pfl_atan2f(-0.0f, -2.0f));
    is_exactly(1.57079637f, pfl_atan2f(3.0f, 0.0f));
    is_exactly(-1.57079637f, pfl_atan2f(-3.0f, 0.0f));
}

void test_pi_is_the_float_nearest_to_pi(void)
{
    is_exactly((float)3.14159265358979323846, PFL_PI);
}

/* ---- ULP -------------------------------------------------------------------------------------------------------------------- */

/* Every STRIDE-th float of +-[lo, hi]. */
static void sweep(float lo, float hi, bool negative, double bound, float (*mine)(float), double (*libm)(double))
{
    char text[96];
    double worst = 0.0;
    float at = lo;
    for (uint32_t bits = ut_bits(lo); bits <= ut_bits(hi); bits += STRIDE) {
        const float x = ut_float(negative ? (bits | 0x80000000u) : bits);
        const double error = ut_ulp(mine(x), libm((double)x));
        if (!(error <= worst)) {
            worst = error;
            at = x;
        }
    }
    (void)snprintf(text, sizeof text, "%.3f ULP at %.9g, bound %.2f", worst, (double)at, bound);
    TEST_ASSERT_TRUE_MESSAGE(worst <= bound, text);
}

void test_exp_within_one_ulp(void)
{
    sweep(0.0f, 88.72f, false, 1.0, pfl_expf, exp);
    sweep(0.0f, 87.33f, true, 1.0, pfl_expf, exp);
}

void test_log_within_one_ulp(void)
{
    sweep(1.17549435e-38f, 3.4028235e38f, false, 1.0, pfl_logf, log);
}

void test_sine_and_cosine_within_their_ulps(void)
{
    sweep(1.17549435e-38f, 1608.0f, false, 2.6, pfl_sinf, sin);
    sweep(1.17549435e-38f, 1608.0f, true, 2.6, pfl_sinf, sin);
    sweep(0.0f, 1608.0f, false, 2.6, pfl_cosf, cos);
    sweep(0.0f, 1608.0f, true, 2.6, pfl_cosf, cos);
}

void test_tangent_within_its_ulps(void)
{
    sweep(1.17549435e-38f, 1608.0f, false, 4.5, pfl_tanf, tan);
    sweep(1.17549435e-38f, 1608.0f, true, 4.5, pfl_tanf, tan);
}

/* "Up to 6.5e6 the absolute error stays under one ULP of x." */
void test_sine_and_cosine_of_large_arguments_within_an_ulp_of_the_argument(void)
{
    for (uint32_t bits = ut_bits(1608.0f); bits <= ut_bits(6.5e6f); bits += 97u) {
        const float x = ut_float(bits);
        const double ulp_of_x = (double)ut_float(bits + 1u) - (double)x;
        TEST_ASSERT_TRUE(fabs((double)pfl_sinf(x) - sin((double)x)) < ulp_of_x);
        TEST_ASSERT_TRUE(fabs((double)pfl_cosf(-x) - cos((double)x)) < ulp_of_x);
    }
}

void test_atan2_within_three_ulps(void)
{
    char text[96];
    uint64_t dice = 5u;
    for (uint32_t k = 0u; k < PAIRS; k++) {
        const float y = ut_float(ut_random(&dice));
        const uint32_t near = (ut_bits(y) & 0x7FFFFFFFu) + (ut_random(&dice) % 0x06000000u);
        const float x = ut_float(((k & 1u) != 0u) ? ut_random(&dice) : ((near % 0x7F800000u) | (k << 31)));
        if (ut_finite(x) && ut_finite(y)) {
            const double reference = atan2((double)y, (double)x);
            if (fabs(reference) >= 1.17549435e-38) {
                const double error = ut_ulp(pfl_atan2f(y, x), reference);
                (void)snprintf(text, sizeof text, "%.3f ULP at (%.9g, %.9g)", error, (double)y, (double)x);
                TEST_ASSERT_TRUE_MESSAGE(error <= 3.0, text);
            }
        }
    }
}

void test_atan2_stays_within_pi(void)
{
    uint64_t dice = 6u;
    for (uint32_t k = 0u; k < PAIRS / 3u; k++) {
        const float y = ut_float(ut_random(&dice));
        const float x = ut_float(ut_random(&dice));
        if (ut_finite(x) && ut_finite(y)) {
            const float a = pfl_atan2f(y, x);
            TEST_ASSERT_TRUE((a >= -PFL_PI) && (a <= PFL_PI));
        }
    }
}

void test_wrap_within_its_error(void)
{
    for (uint32_t bits = 0u; bits <= ut_bits(6400.0f); bits += STRIDE) {
        const float x = ut_float(bits);
        const double reference = remainder((double)x, 2.0 * 3.14159265358979323846);
        const float got = pfl_wrap_pi(x);
        const float mirrored = pfl_wrap_pi(-x);
        const double off = remainder((double)got - reference, 2.0 * 3.14159265358979323846);
        TEST_ASSERT_TRUE(fabs(off) <= 4.0e-7);
        TEST_ASSERT_TRUE(fabs((double)got) <= (3.14159265358979323846 + 4.0e-7));
        TEST_ASSERT_EQUAL_HEX32(ut_bits(got), ut_bits(-mirrored));
    }
}

/* ---- Square root ---------------------------------------------------------------------------------------------------------------- */

void test_sqrt_is_correctly_rounded(void)
{
    for (uint32_t bits = 0u; bits < 0x7F800000u; bits += STRIDE) {
        const float x = ut_float(bits);
        is_exactly((float)sqrt((double)x), pfl_sqrtf(x)); /* double rounding is harmless for a square root */
    }
}

void test_sqrt_in_integers_equals_the_other(void)
{
    for (uint32_t bits = 0u; bits < 0x7F800000u; bits += STRIDE) {
        const float x = ut_float(bits);
        TEST_ASSERT_EQUAL_HEX32(ut_bits((float)sqrt((double)x)), ut_bits(pfl_sqrt_in_integers(x)));
    }
    for (uint32_t bits = 0u; bits < PAIRS / 15u; bits++) { /* subnormals, one by one */
        const float x = ut_float(bits);
        TEST_ASSERT_EQUAL_HEX32(ut_bits((float)sqrt((double)x)), ut_bits(pfl_sqrt_in_integers(x)));
    }
}

void test_sqrt_in_integers_ends(void)
{
    is_exactly(0.0f, pfl_sqrt_in_integers(0.0f));
    is_exactly(-0.0f, pfl_sqrt_in_integers(-0.0f));
    is_exactly(ut_infinity(), pfl_sqrt_in_integers(ut_infinity()));
    is_nan(pfl_sqrt_in_integers(-ut_infinity()));
    is_nan(pfl_sqrt_in_integers(-1.0f));
    is_nan(pfl_sqrt_in_integers(ut_float(0x80000001u)));
    is_nan(pfl_sqrt_in_integers(ut_nan(false)));
    is_nan(pfl_sqrt_in_integers(ut_nan(true)));
}

/* ---- Batches ---------------------------------------------------------------------------------------------------------------------- */

enum { BATCH = 67 };
static float in[BATCH];
static float in2[BATCH];
static float out[BATCH + 1];
static float out2[BATCH + 1];

static void same_as_scalar(const float *got, float (*scalar)(float), size_t n)
{
    for (size_t i = 0u; i < n; i++) {
        is_exactly(scalar(in[i]), got[i]);
    }
    TEST_ASSERT_EQUAL_HEX32(0x12345678u, ut_bits(got[n])); /* nothing beyond n */
}

static float scalar_atan2_in2(float y)
{
    for (size_t i = 0u; i < BATCH; i++) {
        if (ut_bits(in[i]) == ut_bits(y)) {
            return pfl_atan2f(y, in2[i]);
        }
    }
    return 77.0f;
}

void test_batches_equal_scalars_to_the_bit(void)
{
    for (size_t n = 0u; n <= BATCH; n++) {
        uint64_t dice = 100u + n;
        for (size_t i = 0u; i < BATCH; i++) {
            in[i] = (float)(ut_gaussian(&dice) * 40.0);
            in2[i] = (float)(ut_gaussian(&dice) * 40.0);
        }
        out[n] = ut_float(0x12345678u);
        out2[n] = ut_float(0x12345678u);
        pfl_expf_n(in, out, n);
        same_as_scalar(out, pfl_expf, n);
        pfl_sincosf_n(in, out, out2, n);
        same_as_scalar(out, pfl_sinf, n);
        same_as_scalar(out2, pfl_cosf, n);
        pfl_atan2f_n(in, in2, out, n);
        same_as_scalar(out, scalar_atan2_in2, n);
        for (size_t i = 0u; i < BATCH; i++) {
            in[i] = fabsf(in[i]);
        }
        pfl_logf_n(in, out, n);
        same_as_scalar(out, pfl_logf, n);
    }
}

void test_batches_may_work_in_place(void)
{
    float copy[BATCH];
    uint64_t dice = 9u;
    for (size_t i = 0u; i < BATCH; i++) {
        in[i] = (float)(ut_uniform(&dice) * 20.0) + 0.1f;
    }
    memcpy(copy, in, sizeof in);
    pfl_expf_n(copy, copy, BATCH);
    pfl_expf_n(in, out, BATCH);
    TEST_ASSERT_EQUAL_MEMORY(out, copy, sizeof copy);
    memcpy(copy, in, sizeof in);
    pfl_logf_n(copy, copy, BATCH);
    pfl_logf_n(in, out, BATCH);
    TEST_ASSERT_EQUAL_MEMORY(out, copy, sizeof copy);
    memcpy(copy, in, sizeof in);
    pfl_atan2f_n(copy, in, copy, BATCH);
    pfl_atan2f_n(in, in, out, BATCH);
    TEST_ASSERT_EQUAL_MEMORY(out, copy, sizeof copy);
}

void test_one_function_gives_sine_and_cosine_of_the_two(void)
{
    for (float x = -1608.0f; x < 1608.0f; x += 0.37f) {
        float s;
        float c;
        pfl_sincosf(x, &s, &c);
        is_exactly(pfl_sinf(x), s);
        is_exactly(pfl_cosf(x), c);
        is_exactly(s / c, pfl_tanf(x));
    }
}

/* The models' way: right to 8e-7 of its length, at a heading within one ULP (1.2e-7) of the given one. */
void test_way_kernel(void)
{
    uint64_t dice = 11u;
    for (uint32_t k = 0u; k < 300000u; k++) {
        float x;
        float y;
        const float u = (float)(int32_t)ut_random(&dice) * 4.65661287e-10f;
        const float span = (k % 3u == 0u) ? 3.2f : ((k % 3u == 1u) ? 100.0f : 1.0e6f);
        const float heading = span * u;
        const float length = 40.0f * (float)(int32_t)ut_random(&dice) * 4.65661287e-10f;
        pfl_way_kernel(length, heading, &x, &y);
        const double allowed = fabs((double)length) * (8.0e-7 + (1.2e-7 * fabs((double)heading)));
        TEST_ASSERT_DOUBLE_WITHIN(allowed, (double)length * cos((double)heading), (double)x);
        TEST_ASSERT_DOUBLE_WITHIN(allowed, (double)length * sin((double)heading), (double)y);
    }
}

void test_way_kernel_keeps_a_nan(void)
{
    float x;
    float y;
    pfl_way_kernel(1.0f, ut_nan(false), &x, &y);
    is_nan(x);
    is_nan(y);
    pfl_way_kernel(ut_nan(false), 1.0f, &x, &y);
    is_nan(x);
    is_nan(y);
}
