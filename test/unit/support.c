/* Implementation of support.h: host code, which may use the heap and libm. */
#include "support.h"

#include "unity.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define RED_ZONE 256u
#define RED_BYTE 0x5Au
#define FILL_BYTE 0xA5u
#define MAX_BLOCKS 1024u

typedef struct {
    unsigned char *raw;
    size_t bytes;
} block_t;

static block_t blocks[MAX_BLOCKS];
static size_t block_count;

/* ---- Arenas ----------------------------------------------------------------------------------------------------- */

void *ut_arena(size_t bytes)
{
    TEST_ASSERT_TRUE_MESSAGE(block_count < MAX_BLOCKS, "support: too many arenas in one test");
    unsigned char *raw = (unsigned char *)malloc(bytes + (2u * RED_ZONE));
    TEST_ASSERT_NOT_NULL(raw);
    memset(raw, (int)RED_BYTE, bytes + (2u * RED_ZONE));
    memset(raw + RED_ZONE, (int)FILL_BYTE, bytes);
    blocks[block_count].raw = raw;
    blocks[block_count].bytes = bytes;
    block_count++;
    return raw + RED_ZONE;
}

void *ut_arena_for(const pfl_config_t *config, size_t *bytes)
{
    const size_t watch = (config->watch != NULL) ? PFL_WATCH_BYTES(config->sensor_count) : 0u;
#if defined(PFL_GUARD_CONFIG) && (PFL_GUARD_CONFIG == 2)
    const size_t needed = PFL_MAX(pfl_arena_bytes(config), watch); /* with the copy of a good configuration */
#else
    const size_t needed = PFL_ARENA_BYTES(config->particles, config->states, config->noises) + watch;
#endif
    if (bytes != NULL) {
        *bytes = needed;
    }
    return ut_arena(needed);
}

static bool is_filled(const unsigned char *at, size_t n, unsigned char byte)
{
    for (size_t i = 0u; i < n; i++) {
        if (at[i] != byte) {
            return false;
        }
    }
    return true;
}

bool ut_red_zones_intact(void)
{
    for (size_t k = 0u; k < block_count; k++) {
        const unsigned char *raw = blocks[k].raw;
        if (!is_filled(raw, RED_ZONE, RED_BYTE) || !is_filled(raw + RED_ZONE + blocks[k].bytes, RED_ZONE, RED_BYTE)) {
            return false;
        }
    }
    return true;
}

bool ut_untouched(const void *arena, size_t bytes)
{
    return is_filled((const unsigned char *)arena, bytes, FILL_BYTE);
}

void ut_arenas_end(void)
{
    const bool intact = ut_red_zones_intact();
    for (size_t k = 0u; k < block_count; k++) {
        free(blocks[k].raw);
    }
    block_count = 0u;
    TEST_ASSERT_TRUE_MESSAGE(intact, "a red zone was written");
}

/* ---- Dictated filters ------------------------------------------------------------------------------------------- */

void ut_table_draw(void *user, const pfl_batch_t *p)
{
    const ut_table_t *table = (const ut_table_t *)user;
    for (uint32_t d = 0u; d < table->states; d++) {
        memcpy(PFL_STATE(p, d), &table->x[(d * table->particles) + p->first], sizeof(float) * p->n);
    }
}

void ut_index_draw(void *user, const pfl_batch_t *p)
{
    (void)user;
    for (uint32_t i = 0u; i < p->n; i++) {
        PFL_STATE(p, 0)[i] = (float)(p->first + i);
    }
}

void ut_index_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    (void)u;
    (void)dt_s;
    ut_index_draw(user, p);
}

void ut_hold_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    (void)user;
    (void)u;
    (void)dt_s;
    (void)p;
}

void ut_dictated_loglik(void *user, const void *z, const pfl_view_t *p, float *ll)
{
    (void)user;
    memcpy(ll, (const float *)z + p->first, sizeof(float) * p->n);
}

pfl_config_t ut_dictated_config(uint32_t particles, uint16_t states)
{
    static const pfl_sensor_t sensor = {.loglik = ut_dictated_loglik};
    pfl_config_t c;
    memset(&c, 0, sizeof c);
    c.abi = PFL_ABI;
    c.particles = particles;
    c.states = states;
    c.sensor_count = 1u;
    c.seed = 1u;
    c.sensors = &sensor;
    c.predict = ut_hold_predict;
    c.draw = ut_index_draw;
    return c;
}

/* ---- Linear Gaussian -------------------------------------------------------------------------------------------- */

void ut_linear_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    (void)user;
    (void)u;
    for (uint32_t i = 0u; i < p->n; i++) {
        PFL_STATE(p, 0)[i] += (dt_s * PFL_STATE(p, 1)[i]) + (0.1f * PFL_NOISE(p, 0)[i]);
        PFL_STATE(p, 1)[i] += 0.05f * PFL_NOISE(p, 1)[i];
    }
}

void ut_linear_draw(void *user, const pfl_batch_t *p)
{
    (void)user;
    for (uint32_t i = 0u; i < p->n; i++) {
        PFL_STATE(p, 0)[i] = PFL_NOISE(p, 0)[i];
        PFL_STATE(p, 1)[i] = PFL_NOISE(p, 1)[i];
    }
}

void ut_linear_loglik(void *user, const void *z, const pfl_view_t *p, float *ll)
{
    (void)user;
    for (uint32_t i = 0u; i < p->n; i++) {
        const float e = p->x[i] - *(const float *)z;
        ll[i] = -0.5f * (e * e);
    }
}

pfl_config_t ut_linear_config(uint32_t particles)
{
    static const pfl_sensor_t sensor = {.loglik = ut_linear_loglik};
    pfl_config_t c = ut_dictated_config(particles, 2u);
    c.noises = 2u;
    c.ess_ratio = 0.5f;
    c.seed = 42u;
    c.sensors = &sensor;
    c.predict = ut_linear_predict;
    c.draw = ut_linear_draw;
    return c;
}

/* ---- Filters ---------------------------------------------------------------------------------------------------- */

pfl_t *ut_filter(const pfl_config_t *config)
{
    size_t bytes = 0u;
    void *arena = ut_arena_for(config, &bytes);
    pfl_t *f = NULL;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_init(arena, bytes, config, 0u, &f));
    TEST_ASSERT_NOT_NULL(f);
    return f;
}

unsigned char *ut_snapshot(const pfl_t *f)
{
    const size_t bytes = pfl_snapshot_bytes(f);
    unsigned char *buffer = (unsigned char *)ut_arena(bytes);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_snapshot(f, buffer, bytes));
    return buffer;
}

bool ut_same_bytes(const unsigned char *a, const unsigned char *b, size_t bytes)
{
    return memcmp(a, b, bytes) == 0;
}

/* Words of the snapshot's head (lib/src/snapshot.c): 13 test ratio, 18 rejected, 19 faulted, 23 overruns, from 28
 * to 42 the watch; the last word is the CRC. */
bool ut_same_posterior(const unsigned char *a, const unsigned char *b, size_t bytes)
{
    const size_t words = (bytes / 4u) - 1u;
    for (size_t k = 0u; k < words; k++) {
        const bool counter = (k == 13u) || (k == 18u) || (k == 19u) || (k == 23u) || ((k >= 28u) && (k <= 42u));
        if (!counter && (memcmp(a + (4u * k), b + (4u * k), 4u) != 0)) {
            return false;
        }
    }
    return true;
}

uint64_t ut_fly_linear(pfl_t *f, uint64_t t_us, float z, uint64_t hash)
{
    float mean[2];
    float cov[4];
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(f, t_us, NULL));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(f, 0u, t_us, &z));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(f, mean, cov));
    return ut_fnv(ut_fnv(hash, mean, sizeof mean), cov, sizeof cov);
}

/* ---- Numbers ---------------------------------------------------------------------------------------------------- */

uint64_t ut_fnv(uint64_t hash, const void *bytes, size_t n)
{
    const unsigned char *at = (const unsigned char *)bytes;
    for (size_t i = 0u; i < n; i++) {
        hash = (hash ^ at[i]) * 0x100000001B3u;
    }
    return hash;
}

uint32_t ut_bits(float x)
{
    uint32_t u;
    memcpy(&u, &x, sizeof u);
    return u;
}

float ut_float(uint32_t bits)
{
    float x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

bool ut_finite(float x)
{
    return (ut_bits(x) & 0x7F800000u) != 0x7F800000u;
}

float ut_infinity(void)
{
    return ut_float(0x7F800000u);
}

float ut_nan(bool negative)
{
    return ut_float(negative ? 0xFFC00000u : 0x7FC00000u);
}

uint32_t ut_random(uint64_t *state)
{
    *state ^= *state >> 12;
    *state ^= *state << 25;
    *state ^= *state >> 27;
    return (uint32_t)((*state * 0x2545F4914F6CDD1Du) >> 32);
}

double ut_uniform(uint64_t *state)
{
    return (double)ut_random(state) / 4294967296.0;
}

double ut_gaussian(uint64_t *state)
{
    const double u = 1.0 - ut_uniform(state);
    const double v = ut_uniform(state);
    return sqrt(-2.0 * log(u)) * cos(6.283185307179586 * v);
}

double ut_ulp(float got, double reference)
{
    const double magnitude = fabs(reference);
    int exponent = 0;
    (void)frexp((magnitude > (double)FLT_MIN) ? magnitude : (double)FLT_MIN, &exponent);
    return fabs((double)got - reference) / ldexp(1.0, exponent - 24);
}
