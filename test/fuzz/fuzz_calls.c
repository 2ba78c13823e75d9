/* Any sequence of public calls on up to three filters, with callbacks that do anything a callback can do: after each
 * call the invariants hold, its status is one that the header names, its outputs are finite, a refusal left no trace,
 * and no other filter has changed by a bit.
 *
 * A new public call is a function and a line in `calls`. */
#include "fuzz.h"

#include "core.h"

#include <math.h>
#include <stdlib.h>

#define SLOTS 3u /* filters; the last is where forks go */
#define FORK (SLOTS - 1u)
#define STATES 4u
#define PARTICLES 70u
#define SENSORS 3u
#define ARENA_MAX (PFL_ARENA_BYTES(PARTICLES, STATES, STATES) + PFL_RETRY_BYTES(STATES) + PFL_WATCH_BYTES(SENSORS))
#define CALLS_MAX 48u
#define DEPTH 2u /* a callback may call another filter, whose callbacks call none */

typedef struct {
    pfl_config_t config;
    pfl_sensor_t sensor[SENSORS];
    pfl_constraint_t constraint;
    pfl_kernel_t kernel;
    pfl_watch_t watch;
    float lo[STATES], hi[STATES], ok_sigma[STATES];
} setup_t;

typedef struct {
    pfl_t *f;             /* null: none */
    const setup_t *setup; /* a fork has its original's */
    void *arena;
    size_t bytes;
    bool worn;                       /* a bit of its unguarded memory was flipped, and not scrubbed yet */
    unsigned char before[ARENA_MAX]; /* the arena as the last call left it */
} slot_t;

typedef struct {
    stream_t in;
    setup_t setup[FORK];
    slot_t slot[SLOTS];
    uint32_t entered; /* slots whose call is under way */
    uint32_t touched; /* slots that the call at hand may change */
    const pfl_t *running;
    uint32_t depth, calls;
    bool worn;   /* some filter is */
    bool vandal; /* a callback wrote where it should not, in the call at hand */
    float last_z;
    void *kept; /* a snapshot */
    size_t kept_bytes;
    const setup_t *kept_setup;
    bool kept_has_moments;
    float kept_mean[STATES], kept_cov[STATES * STATES];
} world_t;

static world_t world;

static void call_inside_callback(void);

/* ---- Callbacks: mostly sane, now and then anything --------------------------------------------------------------- */

typedef enum { DO_SANE, DO_ONE, DO_EACH, DO_SAME, DO_SCALE, DO_BEYOND, DO_CALL } deed_t;

static deed_t next_deed(void)
{
    const uint8_t byte = take_u8(&world.in);
    return (byte < 160u)   ? DO_SANE
           : (byte < 192u) ? DO_ONE
           : (byte < 208u) ? DO_EACH
           : (byte < 220u) ? DO_SAME
           : (byte < 230u) ? DO_SCALE
           : (byte < 234u) ? DO_BEYOND
                           : DO_CALL;
}

static void spoil(float *x, uint32_t n, deed_t deed)
{
    if (deed == DO_CALL) {
        call_inside_callback();
    } else if (deed == DO_ONE) {
        x[take_below(&world.in, n)] = take_float(&world.in);
    } else if (deed == DO_EACH) {
        for (uint32_t i = 0u; i < n; i++) {
            x[i] = take_float(&world.in);
        }
    } else if (deed == DO_SAME || deed == DO_SCALE) {
        const float value = take_float(&world.in);
        for (uint32_t i = 0u; i < n; i++) {
            x[i] = (deed == DO_SAME) ? value : (x[i] * value);
        }
    }
}

/* One float behind its last particle: into a canary, or into a word that the guard looks at. */
static void write_beyond(float *last, deed_t deed)
{
    if (deed == DO_BEYOND) {
        last[1] = take_float(&world.in);
        world.vandal = true;
    }
}

static void spoil_particles(const setup_t *setup, const pfl_batch_t *p)
{
    const deed_t deed = next_deed();
    const uint32_t d = take_below(&world.in, setup->config.states);
    const bool at_the_end =
        (p->stride == PFL_STRIDE(setup->config.particles)) && ((p->first + p->n) == setup->config.particles);
    spoil(PFL_STATE(p, d), p->n, deed);
    if (at_the_end) {
        write_beyond(PFL_STATE(p, d) + (p->n - 1u), deed);
    }
}

static void check_batch(const setup_t *setup, uint32_t first, uint32_t n, size_t stride)
{
    REQUIRE((n >= 1u) && (n <= PFL_BATCH) && (n <= stride));
    REQUIRE((first < setup->config.particles) && (n <= (setup->config.particles - first)));
}

static void predict(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    const setup_t *setup = (const setup_t *)user;
    const uint32_t states = setup->config.states;
    (void)u;
    check_batch(setup, p->first, p->n, p->stride);
    REQUIRE(isfinite(dt_s) && (dt_s >= 0.0f));
    for (uint32_t d = 0u; d < states; d++) {
        float *x = PFL_STATE(p, d);
        REQUIRE(world.worn || all_finite(x, p->n));
        for (uint32_t i = 0u; i < p->n; i++) {
            x[i] += dt_s * PFL_STATE(p, (d + 1u) % states)[i];
        }
    }
    for (uint32_t q = 0u; q < setup->config.noises; q++) {
        const float *noise = PFL_NOISE(p, q);
        for (uint32_t i = 0u; i < p->n; i++) {
            REQUIRE(fabsf(noise[i]) < 6.67f);
            PFL_STATE(p, q % states)[i] += 0.1f * noise[i];
        }
    }
    spoil_particles(setup, p);
}

static void draw(void *user, const pfl_batch_t *p)
{
    const setup_t *setup = (const setup_t *)user;
    check_batch(setup, p->first, p->n, p->stride);
    for (uint32_t d = 0u; d < setup->config.states; d++) {
        REQUIRE(all_finite(PFL_NOISE(p, d), p->n));
        memcpy(PFL_STATE(p, d), PFL_NOISE(p, d), sizeof(float) * p->n);
    }
    spoil_particles(setup, p);
}

static void redraw(void *user, const void *z, const pfl_batch_t *p)
{
    draw(user, p);
    for (uint32_t i = 0u; i < p->n; i++) {
        p->x[i] += *(const float *)z;
    }
}

static void loglik(void *user, const void *z, const pfl_view_t *p, float *ll)
{
    const setup_t *setup = (const setup_t *)user;
    const deed_t deed = next_deed();
    check_batch(setup, p->first, p->n, p->stride);
    for (uint32_t d = 0u; d < setup->config.states; d++) {
        REQUIRE(world.worn || all_finite(p->x + (d * p->stride), p->n));
    }
    for (uint32_t i = 0u; i < p->n; i++) {
        const float off = p->x[i] - *(const float *)z;
        ll[i] = -0.5f * (off * off);
    }
    spoil(ll, p->n, deed);
    if (p->n < PFL_BATCH) {
        write_beyond(&ll[p->n - 1u], deed);
    }
}

static void inside(void *user, const pfl_view_t *p, uint32_t *flags)
{
    const uint8_t how = take_u8(&world.in);
    check_batch((const setup_t *)user, p->first, p->n, p->stride);
    for (uint32_t i = 0u; i < p->n; i++) {
        flags[i] = (fabsf(p->x[i]) < 2.0f) ? 1u : 0u;
        flags[i] = (how < 192u) ? flags[i] : (how < 224u) ? (how & 1u) : take_u8(&world.in);
    }
}

static void project(void *user, const pfl_batch_t *p)
{
    check_batch((const setup_t *)user, p->first, p->n, p->stride);
    for (uint32_t i = 0u; i < p->n; i++) {
        p->x[i] = (fabsf(p->x[i]) < 2.0f) ? p->x[i] : 1.0f;
    }
    spoil(p->x, p->n, next_deed());
}

/* ---- Configurations ------------------------------------------------------------------------------------------------ */

static void choose_sizes(stream_t *in, pfl_config_t *c)
{
    static const pfl_scheme_fn schemes[] = {pfl_systematic, pfl_stratified, pfl_residual, pfl_multinomial};
    static const uint8_t particles[] = {1u, 2u, 3u, 4u, 5u, 7u, 8u, 9u, 12u, 15u, 16u, 17u, 20u, 33u, 65u, PARTICLES};
    c->abi = PFL_ABI;
    c->particles = particles[take_below(in, 16u)];
    c->states = (uint16_t)(1u + take_below(in, STATES));
    c->noises = (uint16_t)take_below(in, STATES + 1u);
    c->sensor_count = (uint16_t)take_below(in, 4u);
    c->resampling = schemes[take_below(in, 4u)];
    c->seed = take_below(in, 4u);
    c->ess_ratio = (float)take_below(in, 5u) / 4.0f;
}

static void choose_options(stream_t *in, setup_t *s)
{
    static const uint32_t longest_us[] = {0u, 0u, 1000u, 100000u};
    pfl_config_t *c = &s->config;
    const uint8_t bits = take_u8(in);
    c->moments = ((bits & 7u) == 0u) ? PFL_MOMENTS_MEAN : PFL_MOMENTS_FULL;
    c->circular_mask = ((bits & 8u) != 0u) ? (take_u8(in) & ((1u << c->states) - 1u)) : 0u;
    c->circular = pfl_circular_means;
    c->dt_max_us = longest_us[(bits >> 4) & 3u];
    c->draw = ((bits & 0xC0u) == 0u) ? NULL : draw;
    c->budget_cycles = take_u8(in);
    if ((take_u8(in) & 1u) != 0u) {
        for (uint32_t d = 0u; d < c->states; d++) {
            s->lo[d] = take_sane(in);
            s->hi[d] = s->lo[d] + 0.5f;
        }
        c->lo = s->lo;
        c->hi = s->hi;
    }
    if ((take_u8(in) & 1u) != 0u) {
        s->constraint = (pfl_constraint_t){
            .inside = inside, .project = project, .tries = 1u + take_below(in, 4u), .keep = pfl_constraint_keep};
        c->constraint = &s->constraint;
    }
    if (((take_u8(in) & 1u) != 0u) && (c->moments == PFL_MOMENTS_FULL)) {
        s->kernel = (pfl_kernel_t){0.3f, take_u8(in) & ((1u << c->states) - 1u), pfl_kernel_move};
        c->kernel = &s->kernel;
    }
}

/* Limits so narrow that a few calls lead through every phase. */
static void choose_watch(stream_t *in, setup_t *s)
{
    const uint8_t bits = take_u8(in);
    if ((bits & 1u) == 0u) {
        return;
    }
    for (uint32_t d = 0u; d < STATES; d++) {
        s->ok_sigma[d] = ((bits & 2u) != 0u) ? INFINITY : 0.8f;
    }
    s->watch.ok_sigma = (((bits & 4u) != 0u) && (s->config.moments == PFL_MOMENTS_FULL)) ? s->ok_sigma : NULL;
    s->watch.confirm_us = ((bits & 8u) != 0u) ? 1u : 100000u;
    s->watch.lost_us = ((bits & 16u) != 0u) ? 200000u : 0u;
    s->watch.lost_rejects = (bits >> 5) & 1u;
    s->watch.settle_updates = (bits >> 6) & 1u;
    s->watch.lean_ratio = (float)take_below(in, 5u) / 4.0f;
    s->watch.reinject = (float)take_below(in, 9u) / 8.0f;
    s->watch.keep = pfl_watch_keep;
    s->config.watch = &s->watch;
}

static pfl_sensor_t choose_sensor(stream_t *in)
{
    const uint8_t bits = take_u8(in);
    return (pfl_sensor_t){.loglik = loglik,
                          .gate = ((bits & 3u) == 0u) ? 9.0f : 0.0f,
                          .redraw = ((bits & 4u) != 0u) ? redraw : NULL,
                          .timeout_us = ((bits & 8u) != 0u) ? 50000u : 0u,
                          .z_bytes = ((bits & 16u) != 0u) ? sizeof(float) : 0u,
                          .frozen_after = (uint16_t)(bits >> 6)};
}

static void choose_setup(stream_t *in, setup_t *s)
{
    memset(s, 0, sizeof *s);
    choose_sizes(in, &s->config);
    choose_options(in, s);
    choose_watch(in, s);
    for (uint32_t k = 0u; k < s->config.sensor_count; k++) {
        s->sensor[k] = choose_sensor(in);
    }
    s->config.sensors = s->sensor;
    s->config.predict = predict;
    s->config.user = s;
}

/* ---- Checks -------------------------------------------------------------------------------------------------------- */

static void check_health(const pfl_t *f)
{
    pfl_health_t h;
    pfl_record_t record;
    REQUIRE((pfl_health(f, &h) == PFL_OK) && (pfl_record(f, &record) == PFL_OK));
    REQUIRE(isfinite(h.ess) && (h.ess >= 1.0f) && (h.ess <= (float)f->config->particles));
    REQUIRE(isfinite(h.test_ratio) && (h.test_ratio >= 0.0f) && isfinite(h.best_loglik));
    REQUIRE(h.cycles_resample <= h.cycles_last);
    REQUIRE((h.phase <= PFL_PHASE_SETTLING) && ((h.phase == PFL_PHASE_INIT) || (f->config->watch != NULL)));
    REQUIRE(((h.mode & PFL_MODE_USABLE) != 0u) == ((h.phase == PFL_PHASE_TRACKING) || (h.phase == PFL_PHASE_DEGRADED)));
    REQUIRE(((h.fault >> 10) == 0u) && ((h.event >> 9) == 0u) && ((h.mode >> 5) == 0u));
    REQUIRE((f->config->watch == NULL) || /* a snapshot of a filter with other sensors fits one without */
            ((h.reject >> f->config->sensor_count) == 0u));
    REQUIRE((record.t_us == h.t_us) && (record.active == f->config->particles) && (record.cycles == h.cycles_last));
    REQUIRE((record.fault == h.fault) && (record.event == h.event) && (record.reject == h.reject));
    REQUIRE(record.state == ((uint32_t)h.phase | ((h.mode & 15u) << 4)));
    for (uint16_t k = 0u; k <= f->config->sensor_count; k++) {
        pfl_sensor_health_t one;
        const pfl_status_t status = pfl_sensor_health(f, k, &one);
        REQUIRE(status == ((k == f->config->sensor_count) ? PFL_ERR_SENSOR
                           : (f->config->watch == NULL)   ? PFL_ERR_CONFIG
                                                          : PFL_OK));
        REQUIRE((status != PFL_OK) || (isfinite(one.test_ratio) && (one.test_ratio >= 0.0f)));
    }
}

static void check_answers(const pfl_t *f)
{
    float state[STATES];
    float delta[STATES];
    REQUIRE(pfl_invariants_hold(f));
    check_health(f);
    REQUIRE(pfl_most_likely(f, state) == PFL_OK);
    REQUIRE(all_finite(state, f->config->states));
    REQUIRE(pfl_last_reset(f, NULL, NULL, delta) == PFL_OK);
    REQUIRE(all_finite(delta, f->config->states));
}

/* Is a piece of the arena as it was? */
static bool is_kept(const slot_t *s, const void *at, size_t bytes)
{
    const size_t offset = (size_t)((const unsigned char *)at - (const unsigned char *)s->arena);
    return memcmp(at, s->before + offset, bytes) == 0;
}

/* The posterior and all that later calls make of it; not counters and scratch space. */
static void check_posterior_kept(const slot_t *s)
{
    const pfl_t *f = s->f;
    REQUIRE(
        is_kept(s, f->mean,
                sizeof(float) * ((4u * f->config->states) + ((f->config->states * (f->config->states + 1u)) / 2u))));
    REQUIRE(is_kept(s, f->x, sizeof(float) * f->stride * f->config->states));
    REQUIRE(is_kept(s, &f->weights_equal, sizeof f->weights_equal));
    REQUIRE((f->weights_equal != 0u) || is_kept(s, f->log_weight, sizeof(float) * f->stride));
    REQUIRE(is_kept(s, &f->log_weight, sizeof f->log_weight) && is_kept(s, &f->scratch, sizeof f->scratch));
    REQUIRE(is_kept(s, &f->t_us, sizeof f->t_us) && is_kept(s, &f->rng, sizeof f->rng));
    REQUIRE(is_kept(s, &f->log_weight_top, sizeof(float)) && is_kept(s, &f->ess, sizeof(float)));
    REQUIRE(is_kept(s, &f->moments_current, sizeof(uint32_t)) && is_kept(s, &f->resample_pending, sizeof(uint32_t)));
    REQUIRE(is_kept(s, &f->t_fused_us, sizeof(uint64_t)) && is_kept(s, &f->best_index, sizeof(uint32_t)));
}

/* All is as it was but the guards' own, what the mended block says of its repair, and, with `fault`, that mask. */
static bool is_as_before(const slot_t *s, bool mended, bool fault)
{
    struct pfl now;
    struct pfl was;
    memcpy(&now, s->arena, sizeof now);
    memcpy(&was, s->before, sizeof was);
    now.seal = was.seal;
    memcpy(now.copy, was.copy, sizeof now.copy);
    if (mended || ((was.watched.fault & PFL_FAULT_CONFIG) != 0u)) { /* the next call says that that is over */
        now.mended = mended ? was.mended : now.mended;
        now.watched.event &= ~PFL_EVENT_MENDED | was.watched.event;
        now.watched.fault &= ~PFL_FAULT_CONFIG;
        was.watched.fault &= ~PFL_FAULT_CONFIG;
    }
    if (fault) {
        now.watched.fault = was.watched.fault;
    }
    const unsigned char *behind = (const unsigned char *)s->arena + sizeof now;
    return (memcmp(&now, &was, sizeof now) == 0) &&
           (memcmp(behind, s->before + sizeof now, s->bytes - sizeof now) == 0);
}

/* A refusal leaves no trace but counters and masks; one in mid-call keeps the posterior, unless a lost filter helped
 * itself: that is a reset, which it counts. */
static void check_refusal(const slot_t *s, pfl_status_t status)
{
    const bool in_mid_call = (status == PFL_REJECTED) || (status == PFL_ERR_NONFINITE) || (status == PFL_ERR_LOGLIK) ||
                             (status == PFL_ERR_BUDGET) || (status == PFL_ERR_CORRUPT);
    if (!in_mid_call) {
        REQUIRE(is_as_before(s, false, (status == PFL_ERR_TIME) || (status == PFL_ERR_GAP)));
    } else if (is_kept(s, &s->f->resets, sizeof s->f->resets)) {
        check_posterior_kept(s);
    } else {
        REQUIRE(((status == PFL_REJECTED) || (status == PFL_ERR_CORRUPT)) && (s->setup->watch.reinject > 0.0f));
    }
}

/* ---- Calls --------------------------------------------------------------------------------------------------------- */

static uint64_t choose_time(uint64_t now)
{
    const uint8_t how = take_u8(&world.in);
    if (how < 200u) {
        return now + (how * 1000u);
    }
    switch (how & 7u) {
    case 0u:
        return now + 1u;
    case 1u:
        return now - 1u;
    case 2u:
        return now + UINT32_MAX;
    case 3u:
        return now + UINT32_MAX + 1u;
    case 4u:
        return take_u64(&world.in);
    case 5u:
        return UINT64_MAX;
    case 6u:
        return now + 16000u;
    default:
        return now + 1600001u;
    }
}

static pfl_status_t do_predict(slot_t *s)
{
    const uint64_t was_us = s->f->t_us;
    const uint64_t t_us = choose_time(was_us);
    const pfl_status_t status = pfl_predict(s->f, t_us, NULL);
    const bool canary =
        (status == PFL_ERR_CORRUPT) && (s->f->t_us == t_us); /* found at the end of whatever came of it */
    REQUIRE(s->f->t_us == (((status >= PFL_OK) || canary) ? t_us : was_us));
    return status;
}

static pfl_status_t do_update(slot_t *s)
{
    const uint8_t how = take_u8(&world.in);
    const float z = ((how & 0x18u) == 0x18u) ? world.last_z : take_float(&world.in);
    const uint16_t sensor = (uint16_t)(how & 3u);
    const uint64_t t_us = s->f->t_us + (((how & 0x1Cu) == 0x1Cu) ? 1u : 0u);
    world.last_z = z;
    return pfl_update(s->f, sensor, t_us, ((how & 0xE0u) == 0xE0u) ? NULL : &z);
}

static pfl_status_t do_resample(slot_t *s)
{
    const pfl_status_t status = pfl_resample(s->f);
    pfl_view_t view;
    float weight[PARTICLES];
    REQUIRE(pfl_particles(s->f, &view, weight) == PFL_OK);
    for (uint32_t i = 0u; i < view.n; i++) {
        REQUIRE(weight[i] <= 0.0f && weight[i] >= 0.0f);
    }
    return status;
}

static pfl_status_t do_estimate(slot_t *s)
{
    float mean[STATES];
    float cov[STATES * STATES];
    const uint8_t how = take_u8(&world.in);
    const uint32_t states = s->f->config->states;
    const bool covariance = (how & 1u) != 0u;
    const pfl_status_t status = pfl_estimate(s->f, ((how & 0xE0u) == 0xE0u) ? NULL : mean, covariance ? cov : NULL);
    if ((status == PFL_OK) && !s->worn) {
        REQUIRE(all_finite(mean, states));
        REQUIRE(!covariance || all_finite(cov, (size_t)states * states));
        for (uint32_t d = 0u; covariance && (d < states); d++) {
            REQUIRE(cov[d * (states + 1u)] >= 0.0f);
        }
    }
    return status;
}

static pfl_status_t do_reset(slot_t *s)
{
    return pfl_reset(s->f, take_u16(&world.in));
}

static pfl_status_t do_quantile(slot_t *s)
{
    float low = NAN;
    float high = NAN;
    const uint16_t state = (uint16_t)take_below(&world.in, 5u);
    const float p = take_float(&world.in) / 8.0f;
    const pfl_status_t status = pfl_quantile(s->f, state, p, &low);
    if (status == PFL_OK) {
        const pfl_status_t whole = pfl_quantile(s->f, state, 1.0f, &high);
        REQUIRE((whole == PFL_OK) || (s->worn && (whole == PFL_ERR_NONFINITE)));
        REQUIRE(s->worn || (isfinite(low) && isfinite(high) && (low <= high)));
    }
    return status;
}

static pfl_status_t do_farthest(slot_t *s)
{
    float distance = NAN;
    const uint16_t x = (uint16_t)take_below(&world.in, 5u);
    const uint16_t y = (uint16_t)take_below(&world.in, 5u);
    const float at_x = take_float(&world.in);
    const pfl_status_t status = pfl_farthest(s->f, x, y, at_x, take_float(&world.in), &distance);
    REQUIRE((status != PFL_OK) || s->worn || (isfinite(distance) && (distance >= 0.0f)));
    return status;
}

static pfl_status_t do_particles(slot_t *s)
{
    pfl_view_t view;
    float weight[PARTICLES];
    const pfl_status_t status = pfl_particles(s->f, &view, weight);
    bool top = false;
    check_batch(s->setup, view.first, 1u, view.stride);
    REQUIRE(view.n == s->f->config->particles);
    for (uint32_t i = 0u; i < view.n; i++) {
        REQUIRE(s->worn || (weight[i] <= 0.0f));
        top = top || (weight[i] > -1.0e-3f);
    }
    REQUIRE(s->worn || top);
    return status;
}

static pfl_status_t do_fork(slot_t *s)
{
    slot_t *to = &world.slot[FORK];
    const size_t bytes = pfl_arena_bytes(&s->setup->config);
    const bool small = (take_u8(&world.in) & 15u) == 0u;
    if (s == to) {
        pfl_t *none = s->f;
        const pfl_status_t status = pfl_fork(s->f, s->arena, s->bytes, &none);
        REQUIRE((status == PFL_ERR_MEMORY) && (none == NULL));
        return status;
    }
    world.touched |= 1u << FORK;
    free(to->arena);
    to->bytes = small ? (bytes - 1u) : bytes;
    to->arena = malloc(to->bytes);
    to->setup = s->setup;
    to->worn = s->worn;
    const pfl_status_t status = pfl_fork(s->f, to->arena, to->bytes, &to->f);
    REQUIRE((status == PFL_OK) == (to->f != NULL));
    return status;
}

static pfl_status_t look_ahead(void *user, uint32_t step, pfl_t *fork)
{
    float value = 0.0f;
    (void)user;
    (void)step;
    REQUIRE(pfl_quantile(fork, 0u, 0.5f, &value) == PFL_OK);
    REQUIRE(world.worn || isfinite(value));
    return ((take_u8(&world.in) & 15u) == 0u) ? PFL_ERR_SENSOR : PFL_OK;
}

static pfl_status_t do_forecast(slot_t *s)
{
    float mean[3u * STATES];
    float cov[3u * STATES * STATES];
    slot_t *to = &world.slot[FORK];
    const uint8_t how = take_u8(&world.in);
    const pfl_horizon_t horizon = {
        take_u8(&world.in) * 1000u, how & 3u, NULL, NULL, ((how & 8u) != 0u) ? look_ahead : NULL, NULL};
    const bool covariance = ((how & 4u) != 0u) && (s->setup->config.moments == PFL_MOMENTS_FULL);
    if (s == to) {
        return pfl_health(s->f, &(pfl_health_t){0});
    }
    world.touched |= 1u << FORK;
    free(to->arena);
    to->bytes = pfl_arena_bytes(&s->setup->config);
    to->arena = malloc(to->bytes);
    to->setup = s->setup;
    to->worn = s->worn;
    world.running = NULL; /* the fork is, and nobody knows it yet */
    const pfl_status_t status =
        pfl_forecast(s->f, to->arena, to->bytes, &horizon, mean, covariance ? cov : NULL, &to->f);
    if ((status >= PFL_OK) && !s->worn) {
        const size_t n = (size_t)horizon.steps * s->setup->config.states;
        REQUIRE(all_finite(mean, n) && (!covariance || all_finite(cov, n * s->setup->config.states)));
    }
    REQUIRE(memcmp(s->arena, s->before, s->bytes) == 0);
    return status;
}

static pfl_status_t do_snapshot(slot_t *s)
{
    const size_t bytes = pfl_snapshot_bytes(s->f);
    const bool small = (take_u8(&world.in) & 15u) == 0u;
    const bool full = s->setup->config.moments == PFL_MOMENTS_FULL;
    world.kept_has_moments = pfl_estimate(s->f, world.kept_mean, full ? world.kept_cov : NULL) == PFL_OK;
    free(world.kept);
    world.kept_bytes = small ? (bytes - 1u) : bytes;
    world.kept = calloc(1u, world.kept_bytes);
    const pfl_status_t status = pfl_snapshot(s->f, world.kept, world.kept_bytes);
    REQUIRE(status == (small ? PFL_ERR_MEMORY : PFL_OK));
    world.kept_setup = (small || s->worn) ? NULL : s->setup;
    if (small) { /* the estimate above may have been the first since a predict */
        memcpy(s->before, s->arena, s->bytes);
    }
    return status;
}

/* What was kept comes back to the bit, in the original and in its forks. */
static pfl_status_t do_restore(slot_t *s)
{
    float mean[STATES];
    float cov[STATES * STATES];
    const uint32_t states = s->f->config->states;
    const bool full = s->setup->config.moments == PFL_MOMENTS_FULL;
    const pfl_status_t status = pfl_restore(s->f, world.kept, world.kept_bytes);
    REQUIRE((status == PFL_OK) || (world.kept_setup != s->setup) || s->worn);
    if ((status == PFL_OK) && (world.kept_setup == s->setup) && world.kept_has_moments) {
        REQUIRE(pfl_estimate(s->f, mean, full ? cov : NULL) == PFL_OK);
        REQUIRE(memcmp(mean, world.kept_mean, sizeof(float) * states) == 0);
        REQUIRE(!full || (memcmp(cov, world.kept_cov, sizeof(float) * states * states) == 0));
    }
    return status;
}

/* Damage in idle time is mended, and where there is none nothing is. */
static pfl_status_t do_scrub(slot_t *s)
{
    uint32_t mended = 0u;
    pfl_status_t status = pfl_scrub(s->f, &mended);
    REQUIRE((status == PFL_OK) || ((status == PFL_ERR_CORRUPT) && s->worn));
    REQUIRE(s->worn || (mended == 0u) || (s->setup->config.lo != NULL));
    if (status != PFL_OK) {
        status = pfl_scrub(s->f, &mended); /* that was a canary */
    }
    s->worn = false;
    return status;
}

/* Answers that do not change the filter, of one whose memory may be damaged: they know, or follow nothing that is. */
static void read_all(const slot_t *s, pfl_status_t want)
{
    pfl_view_t view;
    pfl_health_t health;
    pfl_record_t record;
    pfl_sensor_health_t sensor;
    float value[STATES];
    float weight[PARTICLES];
    uint32_t count;
    uint64_t t_us;
    const pfl_status_t got = pfl_health(s->f, &health);
    REQUIRE((got == want) || ((got == PFL_OK) && (want == PFL_ERR_CONFIG)));
    REQUIRE((pfl_record(s->f, &record) == want) && (pfl_sensor_health(s->f, 0u, &sensor) == want));
    REQUIRE((pfl_particles(s->f, &view, weight) == want) && (pfl_most_likely(s->f, value) == want));
    REQUIRE((pfl_last_reset(s->f, &count, &t_us, value) == want) && (pfl_snapshot_bytes(s->f) == 0u));
    REQUIRE((pfl_farthest(s->f, 0u, 0u, 0.0f, 0.0f, value) == want) && !pfl_invariants_hold(s->f));
    REQUIRE(isfinite(pfl_effective_sample_size(s->f)));
}

/* One flipped bit of what is guarded is mended at the next call, as if it had not been; two may be beyond repair. The
 * same bit of the block and of its copy is a change that nothing can see: not tried. */
static void flip_guarded(slot_t *s, size_t offset, uint8_t bit)
{
    unsigned char *bytes = (unsigned char *)s->arena;
    const bool twice = (take_u8(&world.in) & 7u) == 0u;
    const size_t other = (offset + take_u16(&world.in)) % offsetof(struct pfl, rng);
    const size_t apart = (offset > other) ? (offset - other) : (other - offset);
    if (twice && (apart == offsetof(struct pfl, copy)) && ((bit & 7u) == ((bit >> 3) & 7u))) {
        return;
    }
    bytes[offset] ^= (unsigned char)(1u << (bit & 7u));
    bytes[other] ^= twice ? (unsigned char)(1u << ((bit >> 3) & 7u)) : 0u;
    if (!twice && (offset < offsetof(struct pfl, seal))) { /* block and copy agree that a damaged seal is wrong */
        read_all(s, PFL_ERR_CORRUPT);
    }
    const pfl_status_t status = pfl_update(s->f, 0u, 0u, NULL);
    REQUIRE((status == PFL_ERR_ARG) || (twice && (status == PFL_ERR_CORRUPT)));
    if (status == PFL_ERR_ARG) {
        REQUIRE(is_as_before(s, true, true));
    } else {
        float value[STATES * STATES];
        REQUIRE(pfl_predict(s->f, 0u, NULL) == PFL_ERR_CORRUPT);
        REQUIRE((pfl_estimate(s->f, value, NULL) == PFL_ERR_CORRUPT) && (pfl_reset(s->f, 0u) == PFL_ERR_CORRUPT));
        REQUIRE(pfl_scrub(s->f, NULL) == PFL_ERR_CORRUPT);
        memcpy(s->arena, s->before, s->bytes);
    }
}

/* Anywhere, or the bit of a particle that turns what lies between 1 and 2 into what is not finite. */
static void flip_unguarded(slot_t *s, size_t at, uint8_t how)
{
    const size_t first = offsetof(struct pfl, rng);
    const size_t numbers = (size_t)s->f->stride * s->f->config->states;
    const bool number = (how & 16u) != 0u;
    unsigned char *byte = number ? ((unsigned char *)&s->f->x[at % numbers] + 3)
                                 : ((unsigned char *)s->arena + first + (at % (s->bytes - first)));
    *byte ^= (unsigned char)(number ? 0x40u : (1u << (how & 7u)));
    s->worn = true;
}

static pfl_status_t do_flip(slot_t *s)
{
    const uint8_t how = take_u8(&world.in);
    const size_t at = take_u16(&world.in) | (((size_t)how >> 7) << 16);
    if (((how & 64u) != 0u) && !s->worn) {
        flip_guarded(s, at % offsetof(struct pfl, rng), how);
    } else {
        flip_unguarded(s, at, how);
    }
    if (((how & 32u) != 0u) && s->worn) {
        return do_scrub(s);
    }
    return pfl_health(s->f, &(pfl_health_t){0});
}

/* A flipped bit of the configuration: every call says so and changes nothing, and goes on when it is flipped back. */
static pfl_status_t do_flip_config(slot_t *s)
{
    float value[STATES * STATES];
    const setup_t *setup = s->setup;
    const pfl_config_t *c = &setup->config;
    const struct {
        const void *at;
        size_t bytes;
    } parts[] = {{c, offsetof(pfl_config_t, user) + sizeof c->user}, /* 32-bit machines pad behind it */
                 {setup->sensor, c->sensor_count * sizeof setup->sensor[0]},
                 {c->constraint, sizeof *c->constraint},
                 {c->kernel, sizeof *c->kernel},
                 {c->watch, sizeof *c->watch},
                 {c->lo, c->states * sizeof(float)},
                 {c->hi, c->states * sizeof(float)},
                 {(c->watch != NULL) ? c->watch->ok_sigma : NULL, c->states * sizeof(float)}};
    const uint32_t part = take_below(&world.in, 8u);
    const bool there = (parts[part].at != NULL) && (parts[part].bytes > 0u);
    const void *at = there ? parts[part].at : parts[0].at;
    const size_t offset = take_u8(&world.in) % (there ? parts[part].bytes : parts[0].bytes);
    unsigned char *byte = (unsigned char *)(uintptr_t)at + offset; /* the parts are the target's own */
    const unsigned char bit = (unsigned char)(1u << (take_u8(&world.in) & 7u));
    *byte ^= bit;
    read_all(s, PFL_ERR_CONFIG);
    REQUIRE((pfl_predict(s->f, 0u, NULL) == PFL_ERR_CONFIG) && (pfl_update(s->f, 0u, 0u, value) == PFL_ERR_CONFIG));
    REQUIRE((pfl_resample(s->f) == PFL_ERR_CONFIG) && (pfl_reset(s->f, 0u) == PFL_ERR_CONFIG));
    REQUIRE((pfl_estimate(s->f, value, NULL) == PFL_ERR_CONFIG) && (pfl_scrub(s->f, NULL) == PFL_ERR_CONFIG));
    REQUIRE((pfl_quantile(s->f, 0u, 0.5f, value) == PFL_ERR_CONFIG));
    REQUIRE(pfl_snapshot(s->f, value, sizeof value) == PFL_ERR_CONFIG);
    REQUIRE(pfl_restore(s->f, value, sizeof value) == PFL_ERR_CONFIG);
    *byte ^= bit;
    REQUIRE(is_as_before(s, false, true));
    return pfl_health(s->f, &(pfl_health_t){0});
}

static pfl_status_t do_port(slot_t *s)
{
    fuzz_port.step = take_float(&world.in) > 0.0f ? take_u8(&world.in) : take_u32(&world.in);
    return pfl_health(s->f, &(pfl_health_t){0});
}

/* What is no filter is told from one. */
static pfl_status_t do_stranger(slot_t *s)
{
    static uint64_t nothing[PFL_CONTROL_BYTES / 8u];
    float value[STATES * STATES];
    const bool null = (take_u8(&world.in) & 1u) != 0u;
    pfl_t *f = null ? NULL : (pfl_t *)(void *)nothing;
    const pfl_status_t want = null ? PFL_ERR_ARG : PFL_ERR_CORRUPT;
    REQUIRE((pfl_predict(f, 0u, NULL) == want) && (pfl_update(f, 0u, 0u, value) == want));
    REQUIRE((pfl_resample(f) == want) && (pfl_reset(f, 0u) == want) && (pfl_estimate(f, value, NULL) == want));
    REQUIRE((pfl_most_likely(f, value) == want) && (pfl_quantile(f, 0u, 0.5f, value) == want));
    REQUIRE((pfl_particles(f, &(pfl_view_t){0}, NULL) == want) && (pfl_farthest(f, 0u, 0u, 0.0f, 0.0f, value) == want));
    REQUIRE((pfl_health(f, &(pfl_health_t){0}) == want) && (pfl_last_reset(f, NULL, NULL, value) == want));
    REQUIRE((pfl_snapshot(f, value, sizeof value) == want) && (pfl_restore(f, value, sizeof value) == want));
    REQUIRE((pfl_scrub(f, NULL) == want) && (pfl_record(f, &(pfl_record_t){0}) == want));
    REQUIRE(pfl_sensor_health(f, 0u, &(pfl_sensor_health_t){0}) == want);
    REQUIRE((pfl_snapshot_bytes(f) == 0u) && !pfl_invariants_hold(f) && !(pfl_effective_sample_size(f) > 0.0f));
    REQUIRE((pfl_fork(f, s->arena, s->bytes, &f) == want) && (f == NULL));
    return pfl_health(s->f, &(pfl_health_t){0});
}

#define ST(status) (1u << ((status)-PFL_ERR_NO_DRAW))

#define UPDATE                                                                                                         \
    (ST(PFL_OK) | ST(PFL_DEFERRED) | ST(PFL_REJECTED) | ST(PFL_ERR_NONFINITE) | ST(PFL_ERR_LOGLIK) |                   \
     ST(PFL_ERR_BUDGET) | ST(PFL_ERR_TIME) | ST(PFL_ERR_SENSOR) | ST(PFL_ERR_ARG))

typedef struct {
    const char *name;
    pfl_status_t (*call)(slot_t *s);
    uint32_t statuses; /* that the header names */
    bool shares;       /* uses what belongs to no single filter: not from within a callback */
} call_t;

static const call_t calls[] = {
    {"predict", do_predict,
     ST(PFL_OK) | ST(PFL_QUARANTINED) | ST(PFL_ERR_NONFINITE) | ST(PFL_ERR_TIME) | ST(PFL_ERR_GAP), false},
    {"update", do_update, UPDATE, false},
    {"estimate", do_estimate, ST(PFL_OK) | ST(PFL_ERR_CONFIG) | ST(PFL_ERR_ARG) | ST(PFL_ERR_NONFINITE), false},
    {"predict", do_predict,
     ST(PFL_OK) | ST(PFL_QUARANTINED) | ST(PFL_ERR_NONFINITE) | ST(PFL_ERR_TIME) | ST(PFL_ERR_GAP), false},
    {"resample", do_resample, ST(PFL_OK), false},
    {"reset", do_reset, ST(PFL_OK) | ST(PFL_ERR_NO_DRAW) | ST(PFL_ERR_NONFINITE), false},
    {"quantile", do_quantile, ST(PFL_OK) | ST(PFL_ERR_ARG), false},
    {"farthest", do_farthest, ST(PFL_OK) | ST(PFL_ERR_ARG), false},
    {"particles", do_particles, ST(PFL_OK), false},
    {"fork", do_fork, ST(PFL_OK) | ST(PFL_ERR_MEMORY), true},
    {"forecast", do_forecast,
     ST(PFL_OK) | ST(PFL_QUARANTINED) | ST(PFL_ERR_ARG) | ST(PFL_ERR_NONFINITE) | ST(PFL_ERR_TIME) | ST(PFL_ERR_GAP) |
         ST(PFL_ERR_SENSOR),
     true},
    {"snapshot", do_snapshot, ST(PFL_OK) | ST(PFL_ERR_MEMORY), true},
    {"restore", do_restore, ST(PFL_OK) | ST(PFL_ERR_CORRUPT) | ST(PFL_ERR_ARG), true},
    {"port", do_port, ST(PFL_OK), true},
    {"stranger", do_stranger, ST(PFL_OK), false},
    {"scrub", do_scrub, ST(PFL_OK), false},
    {"flip", do_flip, ST(PFL_OK), true},
    {"flip config", do_flip_config, ST(PFL_OK), true},
    {"update", do_update, UPDATE, false},
    {"update", do_update, UPDATE, false},
};
enum { CALLS = sizeof calls / sizeof calls[0] };

/* No other filter changes: a fault in one never costs another a bit. */
static void check_others(void)
{
    for (uint32_t k = 0u; k < SLOTS; k++) {
        slot_t *s = &world.slot[k];
        if ((s->f == NULL) || ((world.entered & (1u << k)) != 0u)) {
            continue;
        }
        if ((world.touched & (1u << k)) != 0u) {
            memcpy(s->before, s->arena, s->bytes);
        } else {
            REQUIRE(memcmp(s->before, s->arena, s->bytes) == 0);
        }
    }
}

static void make_call(uint32_t k, const call_t *call)
{
    slot_t *s = &world.slot[k];
    const pfl_t *outer = world.running;
    world.vandal = world.vandal && (world.depth > 0u);
    world.worn = false;
    for (uint32_t n = 0u; n < SLOTS; n++) {
        world.worn = world.worn || ((world.slot[n].f != NULL) && world.slot[n].worn);
    }
    const uint32_t outer_touched = world.touched;
    world.running = s->f;
    world.touched = 1u << k;
    world.entered |= 1u << k;
    const pfl_status_t status = call->call(s);
    world.entered &= ~(1u << k);
    world.running = outer;
    fuzz_note(call->name, (int)status);
    REQUIRE((status >= PFL_ERR_NO_DRAW) && (status <= PFL_QUARANTINED));
    const uint32_t damage =
        (s->worn ? (ST(PFL_ERR_CORRUPT) | ST(PFL_ERR_NONFINITE)) : 0u) | (world.vandal ? ST(PFL_ERR_CORRUPT) : 0u);
    REQUIRE(((call->statuses | damage) & ST(status)) != 0u);
    if ((s->f != NULL) && !s->worn) {
        const bool reset_failed = (call->call == do_reset) && (status == PFL_ERR_NONFINITE);
        const bool estimated = (call->call == do_estimate) && (status == PFL_ERR_NONFINITE);
        const bool elsewhere = (call->call == do_forecast) || (call->call == do_fork);
        const bool vandalised = (status == PFL_ERR_CORRUPT) && (call->call != do_update);
        if ((status < PFL_OK) && !reset_failed && !estimated && !elsewhere && !vandalised) {
            check_refusal(s, status);
        }
        REQUIRE(pfl_invariants_hold(s->f));
        if ((world.calls++ & 3u) == 0u) { /* they take longer than most calls */
            check_answers(s->f);
        }
    }
    check_others();
    world.touched = outer_touched | world.touched;
}

/* From within a callback: the running filter is busy, another one is not. */
static void call_inside_callback(void)
{
    float value[STATES * STATES];
    const uint32_t k = take_below(&world.in, SLOTS);
    pfl_t *f = world.slot[k].f;
    if (f == NULL) {
        return;
    }
    if (f != world.running) {
        const call_t *call = &calls[take_below(&world.in, CALLS)];
        if (((world.entered & (1u << k)) == 0u) && (world.depth < DEPTH) && !call->shares) {
            world.depth++;
            make_call(k, call);
            world.depth--;
        }
        return;
    }
    REQUIRE(pfl_predict(f, f->t_us + 1u, NULL) == PFL_ERR_BUSY);
    REQUIRE(pfl_update(f, 0u, f->t_us, value) == PFL_ERR_BUSY);
    REQUIRE(pfl_resample(f) == PFL_ERR_BUSY);
    REQUIRE(pfl_estimate(f, value, NULL) == PFL_ERR_BUSY);
    REQUIRE(pfl_reset(f, 0u) == PFL_ERR_BUSY);
    REQUIRE(pfl_quantile(f, 0u, 0.5f, value) == PFL_ERR_BUSY);
    REQUIRE(pfl_restore(f, value, sizeof value) == PFL_ERR_BUSY);
    REQUIRE(pfl_scrub(f, NULL) == PFL_ERR_BUSY);
    REQUIRE(pfl_snapshot(f, value, sizeof value) == PFL_ERR_BUSY);
}

/* ---- A run --------------------------------------------------------------------------------------------------------- */

static void make_filter(slot_t *s, setup_t *setup)
{
    choose_setup(&world.in, setup);
    s->setup = setup;
    s->bytes = pfl_arena_bytes(&setup->config);
    REQUIRE((s->bytes > 0u) && (s->bytes <= ARENA_MAX));
    s->arena = malloc(s->bytes);
    const pfl_status_t status = pfl_init(s->arena, s->bytes, &setup->config, take_u8(&world.in), &s->f);
    REQUIRE((status == PFL_OK) || (status == PFL_ERR_NONFINITE) || ((status == PFL_ERR_CORRUPT) && world.vandal));
    REQUIRE((status == PFL_OK) == (s->f != NULL));
    if (s->f != NULL) {
        check_answers(s->f);
        memcpy(s->before, s->arena, s->bytes);
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static const uint32_t masks[] = {0u, 0xFFFFu, 0x00FFFFFFu, 0xFFFFFFFFu};
    world.in = stream_of(data, size);
    const uint8_t port = take_u8(&world.in);
    fuzz_port = (fuzz_port_t){masks[port & 3u], take_u8(&world.in), port >> 5, (port & 28u) == 28u, 0u};
    make_filter(&world.slot[0], &world.setup[0]);
    if ((take_u8(&world.in) & 3u) == 0u) {
        make_filter(&world.slot[1], &world.setup[1]);
    }
    for (uint32_t n = 0u; (n < CALLS_MAX) && !stream_ended(&world.in); n++) {
        const uint8_t byte = take_u8(&world.in);
        const uint32_t k = ((byte >> 5) < SLOTS) ? (uint32_t)(byte >> 5) : 0u;
        if (world.slot[k].f != NULL) {
            make_call(k, &calls[(byte & 31u) % CALLS]);
        }
    }
    for (uint32_t k = 0u; k < SLOTS; k++) {
        if ((world.slot[k].f != NULL) && !world.slot[k].worn) {
            check_answers(world.slot[k].f);
        }
        free(world.slot[k].arena);
        world.slot[k].arena = NULL;
        world.slot[k].f = NULL;
        world.slot[k].worn = false;
    }
    free(world.kept);
    world.kept = NULL;
    world.kept_bytes = 0u;
    world.kept_setup = NULL;
    world.entered = 0u;
    world.depth = 0u;
    world.calls = 0u;
    world.vandal = false;
    world.worn = false;
    world.last_z = 0.0f;
    world.running = NULL;
    return 0;
}
