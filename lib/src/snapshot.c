/* A filter as bytes and back: little-endian 32-bit words, so that a recorder on one machine feeds a replay on another.
 *
 *     magic, version, N, D, Q, counters and clocks, random generator, moments, states, log-weights, CRC-32
 *
 * A restore looks at every word before it changes the first one. */
#include "core.h"

#include "rng_kernels.h"

#define SNAPSHOT_MAGIC 0x73706670u /* "pfps" */
#define SNAPSHOT_VERSION 1u
#define HEAD_WORDS ((size_t)28u)
#define LANE_WORDS ((size_t)4u * PFL_RNG_LANES)
#define RNG_WORDS (LANE_WORDS + 4u)

static size_t moment_words(size_t states)
{
    return (3u * states) + ((states * (states + 1u)) / 2u);
}

static size_t total_words(const pfl_t *f)
{
    const size_t states = f->config->states;
    return HEAD_WORDS + RNG_WORDS + moment_words(states) + ((size_t)f->config->particles * (states + 1u)) + 1u;
}

static void put_word(unsigned char *at, uint32_t word)
{
    at[0] = (unsigned char)(word & 0xFFu);
    at[1] = (unsigned char)((word >> 8) & 0xFFu);
    at[2] = (unsigned char)((word >> 16) & 0xFFu);
    at[3] = (unsigned char)(word >> 24);
}

static uint32_t get_word(const unsigned char *at)
{
    return (uint32_t)at[0] | ((uint32_t)at[1] << 8) | ((uint32_t)at[2] << 16) | ((uint32_t)at[3] << 24);
}

/* Word k of a snapshot, as it is and as a float. */
static uint32_t word_of(const unsigned char *at, size_t k)
{
    return get_word(&at[4u * k]);
}

static float float_of(const unsigned char *at, size_t k)
{
    return pfl_from_bits((int32_t)word_of(at, k));
}

/* CRC-32 (reflected 0xEDB88320), bit by bit: no table to keep. */
static uint32_t crc32(const unsigned char *bytes, size_t n)
{
    uint32_t crc = 0xFFFFFFFFu;
    for (size_t i = 0u; i < n; i++) {
        crc ^= bytes[i];
        for (uint32_t bit = 0u; bit < 8u; bit++) {
            crc = (crc >> 1) ^ (0xEDB88320u & (0u - (crc & 1u)));
        }
    }
    return ~crc;
}

static unsigned char *put_floats(unsigned char *at, const float *x, size_t n)
{
    for (size_t i = 0u; i < n; i++) {
        put_word(&at[4u * i], pfl_load_u32(&x[i]));
    }
    return &at[4u * n];
}

static const unsigned char *get_floats(const unsigned char *at, float *x, size_t n)
{
    for (size_t i = 0u; i < n; i++) {
        pfl_store_u32(&x[i], word_of(at, i));
    }
    return &at[4u * n];
}

static void head_of(const pfl_t *f, uint32_t head[HEAD_WORDS])
{
    const uint32_t words[HEAD_WORDS] = {SNAPSHOT_MAGIC,
                                        SNAPSHOT_VERSION,
                                        f->config->particles,
                                        f->config->states,
                                        f->config->noises,
                                        (uint32_t)f->t_us,
                                        (uint32_t)(f->t_us >> 32),
                                        (uint32_t)f->reset_t_us,
                                        (uint32_t)(f->reset_t_us >> 32),
                                        (uint32_t)f->t_fused_us,
                                        (uint32_t)(f->t_fused_us >> 32),
                                        (uint32_t)pfl_bits(f->log_weight_top),
                                        (uint32_t)pfl_bits(f->weight_sum),
                                        (uint32_t)pfl_bits(f->test_ratio),
                                        (uint32_t)pfl_bits(f->ess),
                                        f->moments_current,
                                        f->resample_pending,
                                        f->fused,
                                        f->rejected,
                                        f->faulted,
                                        f->resampled,
                                        f->quarantined,
                                        f->resets,
                                        f->overruns,
                                        f->config->moments,
                                        f->redrawn,
                                        f->projected,
                                        f->best_index};
    (void)memcpy(head, words, sizeof words);
}

size_t pfl_snapshot_bytes(const pfl_t *f)
{
    return ((f != NULL) && pfl_is_alive(f)) ? (4u * total_words(f)) : 0u;
}

pfl_status_t pfl_snapshot(const pfl_t *f, void *buffer, size_t buffer_bytes)
{
    const pfl_status_t entered = pfl_enter(f);
    if (entered != PFL_OK) {
        return entered;
    }
    const size_t bytes = pfl_snapshot_bytes(f);
    if (buffer == NULL) {
        return PFL_ERR_ARG;
    }
    if (buffer_bytes < bytes) {
        return PFL_ERR_MEMORY;
    }
    const size_t states = f->config->states;
    uint32_t head[HEAD_WORDS];
    head_of(f, head);
    unsigned char *at = (unsigned char *)buffer;
    for (size_t k = 0u; k < HEAD_WORDS; k++) {
        put_word(&at[4u * k], head[k]);
    }
    at = &at[4u * HEAD_WORDS];
    for (size_t k = 0u; k < RNG_WORDS; k++) {
        put_word(&at[4u * k],
                 (k < LANE_WORDS) ? f->rng.s[k / PFL_RNG_LANES][k % PFL_RNG_LANES] : f->rng.one[k - LANE_WORDS]);
    }
    at = put_floats(&at[4u * RNG_WORDS], f->mean, moment_words(states));
    for (size_t d = 0u; d < states; d++) {
        at = put_floats(at, &f->x[d * f->stride], f->config->particles);
    }
    at = put_floats(at, f->log_weight, f->config->particles);
    put_word(at, crc32((const unsigned char *)buffer, bytes - 4u));
    return PFL_OK;
}

/* ---- Restore -------------------------------------------------------------------------------------------------- */

static bool shape_fits(const pfl_config_t *c, const unsigned char *at)
{
    return (word_of(at, 0u) == SNAPSHOT_MAGIC) && (word_of(at, 1u) == SNAPSHOT_VERSION) &&
           (word_of(at, 2u) == c->particles) && (word_of(at, 3u) == c->states) && (word_of(at, 4u) == c->noises) &&
           (word_of(at, 24u) == c->moments);
}

/* A float between the two, both included; NaN is not. */
static bool lies_within(float x, float lo, float hi)
{
    return pfl_is_not_nan(x) && (x >= lo) && (x <= hi);
}

static bool head_is_good(const pfl_config_t *c, const unsigned char *at)
{
    return pfl_is_finite(float_of(at, 11u)) && lies_within(float_of(at, 12u), FLT_MIN, FLT_MAX) &&
           pfl_is_finite(float_of(at, 13u)) && lies_within(float_of(at, 14u), 1.0f, (float)c->particles) &&
           (word_of(at, 15u) <= MOMENTS_OVERFLOWED) && (word_of(at, 16u) <= 1u) && (word_of(at, 27u) < c->particles);
}

static void get_streams(pfl_rng_t *rng, const unsigned char *at)
{
    for (size_t k = 0u; k < LANE_WORDS; k++) {
        rng->s[k / PFL_RNG_LANES][k % PFL_RNG_LANES] = word_of(at, k);
    }
    for (size_t k = 0u; k < 4u; k++) {
        rng->one[k] = word_of(at, LANE_WORDS + k);
    }
}

/* Streams alive, moments and states finite, log-weights below their top. */
static bool body_is_good(const pfl_t *f, const unsigned char *at)
{
    const float top = float_of(at, 11u);
    const size_t states = f->config->states;
    const size_t finite = moment_words(states) + (states * f->config->particles);
    const unsigned char *streams = &at[4u * HEAD_WORDS];
    const unsigned char *numbers = &streams[4u * RNG_WORDS];
    const unsigned char *weights = &numbers[4u * finite];
    pfl_rng_t rng;
    uint32_t bad = 0u;
    get_streams(&rng, streams);
    for (size_t k = 0u; k < finite; k++) {
        bad |= pfl_is_finite(float_of(numbers, k)) ? 0u : 1u;
    }
    for (size_t i = 0u; i < f->config->particles; i++) {
        const float relative = float_of(weights, i) - top;
        bad |= (pfl_is_not_nan(relative) && (relative <= 0.0f)) ? 0u : 1u;
    }
    return pfl_rng_alive(&rng) && (bad == 0u);
}

static uint64_t time_of(const unsigned char *at, size_t k)
{
    return (uint64_t)word_of(at, k) | ((uint64_t)word_of(at, k + 1u) << 32);
}

static void take_head(pfl_t *f, const unsigned char *at)
{
    f->t_us = time_of(at, 5u);
    f->reset_t_us = time_of(at, 7u);
    f->t_fused_us = time_of(at, 9u);
    f->log_weight_top = float_of(at, 11u);
    f->weight_sum = float_of(at, 12u);
    f->test_ratio = float_of(at, 13u);
    f->ess = float_of(at, 14u);
    f->moments_current = word_of(at, 15u);
    f->resample_pending = word_of(at, 16u);
    f->fused = word_of(at, 17u);
    f->rejected = word_of(at, 18u);
    f->faulted = word_of(at, 19u);
    f->resampled = word_of(at, 20u);
    f->quarantined = word_of(at, 21u);
    f->resets = word_of(at, 22u);
    f->overruns = word_of(at, 23u);
    f->redrawn = word_of(at, 25u);
    f->projected = word_of(at, 26u);
    f->best_index = word_of(at, 27u);
    f->scratch_is_weights = 0u;
}

pfl_status_t pfl_restore(pfl_t *f, const void *buffer, size_t buffer_bytes)
{
    const pfl_status_t entered = pfl_begin(f);
    if (entered != PFL_OK) {
        return entered;
    }
    if (buffer == NULL) {
        return PFL_ERR_ARG;
    }
    const unsigned char *at = (const unsigned char *)buffer;
    const size_t bytes = pfl_snapshot_bytes(f);
    if ((buffer_bytes < bytes) || !shape_fits(f->config, at) || !head_is_good(f->config, at) ||
        (get_word(&at[bytes - 4u]) != crc32(at, bytes - 4u)) || !body_is_good(f, at)) {
        return PFL_ERR_CORRUPT;
    }
    const size_t states = f->config->states;
    take_head(f, at);
    get_streams(&f->rng, &at[4u * HEAD_WORDS]);
    at = get_floats(&at[4u * (HEAD_WORDS + RNG_WORDS)], f->mean, moment_words(states));
    for (size_t d = 0u; d < states; d++) {
        at = get_floats(at, &f->x[d * f->stride], f->config->particles);
    }
    (void)get_floats(at, f->log_weight, f->config->particles);
    return PFL_OK;
}
