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
#include "resample.h"

#include "rng_kernels.h"

#define QUANTA 2.0e9f
#define LANES 8u

PFL_NOINLINE comb_t pfl_comb_of(uint32_t count, uint32_t total)
{
    uint32_t shift = 29u;
    /*@ loop invariant 9 <= shift <= 29 && half < (1 << (shift - 9));
        loop assigns shift, half;
        loop variant shift; */
    for (uint32_t half = count / 2u; half != 0u; half /= 2u) {
        shift--;
    }
    uint32_t rest = count << shift; /* less than 2^30 */
    uint32_t factor = 0u;
    /*@ loop invariant bit <= 32;
        loop assigns bit, rest, factor;
        loop variant 32 - bit; */
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
/*@ requires sized(f) && column(f->scratch, f) && \valid(sums + (0 .. LANES - 1));
    assigns f->scratch[0 .. padded(f) - 1], sums[0 .. LANES - 1]; */
static void quantise(pfl_t *f, uint32_t *sums)
{
    memset(sums, 0, sizeof(uint32_t) * LANES);
    quantise_lanes(f->scratch, &f->scratch[pfl_padded(f)], QUANTA / f->weight_sum, sums);
}

/*@ requires \valid_read(sums + (0 .. LANES - 1));
    assigns \nothing; */
static uint32_t total_of(const uint32_t *sums)
{
    return ((sums[0] + sums[1]) + (sums[2] + sums[3])) + ((sums[4] + sums[5]) + (sums[6] + sums[7]));
}

uint32_t pfl_quantise(pfl_t *f)
{
    uint32_t sums[LANES];
    quantise(f, sums);
    return total_of(sums);
}

/* ---- Integer weights to offspring counts, both in the scratch column -------------------------------------------------- */

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
/*@ requires sized(f) && column(f->scratch, f) && \valid(f->lanes + (0 .. 2 * LANES - 1));
    requires \valid_read(comb) && comb->shift < 32 && \valid_read(sums + (0 .. LANES - 1));
    assigns f->scratch[0 .. padded(f) - 1], f->lanes[0 .. 2 * LANES - 1]; */
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
/*@ requires sized(f) && column(f->scratch, f) && \valid(f->lanes + (0 .. 2 * LANES - 1));
    requires \valid_read(comb) && comb->shift < 32 && \valid_read(sums + (0 .. LANES - 1));
    assigns f->scratch[0 .. padded(f) - 1], f->lanes[0 .. 2 * LANES - 1]; */
static void comb_lanes(pfl_t *f, const comb_t *comb, const uint32_t *sums, uint32_t start)
{
    const comb_t c = *comb;
    const uint32_t count = pfl_padded(f);
    float *const column = f->scratch;
    float *const end = &f->scratch[count];
    uint32_t reach = 0u;
    uint32_t before = 0u;
    (void)sums;
    /*@ loop invariant l <= LANES;
        loop assigns l, reach, before, column[0 .. count - 1];
        loop variant LANES - l; */
    for (uint32_t l = 0u; l < LANES; l++) {
        //@ ghost uint32_t i = l;
        /*@ loop invariant at == column + i && i % LANES == l && i <= count + l;
            loop assigns i, at, reach, before, column[0 .. count - 1];
            loop variant count + LANES - i; */
        for (float *at = &column[l]; at < end; at += LANES) {
            reach += pfl_load_u32(at);
            const uint32_t below = (height(c.factor, reach) + start) >> c.shift;
            pfl_store_u32(at, below - before);
            before = below;
            //@ ghost i += LANES;
        }
    }
}
#endif

/*@ requires sized(f) && column(f->scratch, f) && \valid(f);
    requires \valid(f->lanes + (0 .. 2 * LANES - 1));
    assigns f->scratch[0 .. padded(f) - 1], f->lanes[0 .. 2 * LANES - 1], f->rng.one[0 .. 3]; */
void pfl_systematic(pfl_t *f)
{
    uint32_t sums[LANES];
    quantise(f, sums);
    const comb_t comb = pfl_comb_of(f->config->particles, total_of(sums));
    comb_lanes(f, &comb, sums, pfl_xoshiro_next(f->rng.one) >> (32u - comb.shift));
}

/* ---- Offspring counts to copies --------------------------------------------------------------------------------------- */

/* n == 0 and n <= 1 as numbers, n < 2^31, as the processor adds them with least effort and no branch. */
/*@ assigns \nothing;
    ensures \result <= 1; */
static inline uint32_t is_none(uint32_t n)
{
#if defined(__arm__)
    return (n - 1u) >> 31;
#else
    return (uint32_t)(n < 1u);
#endif
}

/*@ assigns \nothing;
    ensures \result <= 1; */
static inline uint32_t is_few(uint32_t n)
{
#if defined(__arm__)
    return (n - 2u) >> 31;
#else
    return (uint32_t)((n >> 1) < 1u);
#endif
}

/* What is to be moved: `slots` particles leave no offspring, `parents` leave more than one. */
typedef struct {
    uint32_t slots;
    uint32_t parents;
} moves_t;

/*@ predicate listed{L}(float *list, integer count, integer slots, integer parents) =
      0 <= slots <= count && 0 <= parents <= count &&
      (\forall integer k; 0 <= k < slots ==> 0 <= bits_of(list[k]) < count) &&
      (\forall integer k; count - parents <= k < count ==> 0 <= bits_of(list[k]) < count); */

/* Slots without offspring, from the front of a list, and parents with more than one, from its end. Particle i finds at
 * most i entries: both stores fit, and where they hit the same place they store the same, so that neither needs a
 * branch. */
/*@ requires 0 < count <= PFL_PARTICLES_MAX + 7 && count % LANES == 0;
    requires \valid_read(offspring + (0 .. count - 1)) && \valid(list + (0 .. count - 1));
    assigns list[0 .. count - 1];
    ensures listed(list, count, \result.slots, \result.parents); */
PFL_NOINLINE static moves_t list_moves(const float *restrict offspring, float *restrict list, uint32_t count)
{
    float *last = &list[count - 1u]; /* where a parent goes if all before were parents */
    size_t slots = 0u;
    size_t others = 0u; /* no parents */
    /*@ loop invariant i <= count && i % LANES == 0 && slots <= i && others <= i;
        loop invariant last == list + (count - 1 - i) && offspring == \at(offspring, Pre) + i;
        loop invariant listed(list, count, slots, i - others);
        loop assigns i, slots, others, last, offspring, list[0 .. count - 1];
        loop variant count - i; */
    for (uint32_t i = 0u; i < count; i += LANES) {
        /*@ loop invariant l <= LANES && slots <= i + l && others <= i + l;
            loop invariant listed(list, count, slots, i + l - others);
            loop assigns l, slots, others, list[0 .. count - 1];
            loop variant LANES - l; */
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
    const moves_t moves = {(uint32_t)slots, count - (uint32_t)others};
    return moves;
}

/* Writes four states of all parents to the slots of their copies: the column at `a` and those `near`, `far` and both
 * further on. Offspring sum to N, so that the last copy fills the last slot; should memory be damaged, no copy goes
 * beyond it: a count too large ends the copying. */
/*@ requires sized(f) && column(f->scratch, f) && column(f->log_weight, f) && near <= f->stride && far <= 2 * f->stride;
    requires \valid(a + (0 .. near + far + f->stride - 1)) && listed(f->log_weight, padded(f), moves.slots, moves.parents);
    requires \separated(a + (0 .. near + far + f->stride - 1), f->log_weight + (0 .. f->stride - 1));
    assigns a[0 .. near + far + f->stride - 1];
    ensures listed(f->log_weight, padded(f), moves.slots, moves.parents); */
static void copy_four_states(const pfl_t *f, float *a, size_t near, size_t far, moves_t moves)
{
    const float *const offspring = f->scratch;
    const float *const list = f->log_weight;
    const float *slot = list;
    const float *parent = &list[pfl_padded(f)];
    uint32_t room = moves.slots;
    float *const b = a + near;
    float *const c = a + far;
    float *const d = c + near;
    /*@ loop invariant k <= moves.parents && room <= moves.slots;
        loop invariant parent == list + (padded(f) - k) && slot == list + (moves.slots - room);
        loop invariant listed(f->log_weight, padded(f), moves.slots, moves.parents);
        loop assigns k, slot, parent, room, a[0 .. near + far + f->stride - 1];
        loop variant moves.parents - k; */
    for (uint32_t k = 0u; k < moves.parents; k++) {
        parent--;
        const uint32_t from = pfl_load_u32(parent);
        /*@ assert from < padded(f); */
        const uint32_t ua = pfl_load_u32(&a[from]);
        const uint32_t ub = pfl_load_u32(&b[from]);
        const uint32_t uc = pfl_load_u32(&c[from]);
        const uint32_t ud = pfl_load_u32(&d[from]);
        const uint32_t more = pfl_load_u32(&offspring[from]) - 2u; /* copies after the first */
        if (more >= room) {
            break;
        }
        //@ ghost uint32_t i = moves.slots - room;
        room -= more + 1u;
        const float *const stop = slot + (more + 1u);
        /*@ loop invariant i < moves.slots - room && slot == list + i;
            loop invariant listed(f->log_weight, padded(f), moves.slots, moves.parents);
            loop assigns i, slot, a[0 .. near + far + f->stride - 1];
            loop variant (moves.slots - room) - i; */
        do {
            const uint32_t to = pfl_load_u32(slot);
            /*@ assert to < padded(f); */
            pfl_store_u32(&a[to], ua);
            pfl_store_u32(&b[to], ub);
            pfl_store_u32(&c[to], uc);
            pfl_store_u32(&d[to], ud);
            slot++;
            //@ ghost i++;
        } while (slot != stop);
    }
}

/* Four columns at a time; where fewer are left some are written again, with the same. */
/*@ requires sized(f) && column(f->scratch, f) && column(f->log_weight, f);
    requires 1 <= f->config->states <= PFL_STATES_MAX && \valid(f->x + (0 .. (f->config->states * f->stride) - 1));
    requires \separated(f->x + (0 .. (f->config->states * f->stride) - 1), f->log_weight + (0 .. f->stride - 1));
    assigns f->scratch[0 .. f->stride - 1], f->log_weight[0 .. f->stride - 1], f->x[0 .. (f->config->states * f->stride) - 1]; */
PFL_NOINLINE static void copy_surplus(pfl_t *f)
{
    const uint32_t count = pfl_padded(f);
    /*@ loop invariant f->config->particles <= i <= count;
        loop assigns i, f->scratch[0 .. f->stride - 1];
        loop variant count - i; */
    for (uint32_t i = f->config->particles; i < count; i++) {
        pfl_store_u32(&f->scratch[i], 1u); /* padding stays as it is */
    }
    const moves_t moves = list_moves(f->scratch, f->log_weight, count);
    if ((moves.slots + moves.parents) > f->config->particles) {
        return; /* damaged counts: the lists may have run into each other, and hold the padding */
    }
    const uint32_t states = f->config->states;
    const uint32_t near = (states > 1u) ? 1u : 0u;
    const uint32_t far = (states > 3u) ? 2u : (states - 1u - near);
    /*@ loop invariant d <= states + 3 && (d == 0 || 4 <= d) && listed(f->log_weight, padded(f), moves.slots, moves.parents);
        loop assigns d, f->x[0 .. (f->config->states * f->stride) - 1];
        loop variant states + 3 - d; */
    for (uint32_t d = 0u; d < states; d += 4u) {
        const uint32_t from = ((d > 0u) && ((states - d) < 4u)) ? (states - 4u) : d;
        /*@ assert fits(from, near + far + 1, f->config->states, f->stride); */
        copy_four_states(f, &f->x[(size_t)from * f->stride], (size_t)near * f->stride, (size_t)far * f->stride, moves);
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
    if (f->config->resampling != NULL) {
        f->config->resampling(f);
    } else {
        pfl_systematic(f);
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
