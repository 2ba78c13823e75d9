/* pflight as the tracker of `standoff`: motion models, the road as a constraint, and one sensor for each UAV. */
#include "cloud.h"
#include "host_random.h"
#include "standoff.h"

#include <math.h>
#include <stdlib.h>

#define ON_ROAD_M 1e-4 /* rounding that still counts as on the road */

/* Sensors: one for each UAV, the same with part of the weight, and the road itself for fallback=weight. */
enum { SENSOR_PART = STANDOFF_UAVS, SENSOR_ROAD = 2 * STANDOFF_UAVS, SENSORS };

/* The motion stands first: the ready models take a pointer to the whole for a pointer to it. */
typedef struct {
    union {
        pfl_constant_velocity_t cv;
        pfl_road_target_t road;
        pfl_lane_target_t lane;
    } motion;
    float start[TARGET_STATES]; /* mean of the prior */
    bool on_road;               /* the prior's draws are clamped to it */
    pfl_ring_t ring;
} model_t;

/* The ring stands first, for the ready callbacks. */
typedef struct {
    pfl_ring_t ring;
    bool rescue; /* fallback=weight: the whole cloud was lost, so the next step slides */
} road_t;

struct standoff_pf {
    const standoff_study_t *study;
    model_t model;
    road_t road;
    pfl_range_bearing_t seen;
    pfl_range_bearing_t seen_in_part;
    pfl_sensor_t sensor[SENSORS];
    pfl_constraint_t constraint;
    pfl_kernel_t kernel;
    pfl_config_t config;
    void *arena;
    pfl_t *filter;
    float *log_weights;
    bool in_sight; /* the target was seen the step before */
    unsigned steps;
    uint64_t off_road;
};

/* ---- Callbacks ---------------------------------------------------------------------------------------------------- */

static void draw_prior(void *user, const pfl_batch_t *p)
{
    static const float sigma[TARGET_STATES] = {10.0f, 10.0f, 3.0f, 3.0f};
    model_t *model = (model_t *)user;

    for (uint32_t d = 0u; d < TARGET_STATES; d++) {
        float *x = PFL_STATE(p, d);
        const float *w = PFL_NOISE(p, d);
        for (uint32_t i = 0u; i < p->n; i++) {
            x[i] = model->start[d] + sigma[d] * w[i];
        }
    }
    if (model->on_road) {
        pfl_ring_clamp(&model->ring, p);
    }
}

static void draw_on_lane(void *user, const pfl_batch_t *p)
{
    standoff_lane_draw(((const model_t *)user)->start, p);
}

static void keep_off(void *user, const pfl_batch_t *p)
{
    (void)user;
    (void)p; /* what is off the road stays there */
}

static void keep_or_rescue(void *user, const pfl_batch_t *p)
{
    if (((const road_t *)user)->rescue) {
        pfl_ring_slide(user, p);
    }
}

/* The road as a sensor: who is off it, is impossible. */
static void road_loglik(void *user, const void *z, const pfl_view_t *p, float *ll)
{
    uint32_t inside[PFL_BATCH];

    (void)z;
    pfl_ring_inside(user, p, inside);
    for (uint32_t i = 0u; i < p->n; i++) {
        ll[i] = inside[i] != 0u ? 0.0f : -(float)INFINITY;
    }
}

/* ---- Configuration ------------------------------------------------------------------------------------------------ */

static const pfl_ring_t ring_road = {
    .x_state = TARGET_X,
    .y_state = TARGET_Y,
    .vx_state = TARGET_VX,
    .vy_state = TARGET_VY,
    .inner_m = (float)ROAD_INNER_M,
    .outer_m = (float)ROAD_OUTER_M,
};

/* The models' noises are spectral densities; the page's acceleration is held over a step of the filter. */
static float density(double acceleration)
{
    return (float)(acceleration * sqrt(STANDOFF_PERIOD_S));
}

static void set_model(standoff_pf_t *pf, const double *prior)
{
    const standoff_study_t *s = pf->study;
    model_t *model = &pf->model;

    model->on_road = s->constrained;
    model->ring = ring_road;
    for (int d = 0; d < TARGET_STATES; d++) {
        model->start[d] = (float)prior[d];
    }
    if (s->motion == MOTION_CV) {
        model->motion.cv = (pfl_constant_velocity_t){.sigma_accel = density(s->sigma_along)};
    } else if (s->motion == MOTION_ROAD) {
        model->motion.road = (pfl_road_target_t){
            .inner_m = (float)ROAD_INNER_M,
            .outer_m = (float)ROAD_OUTER_M,
            .sigma_across = density(s->sigma_across),
            .sigma_along = density(s->sigma_along),
        };
    } else {
        model->motion.lane = standoff_lane_model(s->sigma_along);
        standoff_lane_start(prior, model->start);
    }
}

static void set_road(standoff_pf_t *pf)
{
    static const pfl_project_fn project[] = {
        [FALLBACK_SLIDE] = pfl_ring_slide,  [FALLBACK_CLAMP] = pfl_ring_clamp, [FALLBACK_BOUNCE] = pfl_ring_bounce,
        [FALLBACK_WEIGHT] = keep_or_rescue, [FALLBACK_KEEP] = keep_off,
    };

    pf->road.ring = ring_road;
    pf->constraint = (pfl_constraint_t){
        .inside = pfl_ring_inside,
        .project = project[pf->study->fallback],
        .user = &pf->road,
        .tries = pf->study->tries,
        .keep = pfl_constraint_keep,
    };
}

static void set_sensors(standoff_pf_t *pf)
{
    const double part = sqrt(1.0 / (double)pf->study->parts);
    const bool lane = pf->study->motion == MOTION_LANE;

    for (unsigned i = 0u; i < STANDOFF_UAVS; i++) {
        pf->sensor[i].loglik = lane ? standoff_lane_loglik : pfl_range_bearing_loglik;
        pf->sensor[SENSOR_PART + i] = pf->sensor[i];
        pf->sensor[i].user = &pf->seen;
        pf->sensor[SENSOR_PART + i].user = &pf->seen_in_part;
    }
    pf->sensor[SENSOR_ROAD] = (pfl_sensor_t){.loglik = road_loglik, .user = &pf->road};
    pf->seen = (pfl_range_bearing_t){
        .x_state = 0u,
        .y_state = 1u,
        .inv_sigma_range = (float)(1.0 / SENSOR_RANGE_SIGMA_M),
        .inv_sigma_bearing = (float)(1.0 / SENSOR_BEARING_SIGMA_RAD),
    };
    pf->seen_in_part = pf->seen;
    pf->seen_in_part.inv_sigma_range *= (float)part;
    pf->seen_in_part.inv_sigma_bearing *= (float)part;
}

static void set_config(standoff_pf_t *pf, uint32_t run)
{
    static const pfl_predict_fn predict[] = {
        [MOTION_CV] = pfl_constant_velocity_predict,
        [MOTION_ROAD] = pfl_road_target_predict,
        [MOTION_LANE] = pfl_lane_target_predict,
    };
    const standoff_study_t *s = pf->study;
    const bool lane = s->motion == MOTION_LANE;
    host_random_t random;

    pf->kernel = (pfl_kernel_t){
        .width = (float)s->kernel_width,
        .states_mask = (1u << PFL_LANE_ARC) | (1u << PFL_LANE_SPEED), /* the offset keeps to the road */
        .move = pfl_kernel_move,
    };
    host_random_start(&random, s->seed, run, RANDOM_FILTER_SEED);
    pf->config = (pfl_config_t){
        .abi = PFL_ABI,
        .particles = s->particles,
        .states = lane ? PFL_LANE_STATES : TARGET_STATES,
        .noises = 2u,
        .sensor_count = SENSORS,
        .moments = lane ? PFL_MOMENTS_FULL : PFL_MOMENTS_MEAN,
        .ess_ratio = 0.0f, /* the step below resamples, once for all UAVs */
        .seed = host_random_u64(&random),
        .sensors = pf->sensor,
        .constraint = s->constrained && s->motion == MOTION_CV ? &pf->constraint : NULL,
        .kernel = lane && s->kernel_width > 0.0 ? &pf->kernel : NULL,
        .predict = predict[s->motion],
        .draw = lane ? draw_on_lane : draw_prior,
        .user = &pf->model,
    };
}

/* ---- Life --------------------------------------------------------------------------------------------------------- */

/* PFL_REJECTED comes from the road only, and is dealt with there. */
static bool check(pfl_status_t status, const char *call, unsigned k, failure_t *failure)
{
    return status >= 0 || fail(failure, EXIT_HARNESS, "step %u: %s: %s", k, call, pfl_status_string(status));
}

void standoff_pf_close(standoff_pf_t *pf)
{
    if (pf != NULL) {
        free(pf->arena);
        free(pf->log_weights);
        free(pf);
    }
}

standoff_pf_t *standoff_pf_open(const standoff_study_t *s, uint32_t run, const double *prior, failure_t *failure)
{
    const size_t bytes = PFL_ARENA_BYTES(s->particles, TARGET_STATES, TARGET_STATES) + PFL_RETRY_BYTES(TARGET_STATES);
    standoff_pf_t *pf = calloc(1u, sizeof *pf);

    if (pf != NULL) {
        pf->study = s;
        pf->arena = malloc(bytes);
        pf->log_weights = malloc(s->particles * sizeof *pf->log_weights);
    }
    if (pf == NULL || pf->arena == NULL || pf->log_weights == NULL) {
        (void)fail(failure, EXIT_HARNESS, "no memory for %lu particles", (unsigned long)s->particles);
        standoff_pf_close(pf);
        return NULL;
    }
    set_model(pf, prior);
    set_road(pf);
    set_sensors(pf);
    set_config(pf, run);
    if (!check(pfl_init(pf->arena, bytes, &pf->config, 0u, &pf->filter), "pfl_init", 0u, failure)) {
        standoff_pf_close(pf);
        return NULL;
    }
    return pf;
}

/* ---- A step ------------------------------------------------------------------------------------------------------- */

/* fallback=weight: particles off the road lose their weight, and those on it take their place: in an outage here, or
 * else with the measurement. When all would, none does, and the next step slides. */
static bool weigh_road(standoff_pf_t *pf, unsigned k, bool in_sight, failure_t *failure)
{
    if (pf->config.constraint == NULL || pf->study->fallback != FALLBACK_WEIGHT) {
        return true;
    }
    const pfl_status_t status = pfl_update(pf->filter, SENSOR_ROAD, (uint64_t)k * STANDOFF_PERIOD_US, &pf->road);
    pf->road.rescue = status == PFL_REJECTED;
    if (pf->road.rescue) {
        return true;
    }
    return check(status, "pfl_update", k, failure) &&
           (in_sight || check(pfl_resample(pf->filter), "pfl_resample", k, failure));
}

static bool update(standoff_pf_t *pf, unsigned k, unsigned first_sensor, const standoff_sight_t *sight,
                   failure_t *failure)
{
    const uint64_t t_us = (uint64_t)k * STANDOFF_PERIOD_US;

    for (unsigned i = 0u; i < pf->study->uavs; i++) {
        const pfl_range_bearing_z_t z = {(float)sight[i].from_x_m, (float)sight[i].from_y_m, (float)sight[i].range_m,
                                         (float)sight[i].bearing_rad};
        if (sight[i].seen &&
            !check(pfl_update(pf->filter, (uint16_t)(first_sensor + i), t_us, &z), "pfl_update", k, failure)) {
            return false;
        }
    }
    return true;
}

/* Lane: a cloud much wider than the measurement would starve. It takes the first one after a gap in parts, each with
 * its share of the log-likelihood, and comes to life again between them by the kernel step. */
static bool fuse(standoff_pf_t *pf, unsigned k, const standoff_sight_t *sight, failure_t *failure)
{
    const standoff_study_t *s = pf->study;
    const uint32_t parts = s->motion == MOTION_LANE && !pf->in_sight ? s->parts : 1u;

    for (uint32_t part = 1u; part < parts; part++) {
        if (!update(pf, k, SENSOR_PART, sight, failure) ||
            !check(pfl_resample(pf->filter), "pfl_resample", k, failure)) {
            return false;
        }
    }
    if (!update(pf, k, parts > 1u ? SENSOR_PART : 0u, sight, failure)) {
        return false;
    }
    const double ess = (double)pfl_effective_sample_size(pf->filter);
    return ess > s->ess_ratio * (double)s->particles || check(pfl_resample(pf->filter), "pfl_resample", k, failure);
}

static bool answer(standoff_pf_t *pf, unsigned k, standoff_belief_t *belief, failure_t *failure)
{
    const bool lane = pf->study->motion == MOTION_LANE;
    float mean[TARGET_STATES];
    float cov[TARGET_STATES * TARGET_STATES];
    float reach_m;
    const uint16_t second = lane ? PFL_LANE_OFFSET : TARGET_Y;

    if (!check(pfl_estimate(pf->filter, mean, lane ? cov : NULL), "pfl_estimate", k, failure) ||
        !check(pfl_farthest(pf->filter, 0u, second, mean[0], mean[second], &reach_m), "pfl_farthest", k, failure)) {
        return false;
    }
    for (int d = 0; !lane && d < TARGET_STATES; d++) {
        belief->target[d] = (double)mean[d];
    }
    if (lane) {
        standoff_lane_belief(mean, cov, belief);
    }
    if (!lane || pf->study->farthest) {
        belief->reach_m = (double)reach_m;
    }
    return true;
}

static bool count_off_road(standoff_pf_t *pf, unsigned k, failure_t *failure)
{
    const bool lane = pf->study->motion == MOTION_LANE;
    pfl_view_t view;

    if (!check(pfl_particles(pf->filter, &view, pf->log_weights), "pfl_particles", k, failure)) {
        return false;
    }
    for (uint32_t i = 0u; i < view.n; i++) {
        const double x = (double)view.x[TARGET_X * view.stride + i];
        const double y = (double)view.x[TARGET_Y * view.stride + i];
        const double r = lane ? ROAD_CENTER_LINE_M + (double)view.x[PFL_LANE_OFFSET * view.stride + i] : hypot(x, y);
        const bool off = r < ROAD_INNER_M - ON_ROAD_M || r > ROAD_OUTER_M + ON_ROAD_M;
        pf->off_road += off && isfinite(pf->log_weights[i]) ? 1u : 0u;
    }
    return true;
}

bool standoff_pf_step(standoff_pf_t *pf, unsigned k, const standoff_sight_t *sight, standoff_belief_t *belief,
                      uint32_t *cycles_ns, cycle_t *cycle, failure_t *failure)
{
    const uint64_t t_us = (uint64_t)k * STANDOFF_PERIOD_US;
    pfl_health_t health;

    if (!check(pfl_predict(pf->filter, t_us, NULL), "pfl_predict", k, failure) ||
        !weigh_road(pf, k, sight != NULL, failure) || (sight != NULL && !fuse(pf, k, sight, failure)) ||
        !answer(pf, k, belief, failure) || !check(pfl_health(pf->filter, &health), "pfl_health", k, failure) ||
        !count_off_road(pf, k, failure)) {
        return false;
    }
    *cycles_ns = cycle_ns(health.cycles_last);
    *cycle = cycle_of(&health);
    pf->in_sight = sight != NULL;
    pf->steps = k;
    return true;
}

void standoff_pf_show(const standoff_pf_t *pf, unsigned k, const double *target, const standoff_belief_t *belief,
                      look_t *look)
{
    const look_at_t at = {
        .t_s = STANDOFF_PERIOD_S * (double)k,
        .state = {TARGET_X, TARGET_Y},
        .axis = {"x [m]", "y [m]"},
        .truth = {target[TARGET_X], target[TARGET_Y]},
        .estimate = {belief->target[TARGET_X], belief->target[TARGET_Y]},
    };

    if (pf != NULL && pf->study->motion != MOTION_LANE) {
        look_take(look, pf->filter, &at);
    }
}

void standoff_pf_counts(const standoff_pf_t *pf, double *draws, double *fallback, double *off_road)
{
    const double all = (double)pf->steps * (double)pf->study->particles;
    pfl_health_t health = {0};

    (void)pfl_health(pf->filter, &health);
    *draws = 1.0 + (double)health.redrawn / all;
    *fallback = (double)health.projected / all;
    *off_road = (double)pf->off_road / all;
}
