/* Resampling, exact in integers and in place.
 *
 * Weights become integers q_i, about 2e9 in all; their running sum c is exact, so neither order nor vector width can
 * matter and no index can leave the array. Each scheme turns c into offspring counts that add up to N; survivors are
 * then copied onto the slots of those that leave none, and nothing else moves. The scratch column holds weights, then
 * the running sum, then the list of free slots; the log-weight column holds the counts, before it becomes equal
 * weights.
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
    while (m >= (1ull << 31)) {
        m >>= 1;
        fraction--;
    }
    m += 1u;
    if (m >= (1ull << 31)) {
        m >>= 1;
        fraction--;
    }
    comb_t comb = {(uint32_t)m, fraction};
    return comb;
}

/* Weights to running sums in the scratch column; returns the total S, 0 < S < 2^31. */
static uint32_t accumulate(pfl_t *f)
{
    const float scale = QUANTA / f->weight_sum;
    const uint32_t count = f->config->particles;
    float *column = f->scratch;
    uint32_t sum = 0u;
    for (uint32_t i = 0u; i < count; i++) {
        sum += (uint32_t)(int32_t)(column[i] * scale);
        pfl_store_u32(&column[i], sum);
    }
    return sum;
}

static void count_systematic(pfl_t *f)
{
    const uint32_t count = f->config->particles;
    const comb_t comb = comb_of(count, accumulate(f));
    const uint64_t offset = (uint64_t)pfl_xoshiro_next(f->rng.one) << (comb.fraction - 32u);
    const float *sums = f->scratch;
    float *offspring = f->log_weight;
    uint32_t before = 0u;
    for (uint32_t i = 0u; i < count; i++) {
        const uint64_t point = ((uint64_t)pfl_load_u32(&sums[i]) * comb.factor) + offset;
        const uint32_t all = (uint32_t)(point >> comb.fraction);
        const uint32_t below = (all < count) ? all : count;
        pfl_store_u32(&offspring[i], below - before);
        before = below;
    }
}

static void count_stratified(pfl_t *f)
{
    const uint32_t count = f->config->particles;
    const comb_t comb = comb_of(count, accumulate(f));
    uint32_t before = 0u;
    uint32_t drawn = 0u; /* strata whose point is known: those below `drawn` */
    uint32_t offset = 0u;
    for (uint32_t i = 0u; i < count; i++) {
        const uint64_t reach = (uint64_t)pfl_load_u32(&f->scratch[i]) * comb.factor;
        const uint32_t stratum = (uint32_t)(reach >> comb.fraction);
        const uint32_t part = (uint32_t)(reach >> (comb.fraction - 32u));
        while ((drawn <= stratum) && (drawn < count)) {
            offset = pfl_xoshiro_next(f->rng.one);
            drawn++;
        }
        const uint32_t all = stratum + ((offset < part) ? 1u : 0u);
        const uint32_t below = (all < count) ? all : count;
        pfl_store_u32(&f->log_weight[i], below - before);
        before = below;
    }
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

static void count_multinomial(pfl_t *f)
{
    const uint32_t total = accumulate(f);
    for (uint32_t i = 0u; i < f->config->particles; i++) {
        pfl_store_u32(&f->log_weight[i], 0u);
    }
    draw_independently(f, total, f->config->particles);
}

static void count_residual(pfl_t *f)
{
    const uint32_t count = f->config->particles;
    const comb_t comb = comb_of(count, accumulate(f)); /* shares sum to less than N + 1: copies never exceed N */
    uint32_t bits = 32u;
    while ((count >> (32u - bits)) != 0u) {
        bits--; /* 2^bits N <= 2^32: remainders of that many bits cannot overflow their sum */
    }
    uint32_t left = count;
    uint32_t before = 0u;
    uint32_t rest = 0u;
    for (uint32_t i = 0u; i < count; i++) {
        const uint32_t sum = pfl_load_u32(&f->scratch[i]);
        const uint64_t share = (uint64_t)(sum - before) * comb.factor;
        const uint32_t copies = (uint32_t)(share >> comb.fraction);
        before = sum;
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
}

/* Lists the slots of particles without offspring in the scratch column; returns how many. */
static uint32_t list_free_slots(pfl_t *f)
{
    const uint32_t count = f->config->particles;
    const float *offspring = f->log_weight;
    float *list = f->scratch;
    uint32_t slots = 0u;
    for (uint32_t i = 0u; i < count; i++) {
        pfl_store_u32(&list[slots], i);
        slots += (pfl_load_u32(&offspring[i]) == 0u) ? 1u : 0u;
    }
    return slots;
}

/* Copies the surplus offspring onto the free slots. */
static void fill_free_slots(pfl_t *f, uint32_t slots)
{
    const uint32_t states = f->config->states;
    const size_t stride = f->stride;
    const float *offspring = f->log_weight;
    const float *list = f->scratch;
    uint32_t used = 0u;
    for (uint32_t i = 0u; used < slots; i++) {
        for (uint32_t more = pfl_load_u32(&offspring[i]); more > 1u; more--) {
            float *x = f->x;
            const uint32_t slot = pfl_load_u32(&list[used]);
            for (uint32_t d = 0u; d < states; d++) {
                x[slot] = x[i];
                x += stride;
            }
            used++;
        }
    }
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
    case PFL_RESAMPLE_SYSTEMATIC:
    default:
        count_systematic(f);
        break;
    }
    fill_free_slots(f, list_free_slots(f));
    pfl_weights_equal(f);
    pfl_kernel_move(f);
    f->scratch_is_weights = 0u;
    f->resample_pending = 0u;
    pfl_count(&f->resampled, 1u);
    f->cycles_resample += pfl_meter_read(f) - start;
}
