/* Resampling, exact in integers and in place.
 *
 * Weights become integers q_i with the sum S, 2^30 < S < 2^31, so neither order nor vector width can matter. A scheme
 * turns them into offspring counts, which sum to N exactly: no index can leave the array. Survivors stay where they
 * are; the surplus offspring are copied onto the slots of those that leave none, and nothing else moves.
 *
 * The evenly spaced points of the systematic scheme are never visited (Kitagawa 1996): the number of points below the
 * running sum c is floor(c N / S + v), v in [0, 1), here
 *
 *     below(c) = (h(c) + V) >> F,    h(c) = floor(c M / 2^32),    M = ceil(n 2^32 / S),    n = N 2^F,
 *
 * with V a random number of F bits. h and with it below() never falls. h(0) = 0, so nothing is below a sum of zero. As
 * n 2^32 <= S M < n 2^32 + S and S < 2^32, h(S) = n: exactly N points lie below the whole sum, whatever V, and no
 * rounding is left to be clamped. A particle without weight does not move c and gets nothing. The mean of below(c) over
 * the 2^F equally likely V is h(c) / 2^F, which is c N / S to within 2^-F: with F = 29 - floor(log2 N) every expected
 * count is right to 2^-28 N, 1e-6 of an offspring at N = 300. */
#include "core.h"

#include "rng_kernels.h"

#define QUANTA 2.0e9f
#define LANES 8u

typedef struct {
    uint32_t factor; /* M */
    uint32_t shift;  /* F */
} comb_t;

/* 0 < count <= 2^20, 2^30 < total < 2^31. */
PFL_NOINLINE static comb_t comb_of(uint32_t count, uint32_t total)
{
    uint32_t shift = 29u;
    while ((count >> (30u - shift)) != 0u) {
        shift--;
    }
    uint32_t rest = count << shift; /* less than 2^30 */
    uint32_t factor = 0u;
    for (uint32_t bit = 0u; bit < 32u; bit++) { /* division by hand: 64 bits are a library call on small cores */
        rest <<= 1;
        factor <<= 1;
        if (rest >= total) {
            rest -= total;
            factor |= 1u;
        }
    }
    comb_t comb = {factor + ((rest > 0u) ? 1u : 0u), shift};
    return comb;
}

/* h(c) */
static inline uint32_t height(uint32_t factor, uint32_t c)
{
    return (uint32_t)(((uint64_t)c * factor) >> 32);
}

/* Loops over eight lanes at a moving address, a step at a time: so gcc makes vectors of them, and as well as anything of
 * their unrolled form on a core without. */

/* Weights to integers, padding (zeros) included; adds those of particles i mod 8. */
PFL_NOINLINE static void quantise_lanes(float *column, const float *end, float scale, uint32_t *sums)
{
    uint32_t sum[LANES];
    PFL_COPY(sum, sums, sizeof sum);
    for (float *at = column; at < end; at += LANES) {
        for (uint32_t l = 0u; l < LANES; l++) {
            pfl_store_u32(&at[l], (uint32_t)(int32_t)(at[l] * scale));
        }
        for (uint32_t l = 0u; l < LANES; l++) {
            sum[l] += pfl_load_u32(&at[l]);
        }
    }
    PFL_COPY(sums, sum, sizeof sum);
}

/* The weights in the scratch column to integers. Their sum misses QUANTA by the rounding of weight_sum, at most
 * N / 8 + 3 steps of 2^-24, and one for each particle: 1 %. */
static void quantise(pfl_t *f, uint32_t *sums)
{
    memset(sums, 0, sizeof(uint32_t) * LANES);
    quantise_lanes(f->scratch, &f->scratch[pfl_padded(f)], QUANTA / f->weight_sum, sums);
}

static uint32_t total_of(const uint32_t *sums)
{
    return ((sums[0] + sums[1]) + (sums[2] + sums[3])) + ((sums[4] + sums[5]) + (sums[6] + sums[7]));
}

/* ---- Schemes: integer weights to offspring counts, both in the scratch column ---------------------------------------- */

/* The order of the particles on the comb is free. It is by lanes: first those with i mod 8 = 0, then 1, and so on. A
 * vector runs through all lanes at once, each from where the one before ends; without vectors one lane after the other
 * keeps its sum in a register. The same counts either way. */
#if defined(__SSE2__) || defined(__ARM_NEON)
PFL_NOINLINE static void comb_vectors(float *column, const float *end, uint32_t factor, uint32_t shift, uint32_t start,
                                      float *lanes)
{
    uint32_t reach[LANES];
    uint32_t before[LANES];
    PFL_COPY(reach, lanes, sizeof reach);
    PFL_COPY(before, &lanes[LANES], sizeof before);
    for (float *at = column; at < end; at += LANES) {
        uint32_t below[LANES];
        for (uint32_t l = 0u; l < LANES; l++) {
            reach[l] += pfl_load_u32(&at[l]);
        }
        for (uint32_t l = 0u; l < LANES; l++) {
            below[l] = (height(factor, reach[l]) + start) >> shift;
        }
        for (uint32_t l = 0u; l < LANES; l++) {
            pfl_store_u32(&at[l], below[l] - before[l]);
        }
        for (uint32_t l = 0u; l < LANES; l++) {
            before[l] = below[l];
        }
    }
    PFL_COPY(lanes, reach, sizeof reach);
    PFL_COPY(&lanes[LANES], before, sizeof before);
}

/* In the lanes of the moments, free by now, lie the sum where each lane begins and the points below it. In memory that
 * outlives the call: what comb_vectors writes back keeps gcc's vectors together. */
static void comb_lanes(pfl_t *f, const comb_t *comb, const uint32_t *sums, uint32_t start)
{
    uint32_t sum = 0u;
    for (uint32_t l = 0u; l < LANES; l++) {
        pfl_store_u32(&f->lanes[l], sum);
        pfl_store_u32(&f->lanes[LANES + l], (height(comb->factor, sum) + start) >> comb->shift);
        sum += sums[l];
    }
    comb_vectors(f->scratch, &f->scratch[pfl_padded(f)], comb->factor, comb->shift, start, f->lanes);
}
#else
static void comb_lanes(pfl_t *f, const comb_t *comb, const uint32_t *sums, uint32_t start)
{
    const comb_t c = *comb;
    float *const column = f->scratch;
    const float *const end = &f->scratch[pfl_padded(f)];
    uint32_t reach = 0u;
    uint32_t before = 0u;
    (void)sums;
    for (uint32_t l = 0u; l < LANES; l++) {
        for (float *at = &column[l]; at < end; at += LANES) {
            reach += pfl_load_u32(at);
            const uint32_t below = (height(c.factor, reach) + start) >> c.shift;
            pfl_store_u32(at, below - before);
            before = below;
        }
    }
}
#endif

PFL_NOINLINE static void count_systematic(pfl_t *f)
{
    uint32_t sums[LANES];
    quantise(f, sums);
    const comb_t comb = comb_of(f->config->particles, total_of(sums));
    comb_lanes(f, &comb, sums, pfl_xoshiro_next(f->rng.one) >> (32u - comb.shift));
}

/* The same with a V of its own for the point of each stratum k <= c N / S < k + 1. */
PFL_NOINLINE static void count_stratified(pfl_t *f)
{
    const uint32_t count = f->config->particles;
    uint32_t sums[LANES];
    quantise(f, sums);
    const comb_t comb = comb_of(count, total_of(sums));
    uint32_t reach = 0u;
    uint32_t before = 0u;
    uint32_t drawn = 0u; /* strata whose V is known: those below `drawn` */
    uint32_t start = 0u;
    for (uint32_t i = 0u; i < count; i++) {
        reach += pfl_load_u32(&f->scratch[i]);
        const uint32_t high = height(comb.factor, reach);
        while ((drawn <= (high >> comb.shift)) && (drawn < count)) {
            start = pfl_xoshiro_next(f->rng.one) >> (32u - comb.shift);
            drawn++;
        }
        const uint32_t below = (high + start) >> comb.shift;
        pfl_store_u32(&f->scratch[i], below - before);
        before = below;
    }
}

/* Two schemes draw particles in any order: their counts grow in the log-weight column, while the scratch column holds
 * running sums; then the columns change places. */
static void exchange_columns(pfl_t *f)
{
    float *counts = f->log_weight;
    f->log_weight = f->scratch;
    f->scratch = counts;
}

/* First particle whose running sum exceeds u. */
static uint32_t search(const pfl_t *f, uint32_t u)
{
    uint32_t low = 0u;
    uint32_t high = f->config->particles - 1u;
    while (low < high) {
        const uint32_t middle = low + ((high - low) / 2u);
        if (pfl_load_u32(&f->scratch[middle]) > u) {
            high = middle;
        } else {
            low = middle + 1u;
        }
    }
    return low;
}

/* Adds `draws` independent draws from the running sums to the counts. */
static void draw_independently(pfl_t *f, uint32_t total, uint32_t draws)
{
    for (uint32_t k = 0u; k < draws; k++) {
        const uint64_t r = pfl_xoshiro_next(f->rng.one);
        const uint32_t i = search(f, (uint32_t)((r * total) >> 32));
        pfl_store_u32(&f->log_weight[i], pfl_load_u32(&f->log_weight[i]) + 1u);
    }
}

PFL_NOINLINE static void count_multinomial(pfl_t *f)
{
    const uint32_t count = f->config->particles;
    uint32_t sums[LANES];
    uint32_t sum = 0u;
    quantise(f, sums);
    for (uint32_t i = 0u; i < count; i++) {
        sum += pfl_load_u32(&f->scratch[i]);
        pfl_store_u32(&f->scratch[i], sum);
        pfl_store_u32(&f->log_weight[i], 0u);
    }
    draw_independently(f, sum, count);
    exchange_columns(f);
}

/* One more copy to the first particles that have some. */
static void give_away(pfl_t *f, uint32_t left)
{
    for (uint32_t i = 0u; left > 0u; i++) {
        const uint32_t copies = pfl_load_u32(&f->log_weight[i]);
        const uint32_t more = (copies > 0u) ? 1u : 0u;
        pfl_store_u32(&f->log_weight[i], copies + more);
        left -= more;
    }
}

PFL_NOINLINE static void count_residual(pfl_t *f)
{
    const uint32_t count = f->config->particles;
    uint32_t sums[LANES];
    quantise(f, sums);
    const comb_t comb = comb_of(count, total_of(sums)); /* shares q M sum to less than N + 1: copies never exceed N */
    uint32_t bits = 32u;
    while ((count >> (32u - bits)) != 0u) {
        bits--; /* 2^bits N <= 2^32: remainders of that many bits cannot overflow their sum */
    }
    uint32_t left = count;
    uint32_t rest = 0u;
    for (uint32_t i = 0u; i < count; i++) {
        const uint64_t share = ((uint64_t)pfl_load_u32(&f->scratch[i]) * comb.factor) >> comb.shift;
        const uint32_t copies = (uint32_t)(share >> 32);
        left -= copies;
        rest += (uint32_t)share >> (32u - bits);
        pfl_store_u32(&f->log_weight[i], copies);
        pfl_store_u32(&f->scratch[i], rest);
    }
    if (rest != 0u) {
        draw_independently(f, rest, left);
    } else { /* remainders too small for their bits, N >= 65536 only */
        give_away(f, left);
    }
    exchange_columns(f);
}

/* ---- Offspring counts to copies --------------------------------------------------------------------------------------- */

/* n == 0 and n <= 1 as numbers, n < 2^31, as the processor adds them with least effort and no branch. */
static inline uint32_t is_none(uint32_t n)
{
#if defined(__arm__)
    return (n - 1u) >> 31;
#else
    return (uint32_t)(n < 1u);
#endif
}

static inline uint32_t is_few(uint32_t n)
{
#if defined(__arm__)
    return (n - 2u) >> 31;
#else
    return (uint32_t)((n >> 1) < 1u);
#endif
}

/* Slots without offspring, from the front of a list, and parents with more than one, from its end. Particle i finds at
 * most i entries: both stores fit, and where they hit the same place they store the same, so that neither needs a
 * branch. Returns the number of parents. */
PFL_NOINLINE static uint32_t list_moves(const float *restrict offspring, float *restrict list, uint32_t count)
{
    float *last = &list[count - 1u]; /* where a parent goes if all before were parents */
    size_t slots = 0u;
    size_t others = 0u; /* no parents */
    for (uint32_t i = 0u; i < count; i += LANES) {
        for (uint32_t l = 0u; l < LANES; l++) {
            const uint32_t n = pfl_load_u32(&offspring[l]);
            pfl_store_u32(&list[slots], i + l);
            pfl_store_u32(&(last - l)[others], i + l);
            slots += is_none(n);
            others += is_few(n);
        }
        last -= LANES;
        offspring += LANES;
    }
    return count - (uint32_t)others;
}

/* Writes one state of all parents to the slots of their copies. */
static void copy_state(const pfl_t *f, float *x, uint32_t parents)
{
    const float *const offspring = f->scratch;
    const float *slot = f->log_weight;
    const float *parent = &f->log_weight[pfl_padded(f)];
    for (uint32_t k = 0u; k < parents; k++) {
        parent--;
        const uint32_t from = pfl_load_u32(parent);
        const uint32_t u = pfl_load_u32(&x[from]);
        for (uint32_t n = pfl_load_u32(&offspring[from]); n > 1u; n--) {
            pfl_store_u32(&x[pfl_load_u32(slot)], u);
            slot++;
        }
    }
}

/* The same for four states at a time, which finds each slot but once. */
static void copy_four_states(const pfl_t *f, float *a, uint32_t parents)
{
    const float *const offspring = f->scratch;
    const float *slot = f->log_weight;
    const float *parent = &f->log_weight[pfl_padded(f)];
    float *b = a + f->stride;
    float *c = b + f->stride;
    float *d = c + f->stride;
    for (uint32_t k = 0u; k < parents; k++) {
        parent--;
        const uint32_t from = pfl_load_u32(parent);
        const uint32_t ua = pfl_load_u32(&a[from]);
        const uint32_t ub = pfl_load_u32(&b[from]);
        const uint32_t uc = pfl_load_u32(&c[from]);
        const uint32_t ud = pfl_load_u32(&d[from]);
        for (uint32_t n = pfl_load_u32(&offspring[from]); n > 1u; n--) {
            const uint32_t to = pfl_load_u32(slot);
            pfl_store_u32(&a[to], ua);
            pfl_store_u32(&b[to], ub);
            pfl_store_u32(&c[to], uc);
            pfl_store_u32(&d[to], ud);
            slot++;
        }
    }
}

PFL_NOINLINE static void copy_surplus(pfl_t *f)
{
    for (uint32_t i = f->config->particles; i < pfl_padded(f); i++) {
        pfl_store_u32(&f->scratch[i], 1u); /* padding stays as it is */
    }
    const uint32_t parents = list_moves(f->scratch, f->log_weight, pfl_padded(f));
    uint32_t d = 0u;
    for (; (d + 4u) <= f->config->states; d += 4u) {
        copy_four_states(f, &f->x[(size_t)d * f->stride], parents);
    }
    for (; d < f->config->states; d++) {
        copy_state(f, &f->x[(size_t)d * f->stride], parents);
    }
}

bool pfl_resample_is_due(const pfl_t *f)
{
    const float ratio = f->config->ess_ratio;
    return (ratio >= 1.0f) || (f->ess < (ratio * (float)f->config->particles));
}

void pfl_resample_now(pfl_t *f)
{
    const uint32_t start = pfl_meter_read(f);
    switch ((pfl_resampling_t)f->config->resampling) {
    case PFL_RESAMPLE_STRATIFIED:
        count_stratified(f);
        break;
    case PFL_RESAMPLE_RESIDUAL:
        count_residual(f);
        break;
    case PFL_RESAMPLE_MULTINOMIAL:
        count_multinomial(f);
        break;
    default: /* PFL_RESAMPLE_SYSTEMATIC */
        count_systematic(f);
        break;
    }
    copy_surplus(f);
    pfl_weights_equal(f);
    if (f->config->kernel != NULL) {
        f->config->kernel->move(f);
    }
    f->scratch_is_weights = 0u;
    f->resample_pending = 0u;
    pfl_count(&f->resampled, 1u);
    f->watched.event |= PFL_EVENT_RESAMPLED;
    f->cycles_resample += pfl_meter_read(f) - start;
}
