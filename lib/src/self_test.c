/* Known answers at power-on: does this build, on this processor, in this floating-point mode, compute what every other
 * build computes? Each part is hashed against a constant that all supported compilers and targets agree on. */
#include "core.h"

#include "math_kernels.h"

#include "pflight/math.h"

#define SELF_TEST_PARTICLES 48u
#define SELF_TEST_STEPS 6u

/* The known answers, from gcc and clang at every optimisation level; a change of one is a change of every result. */
#define ANSWER_ARITHMETIC 0xF8D369EDB3F18E76u
#define ANSWER_MATH 0x4FB24A57404BD900u
#define ANSWER_RANDOM 0xF951EE3BF15AFCD0u
#define ANSWER_FLIGHT 0xF5DE6436DBBCDF66u

/* FNV-1a over the bits of a float. */
static void mix(uint64_t *hash, float x)
{
    uint32_t u = (uint32_t)pfl_bits(x);
    for (uint32_t k = 0u; k < 4u; k++) {
        *hash = (*hash ^ (u & 0xFFu)) * 0x100000001B3u;
        u >>= 8;
    }
}

/* The arithmetic itself. Volatile operands keep it from being done by the compiler. */
PFL_NOINLINE static uint64_t hash_of_arithmetic(uint64_t hash)
{
    volatile float one_and_bit = 1.00000012f;
    volatile float tiny = 1.17549435e-38f;
    volatile float third = 0.333333343f;
    volatile float half_way = 5.96046448e-8f; /* 1 + 2^-24: a tie, to even */
    const float product = one_and_bit * one_and_bit;
    mix(&hash, (one_and_bit * one_and_bit) - product); /* not 0 when fused */
    mix(&hash, (third * 3.0f) - 1.0f);                 /* likewise */
    mix(&hash, tiny * third);                          /* subnormal: 0 when flushed */
    mix(&hash, (tiny * third) * 4.0f);
    mix(&hash, 1.0f + half_way); /* the rounding mode: up, down, to zero and to nearest differ in these three */
    mix(&hash, one_and_bit + half_way);
    mix(&hash, -1.0f - (half_way * third));
    mix(&hash, 1.0f / third);
    mix(&hash, pfl_sqrtf(third));
    return hash;
}

PFL_NOINLINE static uint64_t hash_of_math(uint64_t hash)
{
    volatile float start = -12.3f;
    float x = start;
    for (uint32_t k = 0u; k < 40u; k++) {
        float s;
        float c;
        pfl_sincosf(x, &s, &c);
        mix(&hash, pfl_expf(x));
        mix(&hash, pfl_logf(x * x));
        mix(&hash, s);
        mix(&hash, c);
        mix(&hash, pfl_atan2f(s * x, c));
        mix(&hash, pfl_wrap_pi(x));
        x += 0.71f;
    }
    return hash;
}

PFL_NOINLINE static uint64_t hash_of_random(uint64_t hash, float *noise)
{
    pfl_rng_t rng;
    pfl_rng_seed(&rng, 20260101u);
    pfl_rng_long_jump(&rng);
    pfl_rng_normals(&rng, noise, 4u);
    for (uint32_t i = 0u; i < 64u; i++) {
        mix(&hash, noise[i]);
    }
    hash ^= pfl_rng_u32(&rng);
    return hash;
}

static void drift(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    float *angle = PFL_STATE(p, 0);
    float *rate = PFL_STATE(p, 1);
    (void)user;
    (void)u;
    for (uint32_t i = 0u; i < p->n; i++) {
        angle[i] += dt_s * rate[i];
        rate[i] += dt_s * PFL_NOISE(p, 0)[i];
    }
}

static void bearing(void *user, const void *z, const pfl_view_t *p, float *ll)
{
    float measured;
    (void)user;
    memcpy(&measured, z, sizeof measured);
    for (uint32_t i = 0u; i < p->n; i++) {
        const float e = 4.0f * pfl_wrap_pi_kernel(p->x[i] - measured);
        ll[i] = -0.5f * (e * e);
    }
}

static void scatter(void *user, const pfl_batch_t *p)
{
    (void)user;
    for (uint32_t i = 0u; i < p->n; i++) {
        PFL_STATE(p, 0)[i] = 3.0f + PFL_NOISE(p, 0)[i];
        PFL_STATE(p, 1)[i] = PFL_NOISE(p, 1)[i];
    }
}

/* For the hash: nothing, where all is well. */
static uint64_t failure(pfl_status_t status)
{
    return (uint64_t)((status == PFL_OK) ? 0u : 1u);
}

PFL_NOINLINE static void mix_answers(pfl_t *f, uint64_t *hash)
{
    float mean[2] = {0.0f, 0.0f};
    float cov[4] = {0.0f, 0.0f, 0.0f, 0.0f};
    *hash ^= failure(pfl_estimate(f, mean, cov));
    mix(hash, mean[0]);
    mix(hash, mean[1]);
    mix(hash, cov[0]);
    mix(hash, cov[1]);
    mix(hash, cov[3]);
    mix(hash, pfl_effective_sample_size(f));
}

/* A short flight by one resampling scheme. Its configuration lies behind its arena: the stack is for the filter. A call
 * that is not PFL_OK leaves its mark in the hash; after a failed init all of them do. */
PFL_NOINLINE static void fly(void *arena, pfl_scheme_fn scheme, uint64_t *hash)
{
    static const pfl_sensor_t sensor = {.loglik = bearing};
    const size_t arena_bytes = PFL_SELF_TEST_BYTES - sizeof(pfl_config_t);
    pfl_config_t *config = (pfl_config_t *)(void *)((unsigned char *)arena + arena_bytes);
    memset(config, 0, sizeof *config);
    config->abi = PFL_ABI;
    config->particles = SELF_TEST_PARTICLES;
    config->states = 2u;
    config->noises = 1u;
    config->sensor_count = 1u;
    config->resampling = scheme;
    config->circular_mask = 1u;
    config->circular = pfl_circular_means;
    config->ess_ratio = 0.75f;
    config->seed = 7u;
    config->sensors = &sensor;
    config->predict = drift;
    config->draw = scatter;
    pfl_t *f = NULL;
    uint64_t failed = failure(pfl_init(arena, arena_bytes, config, 0u, &f));
    for (uint32_t k = 1u; k <= SELF_TEST_STEPS; k++) {
        const uint64_t t_us = (uint64_t)k * 250000u;
        const float z = 3.0f + (0.125f * (float)k);
        failed |= failure(pfl_predict(f, t_us, NULL));
        failed |= failure(pfl_update(f, 0u, t_us, &z));
        mix_answers(f, hash);
    }
    *hash ^= failed;
    memset(arena, 0, sizeof *f); /* leave no filter behind whose configuration is gone */
}

pfl_status_t pfl_self_test(void *arena, size_t arena_bytes)
{
    static const pfl_scheme_fn schemes[] = {pfl_systematic, pfl_stratified, pfl_residual, pfl_multinomial};
    const uint64_t seed = 0xCBF29CE484222325u;
    if ((arena == NULL) || (((uintptr_t)arena & 7u) != 0u) || (arena_bytes < PFL_SELF_TEST_BYTES)) {
        return PFL_ERR_MEMORY;
    }
    uint64_t flight = seed;
    uint64_t different = hash_of_arithmetic(seed) ^ ANSWER_ARITHMETIC;
    different |= hash_of_math(seed) ^ ANSWER_MATH;
    different |= hash_of_random(seed, (float *)arena) ^ ANSWER_RANDOM;
    for (uint32_t k = 0u; k < (sizeof(schemes) / sizeof(schemes[0])); k++) {
        fly(arena, schemes[k], &flight);
    }
    different |= flight ^ ANSWER_FLIGHT;
    return (different == 0u) ? PFL_OK : PFL_ERR_SELF_TEST;
}
