/* The number of particles as a variable: adaptive.h tells by what.
 *
 * A filter of n particles in a larger arena is laid out as pfl_init would for n, so that nothing else in the library knows
 * the difference. A change of N is a resampling: offspring counts that sum to the new N, their parents moved together to
 * the front, the columns to their new places, and the further copies behind the parents. */
#include "pflight/adaptive.h"

#include "guard.h"
#include "math_kernels.h"
#include "parents.h"
#include "resample.h"
#include "rng_kernels.h"
#include "sqrt_kernel.h"

#define FORGET 0.0625f /* of the worst rate, a resampling */
#define CELL_LIMIT 1.0e9f

/* ---- Places -------------------------------------------------------------------------------------------------------- */

/* Where the parts of the arena lie that depend on N. */
typedef struct {
    size_t stride;
    float *low, *high; /* the weight columns */
    float *sensor;
    float *retry;
} places_t;

static places_t places_of(const pfl_t *f, uint32_t n)
{
    places_t p;
    p.stride = PFL_STRIDE(n);
    p.low = f->x + (p.stride * f->config->states);
    p.high = p.low + p.stride + PFL_CANARY_FLOATS;
    p.sensor = p.high + p.stride + PFL_CANARY_FLOATS;
    p.retry = p.sensor;
    if (f->sensor != NULL) {
        p.retry += PFL_WATCH_BYTES(f->config->sensor_count) / sizeof(float);
    }
    return p;
}

static void move_states(const pfl_t *f, const places_t *to, uint32_t parents)
{
    const uint32_t states = f->config->states;
    for (uint32_t k = 0u; k < states; k++) {
        const size_t d = (to->stride < f->stride) ? k : (states - 1u - k);
        memmove(&f->x[d * to->stride], &f->x[d * f->stride], sizeof(float) * parents);
    }
}

static void move_tracks(const pfl_t *f, const places_t *to)
{
    if (f->sensor != NULL) {
        memmove(to->sensor, f->sensor, PFL_WATCH_BYTES(f->config->sensor_count));
    }
}

/* The first `parents` of every state, and their counts, to the places for another N: outwards from the end, inwards from
 * the front. */
static void move_columns(pfl_t *f, uint32_t parents, uint32_t n)
{
    const places_t to = places_of(f, n);
    if (to.stride < f->stride) {
        move_states(f, &to, parents);
        memmove(to.high, f->scratch, sizeof(float) * parents);
        move_tracks(f, &to);
    } else {
        move_tracks(f, &to);
        memmove(to.high, f->scratch, sizeof(float) * parents);
        move_states(f, &to, parents);
    }
    f->stride = (uint32_t)to.stride;
    f->log_weight = to.low;
    f->scratch = to.high;
    f->sensor = (f->sensor != NULL) ? (pfl_sensor_track_t *)(void *)to.sensor : NULL;
    f->retry = (f->retry != NULL) ? to.retry : NULL;
}

/* ---- Resampling into another N ---------------------------------------------------------------------------------------- */

/* Integer weights in the scratch column to offspring counts there, n in all; parents' counts move to the front, and their
 * indices into the log-weight column. Returns how many parents there are. */
static uint32_t list_parents(pfl_t *f, uint32_t total, uint32_t n)
{
    const comb_t comb = pfl_comb_of(n, total);
    const uint32_t start = pfl_xoshiro_next(f->rng.one) >> (32u - comb.shift);
    uint32_t reach = 0u;
    uint32_t before = 0u;
    uint32_t parents = 0u;
    for (uint32_t i = 0u; i < f->config->particles; i++) {
        reach += pfl_load_u32(&f->scratch[i]);
        const uint32_t below = (height(comb.factor, reach) + start) >> comb.shift;
        if (below > before) {
            pfl_store_u32(&f->scratch[parents], below - before);
            pfl_store_u32(&f->log_weight[parents], i);
            parents++;
        }
        before = below;
    }
    return parents;
}

/* What lies behind the last particle of a column weighs nothing, but is multiplied. */
static void pad(const pfl_t *f, uint32_t n)
{
    for (uint32_t d = 0u; d < f->config->states; d++) {
        memset(&f->x[((size_t)d * f->stride) + n], 0, sizeof(float) * (f->stride - n));
    }
}

/* Integer weights, which sum to `total`, to n particles of equal weight. */
static void resample_into(pfl_t *f, pfl_adaptive_t *a, uint32_t total, uint32_t n)
{
    const uint32_t parents = list_parents(f, total, n);
    pfl_parents_gather(f, parents);
    move_columns(f, parents, n);
    pfl_parents_fill(f, parents);
    pad(f, n);
    a->config.particles = n;
    f->best_index = 0u;
    f->ess = (f->ess < (float)n) ? f->ess : (float)n;
    pfl_weights_equal(f);
    if (f->config->kernel != NULL) {
        f->config->kernel->move(f);
    }
    f->scratch_is_weights = 0u;
    f->resample_pending = 0u;
    pfl_count(&f->resampled, 1u);
    f->watched.event |= PFL_EVENT_RESAMPLED;
    pfl_guard_start(f);
}

/* ---- By need ---------------------------------------------------------------------------------------------------------- */

uint32_t pfl_kld_particles(float cells, float error, float quantile)
{
    const float rest = cells - 1.0f;
    if (!(rest >= 1.0f)) {
        return 1u;
    }
    const float a = 2.0f / (9.0f * rest);
    const float base = (1.0f - a) + (pfl_sqrt_kernel(a) * quantile);
    const float n = (rest / (2.0f * error)) * (base * (base * base));
    if (!(n < (float)PFL_PARTICLES_MAX)) {
        return PFL_PARTICLES_MAX;
    }
    return (uint32_t)(int32_t)n + 1u;
}

/* Number of the cell of a value. */
static uint32_t cell_of(float value, float inv_width)
{
    const float y = value * inv_width;
    const float low = (y > -CELL_LIMIT) ? y : -CELL_LIMIT;
    const float v = (low < CELL_LIMIT) ? low : CELL_LIMIT;
    const int32_t i = (int32_t)v;
    return (uint32_t)i - ((v < (float)i) ? 1u : 0u);
}

static void mark(const pfl_t *f, const pfl_adaptive_t *a, uint32_t i)
{
    uint32_t hash = 0u;
    for (uint32_t k = 0u; k < a->dimensions; k++) {
        const float x = f->x[((size_t)a->state[k] * f->stride) + i];
        const bool circular = ((f->config->circular_mask >> a->state[k]) & 1u) != 0u;
        hash = (hash ^ cell_of(circular ? pfl_wrap_pi_kernel(x) : x, a->inv_width[k])) * 0x9E3779B1u;
        hash ^= hash >> 15;
    }
    hash *= 0x85EBCA77u;
    hash ^= hash >> 13;
    a->bins[(hash & (a->bits - 1u)) / 32u] |= 1u << (hash % 32u);
}

/* Cells that a resampling to the present N would cover. Marks of two cells may fall on one bit: from the bits that stayed
 * free follows how many there were (linear counting: Whang, Vander-Zanden and Taylor 1990). */
static uint32_t count_cells(const pfl_t *f, const pfl_adaptive_t *a, uint32_t total)
{
    const comb_t comb = pfl_comb_of(f->config->particles, total);
    uint32_t reach = 0u;
    uint32_t before = 0u;
    memset(a->bins, 0, a->bits / 8u);
    for (uint32_t i = 0u; i < f->config->particles; i++) {
        reach += pfl_load_u32(&f->scratch[i]);
        const uint32_t below = height(comb.factor, reach) >> comb.shift;
        if (below > before) {
            mark(f, a, i);
        }
        before = below;
    }
    uint32_t marked = 0u;
    for (uint32_t k = 0u; k < (a->bits / 32u); k++) {
        for (uint32_t word = a->bins[k]; word != 0u; word &= word - 1u) {
            marked++;
        }
    }
    const float bits = (float)(int32_t)a->bits;
    const float free_bits = (marked < a->bits) ? (float)(int32_t)(a->bits - marked) : 1.0f;
    return (uint32_t)(int32_t)((bits * pfl_log_kernel(bits / free_bits)) + 0.5f);
}

/* ---- By time ---------------------------------------------------------------------------------------------------------- */

static bool is_by_time(const pfl_t *f, const pfl_adaptive_t *a)
{
    return (a->budget_share > 0.0f) && (f->config->budget_cycles != 0u) && (f->meter.mask != 0u);
}

/* Particles there is time for; before the first cycle's cost is known, those there are. */
static uint32_t affordable(const pfl_t *f, const pfl_adaptive_t *a)
{
    if (!is_by_time(f, a)) {
        return a->most;
    }
    if (!(a->rate > 0.0f)) {
        return f->config->particles;
    }
    const float n = (a->budget_share * (float)f->config->budget_cycles) / a->rate;
    return (n < (float)a->most) ? (uint32_t)(int32_t)n : a->most;
}

/* What a cycle that was cut short would have cost nobody knows: it counts twice. */
static void learn_rate(pfl_t *f, pfl_adaptive_t *a, uint32_t n)
{
    (void)pfl_meter_spent(f); /* reads it */
    const float cost = (float)f->meter.used * ((f->overrun_counted != 0u) ? 2.0f : 1.0f);
    const float now = cost / (float)n;
    a->rate = (now > a->rate) ? now : a->rate;
}

/* ---- Calls -------------------------------------------------------------------------------------------------------------- */

static bool bins_are_good(const pfl_adaptive_t *a)
{
    if (!(a->error > 0.0f)) {
        return true;
    }
    for (uint32_t k = 0u; k < a->dimensions; k++) {
        if ((k >= PFL_BINS_DIMENSIONS) || (a->state[k] >= a->config.states)) {
            return false;
        }
    }
    return (a->dimensions > 0u) && (a->bins != NULL) && (a->bits >= 32u) && (a->bits <= 16777216u) &&
           ((a->bits & (a->bits - 1u)) == 0u);
}

static bool is_good(const pfl_adaptive_t *a)
{
    return (a->least >= 1u) && (a->least <= a->most) && (a->config.particles <= a->most) &&
           (a->most <= PFL_PARTICLES_MAX) && bins_are_good(a);
}

/* Within the bounds, in whole groups where these allow it. */
static uint32_t bounded(const pfl_adaptive_t *a, uint32_t needed, uint32_t time_for)
{
    const uint32_t groups = (uint32_t)PFL_CEIL8(needed);
    const uint32_t n = (groups < time_for) ? groups : time_for;
    const uint32_t enough = (n > a->least) ? n : a->least;
    return (enough < a->most) ? enough : a->most;
}

static bool is_due(const pfl_t *f, const pfl_adaptive_t *a)
{
    return (f->weights_equal == 0u) &&
           ((a->ess_ratio >= 1.0f) || (f->ess < (a->ess_ratio * (float)f->config->particles)));
}

static void adapt(pfl_t *f, pfl_adaptive_t *a)
{
    const uint32_t n = f->config->particles;
    const bool timed = is_by_time(f, a);
    const bool untimed = timed && !(a->rate > 0.0f); /* a first cycle, with all that belongs to one */
    if (timed && !untimed) {
        learn_rate(f, a, n); /* without the resampling: only a cycle that is dear already tells something new */
    }
    const uint32_t time_for = affordable(f, a);
    const bool too_many = (time_for < n) && (n > a->least);
    pfl_refresh(f);
    if (untimed || too_many || is_due(f, a)) {
        a->rate *= 1.0f - FORGET; /* only here: what is learned now includes a resampling */
        const uint32_t start = pfl_meter_read(f);
        pfl_weights(f);
        const uint32_t total = pfl_quantise(f);
        a->wanted = a->most;
        if (a->error > 0.0f) {
            a->covered = count_cells(f, a, total);
            a->wanted = pfl_kld_particles((float)(int32_t)a->covered, a->error, a->quantile);
        }
        resample_into(f, a, total, bounded(a, a->wanted, time_for));
        f->cycles_resample += pfl_meter_read(f) - start;
    }
    if (timed) {
        learn_rate(f, a, n);
    }
}

static pfl_status_t enter(pfl_t *f, const pfl_adaptive_t *a)
{
    if (a == NULL) {
        return PFL_ERR_ARG;
    }
    const pfl_status_t entered = pfl_begin(f);
    if (entered != PFL_OK) {
        return entered;
    }
    return ((f->config == &a->config) && is_good(a)) ? PFL_OK : pfl_end(f, PFL_ERR_CONFIG);
}

pfl_status_t pfl_adapt(pfl_t *f, pfl_adaptive_t *a)
{
    const pfl_status_t entered = enter(f, a);
    if (entered != PFL_OK) {
        return entered;
    }
    pfl_meter_resume(f);
    adapt(f, a);
    pfl_meter_pause(f);
    return pfl_end(f, PFL_OK);
}

pfl_status_t pfl_set_particles(pfl_t *f, pfl_adaptive_t *a, uint32_t n)
{
    const pfl_status_t entered = enter(f, a);
    if (entered != PFL_OK) {
        return entered;
    }
    if ((n == 0u) || (n > a->most)) {
        return pfl_end(f, PFL_ERR_ARG);
    }
    pfl_meter_resume(f);
    pfl_refresh(f);
    pfl_weights(f);
    resample_into(f, a, pfl_quantise(f), n);
    pfl_meter_pause(f);
    return pfl_end(f, PFL_OK);
}

pfl_status_t pfl_adaptive_init(void *arena, size_t arena_bytes, pfl_adaptive_t *a, uint64_t t_us, pfl_t **out)
{
    if ((a == NULL) || (out == NULL)) {
        return PFL_ERR_ARG;
    }
    *out = NULL;
    a->config.particles = a->most;
    a->rate = 0.0f;
    a->covered = 0u;
    a->wanted = a->most;
    if (!is_good(a)) {
        return PFL_ERR_CONFIG;
    }
    const pfl_status_t made = pfl_init(arena, arena_bytes, &a->config, t_us, out);
    return ((made == PFL_OK) && is_by_time(*out, a)) ? pfl_set_particles(*out, a, a->least) : made;
}
