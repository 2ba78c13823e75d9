/* Random numbers: xoshiro128++ from its publication written anew, and lanes whose distance is proved by matrix powers
 * over GF(2) that know nothing of jump polynomials. */
#include "support.h"

#include "pflight/rng.h"

#include "unity.h"

#include <math.h>
#include <string.h>

void setUp(void)
{
}

void tearDown(void)
{
}

/* ---- Reference -------------------------------------------------------------------------------------------------------------- */

static uint32_t rotated(uint32_t x, unsigned k)
{
    return (x << k) | (x >> (32u - k));
}

/* xoshiro128++ 1.0, as Blackman and Vigna print it. */
static uint32_t reference_next(uint32_t s[4])
{
    const uint32_t result = rotated(s[0] + s[3], 7u) + s[0];
    const uint32_t t = s[1] << 9;
    s[2] ^= s[0];
    s[3] ^= s[1];
    s[1] ^= s[2];
    s[0] ^= s[3];
    s[2] ^= t;
    s[3] = rotated(s[3], 11u);
    return result;
}

/* The same with the sum alone for output: xoshiro128+ 1.0. */
static uint32_t reference_next_plus(uint32_t s[4])
{
    const uint32_t result = s[0] + s[3];
    (void)reference_next(s);
    return result;
}

/* A 128 x 128 matrix over GF(2): column j is the image of bit j. */
typedef struct {
    uint32_t column[128][4];
} matrix_t;

static void apply(const matrix_t *m, const uint32_t in[4], uint32_t out[4])
{
    uint32_t sum[4] = {0u, 0u, 0u, 0u};
    for (uint32_t j = 0u; j < 128u; j++) {
        const uint32_t mask = 0u - ((in[j / 32u] >> (j % 32u)) & 1u);
        for (uint32_t k = 0u; k < 4u; k++) {
            sum[k] ^= m->column[j][k] & mask;
        }
    }
    memcpy(out, sum, sizeof sum);
}

/* The matrix of 2^power steps. */
static void matrix_of_power(uint32_t power, matrix_t *m)
{
    static matrix_t squared;
    for (uint32_t j = 0u; j < 128u; j++) {
        uint32_t s[4] = {0u, 0u, 0u, 0u};
        s[j / 32u] = (uint32_t)1u << (j % 32u);
        (void)reference_next(s);
        memcpy(m->column[j], s, sizeof s);
    }
    for (uint32_t k = 0u; k < power; k++) {
        for (uint32_t j = 0u; j < 128u; j++) {
            apply(m, m->column[j], squared.column[j]);
        }
        memcpy(m, &squared, sizeof squared);
    }
}

static void lane_of(const pfl_rng_t *rng, uint32_t lane, uint32_t s[4])
{
    for (uint32_t k = 0u; k < 4u; k++) {
        s[k] = (lane < PFL_RNG_LANES) ? rng->s[k][lane] : rng->one[k];
    }
}

/* ---- Streams ------------------------------------------------------------------------------------------------------------------ */

/* First outputs of xoshiro128++ from the state 1, 2, 3, 4; worked out by hand for the first: rotl(5, 7) + 1. */
void test_single_draws_are_xoshiro(void)
{
    static const uint32_t known[] = {641u, 1573767u, 3222811527u, 3517856514u, 836907274u, 4247214768u};
    pfl_rng_t rng;
    uint32_t s[4] = {1u, 2u, 3u, 4u};
    memset(&rng, 0, sizeof rng);
    memcpy(rng.one, s, sizeof s);
    for (size_t k = 0u; k < (sizeof known / sizeof known[0]); k++) {
        TEST_ASSERT_EQUAL_UINT32(known[k], reference_next(s));
        TEST_ASSERT_EQUAL_UINT32(known[k], pfl_rng_u32(&rng));
    }
    for (uint32_t k = 0u; k < 100000u; k++) {
        TEST_ASSERT_EQUAL_HEX32(reference_next(s), pfl_rng_u32(&rng));
    }
}

void test_seed_is_spread_by_splitmix(void)
{
    /* SplitMix64 from 1234567: the published first two outputs */
    pfl_rng_t rng;
    uint32_t s[4];
    pfl_rng_seed(&rng, 1234567u);
    lane_of(&rng, 0u, s);
    TEST_ASSERT_TRUE(((uint64_t)s[0] | ((uint64_t)s[1] << 32)) == 6457827717110365317u);
    TEST_ASSERT_TRUE(((uint64_t)s[2] | ((uint64_t)s[3] << 32)) == 3203168211198807973u);
}

void test_seed_and_jump_write_nothing_behind(void)
{
    struct {
        pfl_rng_t rng;
        uint32_t behind[2u * PFL_RNG_LANES];
    } room;
    memset(&room, 0x5A, sizeof room);
    pfl_rng_seed(&room.rng, 3u);
    pfl_rng_long_jump(&room.rng);
    TEST_ASSERT_EACH_EQUAL_HEX8(0x5A, room.behind, sizeof room.behind);
}

void test_streams_are_two_to_the_64_steps_apart(void)
{
    static matrix_t m;
    matrix_of_power(64u, &m);
    for (uint64_t seed = 0u; seed < 20u; seed++) {
        pfl_rng_t rng;
        pfl_rng_seed(&rng, seed * 0x123456789ABCDEFu);
        for (uint32_t lane = 0u; lane < PFL_RNG_LANES; lane++) {
            uint32_t here[4];
            uint32_t there[4];
            lane_of(&rng, lane, here);
            lane_of(&rng, lane + 1u, there);
            apply(&m, here, here);
            TEST_ASSERT_EQUAL_HEX32_ARRAY(here, there, 4);
        }
    }
}

void test_long_jump_moves_every_stream_two_to_the_96_steps(void)
{
    static matrix_t m;
    pfl_rng_t rng;
    matrix_of_power(96u, &m);
    pfl_rng_seed(&rng, 3u);
    for (uint32_t round = 0u; round < 3u; round++) {
        pfl_rng_t jumped = rng;
        pfl_rng_long_jump(&jumped);
        for (uint32_t lane = 0u; lane <= PFL_RNG_LANES; lane++) {
            uint32_t before[4];
            uint32_t after[4];
            lane_of(&rng, lane, before);
            lane_of(&jumped, lane, after);
            apply(&m, before, before);
            TEST_ASSERT_EQUAL_HEX32_ARRAY(before, after, 4);
        }
        rng = jumped;
    }
}

/* The matrices themselves: 2^10 steps by matrix are 1024 steps. */
void test_matrix_power_agrees_with_single_steps(void)
{
    static matrix_t m;
    uint32_t s[4] = {1u, 2u, 3u, 4u};
    uint32_t jumped[4];
    matrix_of_power(10u, &m);
    apply(&m, s, jumped);
    for (uint32_t k = 0u; k < 1024u; k++) {
        (void)reference_next(s);
    }
    TEST_ASSERT_EQUAL_HEX32_ARRAY(s, jumped, 4);
}

void test_no_seed_gives_a_dead_stream_and_seeds_differ(void)
{
    uint32_t last = 0u;
    for (uint64_t k = 0u; k < 4000u; k++) {
        pfl_rng_t rng;
        pfl_rng_seed(&rng, (k < 2000u) ? k : (UINT64_MAX - k));
        for (uint32_t lane = 0u; lane <= PFL_RNG_LANES; lane++) {
            uint32_t s[4];
            lane_of(&rng, lane, s);
            TEST_ASSERT_TRUE((s[0] | s[1] | s[2] | s[3]) != 0u);
        }
        TEST_ASSERT_TRUE(rng.s[0][0] != last);
        last = rng.s[0][0];
    }
}

void test_the_same_seed_gives_the_same_numbers(void)
{
    pfl_rng_t a;
    pfl_rng_t b;
    memset(&b, 0x55, sizeof b);
    pfl_rng_seed(&a, 42u);
    pfl_rng_seed(&b, 42u);
    TEST_ASSERT_EQUAL_MEMORY(&a, &b, sizeof a);
}

/* ---- Normals -------------------------------------------------------------------------------------------------------------------- */

enum { GROUPS = 4000 };
static float z[GROUPS * 16];
static float parts[GROUPS * 16];

void test_normals_do_not_depend_on_how_calls_are_split(void)
{
    pfl_rng_t a;
    pfl_rng_t b;
    size_t done = 0u;
    pfl_rng_seed(&a, 5u);
    pfl_rng_seed(&b, 5u);
    pfl_rng_normals(&a, z, GROUPS);
    for (size_t n = 0u; done < GROUPS; n = (n * 2u) + 1u) {
        const size_t groups = ((GROUPS - done) < n) ? (GROUPS - done) : n;
        pfl_rng_normals(&b, &parts[done * 16u], groups);
        done += groups;
    }
    TEST_ASSERT_EQUAL_MEMORY(z, parts, sizeof z);
    TEST_ASSERT_EQUAL_MEMORY(&a, &b, sizeof a);
}

void test_no_groups_is_nothing(void)
{
    pfl_rng_t a;
    pfl_rng_t b;
    float untouched = 7.0f;
    pfl_rng_seed(&a, 5u);
    b = a;
    pfl_rng_normals(&a, &untouched, 0u);
    TEST_ASSERT_EQUAL_MEMORY(&a, &b, sizeof a);
    TEST_ASSERT_FLOAT_WITHIN(0.0f, 7.0f, untouched);
}

/* Lane l makes elements l and l + 8 from its next two numbers, and the ninth stream none. Along the true direction the
 * radius is right to 2.3e-6 and 2.2e-6 of itself, the smallest to what 24 bits of u leave; across it, the angle to 4e-6. */
void test_each_lane_makes_its_two_normals(void)
{
    pfl_rng_t rng;
    pfl_rng_t start;
    pfl_rng_seed(&rng, 8u);
    start = rng;
    pfl_rng_normals(&rng, z, GROUPS);
    for (uint32_t lane = 0u; lane < PFL_RNG_LANES; lane++) {
        uint32_t s[4];
        lane_of(&start, lane, s);
        for (uint32_t g = 0u; g < GROUPS; g++) {
            const uint32_t a = reference_next(s);
            const double v = (double)(int32_t)reference_next_plus(s) * 3.14159265358979324 / 2147483648.0;
            const double r = sqrt(-2.0 * log((2147483648.0 - (double)(a & 0x7FFFFFFFu)) / 2147483648.0));
            const double x = (double)z[(16u * g) + lane];
            const double y = (double)z[(16u * g) + lane + 8u];
            TEST_ASSERT_DOUBLE_WITHIN(2.3e-6 + (2.2e-6 * r) + (1.2e-7 / (r + 1.0e-3)), r, (x * cos(v)) + (y * sin(v)));
            TEST_ASSERT_DOUBLE_WITHIN(4.0e-6 * (r + 1.0e-3), 0.0, (y * cos(v)) - (x * sin(v)));
        }
        uint32_t end[4];
        lane_of(&rng, lane, end);
        TEST_ASSERT_EQUAL_HEX32_ARRAY(s, end, 4);
    }
    TEST_ASSERT_EQUAL_HEX32_ARRAY(start.one, rng.one, 4);
}

void test_normals_are_finite_and_bounded_with_mean_zero_and_variance_one(void)
{
    double sum = 0.0;
    double squares = 0.0;
    const double n = 20.0 * (double)GROUPS * 16.0;
    pfl_rng_t rng;
    pfl_rng_seed(&rng, 77u);
    for (uint32_t round = 0u; round < 20u; round++) {
        pfl_rng_normals(&rng, z, GROUPS);
        for (uint32_t i = 0u; i < (GROUPS * 16u); i++) {
            TEST_ASSERT_TRUE(ut_finite(z[i]) && (fabsf(z[i]) < 6.56f));
            sum += (double)z[i];
            squares += (double)z[i] * (double)z[i];
        }
    }
    TEST_ASSERT_DOUBLE_WITHIN(5.0 / sqrt(n), 0.0, sum / n);
    TEST_ASSERT_DOUBLE_WITHIN(5.0 * sqrt(2.0 / n), 1.0, squares / n);
}

/* Extreme draws, by states made for them: s0 = 0 and s3 all ones make the radius' number all ones (the largest), s1 the
 * angle's. */
void test_extreme_draws_are_finite_and_within_their_bound(void)
{
    uint64_t dice = 3u;
    float largest = 0.0f;
    pfl_rng_t rng;
    memset(&rng, 0, sizeof rng);
    for (uint32_t k = 0u; k < 100000u; k++) {
        for (uint32_t lane = 0u; lane < PFL_RNG_LANES; lane++) {
            rng.s[0][lane] = 0u;
            rng.s[1][lane] = (lane == 0u) ? 0u : (ut_random(&dice) >> (k % 32u));
            rng.s[2][lane] = 1u + (ut_random(&dice) >> 1);
            rng.s[3][lane] = 0xFFFFFFFFu;
        }
        pfl_rng_normals(&rng, z, 1u);
        for (uint32_t i = 0u; i < 16u; i++) {
            TEST_ASSERT_TRUE(ut_finite(z[i]));
            largest = (fabsf(z[i]) > largest) ? fabsf(z[i]) : largest;
        }
    }
    TEST_ASSERT_TRUE(largest > 6.55f); /* sqrt(62 log 2) = 6.5556 */
    TEST_ASSERT_TRUE(largest < 6.56f);
}

/* The other end: u = 1 gives a very small radius, never the root of a negative number. */
void test_the_smallest_radius_is_above_zero(void)
{
    pfl_rng_t rng;
    memset(&rng, 0, sizeof rng);
    for (uint32_t lane = 0u; lane < PFL_RNG_LANES; lane++) {
        rng.s[1][lane] = lane; /* s0 = s3 = 0: the output is 0 */
        rng.s[2][lane] = 1u;
    }
    pfl_rng_normals(&rng, z, 1u);
    for (uint32_t i = 0u; i < 8u; i++) {
        const double r = sqrt(((double)z[i] * (double)z[i]) + ((double)z[i + 8u] * (double)z[i + 8u]));
        TEST_ASSERT_TRUE((r > 3.4e-4) && (r < 3.5e-4));
    }
}
