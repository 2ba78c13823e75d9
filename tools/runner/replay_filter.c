/* The filters of `replay`: a model and the sensors that it can see, nothing but what lib/ has ready. */
#include "cloud.h"
#include "hash.h"
#include "host_filter.h"
#include "replay.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define CHI2_95_OF_2 5.991
#define HEADING_SIGMA 0.3f /* of a measured course */
#define ANY_HEADING_SIGMA 3.0f
#define TURN_RATE_SIGMA 0.2f
#define CLIMB_SIGMA 1.0f
#define SMALLEST_SIGMA_M 0.01 /* a cloud that sits on one point is given this */
#define HOVER_TIME_S 5.0f
#define BARO_WALK 0.05f
#define ODOMETRY_POSITION_SIGMA 0.1f

/* The motion stands first: the ready models take a pointer to the whole for a pointer to it. */
typedef struct {
    union {
        pfl_constant_velocity_t cv;
        pfl_hover_t hover;
        pfl_turn_t turn;
        pfl_odometry_t odometry;
    } motion;
    uint32_t states, noises;
    float mean[REPLAY_STATES_MAX], sigma[REPLAY_STATES_MAX]; /* of the prior */
    float ring_m;                                            /* radius of one around the mean; 0: none */
} model_t;

typedef struct {
    model_t model;
    pfl_position_t seen[REPLAY_SENSORS];
    pfl_velocity_t velocity; /* of the turning vehicle */
    pfl_biased_t baro;
    pfl_range_t range;
    pfl_sensor_t sensor[REPLAY_SENSORS];
    uint16_t number[REPLAY_SENSORS]; /* a sensor's place among those wanted */
    uint16_t sensors;
    pfl_config_t config;
} setup_t;

/* What the scores are made of. */
typedef struct {
    double innovation, nis, error, nees, ess;
    size_t positions, inside, compared;
} sums_t;

/* ---- Prior -------------------------------------------------------------------------------------------------------- */

/* Any direction, by a normal so wide that it wraps to uniform. */
static void draw_ring(const model_t *m, const pfl_batch_t *p)
{
    for (uint32_t i = 0u; i < p->n; i++) {
        const float rho_m = m->ring_m + m->sigma[0] * PFL_NOISE(p, 0)[i];
        float sine;
        float cosine;
        pfl_sincosf(pfl_wrap_pi(10.0f * PFL_NOISE(p, 1)[i]), &sine, &cosine);
        PFL_STATE(p, 0)[i] = m->mean[0] + rho_m * cosine;
        PFL_STATE(p, 1)[i] = m->mean[1] + rho_m * sine;
    }
}

static void draw(void *user, const pfl_batch_t *p)
{
    const model_t *m = user;

    for (uint32_t d = 0u; d < m->states; d++) {
        for (uint32_t i = 0u; i < p->n; i++) {
            PFL_STATE(p, d)[i] = m->mean[d] + m->sigma[d] * PFL_NOISE(p, d)[i];
        }
    }
    if (m->ring_m > 0.0f) {
        draw_ring(m, p);
    }
}

static void start(model_t *m, uint32_t state, float mean, float sigma)
{
    m->mean[state] = mean;
    m->sigma[state] = sigma;
}

/* What tells where the filter starts. */
static replay_sensor_t position_sensor(const replay_study_t *s)
{
    return s->wanted[REPLAY_GPS] ? REPLAY_GPS : (s->wanted[REPLAY_FIX] ? REPLAY_FIX : REPLAY_RANGE);
}

static void start_position(const replay_study_t *s, size_t from, model_t *m)
{
    const replay_sensor_t sensor = position_sensor(s);
    const replay_event_t *e = &s->event[replay_first(s, sensor, from)];

    if (sensor == REPLAY_RANGE) {
        const pfl_range_z_t *z = &e->range;
        const float square = z->range_m * z->range_m - z->height_m * z->height_m;
        start(m, 0u, z->anchor_x_m, s->sigma[REPLAY_RANGE]);
        start(m, 1u, z->anchor_y_m, s->sigma[REPLAY_RANGE]);
        m->ring_m = pfl_sqrtf(square > 0.0f ? square : 0.0f);
        return;
    }
    start(m, 0u, e->z[0], s->sigma[sensor]);
    start(m, 1u, e->z[1], s->sigma[sensor]);
}

/* Velocity as components in the states first and first + 1. */
static void start_velocity(const replay_study_t *s, size_t from, model_t *m, uint32_t first)
{
    const size_t i = replay_first(s, REPLAY_VELOCITY, from);
    const bool measured = i < s->events;

    for (uint32_t k = 0u; k < 2u; k++) {
        start(m, first + k, measured ? s->event[i].z[k] : 0.0f, measured ? s->sigma[REPLAY_VELOCITY] : s->start_speed);
    }
}

static void start_turn(const replay_study_t *s, size_t from, model_t *m)
{
    const size_t i = replay_first(s, REPLAY_VELOCITY, from);
    float speed = 0.0f;
    float heading = 0.0f;

    if (i < s->events) {
        speed = pfl_sqrtf(s->event[i].z[0] * s->event[i].z[0] + s->event[i].z[1] * s->event[i].z[1]);
        heading = pfl_atan2f(s->event[i].z[1], s->event[i].z[0]);
    }
    const bool course = speed > 5.0f * s->sigma[REPLAY_VELOCITY];
    start(m, PFL_TURN_SPEED, speed, i < s->events ? s->sigma[REPLAY_VELOCITY] : s->start_speed);
    start(m, PFL_TURN_HEADING, heading, course ? HEADING_SIGMA : ANY_HEADING_SIGMA);
    start(m, PFL_TURN_RATE, 0.0f, TURN_RATE_SIGMA);
}

/* The barometer's bias is its first height less that of GPS; without one of them there is none to be known. */
static void start_height(const replay_study_t *s, size_t from, model_t *m)
{
    const size_t gps = replay_first(s, REPLAY_HEIGHT, from);
    const size_t baro = replay_first(s, REPLAY_BARO, from);
    const bool both = gps < s->events && baro < s->events;
    const size_t height = gps < s->events ? gps : baro;

    if (height < s->events) {
        start(m, 2u, s->event[height].z[0], s->sigma[s->event[height].sensor]);
    }
    start(m, 5u, 0.0f, CLIMB_SIGMA);
    start(m, 6u, both ? s->event[baro].z[0] - s->event[gps].z[0] : 0.0f, both ? s->sigma[REPLAY_HEIGHT] : 0.0f);
    m->motion.hover.bias_walk[0] = both ? BARO_WALK : 0.0f;
}

/* ---- Model and sensors ---------------------------------------------------------------------------------------------- */

/* With the prior of a flight that begins at the event `from`. */
static void make_model(const replay_study_t *s, size_t from, model_t *m, pfl_config_t *c)
{
    const float motion = s->motion;

    switch (s->model) {
    case REPLAY_HOVER:
        m->motion.hover =
            (pfl_hover_t){.axes = 3u, .biases = 1u, .time_s = HOVER_TIME_S, .sigma_mps = {motion, motion, motion}};
        m->states = 7u;
        m->noises = 4u;
        c->predict = pfl_hover_predict;
        start_velocity(s, from, m, 3u);
        start_height(s, from, m);
        break;
    case REPLAY_TURN:
        m->motion.turn = (pfl_turn_t){.sigma_speed = motion, .sigma_rate = s->turning};
        m->states = PFL_TURN_STATES;
        m->noises = 2u;
        c->predict = pfl_turn_predict;
        c->circular_mask = 1u << PFL_TURN_HEADING;
        start_turn(s, from, m);
        break;
    case REPLAY_ODOMETRY:
        m->motion.odometry = (pfl_odometry_t){.speed_scale = 1.0f,
                                              .speed_share = motion,
                                              .turn_share = motion,
                                              .sigma_turn = s->turning,
                                              .sigma_position = ODOMETRY_POSITION_SIGMA};
        m->states = PFL_ODO_STATES;
        m->noises = 4u;
        c->predict = pfl_odometry_predict;
        c->circular_mask = 1u << PFL_ODO_HEADING;
        start(m, PFL_ODO_HEADING, 0.0f, ANY_HEADING_SIGMA);
        break;
    case REPLAY_CV:
    case REPLAY_MODELS:
    default:
        m->motion.cv = (pfl_constant_velocity_t){.sigma_accel = motion};
        m->states = PFL_CV_STATES;
        m->noises = 2u;
        c->predict = pfl_constant_velocity_predict;
        start_velocity(s, from, m, PFL_CV_VX);
        break;
    }
    start_position(s, from, m);
}

/* Where the numbers of a sensor stand among the states. */
static uint16_t first_state(const replay_study_t *s, unsigned sensor)
{
    if (sensor == REPLAY_VELOCITY) {
        return s->model == REPLAY_HOVER ? 3u : 2u;
    }
    return sensor == REPLAY_HEIGHT ? 2u : 0u;
}

static pfl_sensor_t make_sensor(const replay_study_t *s, setup_t *u, unsigned sensor)
{
    const float inv_sigma = 1.0f / s->sigma[sensor];
    const uint16_t first = first_state(s, sensor);

    if (sensor == REPLAY_BARO) {
        u->baro = (pfl_biased_t){.count = 1u, .state = {2u}, .bias = {6u}, .inv_sigma = {inv_sigma}};
        return (pfl_sensor_t){.loglik = pfl_biased_loglik, .user = &u->baro, .gate = s->gate};
    }
    if (sensor == REPLAY_RANGE) {
        u->range = (pfl_range_t){0u, 1u, inv_sigma, s->range_dof};
        return (pfl_sensor_t){.loglik = pfl_range_loglik, .user = &u->range, .gate = s->gate};
    }
    if (sensor == REPLAY_VELOCITY && s->model == REPLAY_TURN) {
        u->velocity = (pfl_velocity_t){PFL_TURN_SPEED, PFL_TURN_HEADING, inv_sigma};
        return (pfl_sensor_t){.loglik = pfl_velocity_loglik, .user = &u->velocity, .gate = s->gate};
    }
    u->seen[sensor] = (pfl_position_t){.count = sensor == REPLAY_HEIGHT ? 1u : 2u,
                                       .state = {first, (uint16_t)(first + 1u)},
                                       .inv_sigma = {inv_sigma, inv_sigma}};
    return (pfl_sensor_t){.loglik = pfl_position_loglik, .user = &u->seen[sensor], .gate = s->gate};
}

static void make_setup(const replay_study_t *s, uint32_t run, setup_t *u)
{
    *u = (setup_t){.config = {.abi = PFL_ABI,
                              .particles = s->particles,
                              .ess_ratio = s->ess_ratio,
                              .seed = s->seed + run,
                              .circular = pfl_circular_means,
                              .sensors = u->sensor,
                              .draw = draw,
                              .user = &u->model}};
    make_model(s, 0u, &u->model, &u->config);
    for (unsigned k = 0u; k < REPLAY_SENSORS; k++) {
        if (s->wanted[k]) {
            u->number[k] = u->sensors;
            u->sensor[u->sensors++] = make_sensor(s, u, k);
        }
    }
    u->config.states = (uint16_t)u->model.states;
    u->config.noises = (uint16_t)u->model.noises;
    u->config.sensor_count = u->sensors;
}

/* ---- Flight --------------------------------------------------------------------------------------------------------- */

/* e' (P + sigma^2 I)^-1 e in the plane of the first two states. */
static double normalised(const float *cov, uint32_t states, double sigma, double ex, double ey)
{
    const double a = (double)cov[0] + sigma * sigma;
    const double b = (double)cov[1];
    const double c = (double)cov[states + 1u] + sigma * sigma;
    const double det = a * c - b * b;

    return det > 0.0 ? (c * ex * ex - 2.0 * b * ex * ey + a * ey * ey) / det : 0.0;
}

static bool check(pfl_status_t status, const char *call, size_t i, failure_t *failure)
{
    return status >= 0 || status == PFL_REJECTED ||
           fail(failure, EXIT_HARNESS, "measurement %zu: %s: %s", i, call, pfl_status_string(status));
}

static void score_innovation(const replay_study_t *s, const replay_event_t *e, const float *mean, const float *cov,
                             uint32_t states, double *row, sums_t *sums)
{
    const double ex = (double)e->z[0] - (double)mean[0];
    const double ey = (double)e->z[1] - (double)mean[1];
    const double nis = normalised(cov, states, (double)s->sigma[e->sensor], ex, ey);

    row[REPLAY_COLUMN_MEASURED_X] = (double)e->z[0];
    row[REPLAY_COLUMN_MEASURED_Y] = (double)e->z[1];
    row[REPLAY_COLUMN_NIS] = nis;
    if (e->t_s - s->event[0].t_s >= s->from_s) {
        sums->innovation += ex * ex + ey * ey;
        sums->nis += nis;
        sums->inside += nis <= CHI2_95_OF_2 ? 1u : 0u;
        sums->positions++;
    }
}

static void score_estimate(const replay_study_t *s, const replay_event_t *e, const float *mean, const float *cov,
                           uint32_t states, double *row, sums_t *sums)
{
    const double ex = (double)mean[0] - e->truth[0];
    const double ey = (double)mean[1] - e->truth[1];

    row[REPLAY_COLUMN_T] = e->t_s;
    row[REPLAY_COLUMN_X] = (double)mean[0];
    row[REPLAY_COLUMN_Y] = (double)mean[1];
    row[REPLAY_COLUMN_TRUTH_X] = e->truth[0];
    row[REPLAY_COLUMN_TRUTH_Y] = e->truth[1];
    row[REPLAY_COLUMN_SIGMA] = sqrt((double)cov[0] + (double)cov[states + 1u]);
    if (!isnan(ex)) {
        row[REPLAY_COLUMN_NEES] = normalised(cov, states, SMALLEST_SIGMA_M, ex, ey);
        if (e->t_s - s->event[0].t_s >= s->from_s) {
            sums->error += ex * ex + ey * ey;
            sums->nees += row[REPLAY_COLUMN_NEES];
            sums->compared++;
        }
    }
}

/* Behind a gap in the log begins a flight of its own, if it tells a position. */
static bool restart(const replay_study_t *s, setup_t *u, pfl_t *filter, size_t i, failure_t *failure)
{
    if (s->gap_s <= 0.0 || i == 0u || s->event[i].t_s - s->event[i - 1u].t_s < s->gap_s ||
        replay_first(s, position_sensor(s), i) == s->events) {
        return true;
    }
    make_model(s, i, &u->model, &u->config);
    return check(pfl_reset(filter, s->event[i].t_us), "pfl_reset", i, failure);
}

static void show(const replay_event_t *e, const float *mean, const pfl_t *filter, look_t *look)
{
    const look_at_t at = {
        .t_s = e->t_s,
        .state = {0u, 1u},
        .axis = {"x [m]", "y [m]"},
        .truth = {e->truth[0], e->truth[1]},
        .estimate = {(double)mean[0], (double)mean[1]},
    };

    look_take(look, filter, &at);
}

static bool cycle(const replay_study_t *s, const setup_t *u, pfl_t *filter, size_t i, run_output_t *out, sums_t *sums,
                  failure_t *failure)
{
    const replay_event_t *e = &s->event[i];
    const uint32_t states = u->model.states;
    double row[REPLAY_COLUMNS];
    float mean[REPLAY_STATES_MAX];
    float cov[REPLAY_STATES_MAX * REPLAY_STATES_MAX];
    pfl_health_t health;

    for (size_t c = 0u; c < REPLAY_COLUMNS; c++) {
        row[c] = MISSING;
    }
    if (!check(pfl_predict(filter, e->t_us, &e->odometry), "pfl_predict", i, failure)) {
        return false;
    }
    if (replay_is_position(e->sensor)) {
        if (!check(pfl_estimate(filter, mean, cov), "pfl_estimate", i, failure)) {
            return false;
        }
        score_innovation(s, e, mean, cov, states, row, sums);
    }
    const void *z = e->sensor == REPLAY_RANGE ? (const void *)&e->range : e->z;
    if (!check(pfl_update(filter, u->number[e->sensor], e->t_us, z), "pfl_update", i, failure) ||
        !check(pfl_estimate(filter, mean, cov), "pfl_estimate", i, failure) ||
        !check(pfl_health(filter, &health), "pfl_health", i, failure)) {
        return false;
    }
    score_estimate(s, e, mean, cov, states, row, sums);
    sums->ess += (double)health.ess;
    out->hash = hash_floats(out->hash, mean, states);
    out->cycles_ns[i] = cycle_ns(health.cycles_last);
    out->cycle[i] = cycle_of(&health);
    show(e, mean, filter, out->look);
    out->value[REPLAY_REJECTED] = (double)health.rejected;
    out->value[REPLAY_RESTARTS] = (double)health.resets;
    if (out->series != NULL) {
        memcpy(&out->series[i * REPLAY_COLUMNS], row, sizeof row);
    }
    return true;
}

static bool fly(const replay_study_t *s, setup_t *u, pfl_t *filter, run_output_t *out, failure_t *failure)
{
    sums_t sums = {0};

    for (size_t i = 0u; i < s->events; i++) {
        if (!restart(s, u, filter, i, failure) || !cycle(s, u, filter, i, out, &sums, failure)) {
            return false;
        }
    }
    if (sums.positions == 0u && sums.compared == 0u) {
        return fail(failure, EXIT_USAGE, "--set from=%g: the log has no position after that, measured or true",
                    s->from_s);
    }
    const double positions = (double)sums.positions;
    out->value[REPLAY_INNOVATION] = sums.positions > 0u ? sqrt(sums.innovation / positions) : MISSING;
    out->value[REPLAY_NIS] = sums.positions > 0u ? sums.nis / positions : MISSING;
    out->value[REPLAY_INSIDE] = sums.positions > 0u ? (double)sums.inside / positions : MISSING;
    out->value[REPLAY_SCORED] = positions;
    out->value[REPLAY_ERROR] = sums.compared > 0u ? sqrt(sums.error / (double)sums.compared) : MISSING;
    out->value[REPLAY_NEES] = sums.compared > 0u ? sums.nees / (double)sums.compared : MISSING;
    out->value[REPLAY_RESAMPLED] = (double)out->cycle[s->events - 1u].resampled / (double)s->events;
    out->value[REPLAY_ESS] = sums.ess / ((double)s->events * (double)s->particles);
    out->value[REPLAY_ARENA] = (double)pfl_arena_bytes(&u->config);
    return true;
}

bool replay_fly(const replay_study_t *s, uint32_t run, run_output_t *out, failure_t *failure)
{
    setup_t u;
    void *arena;

    make_setup(s, run, &u);
    pfl_t *filter = host_filter(&u.config, &arena, failure);
    const bool flown = filter != NULL && fly(s, &u, filter, out, failure);
    free(arena);
    return flown;
}
