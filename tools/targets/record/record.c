/* Records the tape of a scenario (replay/tape.h) while the runner flies it: linked into the runner with the linker's
 * --wrap for each function below, so that the scenario's own code runs unchanged. One run, one thread.
 *
 * PFLIGHT_TAPE=NAME        writes NAME.in, and to NAME.out what the library answered
 * PFLIGHT_TAPE_PLAY=FILE   answers each call with what stands in FILE (the tape.out of another machine) instead: the
 *                          runner's hash and metrics are then those of that machine's estimates */
#include "../replay/tape.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The library's own, and what the linker puts in their place. */
#define WRAP(type, name, arguments)                                                                                    \
    type __real_##name arguments;                                                                                      \
    type __wrap_##name arguments;                                                                                      \
    type __wrap_##name arguments

static FILE *tape, *answers, *played;
static bool opened;
static unsigned depth; /* > 0 inside a call of the library, which calls itself */

/* The filter on the tape, and what its configuration was before ours replaced it. */
static pfl_t *filter, *ahead;
static pfl_config_t config;
static const pfl_config_t *original;
static const type_t *model_u;

static void stop(const char *why)
{
    (void)fprintf(stderr, "record: %s\n", why);
    exit(3);
}

/* Nothing is wrong, but no tape can hold it: tools/target then flies the whole run, where it can. */
static void no_tape(const char *why)
{
    (void)fprintf(stderr, "record: %s\n", why);
    exit(4);
}

/* ---- Words ----------------------------------------------------------------------------------------------------------- */

static void put_to(FILE *file, uint32_t word)
{
    const unsigned char bytes[4] = {(unsigned char)word, (unsigned char)(word >> 8), (unsigned char)(word >> 16),
                                    (unsigned char)(word >> 24)};
    if (file != NULL && fwrite(bytes, 1u, sizeof bytes, file) != sizeof bytes) {
        stop("cannot write the tape");
    }
}

static void put(uint32_t word)
{
    put_to(tape, word);
}

static uint32_t bits_of(float x)
{
    uint32_t word;
    memcpy(&word, &x, sizeof word);
    return word;
}

static void put_float(float x)
{
    put(bits_of(x));
}

static void put_u64(uint64_t x)
{
    put((uint32_t)x);
    put((uint32_t)(x >> 32));
}

static void put_route(const unsigned char *at)
{
    const pfl_route_t *route;
    memcpy(&route, at, sizeof route);
    put(route != NULL ? 1u : 0u);
    if (route == NULL) {
        return;
    }
    if (route->count > TAPE_WAYPOINTS_MAX) {
        no_tape("a route with too many waypoints");
    }
    put(route->count);
    put(route->closed ? 1u : 0u);
    put((uint32_t)route->switching);
    put_float(route->reach_m);
    put_float(route->approach_rad);
    put_float(route->follow_per_m);
    for (uint32_t k = 0u; k < route->count; k++) {
        put_float(route->waypoint[k].x_m);
        put_float(route->waypoint[k].y_m);
    }
}

/* A member added behind the last one that types.c knows would be left out silently. */
static void check_type(const type_t *type)
{
    const field_t *last = &type->field[type->fields - 1u];
    static const size_t width[] = {4u, 2u, sizeof(bool), 4u, sizeof(void *)};
    if (last->offset + last->count * width[last->kind] + sizeof(void *) <= type->size) {
        stop("a structure has members that types.c does not name");
    }
}

static void put_type(const type_t *type, const void *structure)
{
    check_type(type);
    for (uint32_t k = 0u; k < type->fields; k++) {
        const field_t *field = &type->field[k];
        const unsigned char *at = (const unsigned char *)structure + field->offset;
        for (uint32_t i = 0u; i < field->count; i++) {
            uint16_t half;
            uint32_t word;
            bool flag;
            switch ((field_kind_t)field->kind) {
            case FIELD_ROUTE:
                put_route(at);
                break;
            case FIELD_HALF:
                memcpy(&half, at + 2u * i, sizeof half);
                put(half);
                break;
            case FIELD_BOOL:
                memcpy(&flag, at + sizeof flag * i, sizeof flag);
                put(flag ? 1u : 0u);
                break;
            case FIELD_WORD:
            case FIELD_INV_SIGMA:
            default:
                memcpy(&word, at + 4u * i, sizeof word);
                put(word);
                break;
            }
        }
    }
}

/* ---- Answers: ours to a file, or another machine's in place of ours ---------------------------------------------------- */

static uint32_t answer(uint32_t ours)
{
    unsigned char b[4];

    put_to(answers, ours);
    if (played == NULL) {
        return ours;
    }
    if (fread(b, 1u, sizeof b, played) != sizeof b) {
        stop("the other machine's answers end too early");
    }
    return (uint32_t)b[0] | ((uint32_t)b[1] << 8) | ((uint32_t)b[2] << 16) | ((uint32_t)b[3] << 24);
}

static pfl_status_t answer_status(pfl_status_t ours)
{
    return (pfl_status_t)(int32_t)answer((uint32_t)(int32_t)ours);
}

static void answer_floats(float *x, size_t n)
{
    for (size_t k = 0u; k < n; k++) {
        const uint32_t bits = bits_of(x[k]);
        const uint32_t word = answer((bits & 0x7FFFFFFFu) > 0x7F800000u ? 0x7FC00000u : bits);
        memcpy(&x[k], &word, sizeof word);
    }
}

static void answer_words(void *structure, size_t bytes)
{
    for (size_t k = 0u; k < bytes; k += 4u) {
        uint32_t word;
        memcpy(&word, (unsigned char *)structure + k, sizeof word);
        word = answer(word);
        memcpy((unsigned char *)structure + k, &word, sizeof word);
    }
}

/* ---- Begin and end -------------------------------------------------------------------------------------------------------- */

static void finish(void)
{
    put((uint32_t)TAPE_END);
    if ((tape != NULL && fclose(tape) != 0) || (answers != NULL && fclose(answers) != 0)) {
        (void)fprintf(stderr, "record: cannot write the tape\n");
        _Exit(3);
    }
}

static FILE *open_with(const char *name, const char *ending)
{
    char path[1024];
    (void)snprintf(path, sizeof path, "%s%s", name, ending);
    FILE *file = fopen(path, "wb");
    if (file == NULL) {
        stop("cannot open the tape");
    }
    return file;
}

static void open_once(void)
{
    const char *name = getenv("PFLIGHT_TAPE");
    const char *play = getenv("PFLIGHT_TAPE_PLAY");

    if (opened) {
        return;
    }
    opened = true;
    if (name != NULL) {
        tape = open_with(name, ".in");
        answers = open_with(name, ".out");
    }
    if (play != NULL && (played = fopen(play, "rb")) == NULL) {
        stop("cannot open the other machine's answers");
    }
    if (atexit(finish) != 0) {
        stop("cannot set up");
    }
    put(TAPE_MAGIC);
    put(0u);
    put_float(-1.0f);
    put_float(1.0f);
    put(0u);
}

/* ---- pfl_init --------------------------------------------------------------------------------------------------------------- */

static void draw_and_record(void *user, const pfl_batch_t *p)
{
    (void)user;
    original->draw(original->user, p);
    for (uint32_t d = 0u; d < config.states; d++) {
        for (uint32_t i = 0u; i < p->n; i++) {
            put_float(PFL_STATE(p, d)[i]);
        }
    }
}

static void put_model(void)
{
    uint32_t id = tape_models_count - 1u;
    while (id > 0u && tape_models[id].predict != config.predict) {
        id--;
    }
    if (id == 0u) {
        no_tape("the predict callback of this study is not one of lib/");
    }
    model_u = tape_models[id].u;
    put(id);
    put_type(tape_models[id].user, config.user);
}

static void put_sensors(void)
{
    for (uint32_t k = 0u; k < config.sensor_count; k++) {
        const pfl_sensor_t *sensor = &config.sensors[k];
        const void *user = sensor->user != NULL ? sensor->user : config.user;
        uint32_t id = tape_sensors_count - 1u;
        while (id > 0u && tape_sensors[id].loglik != sensor->loglik) {
            id--;
        }
        put(id);
        put_float(sensor->gate);
        if (id != 0u) {
            put_type(tape_sensors[id].user, user);
            put(tape_sensors[id].z == NULL ? ((const pfl_position_t *)user)->count : 0u);
        }
    }
}

static void put_extras(void)
{
    uint32_t id = 0u;
    if (config.constraint != NULL) {
        id = tape_projects_count - 1u;
        while (id > 0u && tape_projects[id].project != config.constraint->project) {
            id--;
        }
        if (id == 0u || config.constraint->inside != pfl_ring_inside) {
            no_tape("the constraint of this study is not one of lib/");
        }
    }
    put(id);
    if (id != 0u) {
        const void *user = config.constraint->user != NULL ? config.constraint->user : config.user;
        put(config.constraint->tries);
        put_type(&tape_ring, user);
    }
    put(config.kernel != NULL ? 1u : 0u);
    if (config.kernel != NULL) {
        put_float(config.kernel->width);
        put(config.kernel->states_mask);
    }
}

/* The scheme as a number: read_config in replay/play_filter.c has the same order. */
static uint32_t scheme_number(void)
{
    static const pfl_scheme_fn others[] = {pfl_stratified, pfl_residual, pfl_multinomial};
    for (uint32_t k = 0u; k < 3u; k++) {
        if (config.resampling == others[k]) {
            return k + 1u;
        }
    }
    return 0u;
}

static void put_config(uint64_t t_us)
{
    put((uint32_t)TAPE_INIT);
    put(config.particles);
    put(config.states);
    put(config.noises);
    put(config.sensor_count);
    put(scheme_number());
    put(config.moments);
    put(config.circular_mask);
    put_float(config.ess_ratio);
    put_u64(config.seed);
    put(config.dt_max_us);
    put(config.budget_cycles);
    put(config.lo != NULL ? 1u : 0u);
    for (uint32_t d = 0u; config.lo != NULL && d < config.states; d++) {
        put_float(config.lo[d]);
    }
    for (uint32_t d = 0u; config.lo != NULL && d < config.states; d++) {
        put_float(config.hi[d]);
    }
    put_model();
    put_sensors();
    put_extras();
    put(config.draw != NULL ? 1u : 0u);
    put_u64(t_us);
}

WRAP(pfl_status_t, pfl_init, (void *arena, size_t bytes, const pfl_config_t *c, uint64_t t_us, pfl_t **out))
{
    open_once();
    original = c;
    config = *c;
    put_config(t_us);
    config.draw = c->draw != NULL ? draw_and_record : NULL;
    const pfl_status_t status = __real_pfl_init(arena, bytes, &config, t_us, out);
    filter = *out;
    ahead = NULL;
    return answer_status(status);
}

/* ---- The filter's calls ------------------------------------------------------------------------------------------------------ */

static void check_filter(const pfl_t *f)
{
    if (f != filter) {
        no_tape("this study flies several filters at a time");
    }
}

static void put_u(const void *u)
{
    put(u != NULL && model_u != NULL ? 1u : 0u);
    if (u != NULL && model_u != NULL) {
        put_type(model_u, u);
    }
}

WRAP(pfl_status_t, pfl_predict, (pfl_t * f, uint64_t t_us, const void *u))
{
    if (depth > 0u) {
        return __real_pfl_predict(f, t_us, u);
    }
    check_filter(f);
    put((uint32_t)TAPE_PREDICT);
    put_u64(t_us);
    put_u(u);
    return answer_status(__real_pfl_predict(f, t_us, u));
}

static void put_z(uint16_t sensor, const void *z)
{
    for (uint32_t id = 1u; id < tape_sensors_count && sensor < config.sensor_count; id++) {
        if (tape_sensors[id].loglik == config.sensors[sensor].loglik) {
            const void *user = config.sensors[sensor].user != NULL ? config.sensors[sensor].user : config.user;
            if (tape_sensors[id].z != NULL) {
                put_type(tape_sensors[id].z, z);
            } else {
                for (uint32_t k = 0u; k < ((const pfl_position_t *)user)->count; k++) {
                    put_float(((const float *)z)[k]);
                }
            }
            return;
        }
    }
    no_tape("a sensor of this study is not one of lib/");
}

WRAP(pfl_status_t, pfl_update, (pfl_t * f, uint16_t sensor, uint64_t t_us, const void *z))
{
    check_filter(f);
    put((uint32_t)TAPE_UPDATE);
    put(sensor);
    put_u64(t_us);
    put_z(sensor, z);
    return answer_status(__real_pfl_update(f, sensor, t_us, z));
}

WRAP(pfl_status_t, pfl_estimate, (pfl_t * f, float *mean, float *cov))
{
    if (depth > 0u) {
        return __real_pfl_estimate(f, mean, cov);
    }
    check_filter(f);
    put((uint32_t)TAPE_ESTIMATE);
    put(cov != NULL ? 1u : 0u);
    const pfl_status_t status = answer_status(__real_pfl_estimate(f, mean, cov));
    if (status >= 0) {
        answer_floats(mean, config.states);
        answer_floats(cov, cov != NULL ? (size_t)config.states * config.states : 0u);
    }
    return status;
}

WRAP(pfl_status_t, pfl_resample, (pfl_t * f))
{
    if (depth > 0u) {
        return __real_pfl_resample(f);
    }
    check_filter(f);
    put((uint32_t)TAPE_RESAMPLE);
    return answer_status(__real_pfl_resample(f));
}

WRAP(pfl_status_t, pfl_reset, (pfl_t * f, uint64_t t_us))
{
    check_filter(f);
    put((uint32_t)TAPE_RESET);
    put_u64(t_us);
    return answer_status(__real_pfl_reset(f, t_us));
}

WRAP(pfl_status_t, pfl_farthest,
     (const pfl_t *f, uint16_t x_state, uint16_t y_state, float x, float y, float *distance))
{
    put((uint32_t)TAPE_FARTHEST);
    put(f == filter ? 0u : 1u);
    if (f != filter && f != ahead) {
        no_tape("this study flies several filters at a time");
    }
    put(x_state);
    put(y_state);
    put_float(x);
    put_float(y);
    const pfl_status_t status = answer_status(__real_pfl_farthest(f, x_state, y_state, x, y, distance));
    answer_floats(distance, 1u);
    return status;
}

WRAP(float, pfl_effective_sample_size, (const pfl_t *f))
{
    check_filter(f);
    put((uint32_t)TAPE_ESS);
    float ess = __real_pfl_effective_sample_size(f);
    answer_floats(&ess, 1u);
    return ess;
}

/* ---- Forecast: the means travel, the covariances do not --------------------------------------------------------------------- */

static const void *control_and_record(void *user, uint32_t step, uint64_t t_us)
{
    const pfl_horizon_t *horizon = user;
    const void *u = horizon->control != NULL ? horizon->control(horizon->control_user, step, t_us) : NULL;
    put_u(u);
    return u;
}

WRAP(pfl_status_t, pfl_forecast,
     (const pfl_t *f, void *arena, size_t bytes, const pfl_horizon_t *horizon, float *mean, float *cov, pfl_t **out))
{
    pfl_horizon_t ours = *horizon;

    check_filter(f);
    if (horizon->visit != NULL) {
        no_tape("a forecast of this study is looked at step by step, which no tape holds");
    }
    put((uint32_t)TAPE_FORECAST);
    put(cov != NULL ? 1u : 0u);
    put(horizon->step_us);
    put(horizon->steps);
    ours.control = control_and_record;
    ours.control_user = (void *)(uintptr_t)horizon;
    depth++;
    const pfl_status_t done = __real_pfl_forecast(f, arena, bytes, &ours, mean, cov, &ahead);
    depth--;
    if (out != NULL) {
        *out = ahead;
    }
    const pfl_status_t status = answer_status(done);
    answer_floats(mean, status >= 0 ? (size_t)horizon->steps * config.states : 0u);
    return status;
}

/* ---- Guidance ------------------------------------------------------------------------------------------------------------------ */

WRAP(pfl_status_t, pfl_standoff_step, (const pfl_standoff_t *s, float reach_m, float dt_s, pfl_standoff_state_t *state))
{
    open_once();
    put((uint32_t)TAPE_STANDOFF);
    put_type(&tape_standoff, s);
    put_float(reach_m);
    put_float(dt_s);
    put_type(&tape_standoff_state, state);
    const pfl_status_t status = answer_status(__real_pfl_standoff_step(s, reach_m, dt_s, state));
    answer_words(state, sizeof *state);
    return status;
}

WRAP(pfl_status_t, pfl_lvfg_command,
     (const pfl_lvfg_t *lvfg, const pfl_uav_t *uav, uint32_t count, const pfl_target_t *target,
      const pfl_standoff_state_t *standoff, pfl_planar_uav_input_t *command))
{
    pfl_planar_uav_input_t out[2] = {{0.0f, 0.0f}, {0.0f, 0.0f}};

    open_once();
    put((uint32_t)TAPE_LVFG);
    put_type(&tape_lvfg, lvfg);
    put(count);
    put_type(&tape_uav, &uav[0]);
    put_type(&tape_uav, &uav[count == 2u ? 1 : 0]);
    put_type(&tape_target, target);
    put_type(&tape_standoff_state, standoff);
    const pfl_status_t status = answer_status(__real_pfl_lvfg_command(lvfg, uav, count, target, standoff, out));
    answer_words(out, sizeof out);
    memcpy(command, out, count * sizeof out[0]);
    return status;
}

WRAP(pfl_status_t, pfl_nmpc_solve,
     (const pfl_nmpc_t *nmpc, const pfl_nmpc_problem_t *problem, pfl_nmpc_plan_t *plan, pfl_nmpc_work_t *work,
      pfl_nmpc_report_t *report))
{
    pfl_nmpc_report_t ours = {0.0f, 0u};

    open_once();
    put((uint32_t)TAPE_NMPC_SOLVE);
    put_type(&tape_nmpc, nmpc);
    put_type(&tape_uav, &problem->uav);
    put_type(&tape_nmpc_path, problem->target);
    put(problem->pair != NULL ? 1u : 0u);
    if (problem->pair != NULL) {
        put_type(&tape_nmpc_path, problem->pair);
    }
    put_float(problem->distance_m);
    put_type(&tape_nmpc_plan, plan);
    const pfl_status_t status = answer_status(__real_pfl_nmpc_solve(nmpc, problem, plan, work, &ours));
    answer_words(plan, sizeof *plan);
    answer_words(&ours, sizeof ours);
    if (report != NULL) {
        *report = ours;
    }
    return status;
}
