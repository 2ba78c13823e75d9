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

/* For the proofs: a word as it stands in a snapshot, the shape of a filter, and the words of its snapshot. */
/*@ logic integer word_of{L}(unsigned char *p) = p[0] + 0x100 * p[1] + 0x10000 * p[2] + 0x1000000 * p[3];
    predicate shaped{L}(pfl_t *f) =
      sized(f) && 1 <= f->config->states <= PFL_STATES_MAX && f->config->sensor_count <= PFL_SENSORS_MAX &&
      (f->sensor != \null ==> \valid(f->sensor + (0 .. f->config->sensor_count - 1)));
    logic integer tracks_of{L}(pfl_t *f) = f->sensor != \null ? f->config->sensor_count : 0;
    logic integer moments_of(integer d) = 4 * d + (d * (d + 1)) / 2;
    logic integer words(integer n, integer d, integer t) =
      HEAD_WORDS + TRACK_WORDS * t + RNG_WORDS + moments_of(d) + n * (d + 1) + 1; */

/* From `mean` on: mean, best, centre, delta and covariance lie end to end (pfl_lay_out). */
/*@ requires states <= PFL_STATES_MAX;
    assigns \nothing;
    ensures \result == moments_of(states) && \result <= 200; */
static size_t moment_words(size_t states)
{
    return (4u * states) + ((states * (states + 1u)) / 2u);
}

/*@ requires shaped(f);
    assigns \nothing;
    ensures \result == tracks_of(f) && \result <= PFL_SENSORS_MAX;
    ensures 0 < \result ==> \valid(f->sensor + (0 .. \result - 1)); */
static size_t tracked(const pfl_t *f)
{
    return (f->sensor != NULL) ? f->config->sensor_count : 0u;
}

/*@ requires shaped(f);
    assigns \nothing;
    ensures \result == words(f->config->particles, f->config->states, tracks_of(f)); */
static size_t total_words(const pfl_t *f)
{
    const size_t states = f->config->states;
    return HEAD_WORDS + (TRACK_WORDS * tracked(f)) + RNG_WORDS + moment_words(states) +
           ((size_t)f->config->particles * (states + 1u)) + 1u;
}

/*@ requires \valid(at + (0 .. 3));
    assigns at[0 .. 3]; */
static void put_word(unsigned char *at, uint32_t word)
{
    at[0] = (unsigned char)(word & 0xFFu);
    at[1] = (unsigned char)((word >> 8) & 0xFFu);
    at[2] = (unsigned char)((word >> 16) & 0xFFu);
    at[3] = (unsigned char)(word >> 24);
}

/*@ requires \valid_read(at + (0 .. 3));
    assigns \nothing;
    ensures \result == word_of(at); */
static uint32_t get_word(const unsigned char *at)
{
    return (uint32_t)at[0] + ((uint32_t)at[1] * 0x100u) + ((uint32_t)at[2] * 0x10000u) + ((uint32_t)at[3] * 0x1000000u);
}

/* CRC-32 (reflected 0xEDB88320), bit by bit: no table to keep. */
/*@ requires \valid_read(bytes + (0 .. n - 1));
    assigns \nothing; */
static uint32_t crc32(const unsigned char *bytes, size_t n)
{
    uint32_t crc = 0xFFFFFFFFu;
    /*@ loop invariant i <= n;
        loop assigns i, crc;
        loop variant n - i; */
    for (size_t i = 0u; i < n; i++) {
        crc ^= bytes[i];
        /*@ loop invariant bit <= 8;
            loop assigns bit, crc;
            loop variant 8 - bit; */
        for (uint32_t bit = 0u; bit < 8u; bit++) {
            crc = (crc >> 1) ^ (0xEDB88320u & (0u - (crc & 1u)));
        }
    }
    return ~crc;
}

/*@ requires n <= PFL_PARTICLES_MAX && \valid(at + (0 .. (4 * n) - 1)) && \valid_read(x + (0 .. n - 1));
    assigns at[0 .. (4 * n) - 1];
    ensures \result == at + 4 * n; */
static unsigned char *put_floats(unsigned char *at, const float *x, size_t n)
{
    /*@ loop invariant i <= n && at == \at(at, Pre) + 4 * i;
        loop assigns i, at, \at(at, Pre)[0 .. (4 * n) - 1];
        loop variant n - i; */
    for (size_t i = 0u; i < n; i++) {
        put_word(at, pfl_load_u32(&x[i]));
        at += 4;
    }
    return at;
}

/*@ requires n <= PFL_PARTICLES_MAX && \valid_read(at + (0 .. (4 * n) - 1)) && \valid(x + (0 .. n - 1));
    assigns x[0 .. n - 1];
    ensures \result == at + 4 * n; */
static const unsigned char *get_floats(const unsigned char *at, float *x, size_t n)
{
    /*@ loop invariant i <= n && at == \at(at, Pre) + 4 * i;
        loop assigns i, at, x[0 .. n - 1];
        loop variant n - i; */
    for (size_t i = 0u; i < n; i++) {
        pfl_store_u32(&x[i], get_word(at));
        at += 4;
    }
    return at;
}

/* Word k of what begins at `at`. */
/*@ requires k <= 0x10000000 && \valid_read(at + (4 * k .. (4 * k) + 3));
    assigns \nothing;
    ensures \result == word_of(at + 4 * k); */
static uint32_t word_at(const unsigned char *at, size_t k)
{
    return get_word(&at[4u * k]);
}

/*@ requires k <= 0x10000000 && \valid_read(at + (4 * k .. (4 * k) + 3));
    assigns \nothing; */
static float float_at(const unsigned char *at, size_t k)
{
    return pfl_from_bits((int32_t)word_at(at, k));
}

/*@ requires k < 0x10000000 && \valid_read(at + (4 * k .. (4 * k) + 7));
    assigns \nothing; */
static uint64_t time_at(const unsigned char *at, size_t k)
{
    return (uint64_t)word_at(at, k) | ((uint64_t)word_at(at, k + 1u) << 32);
}

/*@ requires \valid(rng) && \valid_read(at + (0 .. (4 * RNG_WORDS) - 1));
    assigns *rng;
    ensures \result == at + 4 * RNG_WORDS; */
static const unsigned char *get_streams(const unsigned char *at, pfl_rng_t *rng)
{
    /*@ loop invariant k <= 4 * PFL_RNG_LANES && at == \at(at, Pre) + 4 * k;
        loop assigns k, at, rng->s[0 .. 3][0 .. PFL_RNG_LANES - 1];
        loop variant 4 * PFL_RNG_LANES - k; */
    for (uint32_t k = 0u; k < (4u * PFL_RNG_LANES); k++) {
        rng->s[k / PFL_RNG_LANES][k % PFL_RNG_LANES] = get_word(at);
        at += 4;
    }
    /*@ loop invariant k <= 4 && at == \at(at, Pre) + 4 * (4 * PFL_RNG_LANES + k);
        loop assigns k, at, rng->one[0 .. 3];
        loop variant 4 - k; */
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
    const size_t bytes = 4u * total_words(f);
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

/*@ requires shaped(f) && \valid_read(at + (0 .. (4 * HEAD_WORDS) - 1));
    assigns \nothing; */
static bool shape_fits(const pfl_t *f, const unsigned char *at)
{
    return (word_at(at, 0) == SNAPSHOT_MAGIC) && (word_at(at, 1) == SNAPSHOT_VERSION) &&
           (word_at(at, 2) == f->config->particles) && (word_at(at, 3) == f->config->states) &&
           (word_at(at, 4) == f->config->noises) && (word_at(at, 24) == f->config->moments);
}

/*@ assigns \nothing; */
static bool is_ratio(float x)
{
    return pfl_is_finite(x) && (x >= 0.0f);
}

/*@ requires shaped(f) && \valid_read(at + (0 .. (4 * HEAD_WORDS) - 1));
    assigns \nothing;
    ensures \result ==> word_of(at + 4 * 27) < f->config->particles; */
static bool numbers_fit(const pfl_t *f, const unsigned char *at)
{
    const float sum = float_at(at, 12);
    const float ess = float_at(at, 14);
    return pfl_is_finite(float_at(at, 11)) && pfl_is_finite(sum) && (sum > 0.0f) && is_ratio(float_at(at, 13)) &&
           (ess >= 1.0f) && (ess <= (float)f->config->particles) && (word_at(at, 15) <= MOMENTS_OVERFLOWED) &&
           (word_at(at, 16) <= 1u) && (word_at(at, 27) < f->config->particles);
}

/*@ requires shaped(f) && \valid_read(at + (0 .. (4 * HEAD_WORDS) - 1));
    assigns \nothing; */
static bool watch_fits(const pfl_t *f, const unsigned char *at)
{
    const uint32_t sensors = f->config->sensor_count;
    const bool known =
        (sensors == 32u) || ((word_at(at, 34) >> sensors) == 0u); /* whose last measurement was refused */
    return known && (word_at(at, 29) == tracked(f)) && (word_at(at, 32) <= (uint32_t)PFL_PHASE_SETTLING) &&
           pfl_is_finite(float_at(at, 41)) && is_ratio(float_at(at, 42));
}

/*@ requires shaped(f) && \valid_read(at + (0 .. (4 * TRACK_WORDS * tracks_of(f)) - 1));
    assigns \nothing; */
static bool tracks_are_good(const pfl_t *f, const unsigned char *at)
{
    /*@ loop invariant k <= tracks_of(f);
        loop assigns k;
        loop variant tracks_of(f) - k; */
    for (size_t k = 0u; k < tracked(f); k++) {
        if (!is_ratio(float_at(at, (k * TRACK_WORDS) + 2u))) {
            return false;
        }
    }
    return true;
}

/*@ requires n <= 0x10000000 && \valid_read(at + (0 .. (4 * n) - 1));
    assigns \nothing; */
static bool floats_are_finite(const unsigned char *at, size_t n)
{
    /*@ loop invariant k <= n;
        loop assigns k;
        loop variant n - k; */
    for (size_t k = 0u; k < n; k++) {
        if (!pfl_is_finite(float_at(at, k))) {
            return false;
        }
    }
    return true;
}

/* None above their top, and one that reaches it: without it all weights could be zero, and so could their sum. */
/*@ requires n <= PFL_PARTICLES_MAX && \valid_read(at + (0 .. (4 * n) - 1));
    assigns \nothing; */
static bool log_weights_fit(const unsigned char *at, uint32_t n, float top)
{
    bool reached = false;
    /*@ loop invariant i <= n;
        loop assigns i, reached;
        loop variant n - i; */
    for (size_t i = 0u; i < n; i++) {
        const float relative = float_at(at, i) - top;
        if (!(relative <= 0.0f)) {
            return false;
        }
        reached = reached || (relative >= 0.0f);
    }
    return reached;
}

/*@ requires shaped(f);
    requires \valid_read(at + (0 .. (4 * words(f->config->particles, f->config->states, tracks_of(f))) - 1));
    assigns \nothing; */
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

/*@ requires \valid(f) && \valid_read(at + (0 .. (4 * HEAD_WORDS) - 1));
    assigns f->t_us, f->reset_t_us, f->t_fused_us, f->log_weight_top, f->weight_sum, f->test_ratio, f->ess,
            f->moments_current, f->resample_pending, f->fused, f->rejected, f->faulted, f->resampled, f->quarantined,
            f->resets, f->overruns, f->redrawn, f->projected, f->best_index, f->mended, f->watched, f->scratch_is_weights;
    ensures f->best_index == \old(word_of(at + 4 * 27)); */
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

/*@ requires shaped(f) && \valid_read(at + (0 .. (4 * TRACK_WORDS * tracks_of(f)) - 1));
    assigns f->sensor[0 .. tracks_of(f) - 1];
    ensures \result == at + 4 * TRACK_WORDS * \old(tracks_of(f)); */
static const unsigned char *take_tracks(const pfl_t *f, const unsigned char *at)
{
    pfl_sensor_track_t *const tracks = f->sensor;
    const size_t count = tracked(f);
    /*@ loop invariant k <= count && at == \at(at, Pre) + 4 * TRACK_WORDS * k;
        loop assigns k, at, tracks[0 .. count - 1];
        loop variant count - k; */
    for (size_t k = 0u; k < count; k++) {
        pfl_sensor_track_t *track = &tracks[k];
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

/* A snapshot of this filter's shape, every word of it sane. */
/*@ requires shaped(f) && bytes == 4 * words(f->config->particles, f->config->states, tracks_of(f));
    requires \valid_read(at + (0 .. bytes - 1));
    assigns \nothing;
    ensures \result ==> word_of(at + 4 * 27) < f->config->particles; */
static bool is_good(const pfl_t *f, const unsigned char *at, size_t bytes)
{
    return shape_fits(f, at) && numbers_fit(f, at) && watch_fits(f, at) &&
           (get_word(at + (bytes - 4u)) == crc32(at, bytes - 4u)) && body_is_good(f, at);
}

/*@ requires shaped(f) && column(f->log_weight, f);
    requires \valid_read(at + (0 .. (4 * (moments_of(f->config->states) +
                                          f->config->particles * (f->config->states + 1))) - 1));
    requires \valid(f->mean + (0 .. moments_of(f->config->states) - 1));
    requires \valid(f->x + (0 .. (f->config->states * f->stride) - 1));
    assigns f->mean[0 .. 199], f->x[0 .. (f->config->states * f->stride) - 1], f->log_weight[0 .. f->stride - 1]; */
static void take_floats(const pfl_t *f, const unsigned char *at)
{
    const size_t states = f->config->states;
    const uint32_t count = f->config->particles;
    const unsigned char *next = get_floats(at, f->mean, moment_words(states));
    /*@ loop invariant d <= states;
        loop invariant next == at + 4 * moments_of(states) + 4 * (d * count);
        loop assigns d, next, f->x[0 .. (states * f->stride) - 1];
        loop variant states - d; */
    for (size_t d = 0u; d < states; d++) {
        /*@ assert fits(d, 1, states, f->stride); */
        /*@ assert fits(d, 1, states, count); */
        next = get_floats(next, &f->x[d * f->stride], count);
    }
    (void)get_floats(next, f->log_weight, count);
}

static pfl_status_t restore(pfl_t *f, const void *buffer, size_t buffer_bytes)
{
    if (buffer == NULL) {
        return PFL_ERR_ARG;
    }
    const unsigned char *at = (const unsigned char *)buffer;
    const size_t bytes = 4u * total_words(f);
    if ((buffer_bytes < bytes) || !is_good(f, at, bytes)) {
        return PFL_ERR_CORRUPT;
    }
    take_head(f, at);
    at = take_tracks(f, at + (4u * HEAD_WORDS));
    at = get_streams(at, &f->rng);
    pfl_weights_settle(f); /* the padding of the column, too */
    take_floats(f, at);
    return PFL_OK;
}

pfl_status_t pfl_restore(pfl_t *f, const void *buffer, size_t buffer_bytes)
{
    const pfl_status_t entered = pfl_begin(f);
    return (entered == PFL_OK) ? pfl_end(f, restore(f, buffer, buffer_bytes)) : entered;
}
