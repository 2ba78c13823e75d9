/* The filter's calls off a tape: configuration and prior, then the cycle. */
#include "play.h"

#include <string.h>

#ifndef PLAY_POOL_BYTES
#define PLAY_POOL_BYTES 98304u /* arena, and what is left for a forecast: nearly all RAM of an STM32F405 */
#endif

typedef union {
    uint64_t align;
    void *pointer;
    unsigned char bytes[TAPE_TYPE_MAX];
    float floats[TAPE_TYPE_MAX / 4u];
} structure_t;

static union {
    uint64_t align;
    unsigned char bytes[PLAY_POOL_BYTES];
} pool;

/* What the configuration points to. It has to live as long as the filter. */
static pfl_config_t config;
static pfl_sensor_t sensors[PLAY_SENSORS_MAX];
static structure_t sensor_user[PLAY_SENSORS_MAX];
static const type_t *sensor_z[PLAY_SENSORS_MAX];
static uint32_t sensor_floats[PLAY_SENSORS_MAX]; /* of z, where it has no type */
static structure_t model_user;
static pfl_antithetic_t mirrored;
static const type_t *model_u;
static pfl_constraint_t constraint;
static pfl_ring_t ring;
static pfl_kernel_t kernel;
static float box_lo[PFL_STATES_MAX], box_hi[PFL_STATES_MAX];
static structure_t argument; /* u or z of the call at hand */

/* ---- Configuration ---------------------------------------------------------------------------------------------------- */

static void draw_off_tape(void *user, const pfl_batch_t *p)
{
    (void)user;
    for (uint32_t d = 0u; d < config.states; d++) {
        float *x = PFL_STATE(p, d);
        for (uint32_t i = 0u; i < p->n; i++) {
            x[i] = words_next_float();
        }
    }
}

/* Stands for a callback of the runner that no call uses. */
static void no_loglik(void *user, const void *z, const pfl_view_t *p, float *ll)
{
    (void)user;
    (void)z;
    for (uint32_t i = 0u; i < p->n; i++) {
        ll[i] = 1.0f; /* a fault */
    }
}

static bool read_model(const play_t *p)
{
    const uint32_t id = words_next();
    if ((id == 0u) || (id >= tape_models_count)) {
        return false;
    }
    config.predict = tape_models[id].predict;
    model_u = tape_models[id].u;
    words_next_type(tape_models[id].user, &model_user, p->sharpen);
    config.user = &model_user;
    if (p->mirror) {
        mirrored.predict = config.predict;
        mirrored.user = config.user;
        mirrored.noises = config.noises;
        config.predict = pfl_antithetic_predict;
        config.user = &mirrored;
        config.noises = (uint16_t)PFL_ANTITHETIC_NOISES(config.noises);
    }
    return !p->mirror || (mirrored.noises <= PFL_ANTITHETIC_MAX);
}

static bool read_sensors(const play_t *p)
{
    for (uint32_t k = 0u; k < config.sensor_count; k++) {
        const uint32_t id = words_next();
        if ((k >= PLAY_SENSORS_MAX) || (id >= tape_sensors_count)) {
            return false;
        }
        sensors[k].gate = words_next_float();
        sensors[k].user = &sensor_user[k];
        sensors[k].loglik = no_loglik;
        sensor_z[k] = tape_sensors[id].z;
        if (id != 0u) {
            sensors[k].loglik = tape_sensors[id].loglik;
            words_next_type(tape_sensors[id].user, &sensor_user[k], p->sharpen);
            sensor_floats[k] = words_next();
        }
    }
    config.sensors = sensors;
    return true;
}

static bool read_extras(void)
{
    const uint32_t project = words_next();
    if (project >= tape_projects_count) {
        return false;
    }
    if (project != 0u) {
        constraint.inside = pfl_ring_inside;
        constraint.project = tape_projects[project].project;
        constraint.user = &ring;
        constraint.tries = words_next();
        constraint.keep = pfl_constraint_keep;
        words_next_type(&tape_ring, &ring, 1.0f);
        config.constraint = &constraint;
    }
    if (words_next() != 0u) {
        kernel.move = pfl_kernel_move;
        kernel.width = words_next_float();
        kernel.states_mask = words_next();
        config.kernel = &kernel;
    }
    return true;
}

static bool read_config(const play_t *p)
{
    static const pfl_scheme_fn schemes[] = {pfl_systematic, pfl_stratified, pfl_residual, pfl_multinomial};
    memset(&config, 0, sizeof config);
    config.abi = PFL_ABI;
    config.particles = words_next();
    config.states = (uint16_t)words_next();
    config.noises = (uint16_t)words_next();
    config.sensor_count = (uint16_t)words_next();
    config.resampling = schemes[words_next() & 3u];
    config.moments = (uint16_t)words_next();
    config.circular_mask = words_next();
    config.circular = pfl_circular_means;
    config.ess_ratio = words_next_float();
    config.seed = words_next_u64();
    config.dt_max_us = words_next();
    config.budget_cycles = words_next();
    config.ess_ratio = (p->ess_ratio >= 0.0f) ? p->ess_ratio : config.ess_ratio;
    if (config.states > PFL_STATES_MAX) {
        return false;
    }
    if (words_next() != 0u) {
        for (uint32_t d = 0u; d < config.states; d++) {
            box_lo[d] = words_next_float();
        }
        for (uint32_t d = 0u; d < config.states; d++) {
            box_hi[d] = words_next_float();
        }
        config.lo = box_lo;
        config.hi = box_hi;
    }
    if (!read_model(p) || !read_sensors(p) || !read_extras()) {
        return false;
    }
    config.draw = (words_next() != 0u) ? draw_off_tape : NULL;
    return true;
}

bool play_init(play_t *p)
{
    mark_t mark;
    if (!read_config(p)) {
        return false;
    }
    const uint64_t t_us = words_next_u64();
    p->arena_bytes = (uint32_t)pfl_arena_bytes(&config);
    p->ahead = NULL;
    PLAY_MARK(mark);
    const pfl_status_t status = pfl_init(&pool, sizeof pool, &config, t_us, &p->filter);
    const uint32_t stop = pfl_port_cycles();
    play_count(p, TAPE_INIT, mark, stop);
    words_put(IO_OUT, (uint32_t)(int32_t)status);
    if (p->filter == NULL) {
        io_text("play: pfl_init: ");
        io_text(pfl_status_string(status));
        io_text("\n");
    }
    return p->filter != NULL;
}

/* ---- A cycle ------------------------------------------------------------------------------------------------------------ */

/* u, which may be null. */
static const void *read_u(void)
{
    if ((words_next() == 0u) || (model_u == NULL)) {
        return NULL;
    }
    words_next_type(model_u, &argument, 1.0f);
    return &argument;
}

bool play_predict(play_t *p)
{
    mark_t mark;
    const uint64_t t_us = words_next_u64();
    const void *u = read_u();
    PLAY_MARK(mark);
    const pfl_status_t status = pfl_predict(p->filter, t_us, u);
    const uint32_t stop = pfl_port_cycles();
    play_count(p, TAPE_PREDICT, mark, stop);
    words_put(IO_OUT, (uint32_t)(int32_t)status);
    return true;
}

bool play_update(play_t *p)
{
    mark_t mark;
    const uint16_t sensor = (uint16_t)words_next();
    const uint64_t t_us = words_next_u64();
    if ((sensor >= PLAY_SENSORS_MAX) || (sensor_floats[sensor] > (TAPE_TYPE_MAX / 4u))) {
        return false;
    }
    if (sensor_z[sensor] != NULL) {
        words_next_type(sensor_z[sensor], &argument, 1.0f);
    } else {
        for (uint32_t k = 0u; k < sensor_floats[sensor]; k++) {
            argument.floats[k] = words_next_float();
        }
    }
    PLAY_MARK(mark);
    const pfl_status_t status = pfl_update(p->filter, sensor, t_us, &argument);
    const uint32_t stop = pfl_port_cycles();
    play_count(p, TAPE_UPDATE, mark, stop);
    words_put(IO_OUT, (uint32_t)(int32_t)status);
    return true;
}

static void put_floats(const float *x, uint32_t n)
{
    for (uint32_t k = 0u; k < n; k++) {
        words_put_float(x[k]);
    }
}

bool play_estimate(play_t *p)
{
    static float mean[PFL_STATES_MAX];
    static float cov[PFL_STATES_MAX * PFL_STATES_MAX];
    mark_t mark;
    const uint32_t d = config.states;
    float *wanted = (words_next() != 0u) ? cov : NULL;
    PLAY_MARK(mark);
    const pfl_status_t status = pfl_estimate(p->filter, mean, wanted);
    const uint32_t stop = pfl_port_cycles();
    play_count(p, TAPE_ESTIMATE, mark, stop);
    words_put(IO_OUT, (uint32_t)(int32_t)status);
    if (status >= 0) {
        p->hash = words_hash(p->hash, mean, d);
        put_floats(mean, d);
        put_floats(cov, (wanted != NULL) ? (d * d) : 0u);
    }
    return true;
}

bool play_resample(play_t *p)
{
    mark_t mark;
    PLAY_MARK(mark);
    const pfl_status_t status = pfl_resample(p->filter);
    const uint32_t stop = pfl_port_cycles();
    play_count(p, TAPE_RESAMPLE, mark, stop);
    words_put(IO_OUT, (uint32_t)(int32_t)status);
    return true;
}

/* Reads the particles while it draws them: not counted. */
bool play_reset(play_t *p)
{
    const uint64_t t_us = words_next_u64();
    words_put(IO_OUT, (uint32_t)(int32_t)pfl_reset(p->filter, t_us));
    return true;
}

/* ---- Answers ------------------------------------------------------------------------------------------------------------- */

bool play_farthest(play_t *p)
{
    mark_t mark;
    float distance = 0.0f;
    const pfl_t *f = (words_next() != 0u) ? p->ahead : p->filter;
    const uint16_t x_state = (uint16_t)words_next();
    const uint16_t y_state = (uint16_t)words_next();
    const float x = words_next_float();
    const float y = words_next_float();
    PLAY_MARK(mark);
    const pfl_status_t status = pfl_farthest(f, x_state, y_state, x, y, &distance);
    const uint32_t stop = pfl_port_cycles();
    play_count(p, TAPE_FARTHEST, mark, stop);
    words_put(IO_OUT, (uint32_t)(int32_t)status);
    words_put_float(distance);
    return true;
}

bool play_ess(play_t *p)
{
    words_put_float(pfl_effective_sample_size(p->filter));
    return true;
}

/* ---- Forecast: the fork has the pool behind the filter's arena ----------------------------------------------------------- */

static const void *control_off_tape(void *user, uint32_t step, uint64_t t_us)
{
    (void)user;
    (void)step;
    (void)t_us;
    return read_u();
}

#define AHEAD_MAX 64u /* steps whose means are kept; longer ones are refused */

bool play_forecast(play_t *p)
{
    static float mean[AHEAD_MAX * 9u];
    mark_t mark;
    const bool with_cov = words_next() != 0u;
    pfl_horizon_t horizon = {0u, 0u, control_off_tape, NULL, NULL, NULL};
    horizon.step_us = words_next();
    horizon.steps = words_next();
    const size_t used = PFL_CEIL8(p->arena_bytes);
    if ((horizon.steps > AHEAD_MAX) || (config.states > 9u) || (used + p->arena_bytes > sizeof pool.bytes)) {
        io_text("play: no room for this forecast\n");
        return false;
    }
    (void)with_cov; /* covariances of all steps would not fit: they are not asked for */
    PLAY_MARK(mark);
    const pfl_status_t status =
        pfl_forecast(p->filter, &pool.bytes[used], sizeof pool.bytes - used, &horizon, mean, NULL, &p->ahead);
    const uint32_t stop = pfl_port_cycles();
    play_count(p, TAPE_FORECAST, mark, stop);
    words_put(IO_OUT, (uint32_t)(int32_t)status);
    put_floats(mean, (status >= 0) ? (horizon.steps * config.states) : 0u);
    return true;
}
