/* Draws faults and lets them in. */
#include "fault.h"

#include "plane.h"

#include <math.h>
#include <string.h>

fault_t fault;
fault_state_t fault_state;

/* ---- Names ---------------------------------------------------------------------------------------------------------- */

static const char *const region_names[REGIONS] = {"configuration",
                                                  "control block",
                                                  "copy and seal",
                                                  "sensor tracks",
                                                  "particles",
                                                  "log-weights",
                                                  "workspace, moments",
                                                  "random streams",
                                                  "canaries",
                                                  "snapshot",
                                                  "callbacks",
                                                  "sensors",
                                                  "time",
                                                  "cycle counter",
                                                  "budget"};

enum { DAMAGE_BIT, DAMAGE_TWO_BITS, DAMAGE_BURST, DAMAGE_STUCK, DAMAGE_ZEROED, DAMAGES };
static const char *const damage_names[DAMAGES] = {"one bit", "two bits", "burst of 8", "stuck word", "zeroed column"};

enum { BLOB_BIT, BLOB_BURST, BLOB_TRUNCATED, BLOB_VERSION, BLOB_SWAPPED, BLOB_ZEROED, BLOBS };
static const char *const blob_names[BLOBS] = {"one bit",       "burst of 8",       "truncated",
                                              "other version", "other endianness", "zeroed part"};

enum {
    CALL_LL_NAN,
    CALL_LL_INF,
    CALL_LL_MINUS_INF,
    CALL_LL_POSITIVE,
    CALL_LL_SHORT,
    CALL_LL_LONG,
    CALL_LL_ONE_NAN,
    CALL_X_NAN,
    CALL_X_ALL_NAN,
    CALL_X_INF,
    CALL_X_BEHIND,
    CALL_X_CONST,
    CALL_REENTER,
    CALLS
};
static const char *const call_names[CALLS] = {
    "log-likelihoods NaN",     "log-likelihoods +inf",     "log-likelihoods -inf",     "log-likelihoods positive",
    "log-likelihoods too few", "log-likelihoods too many", "one log-likelihood NaN",   "one particle NaN",
    "all particles NaN",       "one particle infinite",    "writes behind its column", "casts const away",
    "calls its own filter"};

enum {
    SENSE_DROPOUT,
    SENSE_OUTLIER,
    SENSE_FROZEN,
    SENSE_BIAS,
    SENSE_DUPLICATE,
    SENSE_LATE,
    SENSE_FUTURE,
    SENSE_NAN,
    SENSES
};
static const char *const sense_names[SENSES] = {"dropout",   "outlier", "frozen",          "bias",
                                                "duplicate", "late",    "from the future", "NaN"};

enum { TIME_BACK, TIME_AHEAD, TIME_REPEAT, TIME_GAP, TIME_SET_BACK, TIME_SET_AHEAD, TIMES };
static const char *const time_names[TIMES] = {"one stamp back",    "one stamp ahead",   "stands still", "gap",
                                              "set back for good", "set ahead for good"};

enum { COUNTER_STUCK, COUNTER_24_BIT, COUNTER_BACK, COUNTER_SLOW, COUNTER_FAST, COUNTER_RANDOM, COUNTERS };
static const char *const counter_names[COUNTERS] = {"stuck", "24 bits wide", "jumps back", "slow", "fast", "any value"};

enum { BUDGET_SLOW, BUDGET_ONE_BATCH, BUDGETS };
static const char *const budget_names[BUDGETS] = {"slow callbacks", "one slow callback"};

static uint32_t kinds_of(region_t region)
{
    static const uint32_t special[REGIONS - MEMORY_REGIONS] = {BLOBS, CALLS, SENSES, TIMES, COUNTERS, BUDGETS};
    return ((uint32_t)region < MEMORY_REGIONS) ? (uint32_t)DAMAGES : special[(uint32_t)region - MEMORY_REGIONS];
}

/* A stuck word comes back while callbacks run, wherever it struck first. */
const char *fault_region_name(const fault_t *f)
{
    const bool within = (f->region == REGION_CONFIG) && (f->inside || (f->kind == DAMAGE_STUCK));
    return within ? "configuration, in a callback" : region_names[f->region];
}

const char *fault_kind_name(const fault_t *f)
{
    static const char *const *const special[REGIONS - MEMORY_REGIONS] = {blob_names, call_names,    sense_names,
                                                                         time_names, counter_names, budget_names};
    return ((uint32_t)f->region < MEMORY_REGIONS) ? damage_names[f->kind]
                                                  : special[(uint32_t)f->region - MEMORY_REGIONS][f->kind];
}

/* Of a cycle without a refusal: a predict, whose first batch is a group of its own, and the sensors' updates. */
#define BATCHES(n) (((n) + (PFL_BATCH - 1u)) / PFL_BATCH)
#define CALLBACKS (1u + BATCHES(PARTICLES - PFL_GROUP) + (SENSORS * BATCHES(PARTICLES)))

/* ---- Drawing -------------------------------------------------------------------------------------------------------- */

static bool is_memory(const fault_t *f)
{
    return (uint32_t)f->region < MEMORY_REGIONS;
}

bool fault_lasts(const fault_t *f)
{
    return (is_memory(f) && (f->kind == DAMAGE_STUCK)) ||
           ((f->region == REGION_COUNTER) && (f->kind == COUNTER_24_BIT));
}

/* How many cycles a fault goes on: memory changes once, the rest for up to four seconds. */
static uint32_t length_of(const fault_t *f, double draw, uint32_t left)
{
    const bool once = is_memory(f) || (f->region == REGION_SNAPSHOT) ||
                      ((f->region == REGION_TIME) && ((f->kind == TIME_BACK) || (f->kind == TIME_AHEAD))) ||
                      ((f->region == REGION_COUNTER) && (f->kind == COUNTER_BACK));
    if (fault_lasts(f)) {
        return left;
    }
    return once ? 1u : (uint32_t)(1.0 + (39.0 * draw * draw));
}

fault_t fault_of_run(uint64_t run_seed, uint32_t first, uint32_t last, uint32_t cycles)
{
    host_random_t random;
    host_random_start(&random, run_seed, 0u, RANDOM_TRUTH);
    fault_t f;
    memset(&f, 0, sizeof f);
    f.region = (region_t)(run_seed % (uint64_t)REGIONS);
    f.kind = (uint32_t)(host_random_u64(&random) % kinds_of(f.region));
    f.inside = (host_random_u64(&random) >> 63) != 0u;
    f.first = first + (uint32_t)(host_random_u64(&random) % (last - first + 1u));
    f.point = (uint32_t)(host_random_u64(&random) % (f.inside ? CALLBACKS : 6u));
    f.sensor = (uint32_t)(host_random_u64(&random) % SENSORS);
    f.where[0] = host_random_u64(&random);
    f.where[1] = host_random_u64(&random);
    f.size = host_random_uniform(&random);
    f.cycles = length_of(&f, host_random_uniform(&random), cycles - f.first);
    if (f.region == REGION_SNAPSHOT) {
        f.first = ((f.first + 9u) / 10u) * 10u; /* snapshots are taken once a second */
    }
    return f;
}

fault_t fault_none(void)
{
    fault_t f;
    memset(&f, 0, sizeof f);
    f.first = UINT32_MAX;
    return f;
}

void fault_print(FILE *out, const fault_t *f)
{
    fprintf(out, "%s: %s, from cycle %u for %u", fault_region_name(f), fault_kind_name(f), (unsigned)f->first,
            (unsigned)f->cycles);
    if (is_memory(f)) {
        fprintf(out, ", %s %u", f->inside ? "inside callback" : "between calls, place", (unsigned)f->point);
    }
    if ((f->region == REGION_SENSOR) || (f->region == REGION_CALLBACK)) {
        fprintf(out, ", sensor %u, size %.3f", (unsigned)f->sensor, f->size);
    }
    fprintf(out, "\n");
}

static bool is_on(void)
{
    return (fault_state.number >= fault.first) && ((fault_state.number - fault.first) < fault.cycles);
}

static bool is_on_in(region_t region)
{
    return (fault.region == region) && is_on();
}

static bool of_kind(region_t region, uint32_t kind)
{
    return is_on_in(region) && (fault.kind == kind);
}

/* ---- Memory --------------------------------------------------------------------------------------------------------- */

typedef struct {
    unsigned char *at;
    size_t bytes;
} span_t;

static span_t span(void *at, size_t bytes)
{
    const span_t s = {(unsigned char *)at, bytes};
    return s;
}

static span_t column(float *x, size_t floats)
{
    return span(x, sizeof(float) * floats);
}

static uint32_t work_spans(const pfl_t *f, span_t s[3])
{
    s[0] = column(f->scratch, PFL_STRIDE(f->config->particles) - PFL_CANARY_FLOATS);
    s[1] = column(f->work, PFL_WORK_FLOATS(STATES, f->config->noises));
    s[2] = column(f->mean, PFL_MOMENT_FLOATS(STATES) + PFL_LANE_FLOATS(STATES));
    return 3u;
}

/* Words behind the last particle of each column, and before the first column. */
static uint32_t canary_spans(const pfl_t *f, span_t s[STATES + 3u])
{
    const size_t n = f->config->particles;
    const size_t padded = PFL_CEIL8(n);
    for (uint32_t d = 0u; d < STATES; d++) {
        s[d] = column(&f->x[((size_t)d * f->stride) + n], f->stride - n);
    }
    s[STATES] = column(f->x - PFL_CANARY_FLOATS, PFL_CANARY_FLOATS);
    s[STATES + 1u] = column(f->log_weight + padded, f->stride - padded);
    s[STATES + 2u] = column(f->scratch + padded, f->stride - padded);
    return STATES + 3u;
}

/* The filter's copy of its configuration, if it has one. */
static uint32_t copy_span(pfl_t *f, span_t *s)
{
#if PFL_GUARD_CONFIG == 2
    const ptrdiff_t place = (const unsigned char *)f->config - (const unsigned char *)f;
    *s = span((unsigned char *)f + place, pfl_config_copy_bytes(f->original));
    return 1u;
#else
    (void)f;
    (void)s;
    return 0u;
#endif
}

static uint32_t spans_of(pfl_t *f, span_t s[STATES + 3u])
{
    switch (fault.region) {
    case REGION_CONFIG:
        s[0] = span(&plane.settings, sizeof plane.settings);
        return 1u;
    case REGION_CONTROL:
        s[0] = span(f, offsetof(struct pfl, seal));
        return 1u;
    case REGION_SEAL:
        s[0] = span(&f->seal, offsetof(struct pfl, rng) - offsetof(struct pfl, seal));
        return 1u + copy_span(f, &s[1]);
    case REGION_TRACKS:
        s[0] = span(f->sensor, sizeof(pfl_sensor_track_t) * SENSORS);
        return (f->sensor != NULL) ? 1u : 0u;
    case REGION_PARTICLES:
        for (uint32_t d = 0u; d < STATES; d++) {
            s[d] = column(&f->x[(size_t)d * f->stride], f->config->particles);
        }
        return STATES;
    case REGION_WEIGHTS:
        s[0] = column(f->log_weight, f->config->particles);
        return 1u;
    case REGION_WORK:
        return work_spans(f, s);
    case REGION_RANDOM:
        s[0] = span(&f->rng, sizeof f->rng);
        return 1u;
    default:
        return canary_spans(f, s);
    }
}

static void flip(const span_t *s, size_t bit)
{
    s->at[(bit / 8u) % s->bytes] ^= (unsigned char)(1u << (bit % 8u));
}

static void damage_span(const span_t *s, size_t bit)
{
    static const unsigned char values[4] = {0x00u, 0xFFu, 0x7Fu, 0xA5u};
    switch (fault.kind) {
    case DAMAGE_TWO_BITS:
        flip(s, bit);
        flip(s, (size_t)(fault.where[1] % (8u * s->bytes)));
        break;
    case DAMAGE_BURST:
        for (size_t k = 0u; k < 8u; k++) {
            flip(s, (bit + k) % (8u * s->bytes));
        }
        break;
    case DAMAGE_STUCK:
        memset(&s->at[(bit / 32u) * 4u], values[fault.where[1] % 4u], ((s->bytes - ((bit / 32u) * 4u)) < 4u) ? 1u : 4u);
        break;
    case DAMAGE_ZEROED:
        memset(s->at, 0, s->bytes);
        break;
    default:
        flip(s, bit);
        break;
    }
}

static void damage_memory(void)
{
    static span_t stuck;
    static size_t stuck_bit;
    if (fault_state.struck && (fault.kind != DAMAGE_STUCK)) {
        return;
    }
    if (!fault_state.struck) { /* pointers are whole yet */
        span_t s[STATES + 3u];
        const uint32_t count = spans_of(plane.f, s);
        size_t bits = 0u;
        for (uint32_t k = 0u; k < count; k++) {
            bits += 8u * s[k].bytes;
        }
        size_t bit = (bits > 0u) ? (size_t)(fault.where[0] % bits) : 0u;
        uint32_t k = 0u;
        while ((k < count) && (bit >= (8u * s[k].bytes))) {
            bit -= 8u * s[k].bytes;
            k++;
        }
        if (k >= count) {
            return;
        }
        stuck = s[k];
        stuck_bit = bit;
    }
    fault_state.struck = true;
    damage_span(&stuck, stuck_bit);
}

/* ---- Places --------------------------------------------------------------------------------------------------------- */

void fault_begin_cycle(uint32_t number, const instant_t *instant)
{
    fault_state.number = number;
    fault_state.callbacks = 0u;
    if ((number + 1u == fault.first) || ((number < 1u) && (fault.first == 0u))) {
        fault_state.held = *instant;
    }
}

void fault_between_calls(uint32_t place)
{
    const bool again = fault_state.struck && (fault.kind == DAMAGE_STUCK);
    if (is_memory(&fault) && is_on() && (plane.f != NULL) && (again || (!fault.inside && (place == fault.point)))) {
        damage_memory();
    }
}

static void in_callback(void)
{
    const uint32_t number = fault_state.callbacks++;
    const bool again = fault_state.struck && (fault.kind == DAMAGE_STUCK);
    if (is_memory(&fault) && is_on() && (plane.f != NULL) && (again || (fault.inside && (number == fault.point)))) {
        damage_memory();
    }
}

static void reenter(void)
{
    static const float z[2] = {0.0f, 0.0f};
    float mean[STATES];
    if (plane.f == NULL) {
        return;
    }
    if ((fault.where[0] & 1u) != 0u) {
        (void)pfl_update(plane.f, 0u, plane.now_us, z);
    } else {
        (void)pfl_predict(plane.f, plane.now_us + 1000u, NULL);
    }
    (void)pfl_estimate(plane.f, mean, NULL);
}

static void spoil_batch(const pfl_batch_t *p)
{
    const uint32_t i = (uint32_t)(fault.where[0] % p->n);
    const uint32_t d = (uint32_t)(fault.where[1] % STATES);
    switch (fault.kind) {
    case CALL_X_NAN:
        PFL_STATE(p, d)[i] = NAN;
        break;
    case CALL_X_ALL_NAN:
        for (uint32_t k = 0u; k < p->n; k++) {
            PFL_STATE(p, d)[k] = NAN;
        }
        break;
    case CALL_X_INF:
        PFL_STATE(p, d)[i] = ((fault.where[0] >> 40) & 1u) ? INFINITY : -INFINITY;
        break;
    case CALL_X_BEHIND:
        PFL_STATE(p, d)[p->n] = 1.0e3f;
        break;
    case CALL_REENTER:
        reenter();
        break;
    default:
        break;
    }
}

void fault_in_predict(const pfl_batch_t *p)
{
    in_callback();
    if (is_on_in(REGION_CALLBACK)) {
        spoil_batch(p);
    }
}

static void fill(float *ll, uint32_t n, float value)
{
    for (uint32_t i = 0u; i < n; i++) {
        ll[i] = value;
    }
}

static void cast_away(const pfl_view_t *p, uint32_t i)
{
    float *x;
    memcpy(&x, &p->x, sizeof x);
    x[i + ((fault.where[1] % STATES) * p->stride)] = (float)(fault.size * 1.0e4);
}

static void spoil_loglik(const pfl_view_t *p, float *ll)
{
    const uint32_t i = (uint32_t)(fault.where[0] % p->n);
    switch (fault.kind) {
    case CALL_LL_NAN:
        fill(ll, p->n, NAN);
        break;
    case CALL_LL_INF:
        fill(ll, p->n, INFINITY);
        break;
    case CALL_LL_MINUS_INF:
        fill(ll, p->n, -INFINITY);
        break;
    case CALL_LL_POSITIVE:
        ll[i] = (float)(100.0 * fault.size) + 0.01f;
        break;
    case CALL_LL_SHORT:
        ll[p->n - 1u] = NAN; /* as the library left it */
        break;
    case CALL_LL_LONG:
        ll[(p->n < PFL_BATCH) ? p->n : (p->n - 1u)] = -1.0f;
        break;
    case CALL_LL_ONE_NAN:
        ll[i] = NAN;
        break;
    case CALL_X_CONST:
        cast_away(p, i);
        break;
    case CALL_REENTER:
        reenter();
        break;
    default:
        break;
    }
}

void fault_in_loglik(uint32_t sensor, const pfl_view_t *p, float *ll)
{
    in_callback();
    if (is_on_in(REGION_CALLBACK) && (sensor == fault.sensor)) {
        spoil_loglik(p, ll);
    }
}

/* ---- Sensors -------------------------------------------------------------------------------------------------------- */

uint32_t fault_sample(uint32_t sensor, float z[2], uint64_t *t_us)
{
    if (!is_on_in(REGION_SENSOR) || (sensor != fault.sensor)) {
        return 1u;
    }
    const float sigma = world_sigma[sensor];
    const double angle = 6.283185307179586 * (double)(fault.where[0] >> 11) / 9007199254740992.0;
    const double far = (fault.kind == SENSE_BIAS) ? pow(100.0, fault.size) : (10.0 * pow(100.0, fault.size));
    switch (fault.kind) {
    case SENSE_DROPOUT:
        return 0u;
    case SENSE_OUTLIER:
    case SENSE_BIAS:
        z[0] += sigma * (float)(far * cos(angle));
        z[1] += sigma * (float)(far * sin(angle));
        break;
    case SENSE_FROZEN:
        memcpy(z, fault_state.held.sample.z[sensor], 2u * sizeof(float));
        break;
    case SENSE_DUPLICATE:
        return 2u;
    case SENSE_LATE:
        *t_us -= 1u + (uint64_t)(fault.size * 500000.0);
        break;
    case SENSE_FUTURE:
        *t_us += 1u + (uint64_t)(fault.size * 500000.0);
        break;
    default:
        z[fault.where[1] & 1u] = NAN;
        break;
    }
    return 1u;
}

/* ---- Clocks ---------------------------------------------------------------------------------------------------------- */

uint32_t fault_clock(uint32_t us)
{
    const bool gone_by = (fault.region == REGION_TIME) && (fault_state.number >= fault.first);
    const uint32_t off = (uint32_t)(fault.size * fault.size * ((fault.where[0] & 1u) ? 3.0e6 : 1.8e9)) + 1u;
    if (gone_by && (fault.kind == TIME_SET_BACK)) {
        return us - off;
    }
    if (gone_by && (fault.kind == TIME_SET_AHEAD)) {
        return us + off;
    }
    if (!is_on_in(REGION_TIME)) {
        return us;
    }
    switch (fault.kind) {
    case TIME_BACK:
        return us - off;
    case TIME_AHEAD:
        return us + off;
    case TIME_REPEAT:
        return us - ((1u + fault_state.number - fault.first) * 100000u);
    default:
        return us;
    }
}

bool fault_asleep(void)
{
    return of_kind(REGION_TIME, TIME_GAP);
}

uint32_t fault_counter(uint32_t count)
{
    if (!is_on_in(REGION_COUNTER)) {
        return count;
    }
    switch (fault.kind) {
    case COUNTER_STUCK:
        return (uint32_t)fault.where[0];
    case COUNTER_24_BIT:
        return count & 0x00FFFFFFu;
    case COUNTER_BACK:
        return count - (uint32_t)(fault.where[0] % 100000000u);
    case COUNTER_SLOW:
        return count / 10u;
    case COUNTER_FAST:
        return count * 50u;
    default:
        return count * 2654435761u;
    }
}

uint32_t fault_callback_cost(uint32_t particles)
{
    const uint32_t cost = plane.counter.per_particle * particles;
    if (!is_on_in(REGION_BUDGET)) {
        return cost;
    }
    const bool slow = (fault.kind == BUDGET_SLOW) || (fault_state.callbacks == fault.point);
    return slow ? (uint32_t)((double)cost * pow(100.0, fault.size)) : cost;
}

/* ---- Snapshots ------------------------------------------------------------------------------------------------------- */

bool fault_wants_blob(void)
{
    return is_on_in(REGION_SNAPSHOT);
}

void fault_blob(unsigned char *blob, size_t *bytes)
{
    const span_t all = span(blob, *bytes);
    const size_t bit = (size_t)(fault.where[0] % (8u * *bytes));
    switch (fault.kind) {
    case BLOB_BURST:
        for (size_t k = 0u; k < 8u; k++) {
            flip(&all, bit + k);
        }
        break;
    case BLOB_TRUNCATED:
        *bytes = 1u + (bit / 8u) - (((bit / 8u) + 1u == *bytes) ? 1u : 0u);
        break;
    case BLOB_VERSION:
        blob[4] ^= (unsigned char)(1u + (fault.where[0] % 255u));
        break;
    case BLOB_SWAPPED:
        for (size_t k = 0u; k + 4u <= *bytes; k += 4u) {
            const unsigned char word[4] = {blob[k + 3u], blob[k + 2u], blob[k + 1u], blob[k]};
            memcpy(&blob[k], word, 4u);
        }
        break;
    case BLOB_ZEROED:
        blob[0] ^= 1u;
        memset(&blob[bit / 8u], 0, *bytes - (bit / 8u));
        break;
    default:
        flip(&all, bit);
        break;
    }
}
