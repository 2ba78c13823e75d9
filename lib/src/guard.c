/* Guards of the memory that a filter's safety hangs on: configuration, control block, and the gaps between the columns of
 * the arena. Particles need none: a damaged one dies of its weight, or is quarantined. guard.h tells the switches.
 *
 * The control block is sealed between calls: a hash of it, and a copy. Of the block, its copy and the seal the two that
 * agree are right, so that one flipped bit anywhere is mended without a trace in the results. */
#include "guard.h"

#include "hash_kernel.h"
#include "lanes.h"

#define OPEN 0x6F70656Eu     /* "open": a call is in progress, and the block may differ from its copy */
#define SENTINEL 0x3F8CAFE5u /* a float near 1.1: harmless where sums run over the padding */

#define CONFIG_WORDS ((offsetof(pfl_config_t, user) + sizeof(void *)) / 4u) /* 32-bit machines pad behind it */
#define SEALED_WORDS (offsetof(struct pfl, seal) / 4u)
#define CONSTANT_WORDS (offsetof(struct pfl, reset_t_us) / 4u)
#define LOOP_WORDS (offsetof(struct pfl, mean) / sizeof(uintptr_t))

/* What the caller's configuration is called; with a copy of it, `config` is that. */
#if PFL_GUARD_CONFIG == 2
#define ORIGINAL(f) ((f)->original)
#else
#define ORIGINAL(f) ((f)->config)
#endif

/* No byte without a name: what is only padding may differ from copy to copy of a structure. */
typedef char pfl_config_has_no_gap[(sizeof(uint32_t[CONFIG_WORDS]) == ((11u * sizeof(void *)) + 40u)) ? 1 : -1];
typedef char pfl_sensor_has_no_gap[(sizeof(pfl_sensor_t) == ((3u * sizeof(void *)) + 16u)) ? 1 : -1];
typedef char pfl_constraint_has_no_gap[(sizeof(pfl_constraint_t) == ((4u * sizeof(void *)) + 8u)) ? 1 : -1];
typedef char pfl_watch_has_no_gap[(sizeof(pfl_watch_t) == ((2u * sizeof(void *)) + 24u)) ? 1 : -1];
typedef char pfl_sealed_part_fits[(sizeof(uint32_t[SEALED_WORDS]) <= sizeof(((struct pfl *)0)->copy)) ? 1 : -1];

static uint32_t word_at(const void *bytes, size_t k)
{
    uint32_t word;
    PFL_LOAD_WORD(word, (const void *)((const unsigned char *)bytes + (4u * k)));
    return word;
}

PFL_NOINLINE static uint32_t hash_words(uint32_t hash, const void *bytes, size_t words)
{
    return pfl_hash_kernel(hash, bytes, words);
}

PFL_NOINLINE static uint32_t hash_block(const void *block)
{
    return hash_words(1u, block, SEALED_WORDS);
}

PFL_NOINLINE static void count_mended(pfl_t *f, uint32_t fault)
{
    f->watched.fault |= fault;
    f->watched.event |= PFL_EVENT_MENDED;
    pfl_count(&f->mended, 1u);
}

/* ---- Configuration -------------------------------------------------------------------------------------------- */

static uint32_t hash_of_parts(uint32_t hash, const pfl_config_t *c)
{
    hash = hash_words(hash, c->sensors, ((size_t)c->sensor_count * sizeof *c->sensors) / 4u);
    if (c->lo != NULL) {
        hash = hash_words(hash, c->lo, c->states);
        hash = hash_words(hash, c->hi, c->states);
    }
    if (c->constraint != NULL) {
        hash = hash_words(hash, c->constraint, sizeof *c->constraint / 4u);
    }
    if (c->kernel != NULL) {
        hash = hash_words(hash, c->kernel, sizeof *c->kernel / 4u);
    }
    if (c->watch != NULL) {
        hash = hash_words(hash, c->watch, sizeof *c->watch / 4u);
    }
    return hash;
}

static uint32_t hash_of_limits(uint32_t hash, const pfl_config_t *c)
{
    const bool some = (c->watch != NULL) && (c->watch->ok_sigma != NULL);
    return some ? hash_words(hash, c->watch->ok_sigma, c->states) : hash;
}

/* In steps: a damaged pointer must not be followed. */
static bool config_is_intact(const pfl_t *f)
{
    if (PFL_GUARD_CONFIG == 0) {
        return true;
    }
    const pfl_config_t *c = ORIGINAL(f);
    const uint32_t hash = hash_words(1u, c, CONFIG_WORDS);
    return (hash == f->config_hash) && (hash_of_parts(hash, c) == f->parts_hash) &&
           (hash_of_limits(hash, c) == f->limits_hash);
}

/* ---- Its copy, with PFL_GUARD_CONFIG 2, at the end of the arena --------------------------------------------------- */

#if PFL_GUARD_CONFIG == 2
static void start_copy(pfl_t *f)
{
    const size_t bytes = pfl_config_copy_bytes(f->original);
    f->config = pfl_config_copy(f->original, (unsigned char *)f + (pfl_arena_bytes(f->original) - bytes));
    f->copy_hash = hash_words(1u, f->config, bytes / 4u);
}

static bool copy_is_intact(const pfl_t *f)
{
    return hash_words(1u, f->config, pfl_config_copy_bytes(f->original) / 4u) == f->copy_hash;
}

/* The same content in the same place, if the original still has it: pointers into the copy stay good. */
static void renew_copy(pfl_t *f)
{
    if (config_is_intact(f)) {
        const ptrdiff_t place = (const unsigned char *)f->config - (const unsigned char *)f;
        (void)pfl_config_copy(f->original, (unsigned char *)f + place);
    }
}
#else
static void start_copy(const pfl_t *f)
{
    (void)f;
}

static bool copy_is_intact(const pfl_t *f)
{
    (void)f;
    return true;
}

static void renew_copy(const pfl_t *f)
{
    (void)f;
}
#endif

/* ---- Control block -------------------------------------------------------------------------------------------- */

PFL_NOINLINE static void seal(pfl_t *f)
{
    if (PFL_GUARD_CONTROL != 0) {
        f->seal = hash_block(f);
        PFL_COPY(f->copy, f, 4u * SEALED_WORDS);
    }
    f->open = 0u;
}

typedef enum { INTACT, MENDABLE, LOST } damage_t;

static bool copy_differs(const pfl_t *f, size_t words)
{
    uint32_t different = 0u;
    for (size_t k = 0u; k < words; k++) {
        different |= word_at(f, k) ^ word_at(f->copy, k);
    }
    return different != 0u;
}

/* A block that equals its copy is right whatever the seal says, which is made anew at the end of the call; except that
 * memory of zeros agrees with itself, too. */
static damage_t look_at_block(const pfl_t *f)
{
    if ((PFL_GUARD_CONTROL == 0) || (f->open == OPEN) || !copy_differs(f, SEALED_WORDS) || (hash_block(f) == f->seal)) {
        return (f->alive == PFL_ALIVE) ? INTACT : LOST;
    }
    const bool alive = word_at(f->copy, 0u) == PFL_ALIVE;
    return (alive && (hash_block(f->copy) == f->seal)) ? MENDABLE : LOST;
}

static void mend_block(pfl_t *f)
{
    PFL_COPY(f, f->copy, 4u * SEALED_WORDS);
    count_mended(f, PFL_FAULT_CONTROL);
}

/* During a call the seal is that of the copy. */
PFL_NOINLINE static void mend_constants(pfl_t *f)
{
    if (hash_block(f->copy) == f->seal) {
        PFL_COPY(f, f->copy, 4u * CONSTANT_WORDS);
        count_mended(f, PFL_FAULT_CONTROL);
    }
}

void pfl_guard_after_callback(pfl_t *f)
{
    const unsigned char *now = (const unsigned char *)f;
    const unsigned char *kept = (const unsigned char *)f->copy;
    uintptr_t different = 0u;
    for (size_t k = 0u; (PFL_GUARD_CONTROL != 0) && (k < LOOP_WORDS); k++) {
        uintptr_t a;
        uintptr_t b;
        PFL_COPY(&a, &now[k * sizeof a], sizeof a);
        PFL_COPY(&b, &kept[k * sizeof b], sizeof b);
        different |= a ^ b;
    }
    if (different != 0u) {
        mend_constants(f);
    }
    renew_copy(f);
}

void pfl_guard_take_over(pfl_t *f)
{
    if (PFL_GUARD_CONTROL != 0) {
        PFL_COPY(f->copy, f, 4u * CONSTANT_WORDS);
        f->seal = hash_block(f->copy);
    }
}

void pfl_guard_after_batches(pfl_t *f)
{
    if ((PFL_GUARD_CONTROL != 0) && copy_differs(f, CONSTANT_WORDS)) {
        mend_constants(f);
    }
}

/* ---- Callbacks ------------------------------------------------------------------------------------------------ */

pfl_view_t pfl_guard_view(pfl_t *f, uint32_t first, uint32_t n)
{
    pfl_view_t view = {&f->x[first], f->stride, first, n};
    if (PFL_GUARD_VIEW != 0) {
        const float *from = view.x;
        float *to = f->work;
        for (uint32_t left = f->config->states; left > 0u; left--) {
            if (n == PFL_BATCH) { /* a constant, so that compilers unroll it */
                pfl_lanes_copy(to, from, PFL_BATCH);
            } else {
                pfl_lanes_copy(to, from, (uint32_t)PFL_CEIL8(n));
            }
            from += f->stride;
            to += PFL_BATCH;
        }
        view.x = f->work;
        view.stride = PFL_BATCH;
    }
    return view;
}

float *pfl_guard_bay(pfl_t *f, uint32_t n)
{
    float *bay = &f->work[PFL_WORK_FLOATS(f->config->states, f->config->noises) - PFL_BATCH];
    if (PFL_GUARD_CANARIES != 0) {
        pfl_store_u32(&bay[0], 0x7FC00000u);
        pfl_store_u32(&bay[n - 1u], 0x7FC00000u);
        if (n < PFL_BATCH) {
            pfl_store_u32(&bay[n], SENTINEL);
        }
    }
    return bay;
}

bool pfl_guard_bay_is_whole(const float *bay, uint32_t n)
{
    return (PFL_GUARD_CANARIES == 0) || (n == PFL_BATCH) || (pfl_load_u32(&bay[n]) == SENTINEL);
}

/* ---- Canaries ------------------------------------------------------------------------------------------------- */

static uint32_t renew(float *canary)
{
    const uint32_t different = pfl_load_u32(canary) ^ SENTINEL;
    pfl_store_u32(canary, SENTINEL);
    return different;
}

/* Before the first state, behind each state's last particle, behind each weight column. True when all were alive. */
PFL_NOINLINE static bool set_canaries(const pfl_t *f)
{
    const size_t stride = f->stride;
    float *at = f->x + f->config->particles;
    uint32_t different = renew(f->x - 1);
    for (uint32_t left = f->config->states; left > 0u; left--) {
        different |= renew(at);
        at += stride;
    }
    at = f->x + ((f->config->states + 1u) * stride);
    different |= renew(at);
    different |= renew(at + (stride + PFL_CANARY_FLOATS));
    return different == 0u;
}

/* ---- Calls ---------------------------------------------------------------------------------------------------- */

void pfl_guard_start(pfl_t *f)
{
    const pfl_config_t *c = ORIGINAL(f);
    f->config_hash = hash_words(1u, c, CONFIG_WORDS);
    f->parts_hash = hash_of_parts(f->config_hash, c);
    f->limits_hash = hash_of_limits(f->config_hash, c);
    start_copy(f);
    (void)set_canaries(f);
    seal(f);
}

pfl_status_t pfl_guard_look(const pfl_t *f)
{
    const damage_t damage = look_at_block(f);
    if (damage != INTACT) {
        return PFL_ERR_CORRUPT;
    }
    if (!config_is_intact(f)) {
        return PFL_ERR_CONFIG;
    }
    return copy_is_intact(f) ? PFL_OK : PFL_ERR_CORRUPT;
}

pfl_status_t pfl_guard_open(pfl_t *f)
{
    const damage_t damage = look_at_block(f);
    if (damage == LOST) {
        return PFL_ERR_CORRUPT;
    }
    if (damage == MENDABLE) {
        mend_block(f);
    }
    if (!config_is_intact(f)) {
        f->watched.fault |= PFL_FAULT_CONFIG;
        seal(f);
        return PFL_ERR_CONFIG;
    }
    f->watched.event |= ((f->watched.fault & PFL_FAULT_CONFIG) != 0u) ? PFL_EVENT_MENDED : 0u;
    f->watched.fault &= ~PFL_FAULT_CONFIG;
    renew_copy(f);
    f->open = OPEN;
    return PFL_OK;
}

pfl_status_t pfl_guard_close(pfl_t *f, pfl_status_t status)
{
    pfl_status_t answer = status;
    if ((PFL_GUARD_CANARIES != 0) && !set_canaries(f)) {
        count_mended(f, PFL_FAULT_CANARY);
        answer = pfl_fault(f, PFL_ERR_CORRUPT);
    }
    seal(f);
    return answer;
}
