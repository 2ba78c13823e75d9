/* Every ready model, sensor, constraint, guidance law and math function with any floats: nothing is undefined, nothing
 * beyond its arrays is touched, and what the headers promise holds. With sane numbers everything stays finite.
 *
 * byte 0 chooses what, byte 1 bit 0 sane numbers. A new one is a line in a table below. */
#include "fuzz.h"

#include "pflight/math.h"
#include "pflight/pflight.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define STATES 9u
#define NOISES 4u
#define WAYPOINTS 4u
#define PIECES 8u

typedef struct {
    stream_t in;
    bool sane;
    uint32_t n;
    float *x, *noise, *ll;
    uint32_t *flags;
} case_t;

/* Any float; or a positive one that a parameter can have. */
static float number(case_t *c)
{
    return c->sane ? (fabsf(take_sane(&c->in)) + 0.0625f) : take_float(&c->in);
}

static float signed_number(case_t *c)
{
    return c->sane ? take_sane(&c->in) : take_float(&c->in);
}

static void numbers(case_t *c, void *structure, size_t bytes)
{
    for (size_t at = 0u; (at + sizeof(float)) <= bytes; at += sizeof(float)) {
        const float x = number(c);
        memcpy((unsigned char *)structure + at, &x, sizeof x);
    }
}

static uint16_t index_below(case_t *c, uint32_t n)
{
    return (uint16_t)take_below(&c->in, n);
}

static void order(float *low, float *high, const case_t *c)
{
    if (c->sane) {
        *high = *low + *high;
    }
}

static pfl_batch_t batch_of(const case_t *c)
{
    return (pfl_batch_t){c->x, c->n, c->noise, 0u, c->n};
}

static pfl_view_t view_of(const case_t *c)
{
    return (pfl_view_t){c->x, c->n, 0u, c->n};
}

static pfl_route_t route_of(case_t *c, pfl_waypoint_t *waypoint)
{
    pfl_route_t route;
    memset(&route, 0, sizeof route);
    route.waypoint = waypoint;
    route.count = 1u + take_below(&c->in, WAYPOINTS);
    for (uint32_t k = 0u; k < route.count; k++) {
        waypoint[k].x_m = signed_number(c);
        waypoint[k].y_m = signed_number(c);
    }
    const uint8_t how = take_u8(&c->in);
    route.closed = (how & 1u) != 0u;
    route.switching = ((how & 2u) != 0u) ? PFL_SWITCH_HALF_PLANE : PFL_SWITCH_RADIUS;
    route.reach_m = number(c);
    route.approach_rad = c->sane ? 1.0f : number(c);
    route.follow_per_m = number(c);
    return route;
}

/* ---- Models ---------------------------------------------------------------------------------------------------------- */

static union {
    pfl_land_vehicle_t land;
    pfl_constant_velocity_t velocity;
    pfl_odometry_t odometry;
    pfl_road_target_t road;
    pfl_lane_target_t lane;
    pfl_planar_uav_t uav;
    pfl_autopilot_t autopilot;
    pfl_coast_t coast;
    pfl_turn_t turn;
} user;

static union {
    pfl_land_input_t land;
    pfl_odometry_input_t odometry;
    pfl_planar_uav_input_t uav;
    pfl_autopilot_input_t autopilot;
} input;

static void step(case_t *c, pfl_predict_fn predict)
{
    const pfl_batch_t batch = batch_of(c);
    const float dt_s = c->sane ? (number(c) / 16.0f) : (float)take_u32(&c->in) * 1.0e-6f;
    predict(&user, &input, dt_s, &batch);
    REQUIRE(!c->sane || all_finite(c->x, (size_t)STATES * c->n));
}

static void land_vehicle(case_t *c)
{
    numbers(c, &user.land, sizeof user.land);
    numbers(c, &input.land, sizeof input.land);
    input.land.steer_rad = c->sane ? (input.land.steer_rad / 16.0f) : input.land.steer_rad;
    step(c, ((take_u8(&c->in) & 1u) != 0u) ? pfl_land_vehicle_jitter_predict : pfl_land_vehicle_predict);
}

static void constant_velocity(case_t *c)
{
    numbers(c, &user.velocity, sizeof user.velocity);
    step(c, pfl_constant_velocity_predict);
}

static void odometry(case_t *c)
{
    numbers(c, &user.odometry, sizeof user.odometry);
    numbers(c, &input.odometry, sizeof input.odometry);
    step(c, pfl_odometry_predict);
}

static void road_target(case_t *c)
{
    numbers(c, &user.road, sizeof user.road);
    order(&user.road.inner_m, &user.road.outer_m, c);
    step(c, pfl_road_target_predict);
}

static void lane_target(case_t *c)
{
    numbers(c, &user.lane, sizeof user.lane);
    order(&user.lane.speed_min_mps, &user.lane.speed_max_mps, c);
    step(c, pfl_lane_target_predict);
}

static void planar_uav(case_t *c)
{
    numbers(c, &user.uav, sizeof user.uav);
    numbers(c, &input.uav, sizeof input.uav);
    user.uav.pieces = take_below(&c->in, PIECES);
    step(c, pfl_planar_uav_predict);
}

static void autopilot(case_t *c)
{
    pfl_waypoint_t waypoint[WAYPOINTS];
    const pfl_route_t route = route_of(c, waypoint);
    memset(&user, 0, sizeof user);
    memset(&input, 0, sizeof input);
    numbers(c, &user.autopilot, offsetof(pfl_autopilot_t, substeps));
    numbers(c, &input.autopilot, offsetof(pfl_autopilot_input_t, route));
    order(&user.autopilot.speed_min_mps, &user.autopilot.speed_max_mps, c);
    user.autopilot.substeps = index_below(c, PIECES);
    user.autopilot.wind_state = ((take_u8(&c->in) & 1u) != 0u) ? PFL_AUTOPILOT_STATES : 0u;
    user.autopilot.waypoint_state = ((take_u8(&c->in) & 1u) != 0u) ? (STATES - 1u) : 0u;
    input.autopilot.route = ((take_u8(&c->in) & 1u) != 0u) ? &route : NULL;
    step(c, pfl_autopilot_predict);
    if ((user.autopilot.waypoint_state != 0u) && (input.autopilot.route != NULL)) {
        for (uint32_t i = 0u; i < c->n; i++) {
            const float index = c->x[((STATES - 1u) * c->n) + i];
            REQUIRE((index >= 0.0f) && (index < (float)route.count));
        }
    }
}

static void coast(case_t *c)
{
    user.coast = (pfl_coast_t){(uint16_t)(1u + take_below(&c->in, 3u)), index_below(c, 2u)};
    step(c, pfl_coast_predict);
}

static void turn(case_t *c)
{
    numbers(c, &user.turn, sizeof user.turn);
    user.turn.remember = take_below(&c->in, 2u);
    step(c, pfl_turn_predict);
}

/* ---- Sensors --------------------------------------------------------------------------------------------------------- */

static void weigh(case_t *c, pfl_loglik_fn loglik, void *sensor, const void *z)
{
    const pfl_view_t view = view_of(c);
    loglik(sensor, z, &view, c->ll);
    for (uint32_t i = 0u; c->sane && (i < c->n); i++) {
        REQUIRE(c->ll[i] <= PFL_LOGLIK_MAX);
        REQUIRE(isfinite(c->ll[i]));
    }
}

static void position(case_t *c)
{
    pfl_position_t s = {(uint16_t)(1u + take_below(&c->in, PFL_POSITION_MAX)), {0u}, {0.0f}};
    float z[PFL_POSITION_MAX];
    for (uint32_t k = 0u; k < s.count; k++) {
        s.state[k] = index_below(c, STATES);
        s.inv_sigma[k] = number(c);
        z[k] = signed_number(c);
    }
    weigh(c, ((take_u8(&c->in) & 1u) != 0u) ? pfl_position_loglik : pfl_position_distance_loglik, &s, z);
}

static void range(case_t *c)
{
    pfl_range_t s = {index_below(c, STATES), index_below(c, STATES), number(c), number(c)};
    pfl_range_z_t z;
    s.dof = ((take_u8(&c->in) & 1u) != 0u) ? 0.0f : s.dof;
    numbers(c, &z, sizeof z);
    weigh(c, pfl_range_loglik, &s, &z);
}

static void range_bearing(case_t *c)
{
    pfl_range_bearing_t s = {index_below(c, STATES), index_below(c, STATES), number(c), number(c)};
    pfl_range_bearing_z_t z;
    numbers(c, &z, sizeof z);
    weigh(c, pfl_range_bearing_loglik, &s, &z);
}

static void coloured(case_t *c)
{
    pfl_coloured_t s = {(uint16_t)(1u + take_below(&c->in, PFL_POSITION_MAX)), {0u}, {0u}, number(c), {0.0f}};
    pfl_coloured_z_t z;
    for (uint32_t k = 0u; k < s.count; k++) {
        s.state[k] = index_below(c, STATES);
        s.before[k] = index_below(c, STATES);
        s.inv_sigma[k] = number(c);
    }
    numbers(c, &z, sizeof z);
    weigh(c, pfl_coloured_loglik, &s, &z);
}

static void velocity(case_t *c)
{
    pfl_velocity_t s = {index_below(c, STATES), index_below(c, STATES), number(c)};
    const float z[2] = {signed_number(c), signed_number(c)};
    weigh(c, pfl_velocity_loglik, &s, z);
}

/* ---- Constraint -------------------------------------------------------------------------------------------------------- */

static void ring(case_t *c)
{
    static const pfl_project_fn project[] = {pfl_ring_slide, pfl_ring_bounce, pfl_ring_clamp};
    pfl_ring_t r = {0u, 1u, 2u, 3u, signed_number(c), signed_number(c), number(c), number(c)};
    const pfl_batch_t batch = batch_of(c);
    const pfl_view_t view = view_of(c);
    order(&r.inner_m, &r.outer_m, c);
    pfl_ring_inside(&r, &view, c->flags);
    project[take_below(&c->in, 3u)](&r, &batch);
    REQUIRE(!c->sane || all_finite(c->x, 4u * (size_t)c->n));
    pfl_ring_inside(&r, &view, c->flags);
    for (uint32_t i = 0u; c->sane && (i < c->n); i++) {
        REQUIRE(c->flags[i] == 1u);
    }
    float x = signed_number(c);
    float y = signed_number(c);
    pfl_ring_nearest(&r, &x, &y);
    REQUIRE(!c->sane || (isfinite(x) && isfinite(y)));
}

/* ---- Waypoints and guidance: any floats at all ------------------------------------------------------------------------ */

static void waypoints(case_t *c)
{
    pfl_waypoint_t waypoint[WAYPOINTS];
    const pfl_route_t route = route_of(c, waypoint);
    const uint32_t target = ((take_u8(&c->in) & 7u) == 0u) ? take_u32(&c->in) : take_below(&c->in, WAYPOINTS);
    const float x = signed_number(c);
    const float y = signed_number(c);
    REQUIRE(pfl_route_switch(&route, target, x, y) < route.count);
    const float bearing = pfl_route_bearing(&route, target, x, y);
    const float course = pfl_route_course(&route, target, x, y);
    const float off = pfl_route_cross_track(&route, target, x, y);
    REQUIRE(!c->sane || (isfinite(off) && (fabsf(bearing) <= 3.14159275f) && (fabsf(course) <= 3.14159275f)));
}

static void standoff(case_t *c)
{
    pfl_standoff_t s;
    pfl_standoff_state_t state;
    numbers(c, &s, sizeof s);
    numbers(c, &state, sizeof state);
    order(&s.min_m, &s.max_m, c);
    state.steps = take_below(&c->in, 2u);
    const pfl_standoff_state_t before = state;
    const float reach_m = number(c);
    const pfl_status_t status = pfl_standoff_step(&s, reach_m, number(c), &state);
    REQUIRE((status == PFL_OK) || (memcmp(&before, &state, sizeof state) == 0));
    REQUIRE((status != PFL_OK) || (isfinite(state.distance_m) && isfinite(state.rate_mps)));
    REQUIRE((status != PFL_OK) || ((state.wanted_m >= s.min_m) && (state.wanted_m <= s.max_m)));
    REQUIRE((status == PFL_OK) || (!c->sane && ((status == PFL_ERR_ARG) || (status == PFL_ERR_NONFINITE))));
}

static void limits(case_t *c, pfl_uav_limits_t *l)
{
    order(&l->speed_range_mps, &l->cruise_mps, c);
}

static void lvfg(case_t *c)
{
    pfl_lvfg_t g;
    pfl_uav_t uav[2];
    pfl_target_t target;
    pfl_standoff_state_t state;
    pfl_planar_uav_input_t command[2] = {{NAN, NAN}, {NAN, NAN}};
    memset(&g, 0, sizeof g);
    numbers(c, &g, offsetof(pfl_lvfg_t, target_motion));
    limits(c, &g.limits);
    g.target_motion = (take_u8(&c->in) & 1u) != 0u;
    numbers(c, uav, sizeof uav);
    numbers(c, &target, sizeof target);
    numbers(c, &state, sizeof state);
    const uint32_t count = take_below(&c->in, 4u);
    const pfl_status_t status = pfl_lvfg_command(&g, uav, count, &target, &state, command);
    for (uint32_t k = 0u; k < 2u; k++) {
        const bool given = (status == PFL_OK) && (k < count);
        REQUIRE(given ? (isfinite(command[k].speed_mps) && (fabsf(command[k].turn_radps) <= g.limits.turn_max_radps))
                      : isnan(command[k].speed_mps));
    }
    REQUIRE((status == PFL_OK) || (status == PFL_ERR_ARG) || (status == PFL_ERR_NONFINITE));
    REQUIRE(!c->sane || (status == (((count == 1u) || (count == 2u)) ? PFL_OK : PFL_ERR_ARG)));
}

static bool plan_is_finite(const pfl_nmpc_plan_t *plan)
{
    return all_finite(plan->speed_mps, PFL_NMPC_STEPS) && all_finite(plan->turn_radps, PFL_NMPC_STEPS);
}

static void nmpc(case_t *c)
{
    pfl_nmpc_t g;
    pfl_nmpc_path_t target, pair;
    pfl_nmpc_plan_t plan, gradient;
    pfl_nmpc_report_t report = {NAN, 0u};
    pfl_nmpc_problem_t problem;
    pfl_nmpc_work_t work;
    float cost = NAN;
    numbers(c, &g, sizeof g);
    limits(c, &g.limits);
    g.lag_share = c->sane ? 0.5f : g.lag_share;
    g.phase_form = take_below(&c->in, 3u);
    numbers(c, &problem.uav, sizeof problem.uav);
    numbers(c, &target, sizeof target);
    numbers(c, &pair, sizeof pair);
    numbers(c, &plan, sizeof plan);
    problem.target = &target;
    problem.pair = ((take_u8(&c->in) & 1u) != 0u) ? &pair : NULL;
    problem.distance_m = number(c);
    const pfl_nmpc_plan_t before = plan;
    pfl_status_t status = pfl_nmpc_cost(&g, &problem, &plan, &work, &cost, &gradient);
    REQUIRE((status == PFL_OK) ? (isfinite(cost) && plan_is_finite(&gradient)) : isnan(cost));
    if ((take_u8(&c->in) & 3u) != 0u) {
        return; /* a solution takes a hundred times as long */
    }
    status = pfl_nmpc_solve(&g, &problem, &plan, &work, &report);
    REQUIRE((status == PFL_OK) ? (isfinite(report.cost) && plan_is_finite(&plan))
                               : (memcmp(&before, &plan, sizeof plan) == 0));
    REQUIRE(report.evaluations <= PFL_NMPC_EVALUATIONS_MAX);
    for (uint32_t k = 0u; (status == PFL_OK) && (k < PFL_NMPC_STEPS); k++) {
        REQUIRE(fabsf(plan.turn_radps[k]) <= g.limits.turn_max_radps);
    }
}

static void nmpc_paths(case_t *c)
{
    pfl_nmpc_t g;
    pfl_uav_t uav, last;
    pfl_target_t target;
    pfl_nmpc_plan_t plan;
    pfl_nmpc_path_t path;
    numbers(c, &g, sizeof g);
    limits(c, &g.limits);
    numbers(c, &uav, sizeof uav);
    numbers(c, &target, sizeof target);
    numbers(c, &plan, sizeof plan);
    g.phase_form = take_below(&c->in, 2u);
    g.lag_share = c->sane ? 0.5f : g.lag_share;
    pfl_nmpc_shift(&plan);
    if (pfl_nmpc_rollout(&g, &uav, &plan, &path, &last) == PFL_OK) {
        REQUIRE(all_finite(path.x_m, PFL_NMPC_STEPS + 1u) && all_finite(path.y_m, PFL_NMPC_STEPS + 1u));
        REQUIRE(isfinite(last.x_m) && isfinite(last.heading_rad) && isfinite(last.speed_mps));
    }
    if (pfl_nmpc_extrapolate(&g, &target, &path) == PFL_OK) {
        REQUIRE(all_finite(path.x_m, PFL_NMPC_STEPS + 1u) && all_finite(path.y_m, PFL_NMPC_STEPS + 1u));
    }
}

/* ---- Math: what math.h says, for any float ----------------------------------------------------------------------------- */

static bool same(float a, float b)
{
    return (isnan(a) && isnan(b)) || ((a <= b) && (a >= b));
}

static void math(case_t *c)
{
    const float x = take_float(&c->in);
    const float y = take_float(&c->in);
    float s[3];
    float co[3];
    float out[3];
    const float xs[3] = {x, y, 0.5f};
    const float ys[3] = {y, x, -x};
    REQUIRE(isnan(x) ? isnan(pfl_expf(x)) : (pfl_expf(x) >= 0.0f));
    REQUIRE((isnan(x) || (x <= -FLT_MIN)) ? isnan(pfl_logf(x)) : !isnan(pfl_logf(x)));
    REQUIRE(same(pfl_sqrtf(x), sqrtf(x)));
    if (isfinite(x) && isfinite(y)) {
        REQUIRE(fabsf(pfl_atan2f(y, x)) <= 3.14159275f);
        REQUIRE((hypotf(x, y) <= 0.0f) || (fabsf(pfl_atan2f(y, x) - atan2f(y, x)) <= 1.0e-6f));
    }
    if (fabsf(x) <= 1608.0f) {
        REQUIRE(fabsf(pfl_sinf(x) - sinf(x)) <= 4.0e-7f);
        REQUIRE(fabsf(pfl_cosf(x) - cosf(x)) <= 4.0e-7f);
    }
    if (fabsf(x) <= 6400.0f) {
        REQUIRE(fabsf(pfl_wrap_pi(x)) <= 3.1421f);
    }
    pfl_sincosf_n(xs, s, co, 3u);
    pfl_expf_n(xs, out, 3u);
    REQUIRE(same(s[0], pfl_sinf(x)) && same(co[1], pfl_cosf(y)) && same(out[1], pfl_expf(y)));
    pfl_logf_n(xs, out, 3u);
    REQUIRE(same(out[0], pfl_logf(x)));
    pfl_atan2f_n(ys, xs, out, 3u);
    REQUIRE(same(out[0], pfl_atan2f(y, x)) && same(pfl_tanf(x), s[0] / co[0]));
}

/* ---------------------------------------------------------------------------------------------------------------------- */

typedef void (*run_t)(case_t *c);

static const run_t runs[] = {
    land_vehicle, constant_velocity, odometry, road_target, lane_target, planar_uav, autopilot, coast, turn, position,
    range,        range_bearing,     coloured, velocity,    ring,        waypoints,  standoff,  lvfg,  nmpc, nmpc_paths,
    math};
#define RUNS (sizeof runs / sizeof runs[0])

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    case_t c = {.in = stream_of(data, size)};
    const uint8_t what = take_u8(&c.in);
    const uint8_t how = take_u8(&c.in);
    c.sane = (how & 1u) != 0u;
    c.n = ((how & 14u) == 14u) ? PFL_BATCH : (1u + (how >> 5));
    c.x = malloc(sizeof(float) * STATES * c.n);
    c.noise = malloc(sizeof(float) * NOISES * PFL_BATCH);
    c.ll = malloc(sizeof(float) * c.n);
    c.flags = malloc(sizeof(uint32_t) * c.n);
    for (uint32_t i = 0u; i < (NOISES * PFL_BATCH); i++) {
        c.noise[i] = (float)(i % 13u) - 6.0f;
    }
    for (uint32_t i = 0u; i < (STATES * c.n); i++) {
        c.x[i] = (i < 40u) ? signed_number(&c) : c.x[i - 40u];
    }
    runs[what % RUNS](&c);
    free(c.x);
    free(c.noise);
    free(c.ll);
    free(c.flags);
    return 0;
}
