/* Are the bits of pfl_rng_u32 balanced and independent, of each other, of their neighbours and of the seed? Fixed seeds;
 * each assertion fails a perfect generator with odds of at most 1e-6 (five standard errors: 5.7e-7). */
#include "pflight/rng.h"
#include "unity.h"

#include <math.h>
#include <string.h>

#define COUNT 10000000u
#define SIGMAS 5.0

static pfl_rng_t rng;

void setUp(void)
{
    pfl_rng_seed(&rng, 20260302u);
}

void tearDown(void)
{
}

void test_every_bit_is_balanced(void)
{
    uint32_t ones[32] = {0u};
    for (uint32_t i = 0u; i < COUNT; i++) {
        const uint32_t u = pfl_rng_u32(&rng);
        for (uint32_t bit = 0u; bit < 32u; bit++) {
            ones[bit] += (u >> bit) & 1u;
        }
    }
    for (uint32_t bit = 0u; bit < 32u; bit++) {
        TEST_ASSERT_DOUBLE_WITHIN(SIGMAS * 0.5 * sqrt((double)COUNT), 0.5 * COUNT, (double)ones[bit]);
    }
}

/* Each bit agrees with itself `lag` draws earlier half of the time. */
void test_every_bit_is_serially_independent(void)
{
    for (uint32_t lag = 1u; lag <= 4u; lag++) {
        uint32_t agree[32] = {0u};
        uint32_t past[8] = {0u};
        for (uint32_t i = 0u; i < (COUNT + lag); i++) {
            const uint32_t u = pfl_rng_u32(&rng);
            const uint32_t same = ~(u ^ past[(i - lag) & 7u]);
            past[i & 7u] = u;
            for (uint32_t bit = 0u; (i >= lag) && (bit < 32u); bit++) {
                agree[bit] += (same >> bit) & 1u;
            }
        }
        for (uint32_t bit = 0u; bit < 32u; bit++) {
            TEST_ASSERT_DOUBLE_WITHIN(SIGMAS * 0.5 * sqrt((double)COUNT), 0.5 * COUNT, (double)agree[bit]);
        }
    }
}

/* Serial correlation of the numbers themselves, scaled to variance 1. */
void test_numbers_are_serially_uncorrelated(void)
{
    double sum[9] = {0.0};
    double past[16] = {0.0};
    for (uint32_t i = 0u; i < COUNT; i++) {
        const double x = (((double)pfl_rng_u32(&rng) + 0.5) / 4294967296.0 - 0.5) * sqrt(12.0);
        for (uint32_t lag = 1u; lag <= 8u; lag++) {
            sum[lag] += x * past[(i - lag) & 15u]; /* the first few meet zeros */
        }
        past[i & 15u] = x;
    }
    for (uint32_t lag = 1u; lag <= 8u; lag++) {
        TEST_ASSERT_DOUBLE_WITHIN(SIGMAS / sqrt((double)COUNT), 0.0, sum[lag] / COUNT);
    }
}

/* Chi-square of pairs of bytes: 65535 degrees of freedom, five standard deviations. */
static void assert_pairs_are_even(uint32_t shift)
{
    static uint32_t cells[65536];
    const double expected = (double)COUNT / 65536.0;
    double sum = 0.0;
    memset(cells, 0, sizeof cells);
    uint32_t before = pfl_rng_u32(&rng) >> shift;
    for (uint32_t i = 0u; i < COUNT; i++) {
        const uint32_t now = pfl_rng_u32(&rng) >> shift;
        cells[((before & 0xFFu) << 8) | (now & 0xFFu)]++;
        before = now;
    }
    for (uint32_t k = 0u; k < 65536u; k++) {
        sum += (((double)cells[k] - expected) * ((double)cells[k] - expected)) / expected;
    }
    TEST_ASSERT_DOUBLE_WITHIN(SIGMAS * sqrt(2.0 * 65535.0), 65535.0, sum);
}

void test_pairs_of_bytes_fill_the_square(void)
{
    assert_pairs_are_even(0u);
    assert_pairs_are_even(24u);
}

static uint32_t ones_of(uint32_t u)
{
    uint32_t n = 0u;
    for (; u != 0u; u &= u - 1u) {
        n++;
    }
    return n;
}

/* Seeds that differ by one, or in one bit, give streams whose bits agree half of the time. */
void test_neighbouring_seeds_are_independent(void)
{
    const uint32_t draws = 100u;
    pfl_rng_t other;
    double differ = 0.0;
    double bits = 0.0;
    for (uint64_t seed = 0u; seed < 200u; seed++) {
        pfl_rng_seed(&rng, seed);
        pfl_rng_seed(&other, (seed < 64u) ? (((uint64_t)1u << seed) ^ seed) : (seed + 1u));
        for (uint32_t k = 0u; k < draws; k++) {
            differ += (double)ones_of(pfl_rng_u32(&rng) ^ pfl_rng_u32(&other));
            bits += 32.0;
        }
    }
    TEST_ASSERT_DOUBLE_WITHIN(SIGMAS * 0.5 * sqrt(bits), 0.5 * bits, differ);
}

/* The nine streams and those after a long jump begin in states of their own. */
void test_streams_differ_and_jump(void)
{
    uint32_t first[18];
    for (uint32_t jump = 0u; jump < 2u; jump++) {
        for (uint32_t lane = 0u; lane < PFL_RNG_LANES; lane++) {
            first[(jump * 9u) + lane] = rng.s[0][lane];
        }
        first[(jump * 9u) + 8u] = rng.one[0];
        pfl_rng_long_jump(&rng);
    }
    for (uint32_t a = 0u; a < 18u; a++) { /* equal by chance: 3.6e-8 */
        for (uint32_t b = a + 1u; b < 18u; b++) {
            TEST_ASSERT_NOT_EQUAL_UINT32(first[a], first[b]);
        }
    }
}
