/* Antithetic noise: which normals go where, the signs, and that a filter with it has the right posterior. */
#include "support.h"

#include "pflight/antithetic.h"

#include "unity.h"

#include <math.h>

#define NOISES 3u

static float x[NOISES * PFL_BATCH];
static float columns[2u * PFL_BATCH];

void setUp(void)
{
    for (uint32_t k = 0u; k < 2u * PFL_BATCH; k++) {
        columns[k] = 1.0f + (float)k;
    }
}

void tearDown(void)
{
    ut_arenas_end();
}

/* Each state takes the noise of its column. */
static void take(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    (void)dt_s;
    TEST_ASSERT_EQUAL_PTR(&x, user);
    TEST_ASSERT_EQUAL_PTR(&columns, u);
    for (uint32_t q = 0u; q < NOISES; q++) {
        for (uint32_t i = 0u; i < p->n; i++) {
            PFL_STATE(p, q)[i] = PFL_NOISE(p, q)[i];
        }
    }
}

static void move(uint32_t n)
{
    pfl_antithetic_t m = {take, &x, NOISES};
    const pfl_batch_t batch = {x, PFL_BATCH, columns, 0u, n};
    for (uint32_t k = 0u; k < NOISES * PFL_BATCH; k++) {
        x[k] = 0.0f;
    }
    pfl_antithetic_predict(&m, &columns, 0.1f, &batch);
}

void test_pairs_have_opposite_noise_and_no_two_pairs_the_same(void)
{
    static const uint32_t lengths[] = {2u, 16u, 40u, 64u};
    TEST_ASSERT_EQUAL_UINT32(2u, PFL_ANTITHETIC_NOISES(NOISES));
    for (uint32_t k = 0u; k < 4u; k++) {
        const uint32_t n = lengths[k];
        bool used[2u * PFL_BATCH + 1u] = {false};
        move(n);
        for (uint32_t i = 0u; i < NOISES * PFL_BATCH; i++) {
            const uint32_t place = i % PFL_BATCH;
            if (place >= n) {
                TEST_ASSERT_EQUAL_FLOAT(0.0f, x[i]);
            } else if ((place & 1u) == 0u) {
                const uint32_t value = (uint32_t)x[i];
                TEST_ASSERT_EQUAL_FLOAT(-x[i], x[i + 1u]);
                TEST_ASSERT_TRUE(((value - 1u) % PFL_BATCH) < n); /* of what the library made */
                TEST_ASSERT_FALSE(used[value]);
                used[value] = true;
            }
        }
    }
}

void test_an_odd_batch_reads_no_further_than_its_length(void)
{
    move(7u);
    for (uint32_t q = 0u; q < NOISES; q++) {
        for (uint32_t i = 0u; i < 7u; i++) {
            TEST_ASSERT_TRUE(((uint32_t)(fabsf(x[(q * PFL_BATCH) + i]) - 1.0f) % PFL_BATCH) < 7u);
        }
    }
}

static uint32_t moves;

static void count_moves(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    (void)user;
    (void)u;
    (void)dt_s;
    TEST_ASSERT_EQUAL_FLOAT(-PFL_NOISE(p, PFL_ANTITHETIC_MAX - 1u)[0], PFL_NOISE(p, PFL_ANTITHETIC_MAX - 1u)[1]);
    moves++;
}

/* A sanitizer sees a column beyond the last that there is room for. */
void test_more_noises_than_there_is_room_for_are_cut_off(void)
{
    pfl_antithetic_t m = {count_moves, NULL, 50u};
    const pfl_batch_t batch = {x, PFL_BATCH, columns, 0u, PFL_BATCH};
    moves = 0u;
    pfl_antithetic_predict(&m, NULL, 0.1f, &batch);
    TEST_ASSERT_EQUAL_UINT32(1u, moves);
}

/* ---- A filter ---------------------------------------------------------------------------------------------------- */

/* Mean square distance of the position from the Kalman filter's, in its variances, over seeds and steps. */
static double distance_to_kalman(bool antithetic)
{
    pfl_antithetic_t m = {ut_linear_predict, NULL, 2u};
    double squares = 0.0;
    for (uint64_t seed = 1u; seed <= 40u; seed++) {
        pfl_config_t config = ut_linear_config(256u);
        uint64_t dice = 77u * seed;
        double pos = 0.0, vel = 0.0, a = 1.0, b = 0.0, c = 1.0; /* mean, covariance [a b; b c] */
        config.seed = seed;
        if (antithetic) {
            config.noises = PFL_ANTITHETIC_NOISES(2u);
            config.predict = pfl_antithetic_predict;
            config.user = &m;
        }
        pfl_t *f = ut_filter(&config);
        for (uint32_t k = 1u; k <= 50u; k++) {
            const float z = (float)ut_gaussian(&dice);
            float mean[2];
            pos += 0.1 * vel;
            a += 0.2 * b + 0.01 * c + 0.01;
            b += 0.1 * c;
            c += 0.0025;
            const double gain_p = a / (a + 1.0), gain_v = b / (a + 1.0), e = (double)z - pos;
            pos += gain_p * e;
            vel += gain_v * e;
            c -= gain_v * b;
            b -= gain_p * b;
            a -= gain_p * a;
            TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(f, k * 100000ull, NULL));
            TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(f, 0u, k * 100000ull, &z));
            TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(f, mean, NULL));
            squares += ((double)mean[0] - pos) * ((double)mean[0] - pos) / a;
        }
        ut_arenas_end();
    }
    return squares / (40.0 * 50.0);
}

void test_the_posterior_is_the_kalman_filters(void)
{
    const double plain = distance_to_kalman(false);
    const double mirrored = distance_to_kalman(true);
    TEST_ASSERT_TRUE(plain < 10.0 / 256.0); /* what 256 particles can do at all */
    TEST_ASSERT_TRUE(mirrored < 1.2 * plain);
    TEST_ASSERT_TRUE(mirrored > 0.1 / 256.0);
}
