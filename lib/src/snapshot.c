/* A filter as bytes and back: little-endian 32-bit words, so that a recorder on one machine feeds a replay on another.
 *
 *     magic, version, N, D, Q, counters and clocks, the watch, random generator, moments, states, log-weights, CRC-32
 *
 * A restore looks at every word before it changes the first one. */
#include "core.h"

#include "rng_kernels.h"

#define SNAPSHOT_MAGIC 0x73706670u /* "pfps" */
#define SNAPSHOT_VERSION 2u
#define HEAD_WORDS ((size_t)43)
#define TRACK_WORDS ((size_t)6)
#define RNG_WORDS ((4u * PFL_RNG_LANES) + 4u)

/* From `mean` on: mean, best, centre, delta and covariance lie end to end (pfl_lay_out). */
static size_t moment_words(size_t states)
{
    return (4u * states) + ((states * (states + 1u)) / 2u);
}

static size_t tracked(const pfl_t *f)
{
    return (f->sensor != NULL) ? f->config->sensor_count : 0u;
}

static size_t total_words(const pfl_t *f)
{
    const size_t states = f->config->states;
    return HEAD_WORDS + (TRACK_WORDS * tracked(f)) + RNG_WORDS + moment_words(states) +
           ((size_t)f->config->particles * (states + 1u)) + 1u;
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
        put_word(at, pfl_load_u32(&x[i]));
        at += 4;
    }
    return at;
}

static const unsigned char *get_floats(const unsigned char *at, float *x, size_t n)
{
    for (size_t i = 0u; i < n; i++) {
        pfl_store_u32(&x[i], get_word(at));
        at += 4;
    }
    return at;
}

/* Word k of what begins at `at`. */
static uint32_t word_at(const unsigned char *at, size_t k)
{
    return get_word(&at[4u * k]);
}

static float float_at(const unsigned char *at, size_t k)
{
    return pfl_from_bits((int32_t)word_at(at, k));
}

static uint64_t time_at(const unsigned char *at, size_t k)
{
    return (uint64_t)word_at(at, k) | ((uint64_t)word_at(at, k + 1u) << 32);
}

static const unsigned char *get_streams(const unsigned char *at, pfl_rng_t *rng)
{
    for (uint32_t k = 0u; k < (4u * PFL_RNG_LANES); k++) {
        rng->s[k / PFL_RNG_LANES][k % PFL_RNG_LANES] = get_word(at);
        at += 4;
    }
    for (uint32_t k = 0u; k < 4u; k++) {
        rng->one[k] = get_word(at);
        at += 4;
    }
    return at;
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
                                        f->best_index,
                                        f->mended,
                                        (uint32_t)tracked(f),
                                        (uint32_t)f->watched.since_us,
                                        (uint32_t)(f->watched.since_us >> 32),
                                        f->watched.phase,
                                        f->watched.fault,
                                        f->watched.reject,
                                        f->watched.mode,
                                        f->watched.event,
                                        f->watched.refused,
                                        f->watched.lean,
                                        f->watched.settled,
                                        f->watched.quarantined,
                                        (uint32_t)pfl_bits(f->watched.best_loglik),
                                        (uint32_t)pfl_bits(f->watched.ratio_before)};
    memcpy(head, words, sizeof words);
}

static unsigned char *put_tracks(const pfl_t *f, unsigned char *at)
{
    for (size_t k = 0u; k < tracked(f); k++) {
        const pfl_sensor_track_t *track = &f->sensor[k];
        put_word(at, (uint32_t)track->t_fused_us);
        put_word(at + 4, (uint32_t)(track->t_fused_us >> 32));
        put_word(at + 8, (uint32_t)pfl_bits(track->test_ratio));
        put_word(at + 12, track->refused);
        put_word(at + 16, track->content);
        put_word(at + 20, (track->same << 1) | track->seen);
        at += 4u * TRACK_WORDS;
    }
    return at;
}

size_t pfl_snapshot_bytes(const pfl_t *f)
{
    return (pfl_look(f) == PFL_OK) ? (4u * total_words(f)) : 0u;
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
        put_word(at, head[k]);
        at += 4;
    }
    at = put_tracks(f, at);
    for (uint32_t k = 0u; k < RNG_WORDS; k++) {
        put_word(at, (k < (4u * PFL_RNG_LANES)) ? f->rng.s[k / PFL_RNG_LANES][k % PFL_RNG_LANES]
                                                : f->rng.one[k - (4u * PFL_RNG_LANES)]);
        at += 4;
    }
    at = put_floats(at, f->mean, moment_words(states));
    for (size_t d = 0u; d < states; d++) {
        at = put_floats(at, &f->x[d * f->stride], f->config->particles);
    }
    for (uint32_t i = 0u; i < f->config->particles; i++) {
        put_word(at, (f->weights_equal != 0u) ? 0u : pfl_load_u32(&f->log_weight[i]));
        at += 4;
    }
    put_word(at, crc32((const unsigned char *)buffer, bytes - 4u));
    return PFL_OK;
}

/* ---- Restore -------------------------------------------------------------------------------------------------- */

static bool shape_fits(const pfl_t *f, const unsigned char *at)
{
    return (word_at(at, 0) == SNAPSHOT_MAGIC) && (word_at(at, 1) == SNAPSHOT_VERSION) &&
           (word_at(at, 2) == f->config->particles) && (word_at(at, 3) == f->config->states) &&
           (word_at(at, 4) == f->config->noises) && (word_at(at, 24) == f->config->moments);
}

static bool numbers_fit(const pfl_t *f, const unsigned char *at)
{
    const float sum = float_at(at, 12);
    const float ess = float_at(at, 14);
    return pfl_is_finite(float_at(at, 11)) && pfl_is_finite(sum) && (sum > 0.0f) && pfl_is_finite(float_at(at, 13)) &&
           (ess >= 1.0f) && (ess <= (float)f->config->particles) && (word_at(at, 15) <= MOMENTS_OVERFLOWED) &&
           (word_at(at, 16) <= 1u) && (word_at(at, 27) < f->config->particles);
}

static bool watch_fits(const pfl_t *f, const unsigned char *at)
{
    const uint32_t sensors = f->config->sensor_count;
    const bool known =
        (sensors == 32u) || ((word_at(at, 34) >> sensors) == 0u); /* whose last measurement was refused */
    return known && (word_at(at, 29) == tracked(f)) && (word_at(at, 32) <= (uint32_t)PFL_PHASE_SETTLING) &&
           pfl_is_finite(float_at(at, 41)) && pfl_is_finite(float_at(at, 42));
}

static bool tracks_are_good(const pfl_t *f, const unsigned char *at)
{
    for (size_t k = 0u; k < tracked(f); k++) {
        if (!pfl_is_finite(float_at(at, (k * TRACK_WORDS) + 2u))) {
            return false;
        }
    }
    return true;
}

static bool floats_are_finite(const unsigned char *at, size_t n)
{
    for (size_t k = 0u; k < n; k++) {
        if (!pfl_is_finite(float_at(at, k))) {
            return false;
        }
    }
    return true;
}

/* None above their top, and one that reaches it: without it all weights could be zero, and so could their sum. */
static bool log_weights_fit(const unsigned char *at, uint32_t n, float top)
{
    bool reached = false;
    for (size_t i = 0u; i < n; i++) {
        const float relative = float_at(at, i) - top;
        if (!(relative <= 0.0f)) {
            return false;
        }
        reached = reached || (relative >= 0.0f);
    }
    return reached;
}

static bool body_is_good(const pfl_t *f, const unsigned char *at)
{
    const size_t states = f->config->states;
    const size_t finite = moment_words(states) + (states * f->config->particles);
    const unsigned char *tracks = at + (4u * HEAD_WORDS);
    pfl_rng_t rng;
    const unsigned char *floats = get_streams(tracks + (4u * TRACK_WORDS * tracked(f)), &rng);
    return tracks_are_good(f, tracks) && pfl_rng_alive(&rng) && floats_are_finite(floats, finite) &&
           log_weights_fit(floats + (4u * finite), f->config->particles, float_at(at, 11));
}

static void take_head(pfl_t *f, const unsigned char *at)
{
    f->t_us = time_at(at, 5);
    f->reset_t_us = time_at(at, 7);
    f->t_fused_us = time_at(at, 9);
    f->log_weight_top = float_at(at, 11);
    f->weight_sum = float_at(at, 12);
    f->test_ratio = float_at(at, 13);
    f->ess = float_at(at, 14);
    f->moments_current = word_at(at, 15);
    f->resample_pending = word_at(at, 16);
    f->fused = word_at(at, 17);
    f->rejected = word_at(at, 18);
    f->faulted = word_at(at, 19);
    f->resampled = word_at(at, 20);
    f->quarantined = word_at(at, 21);
    f->resets = word_at(at, 22);
    f->overruns = word_at(at, 23);
    f->redrawn = word_at(at, 25);
    f->projected = word_at(at, 26);
    f->best_index = word_at(at, 27);
    f->mended = word_at(at, 28);
    f->watched.since_us = time_at(at, 30);
    f->watched.phase = word_at(at, 32);
    f->watched.fault = word_at(at, 33);
    f->watched.reject = word_at(at, 34);
    f->watched.mode = word_at(at, 35);
    f->watched.event = word_at(at, 36);
    f->watched.refused = word_at(at, 37);
    f->watched.lean = word_at(at, 38);
    f->watched.settled = word_at(at, 39);
    f->watched.quarantined = word_at(at, 40);
    f->watched.best_loglik = float_at(at, 41);
    f->watched.ratio_before = float_at(at, 42);
    f->scratch_is_weights = 0u;
}

static const unsigned char *take_tracks(pfl_t *f, const unsigned char *at)
{
    for (size_t k = 0u; k < tracked(f); k++) {
        pfl_sensor_track_t *track = &f->sensor[k];
        track->t_fused_us = time_at(at, 0);
        track->test_ratio = float_at(at, 2);
        track->refused = word_at(at, 3);
        track->content = word_at(at, 4);
        track->same = word_at(at, 5) >> 1;
        track->seen = word_at(at, 5) & 1u;
        at += 4u * TRACK_WORDS;
    }
    return at;
}

static pfl_status_t restore(pfl_t *f, const void *buffer, size_t buffer_bytes)
{
    if (buffer == NULL) {
        return PFL_ERR_ARG;
    }
    const unsigned char *at = (const unsigned char *)buffer;
    const size_t bytes = pfl_snapshot_bytes(f);
    if ((buffer_bytes < bytes) || !shape_fits(f, at) || !numbers_fit(f, at) || !watch_fits(f, at) ||
        (get_word(at + (bytes - 4u)) != crc32(at, bytes - 4u)) || !body_is_good(f, at)) {
        return PFL_ERR_CORRUPT;
    }
    const size_t states = f->config->states;
    take_head(f, at);
    at = take_tracks(f, at + (4u * HEAD_WORDS));
    at = get_streams(at, &f->rng);
    at = get_floats(at, f->mean, moment_words(states));
    for (size_t d = 0u; d < states; d++) {
        at = get_floats(at, &f->x[d * f->stride], f->config->particles);
    }
    pfl_weights_settle(f); /* the padding of the column, too */
    (void)get_floats(at, f->log_weight, f->config->particles);
    return PFL_OK;
}

pfl_status_t pfl_restore(pfl_t *f, const void *buffer, size_t buffer_bytes)
{
    const pfl_status_t entered = pfl_begin(f);
    return (entered == PFL_OK) ? pfl_end(f, restore(f, buffer, buffer_bytes)) : entered;
}
