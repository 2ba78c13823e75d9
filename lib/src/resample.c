/* Resampling, exact in integers and in place.
 *
 * Weights become integers q_i, about 2e9 in all; their running sum c is exact, so neither order nor vector width can
 * matter, no offspring is lost and no index can leave the array. Survivors stay where they are; their surplus offspring
 * are copied onto the slots of those that leave none, and nothing else moves. The two weight columns, free by then, hold
 * what that takes.
 *
 * The evenly spaced points of the systematic scheme are never visited: point j lies below c when j < c N / S + v, so
 * the number of points below c is floor(c N / S + v) (Kitagawa 1996), taken in fixed point: (c M + V) >> F with
 * M 2^-F just above N / S. */
#include "core.h"

#include "rng_kernels.h"

#define QUANTA 2.0e9f

typedef struct {
    uint32_t factor;   /* M: 2^30 <= M < 2^31 */
    uint32_t fraction; /* F: 32 < F < 63 */
} comb_t;

/* M 2^-F >= count / total, by less than 2^-29 of it. 0 < count <= total. */
static comb_t comb_of(uint32_t count, uint32_t total)
{
    const uint64_t high = ((uint64_t)count << 31) / total;
    const uint64_t rest = ((uint64_t)count << 31) % total;
    uint64_t m = (high << 32) | ((rest << 32) / total); /* count 2^63 / total */
    uint32_t fraction = 63u;
    while (m >= (1ULL << 31)) {
        m >>= 1;
        fraction--;
    }
    m += 1u;
    if (m >= (1ULL << 31)) {
        m >>= 1;
        fraction--;
    }
    comb_t comb = {(uint32_t)m, fraction};
    return comb;
}

/* Weights to integers in the scratch column; returns their sum S, 0 < S < 2^31. */
static uint32_t quantise(pfl_t *f)
{
    const float scale = QUANTA / f->weight_sum;
    const uint32_t count = f->config->particles;
    float *column = f->scratch;
    uint32_t sum = 0u;
    for (uint32_t i = 0u; i < count; i++) {
        const uint32_t q = (uint32_t)(int32_t)(column[i] * scale);
        pfl_store_u32(&column[i], q);
        sum += q;
    }
    return sum;
}

/* ---- Schemes that go through the particles in order: free slots and surplus copies are listed on the way ---------- */

/* The k-th free slot is free[k], and the k-th copy beyond a particle's own place is of particle surplus[k]. `free` is
 * the scratch column behind the reader: the list is never longer than what has been read. */
typedef struct {
    float *free;
    float *surplus;
    uint32_t free_count;
    uint32_t surplus_count;
} lists_t;

static inline void list_offspring(lists_t *lists, uint32_t i, uint32_t offspring)
{
    pfl_store_u32(&lists->free[lists->free_count], i);
    lists->free_count += (offspring == 0u) ? 1u : 0u;
    pfl_store_u32(&lists->surplus[lists->surplus_count], i); /* stays only if there is a surplus: no branch */
    const uint32_t surplus = (offspring > 1u) ? (offspring - 1u) : 0u;
    for (uint32_t k = 1u; k < surplus; k++) {
        pfl_store_u32(&lists->surplus[lists->surplus_count + k], i);
    }
    lists->surplus_count += surplus;
}

static void copy_listed(pfl_t *f, const lists_t *lists)
{
    for (uint32_t d = 0u; d < f->config->states; d++) {
        float *x = &f->x[(size_t)d * f->stride];
        for (uint32_t k = 0u; k < lists->free_count; k++) {
            x[pfl_load_u32(&lists->free[k])] = x[pfl_load_u32(&lists->surplus[k])];
        }
    }
}

PFL_NOINLINE static void resample_systematic(pfl_t *f)
{
    const uint32_t count = f->config->particles;
    const comb_t comb = comb_of(count, quantise(f));
    const float *quanta = f->scratch;
    lists_t lists = {f->scratch, f->log_weight, 0u, 0u};
    uint64_t point = (uint64_t)pfl_xoshiro_next(f->rng.one) << (comb.fraction - 32u);
    uint32_t before = 0u;
    for (uint32_t i = 0u; i < count; i++) {
        point += (uint64_t)pfl_load_u32(&quanta[i]) * comb.factor;
        const uint32_t all = (uint32_t)(point >> comb.fraction);
        const uint32_t below = (all < count) ? all : count;
        list_offspring(&lists, i, below - before);
        before = below;
    }
    copy_listed(f, &lists);
}

PFL_NOINLINE static void resample_stratified(pfl_t *f)
{
    const uint32_t count = f->config->particles;
    const comb_t comb = comb_of(count, quantise(f));
    const float *quanta = f->scratch;
    lists_t lists = {f->scratch, f->log_weight, 0u, 0u};
    uint64_t reach = 0u;
    uint32_t before = 0u;
    uint32_t drawn = 0u; /* strata whose point is known: those below `drawn` */
    uint32_t offset = 0u;
    for (uint32_t i = 0u; i < count; i++) {
        reach += (uint64_t)pfl_load_u32(&quanta[i]) * comb.factor;
        const uint32_t stratum = (uint32_t)(reach >> comb.fraction);
        const uint32_t part = (uint32_t)(reach >> (comb.fraction - 32u));
        while ((drawn <= stratum) && (drawn < count)) {
            offset = pfl_xoshiro_next(f->rng.one);
            drawn++;
        }
        const uint32_t all = stratum + ((offset < part) ? 1u : 0u);
        const uint32_t below = (all < count) ? all : count;
        list_offspring(&lists, i, below - before);
        before = below;
    }
    copy_listed(f, &lists);
}

/* ---- Schemes that draw particles in any order: offspring are counted first, in the log-weight column -------------- */

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

/* Lists the free slots in the scratch column, and copies the surplus there. */
static void copy_counted(pfl_t *f)
{
    const uint32_t count = f->config->particles;
    uint32_t free_count = 0u;
    for (uint32_t i = 0u; i < count; i++) {
        pfl_store_u32(&f->scratch[free_count], i);
        free_count += (pfl_load_u32(&f->log_weight[i]) == 0u) ? 1u : 0u;
    }
    uint32_t used = 0u;
    for (uint32_t i = 0u; used < free_count; i++) {
        for (uint32_t more = pfl_load_u32(&f->log_weight[i]); more > 1u; more--) {
            const uint32_t slot = pfl_load_u32(&f->scratch[used]);
            for (uint32_t d = 0u; d < f->config->states; d++) {
                float *x = &f->x[(size_t)d * f->stride];
                x[slot] = x[i];
            }
            used++;
        }
    }
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

PFL_NOINLINE static void resample_multinomial(pfl_t *f)
{
    const uint32_t count = f->config->particles;
    uint32_t sum = 0u;
    (void)quantise(f);
    for (uint32_t i = 0u; i < count; i++) {
        sum += pfl_load_u32(&f->scratch[i]);
        pfl_store_u32(&f->scratch[i], sum);
        pfl_store_u32(&f->log_weight[i], 0u);
    }
    draw_independently(f, sum, count);
    copy_counted(f);
}

PFL_NOINLINE static void resample_residual(pfl_t *f)
{
    const uint32_t count = f->config->particles;
    const comb_t comb = comb_of(count, quantise(f)); /* shares sum to less than N + 1: copies never exceed N */
    uint32_t bits = 32u;
    while ((count >> (32u - bits)) != 0u) {
        bits--; /* 2^bits N <= 2^32: remainders of that many bits cannot overflow their sum */
    }
    uint32_t left = count;
    uint32_t rest = 0u;
    for (uint32_t i = 0u; i < count; i++) {
        const uint64_t share = (uint64_t)pfl_load_u32(&f->scratch[i]) * comb.factor;
        const uint32_t copies = (uint32_t)(share >> comb.fraction);
        left -= copies;
        rest += (uint32_t)(share >> (comb.fraction - 32u)) >> (32u - bits);
        pfl_store_u32(&f->log_weight[i], copies);
        pfl_store_u32(&f->scratch[i], rest);
    }
    if (rest != 0u) {
        draw_independently(f, rest, left);
    } else { /* remainders too small for their bits, N >= 65536 only: one more copy to the first that have some */
        for (uint32_t i = 0u; left > 0u; i++) {
            const uint32_t copies = pfl_load_u32(&f->log_weight[i]);
            const uint32_t more = (copies > 0u) ? 1u : 0u;
            pfl_store_u32(&f->log_weight[i], copies + more);
            left -= more;
        }
    }
    copy_counted(f);
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
        resample_stratified(f);
        break;
    case PFL_RESAMPLE_RESIDUAL:
        resample_residual(f);
        break;
    case PFL_RESAMPLE_MULTINOMIAL:
        resample_multinomial(f);
        break;
    case PFL_RESAMPLE_SYSTEMATIC:
    default:
        resample_systematic(f);
        break;
    }
    pfl_weights_equal(f);
    pfl_kernel_move(f);
    f->scratch_is_weights = 0u;
    f->resample_pending = 0u;
    pfl_count(&f->resampled, 1u);
    f->cycles_resample += pfl_meter_read(f) - start;
}
