/* The sums over particles (lib/src/lanes.h): the same bits in every form, in the lanes that the file promises, and weights
 * as accurate as they are said to be. */
#include "lanes_forms.h"
#include "support.h"

#include "unity.h"

#include <math.h>
#include <string.h>

#define LANES 8u
#define N_MAX 264u
#define CUT 0x422E47AEu /* bits of 43.57: from there on a particle weighs nothing */

static const lanes_form_t *const forms[] = {&lanes_scalar, &lanes_four, &lanes_eight};
#define FORMS (sizeof forms / sizeof forms[0])

static float w[N_MAX];
static float s[N_MAX];
static float x[4u * N_MAX];
static uint64_t dice;

void setUp(void)
{
    dice = 2026u;
    for (uint32_t i = 0u; i < N_MAX; i++) {
        s[i] = (ut_uniform(&dice) < 0.1) ? -ut_infinity() : (float)(-3.0 - (60.0 * pow(ut_uniform(&dice), 3.0)));
        w[i] = (float)ut_uniform(&dice);
    }
    for (uint32_t i = 0u; i < (4u * N_MAX); i++) {
        x[i] = (float)(1000.0 + ut_gaussian(&dice));
    }
}

void tearDown(void)
{
}

static void begin(float *rows, uint32_t n)
{
    for (uint32_t i = 0u; i < n; i++) {
        rows[i] = 0.125f * (float)i;
    }
}

/* The rounding of y = e log2(e) costs e 2^-24 of a weight and that of the constant e 1.4e-8; the polynomial 7.5e-8, and
 * its evaluation in floats twice that. */
void test_weights_are_accurate_and_end_at_two_to_the_minus_63(void)
{
    for (uint32_t bits = 0x30000000u; bits < CUT; bits += 61u) {
        const float e = ut_float(bits);
        const double exact = exp(-(double)e);
        const double error = fabs((double)lanes_scalar.weight_of(e) - exact) / exact;
        const double slack = 2.6e-7 + (7.5e-8 * (double)e);
        if (error > slack) {
            TEST_FAIL_MESSAGE("a weight is off");
        }
    }
    for (size_t k = 0u; k < FORMS; k++) {
        TEST_ASSERT_TRUE(forms[k]->weight_of(ut_float(CUT - 1u)) >= 1.0842021724855e-19f); /* 2^-63 */
        for (uint32_t bits = CUT; bits <= 0x7F800000u; bits += 4099u) {
            TEST_ASSERT_EQUAL_HEX32(0u, ut_bits(forms[k]->weight_of(ut_float(bits))));
        }
        TEST_ASSERT_EQUAL_HEX32(0u, ut_bits(forms[k]->weight_of(ut_infinity())));
        TEST_ASSERT_FLOAT_WITHIN(1.2e-7f, 1.0f, forms[k]->weight_of(0.0f));
    }
}

void test_every_form_gives_the_same_weights(void)
{
    for (uint32_t bits = 0u; bits < (CUT + 100000u); bits += 1021u) {
        const uint32_t one = ut_bits(lanes_scalar.weight_of(ut_float(bits)));
        if ((one != ut_bits(lanes_four.weight_of(ut_float(bits)))) ||
            (one != ut_bits(lanes_eight.weight_of(ut_float(bits))))) {
            TEST_FAIL_MESSAGE("two forms differ");
        }
    }
}

/* Sums as the file defines them, one particle at a time. */
static void plain_products(float *row, const float *weight, const float *value, float centre, uint32_t n)
{
    for (uint32_t i = 0u; i < n; i++) {
        const float product = weight[i] * (value[i] - centre);
        row[i % LANES] = row[i % LANES] + product;
    }
}

void test_weights_and_their_sums_in_every_form(void)
{
    for (uint32_t n = LANES; n <= N_MAX; n += LANES) {
        float expected[2u * LANES];
        begin(expected, 2u * LANES);
        for (uint32_t i = 0u; i < n; i++) {
            const float weight = lanes_scalar.weight_of(-2.5f - s[i]);
            const float square = weight * weight;
            expected[i % LANES] = expected[i % LANES] + weight;
            expected[LANES + (i % LANES)] = expected[LANES + (i % LANES)] + square;
        }
        for (size_t k = 0u; k < FORMS; k++) {
            float rows[2u * LANES];
            float weights[N_MAX];
            begin(rows, 2u * LANES);
            memset(weights, 0xFF, sizeof weights);
            forms[k]->weigh(rows, weights, s, -2.5f, n);
            TEST_ASSERT_EQUAL_MEMORY(expected, rows, sizeof rows);
            for (uint32_t i = 0u; i < n; i++) {
                TEST_ASSERT_EQUAL_HEX32(ut_bits(lanes_scalar.weight_of(-2.5f - s[i])), ut_bits(weights[i]));
            }
            for (uint32_t i = n; i < N_MAX; i++) {
                TEST_ASSERT_EQUAL_HEX32(UINT32_MAX, ut_bits(weights[i]));
            }
        }
    }
}

void test_products_in_every_form(void)
{
    static const float centres[2] = {999.5f, 1000.25f};
    for (uint32_t n = LANES; n <= N_MAX; n += LANES) {
        float expected[2u * LANES];
        begin(expected, 2u * LANES);
        plain_products(expected, w, x, centres[0], n);
        plain_products(&expected[LANES], w, &x[N_MAX], centres[1], n);
        for (size_t k = 0u; k < FORMS; k++) {
            float rows[2u * LANES];
            begin(rows, 2u * LANES);
            forms[k]->products(rows, w, x, N_MAX, centres, n);
            TEST_ASSERT_EQUAL_MEMORY(expected, rows, sizeof rows);
            begin(rows, 2u * LANES);
            forms[k]->product(rows, w, x, centres, n);
            TEST_ASSERT_EQUAL_MEMORY(expected, rows, sizeof(float) * LANES);
        }
    }
}

/* Wherever it stands, in however many columns, a NaN or an infinity stays in the sum. */
void test_the_sum_shows_any_value_that_is_not_finite(void)
{
    enum { COLUMNS = 4, LONG = 32 };
    const float bad[] = {ut_nan(false), ut_nan(true), ut_infinity(), -ut_infinity()};
    for (size_t k = 0u; k < FORMS; k++) {
        for (uint32_t columns = 1u; columns <= COLUMNS * (N_MAX / LONG); columns++) {
            TEST_ASSERT_TRUE(ut_finite(forms[k]->sum(x, LONG, columns, LONG)));
            for (uint32_t at = 0u; at < (columns * LONG); at++) {
                const float kept = x[at];
                x[at] = bad[at % 4u];
                TEST_ASSERT_FALSE(ut_finite(forms[k]->sum(x, LONG, columns, LONG)));
                x[at] = kept;
            }
        }
    }
}
