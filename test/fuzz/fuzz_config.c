/* Any configuration: pfl_init either refuses it, and nothing is written, or builds a filter that works. What is legal
 * is said here once more, from the comments of the header alone. */
#include "fuzz.h"

#include "pflight/filter.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PARTICLES_FLOWN 200u /* larger filters are only measured */
#define CYCLES 3u

typedef struct {
    pfl_config_t config;
    pfl_sensor_t sensor[PFL_SENSORS_MAX + 1u];
    pfl_constraint_t constraint;
    pfl_kernel_t kernel;
    pfl_watch_t watch;
    float ok_sigma[PFL_STATES_MAX];
    float lo[PFL_STATES_MAX], hi[PFL_STATES_MAX];
} setup_t;

/* ---- Callbacks that are in order ----------------------------------------------------------------------------------- */

static void predict(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    const setup_t *s = (const setup_t *)user;
    (void)u;
    for (uint32_t d = 0u; d < s->config.states; d++) {
        for (uint32_t i = 0u; i < p->n; i++) {
            PFL_STATE(p, d)[i] += dt_s * ((d < s->config.noises) ? PFL_NOISE(p, d)[i] : 0.1f);
        }
    }
}

static void draw(void *user, const pfl_batch_t *p)
{
    const setup_t *s = (const setup_t *)user;
    for (uint32_t d = 0u; d < s->config.states; d++) {
        memcpy(PFL_STATE(p, d), PFL_NOISE(p, d), sizeof(float) * p->n);
    }
}

static void loglik(void *user, const void *z, const pfl_view_t *p, float *ll)
{
    (void)user;
    for (uint32_t i = 0u; i < p->n; i++) {
        const float off = (p->x[i] - *(const float *)z) * 1.0e-3f;
        ll[i] = fmaxf(-0.5f * (off * off), -100.0f);
    }
}

static void inside(void *user, const pfl_view_t *p, uint32_t *flags)
{
    (void)user;
    for (uint32_t i = 0u; i < p->n; i++) {
        flags[i] = (p->x[i] < 1.0f) ? 1u : 0u;
    }
}

static void project(void *user, const pfl_batch_t *p)
{
    (void)user;
    for (uint32_t i = 0u; i < p->n; i++) {
        p->x[i] = fminf(p->x[i], 0.9f);
    }
}

static void redraw(void *user, const void *z, const pfl_batch_t *p)
{
    draw(user, p);
    for (uint32_t i = 0u; i < p->n; i++) {
        p->x[i] = *(const float *)z;
    }
}

/* ---- Configurations -------------------------------------------------------------------------------------------------- */

/* A field: mostly one that is legal, so that not every configuration fails at the first. */
static uint32_t field(stream_t *in, uint32_t most)
{
    const uint8_t how = take_u8(in);
    if (how < 224u) {
        return (how % 32u) % (most + 1u);
    }
    return (how < 240u) ? (most + (how & 1u)) : take_u32(in);
}

static void choose_parts(stream_t *in, setup_t *s)
{
    pfl_config_t *c = &s->config;
    const uint8_t parts = take_u8(in);
    for (uint32_t d = 0u; ((parts & 1u) != 0u) && (d < PFL_STATES_MAX); d++) {
        s->lo[d] = take_float(in);
        s->hi[d] = ((parts & 2u) != 0u) ? (s->lo[d] + 3.0f) : take_float(in);
    }
    c->lo = ((parts & 5u) != 0u) ? s->lo : NULL;
    c->hi = ((parts & 5u) == 1u) ? s->hi : NULL;
    if ((parts & 8u) != 0u) {
        s->constraint.inside = ((parts & 0x70u) == 0x70u) ? NULL : inside;
        s->constraint.project = ((parts & 0x70u) == 0x60u) ? NULL : project;
        s->constraint.tries = field(in, 4u);
        s->constraint.keep = ((parts & 0x70u) == 0x50u) ? NULL : pfl_constraint_keep;
        c->constraint = &s->constraint;
    }
    if ((parts & 128u) != 0u) {
        s->kernel.width = ((parts & 64u) != 0u) ? 0.5f : take_float(in);
        s->kernel.states_mask = field(in, 7u);
        s->kernel.move = ((parts & 0x30u) == 0x30u) ? NULL : pfl_kernel_move;
        c->kernel = &s->kernel;
    }
}

static void choose_watch(stream_t *in, setup_t *s)
{
    pfl_watch_t *w = &s->watch;
    const uint8_t parts = take_u8(in);
    if ((parts & 1u) == 0u) {
        return;
    }
    for (uint32_t d = 0u; d < PFL_STATES_MAX; d++) {
        s->ok_sigma[d] = ((parts & 2u) != 0u) ? 2.0f : take_float(in);
    }
    w->ok_sigma = ((parts & 4u) != 0u) ? s->ok_sigma : NULL;
    w->confirm_us = take_u16(in);
    w->lost_us = take_u32(in);
    w->lost_rejects = take_u8(in) & 3u;
    w->settle_updates = take_u16(in);
    w->lean_ratio = ((parts & 8u) != 0u) ? take_float(in) : 0.0f;
    w->reinject = ((parts & 16u) != 0u) ? take_float(in) : 0.3f;
    w->keep = ((parts & 0xE0u) == 0xE0u) ? NULL : pfl_watch_keep;
    s->config.watch = w;
    for (uint32_t k = 0u; k <= PFL_SENSORS_MAX; k++) {
        s->sensor[k].redraw = ((parts & 32u) != 0u) ? redraw : NULL;
        s->sensor[k].timeout_us = ((parts & 64u) != 0u) ? take_u8(in) * 1000u : 0u;
        s->sensor[k].z_bytes = ((parts & 128u) != 0u) ? sizeof(float) : 0u;
        s->sensor[k].frozen_after = (uint16_t)(k & 3u);
    }
}

static void choose(stream_t *in, setup_t *s)
{
    static const pfl_scheme_fn schemes[] = {pfl_systematic, pfl_stratified, pfl_residual, pfl_multinomial};
    pfl_config_t *c = &s->config;
    memset(s, 0, sizeof *s);
    const uint8_t odd = take_u8(in);
    c->abi = ((odd & 0x1Fu) == 1u) ? take_u32(in) : PFL_ABI;
    c->particles = field(in, 31u);
    c->states = (uint16_t)field(in, PFL_STATES_MAX);
    c->noises = (uint16_t)field(in, PFL_NOISES_MAX);
    c->sensor_count = (uint16_t)field(in, 3u);
    c->resampling = schemes[take_u8(in) & 3u];
    c->moments = (uint16_t)field(in, PFL_MOMENTS_MEAN);
    c->circular_mask = field(in, 3u);
    c->circular = ((odd & 0x1Fu) == 2u) ? NULL : pfl_circular_means;
    c->ess_ratio = ((odd & 0x20u) != 0u) ? take_float(in) : 0.5f;
    c->seed = field(in, 3u);
    c->dt_max_us = ((odd & 0x40u) != 0u) ? take_u32(in) : 0u;
    c->budget_cycles = ((odd & 0x80u) != 0u) ? take_u8(in) : 0u;
    for (uint32_t k = 0u; (k < c->sensor_count) && (k <= PFL_SENSORS_MAX); k++) {
        s->sensor[k].loglik = ((take_u8(in) & 31u) == 31u) ? NULL : loglik;
        s->sensor[k].gate = ((odd & 4u) != 0u) ? take_float(in) : 0.0f;
    }
    choose_parts(in, s);
    choose_watch(in, s);
    c->sensors = ((odd & 0x1Fu) == 3u) ? NULL : s->sensor;
    c->predict = ((odd & 0x1Fu) == 4u) ? NULL : predict;
    c->draw = ((odd & 8u) != 0u) ? NULL : draw;
    c->user = s;
}

/* ---- What the header calls legal --------------------------------------------------------------------------------------- */

static bool numbers_are_legal(const pfl_config_t *c)
{
    return c->particles >= 1u && c->particles <= PFL_PARTICLES_MAX && c->states >= 1u && c->states <= PFL_STATES_MAX &&
           c->noises <= PFL_NOISES_MAX && c->sensor_count <= PFL_SENSORS_MAX && c->moments <= PFL_MOMENTS_MEAN &&
           (c->circular_mask == 0u || c->circular != NULL) &&
           ((uint64_t)c->circular_mask < ((uint64_t)1u << c->states)) && c->ess_ratio >= 0.0f && c->ess_ratio <= 1.0f &&
           c->predict != NULL;
}

static bool parts_are_legal(const pfl_config_t *c)
{
    bool legal = (c->lo == NULL) == (c->hi == NULL) && (c->sensors != NULL || c->sensor_count == 0u);
    for (uint32_t k = 0u; legal && k < c->sensor_count; k++) {
        legal = c->sensors[k].loglik != NULL && isfinite(c->sensors[k].gate) && c->sensors[k].gate >= 0.0f;
    }
    for (uint32_t d = 0u; legal && c->lo != NULL && d < c->states; d++) {
        legal = c->lo[d] < c->hi[d];
    }
    if (c->constraint != NULL) {
        legal = legal && c->constraint->inside != NULL && c->constraint->project != NULL &&
                c->constraint->keep != NULL && c->constraint->tries >= 1u && c->constraint->tries <= PFL_TRIES_MAX;
    }
    if (c->kernel != NULL) {
        legal = legal && c->kernel->move != NULL && c->moments == PFL_MOMENTS_FULL && c->kernel->width > 0.0f &&
                c->kernel->width < 1.0f && ((uint64_t)c->kernel->states_mask < ((uint64_t)1u << c->states));
    }
    return legal;
}

static bool watch_is_legal(const pfl_config_t *c)
{
    const pfl_watch_t *w = c->watch;
    bool legal = true;
    if (w != NULL) {
        legal = w->keep != NULL && w->lean_ratio >= 0.0f && w->lean_ratio <= 1.0f && w->reinject >= 0.0f &&
                w->reinject <= 1.0f && (w->ok_sigma == NULL || c->moments == PFL_MOMENTS_FULL);
        for (uint32_t d = 0u; legal && w->ok_sigma != NULL && d < c->states; d++) {
            legal = w->ok_sigma[d] > 0.0f;
        }
    }
    return legal;
}

static bool is_legal(const pfl_config_t *c)
{
    return numbers_are_legal(c) && parts_are_legal(c) && watch_is_legal(c);
}

/* ---- A filter that works ------------------------------------------------------------------------------------------------- */

static void check_cycle(pfl_t *f, const pfl_config_t *c, uint64_t t_us)
{
    const float z = 0.2f;
    float mean[PFL_STATES_MAX];
    float cov[PFL_STATES_MAX * PFL_STATES_MAX];
    const bool full = c->moments == PFL_MOMENTS_FULL;
    const pfl_status_t moved = pfl_predict(f, t_us, NULL);
    REQUIRE((moved == PFL_OK) || ((moved == PFL_ERR_GAP) && (c->dt_max_us > 0u)));
    for (uint16_t k = 0u; (moved == PFL_OK) && (k <= c->sensor_count); k++) {
        const pfl_status_t fused = pfl_update(f, k, t_us, &z);
        const bool late = (fused == PFL_DEFERRED) || (fused == PFL_ERR_BUDGET);
        const bool known = (c->watch != NULL) && (k < c->sensor_count) && (c->sensors[k].z_bytes > 0u);
        const bool gated = (k < c->sensor_count) && ((c->sensors[k].gate > 0.0f) || known);
        REQUIRE((fused == PFL_ERR_SENSOR) == (k == c->sensor_count));
        REQUIRE((fused == PFL_OK) || (fused == PFL_ERR_SENSOR) || (late && (c->budget_cycles > 0u)) ||
                ((fused == PFL_REJECTED) && gated));
    }
    const pfl_status_t status = pfl_estimate(f, mean, full ? cov : NULL);
    REQUIRE((status == PFL_OK) || ((status == PFL_ERR_NONFINITE) && (c->lo != NULL)));
    REQUIRE((status != PFL_OK) || all_finite(mean, c->states));
    REQUIRE((status != PFL_OK) || !full || all_finite(cov, (size_t)c->states * c->states));
    REQUIRE(pfl_invariants_hold(f));
}

static void check_box(const pfl_t *f, const pfl_config_t *c)
{
    pfl_view_t view;
    REQUIRE(pfl_particles(f, &view, NULL) == PFL_OK);
    for (uint32_t d = 0u; (c->lo != NULL) && (c->constraint == NULL) && (d < c->states); d++) {
        for (uint32_t i = 0u; i < view.n; i++) {
            const float x = PFL_STATE(&view, d)[i];
            REQUIRE((x >= c->lo[d]) && (x <= c->hi[d]));
        }
    }
}

static void check_filter(const pfl_config_t *c, size_t bytes, uint8_t how)
{
    pfl_t *f = NULL;
    unsigned char *arena = malloc(bytes);
    memset(arena, 0xA5, bytes);
    if ((how & 7u) == 1u) {
        REQUIRE(pfl_init(arena, bytes - 1u - (how >> 3), c, 0u, &f) == PFL_ERR_MEMORY);
    } else if ((how & 7u) == 2u) {
        REQUIRE(pfl_init(arena + 1u + (how >> 6), bytes, c, 0u, &f) == PFL_ERR_MEMORY);
    }
    for (size_t i = 0u; i < bytes; i++) {
        REQUIRE(arena[i] == 0xA5u);
    }
    REQUIRE((f == NULL) && (pfl_init(arena, bytes, c, how, &f) == PFL_OK) && (f != NULL));
    check_box(f, c);
    for (uint32_t k = 1u; k <= CYCLES; k++) {
        check_cycle(f, c, how + (k * 100000u));
    }
    check_box(f, c);
    REQUIRE(pfl_resample(f) == PFL_OK);
    REQUIRE(pfl_reset(f, 0u) == ((c->draw != NULL) ? PFL_OK : PFL_ERR_NO_DRAW));
    REQUIRE(pfl_invariants_hold(f));
    free(arena);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static setup_t s;
    uint64_t room[8] = {0u};
    pfl_t *f = NULL;
    stream_t in = stream_of(data, size);
    choose(&in, &s);
    const pfl_config_t *c = &s.config;
    fuzz_port = (fuzz_port_t){(c->budget_cycles > 0u) ? 0xFFFFFFu : 0u, 0u, 7u, false, 0u};
    const size_t bytes = pfl_arena_bytes(c);
    REQUIRE((bytes > 0u) == is_legal(c));
    if ((bytes == 0u) || (c->abi != PFL_ABI)) {
        const pfl_status_t status = pfl_init(room, sizeof room, c, 0u, &f);
        REQUIRE(status == ((c->abi != PFL_ABI) ? PFL_ERR_ABI : PFL_ERR_CONFIG));
    } else if (c->particles <= PARTICLES_FLOWN) {
        check_filter(c, bytes, take_u8(&in));
    } else {
        REQUIRE(bytes >= ((size_t)c->particles * (c->states + 2u) * sizeof(float)));
        REQUIRE(pfl_init(room, sizeof room, c, 0u, &f) == PFL_ERR_MEMORY);
    }
    for (size_t k = 0u; k < sizeof room / sizeof room[0]; k++) {
        REQUIRE(room[k] == 0u);
    }
    return 0;
}
