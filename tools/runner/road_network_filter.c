/* The filters of `road-network`: constant velocity in the plane, the same kept to the annulus that holds all streets (the
 * constrained filter of `standoff`'s paper), and particles on the streets, by one model of a vehicle and by two. */
#include "cloud.h"
#include "host_random.h"
#include "road_network.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define ESS_RATIO 0.5f
#define AGAINST_S 2.0f /* of pfl_road_put */
#define TRIES 4u       /* of the annulus, as in `standoff` */
#define GATE 9.21f     /* chi-square, 2 degrees of freedom, 99 % */

enum { REGIME = PFL_ROAD_STATES, STREET_STATES };

/* One model that is to do for both vehicles: their middle. */
static const pfl_road_vehicle_t compromise = {5.5f, 7.0f, 2.0f, 12.0f, 3.2f, 0.55f, 0.75f, 0.0f};

/* The sensor's parameters stand first, for its log-likelihood; redraw wants the filter. */
typedef struct {
    pfl_range_bearing_t seen;
    const road_filter_t *filter;
} eye_t;

struct road_filter {
    union {
        pfl_constant_velocity_t cv; /* the ready models take a pointer to the whole for a pointer to theirs */
        pfl_jump_t jump;
    } model;
    bool streets;
    const road_map_t *map;
    pfl_road_network_t network[ROAD_VEHICLES];
    float start[TARGET_STATES]; /* mean of the prior */
    bool annulus;
    pfl_ring_t ring;
    pfl_constraint_t constraint;
    eye_t eye;
    pfl_sensor_t sensor;
    pfl_config_t config;
    float room[PFL_JUMP_FLOATS(STREET_STATES, 2)];
    void *arena;
    pfl_t *filter;
};

/* A lost filter (its measurements are refused three times running) draws half of its particles anew about what it sees:
 * the same for all. */
static const pfl_watch_t watch = {.lost_rejects = 3u, .reinject = 0.5f, .keep = pfl_watch_keep};

static void scatter(const road_filter_t *r, const float *mean, const float *sigma, const pfl_batch_t *p)
{
    const uint32_t first = r->streets ? PFL_ROAD_X : 0u;

    for (uint32_t d = 0u; d < TARGET_STATES; d++) {
        for (uint32_t i = 0u; i < p->n; i++) {
            PFL_STATE(p, first + d)[i] = mean[d] + sigma[d] * PFL_NOISE(p, d)[i];
        }
    }
    if (r->annulus) {
        pfl_ring_clamp((void *)(uintptr_t)&r->ring, p);
    }
    if (r->streets) {
        pfl_road_put(&r->map->graph, AGAINST_S, p);
        for (uint32_t i = 0u; i < p->n; i++) {
            PFL_STATE(p, REGIME)[i] = r->model.jump.regimes > 1u && (p->first + i) % 2u == 1u ? 1.0f : 0.0f;
        }
    }
}

static void draw(void *user, const pfl_batch_t *p)
{
    static const float sigma[TARGET_STATES] = {10.0f, 10.0f, 3.0f, 3.0f};
    const road_filter_t *r = (const road_filter_t *)user;

    scatter(r, r->start, sigma, p);
}

static void redraw(void *user, const void *z, const pfl_batch_t *p)
{
    static const float sigma[TARGET_STATES] = {10.0f, 10.0f, 5.0f, 5.0f};
    const pfl_range_bearing_z_t *sight = (const pfl_range_bearing_z_t *)z;
    const float mean[TARGET_STATES] = {sight->from_x_m + sight->range_m * pfl_cosf(sight->bearing_rad),
                                       sight->from_y_m + sight->range_m * pfl_sinf(sight->bearing_rad), 0.0f, 0.0f};

    scatter(((const eye_t *)user)->filter, mean, sigma, p);
}

static void set_streets(const road_study_t *s, road_filter_kind_t kind, road_filter_t *r)
{
    const bool two = kind == ROAD_TWO;

    r->network[ROAD_CAR] = (pfl_road_network_t){&r->map->graph, two ? road_vehicles[ROAD_CAR] : compromise};
    r->network[ROAD_LORRY] = (pfl_road_network_t){&r->map->graph, road_vehicles[ROAD_LORRY]};
    r->model.jump = (pfl_jump_t){
        .regimes = two ? 2u : 1u,
        .regime = {{pfl_road_network_predict, &r->network[ROAD_CAR]},
                   {pfl_road_network_predict, &r->network[ROAD_LORRY]}},
        .states = STREET_STATES, /* no rates: a car never becomes a lorry */
        .noises = 2u,
        .state = REGIME,
        .least = two ? s->particles / 5u : 0u,
        .ess_ratio = ESS_RATIO,
        .room = r->room,
    };
}

static void set_plane(const road_study_t *s, road_filter_t *r)
{
    r->model.cv = (pfl_constant_velocity_t){.sigma_accel = (float)s->accel};
    r->ring = (pfl_ring_t){
        .x_state = TARGET_X,
        .y_state = TARGET_Y,
        .vx_state = TARGET_VX,
        .vy_state = TARGET_VY,
        .inner_m = (float)ROAD_MAP_INNER_M,
        .outer_m = (float)ROAD_MAP_OUTER_M,
    };
    r->constraint = (pfl_constraint_t){
        .inside = pfl_ring_inside,
        .project = pfl_ring_slide,
        .user = &r->ring,
        .tries = TRIES,
        .keep = pfl_constraint_keep,
    };
}

static void set_config(const road_study_t *s, uint32_t run, road_filter_t *r)
{
    const uint16_t first = r->streets ? PFL_ROAD_X : 0u;
    host_random_t random;

    r->eye.filter = r;
    r->eye.seen = (pfl_range_bearing_t){
        .x_state = first,
        .y_state = (uint16_t)(first + 1u),
        .inv_sigma_range = (float)(1.0 / SENSOR_RANGE_SIGMA_M),
        .inv_sigma_bearing = (float)(1.0 / SENSOR_BEARING_SIGMA_RAD),
    };
    r->sensor = (pfl_sensor_t){.loglik = pfl_range_bearing_loglik, .user = &r->eye, .redraw = redraw, .gate = GATE};
    host_random_start(&random, s->seed, run, RANDOM_FILTER_SEED);
    r->config = (pfl_config_t){
        .abi = PFL_ABI,
        .particles = s->particles,
        .states = r->streets ? STREET_STATES : TARGET_STATES,
        .noises = r->streets ? 3u : 2u,
        .sensor_count = 1u,
        .moments = PFL_MOMENTS_MEAN,
        .ess_ratio = r->streets ? 0.0f : ESS_RATIO,
        .seed = host_random_u64(&random),
        .sensors = &r->sensor,
        .watch = &watch,
        .constraint = r->annulus ? &r->constraint : NULL,
        .predict = r->streets ? pfl_jump_predict : pfl_constant_velocity_predict,
        .draw = draw,
        .user = r,
    };
}

static bool check(pfl_status_t status, const char *call, unsigned k, failure_t *failure)
{
    return status == PFL_OK || fail(failure, EXIT_HARNESS, "step %u: %s: %s", k, call, pfl_status_string(status));
}

void road_filter_close(road_filter_t *r)
{
    if (r != NULL) {
        free(r->arena);
        free(r);
    }
}

road_filter_t *road_filter_open(const road_study_t *s, const road_map_t *map, road_filter_kind_t kind, uint32_t run,
                                const double *prior, failure_t *failure)
{
    road_filter_t *r = calloc(1u, sizeof *r);

    if (r == NULL) {
        (void)fail(failure, EXIT_HARNESS, "out of memory");
        return NULL;
    }
    r->map = map;
    r->streets = kind == ROAD_ONE || kind == ROAD_TWO;
    r->annulus = kind == ROAD_ANNULUS;
    for (int d = 0; d < TARGET_STATES; d++) {
        r->start[d] = (float)prior[d];
    }
    if (r->streets) {
        set_streets(s, kind, r);
    } else {
        set_plane(s, r);
    }
    set_config(s, run, r);
    const size_t bytes = pfl_arena_bytes(&r->config);
    r->arena = malloc(bytes);
    if (r->arena == NULL || !check(pfl_init(r->arena, bytes, &r->config, 0u, &r->filter), "pfl_init", 0u, failure)) {
        if (r->arena == NULL) {
            (void)fail(failure, EXIT_HARNESS, "no memory for %lu particles", (unsigned long)s->particles);
        }
        road_filter_close(r);
        return NULL;
    }
    return r;
}

static bool fuse(road_filter_t *r, unsigned k, const standoff_sight_t *sight, failure_t *failure)
{
    const pfl_range_bearing_z_t z = {(float)sight->from_x_m, (float)sight->from_y_m, (float)sight->range_m,
                                     (float)sight->bearing_rad};

    const pfl_status_t status = pfl_update(r->filter, 0u, (uint64_t)k * STANDOFF_PERIOD_US, &z);

    if (status == PFL_REJECTED) {
        return true; /* by the gate: the watch counts them */
    }
    return check(status, "pfl_update", k, failure) &&
           (!r->streets || check(pfl_jump_resample(r->filter, &r->model.jump), "pfl_jump_resample", k, failure));
}

bool road_filter_step(road_filter_t *r, unsigned k, const standoff_sight_t *sight, standoff_belief_t *belief,
                      double *lorry, uint32_t *cycles_ns, cycle_t *cycle, failure_t *failure)
{
    const uint16_t first = r->streets ? PFL_ROAD_X : 0u;
    float mean[STREET_STATES];
    float reach_m;
    pfl_health_t health;

    if (!check(pfl_predict(r->filter, (uint64_t)k * STANDOFF_PERIOD_US, NULL), "pfl_predict", k, failure) ||
        (sight != NULL && !fuse(r, k, sight, failure)) ||
        !check(pfl_estimate(r->filter, mean, NULL), "pfl_estimate", k, failure) ||
        !check(pfl_farthest(r->filter, first, (uint16_t)(first + 1u), mean[first], mean[first + 1u], &reach_m),
               "pfl_farthest", k, failure) ||
        !check(pfl_health(r->filter, &health), "pfl_health", k, failure)) {
        return false;
    }
    for (int d = 0; d < TARGET_STATES; d++) {
        belief->target[d] = (double)mean[first + d];
    }
    belief->reach_m = (double)reach_m;
    *lorry = r->streets ? (double)mean[REGIME] : 0.0;
    *cycles_ns = cycle_ns(health.cycles_last);
    *cycle = cycle_of(&health);
    return true;
}

void road_filter_show(const road_filter_t *r, unsigned k, const double *target, const standoff_belief_t *belief,
                      look_t *look)
{
    const uint16_t first = r->streets ? PFL_ROAD_X : 0u;
    const look_at_t at = {
        .t_s = STANDOFF_PERIOD_S * (double)k,
        .state = {first, (uint16_t)(first + 1u)},
        .axis = {"x [m]", "y [m]"},
        .truth = {target[TARGET_X], target[TARGET_Y]},
        .estimate = {belief->target[TARGET_X], belief->target[TARGET_Y]},
    };

    look_take(look, r->filter, &at);
}
