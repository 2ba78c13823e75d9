/* The ready models and sensors, as the filter calls them: in batches, their noise at hand. */
#include "kernels_batches.h"

/* ---- Models ---------------------------------------------------------------------------------------------------------- */

static const pfl_land_vehicle_t land = {100000.0f, 0.3f, 1250.0f, 2.5f, 0.5f, 2.0f, 0.05f, 0.02f};
static const pfl_land_input_t land_input = {0.03f, -0.05f};

KERNEL(land_vehicle)
{
    move(pfl_land_vehicle_predict, &land, &land_input);
}

KERNEL(land_vehicle_jitter)
{
    move(pfl_land_vehicle_jitter_predict, &land, &land_input);
}

KERNEL(constant_velocity)
{
    static const pfl_constant_velocity_t model = {1.0f, 0.0f};
    move(pfl_constant_velocity_predict, &model, NULL);
}

KERNEL(constant_velocity_walk)
{
    static const pfl_constant_velocity_t model = {1.0f, 0.1f};
    move(pfl_constant_velocity_predict, &model, NULL);
}

KERNEL(odometry)
{
    static const pfl_odometry_t model = {1.0f, 0.05f, 0.05f, 0.01f, 0.02f};
    static const pfl_odometry_input_t u = {3.0f, 0.2f};
    move(pfl_odometry_predict, &model, &u);
}

KERNEL(road_target)
{
    static const pfl_road_target_t model = {0.0f, 0.0f, 10.0f, 20.0f, 1.0f, 1.0f};
    move(pfl_road_target_predict, &model, NULL);
}

KERNEL(lane_target)
{
    static const pfl_lane_target_t model = {1.0f, 0.0f, 30.0f, 12.0f, 1.0f, 5.0f};
    move(pfl_lane_target_predict, &model, NULL);
}

KERNEL(planar_uav)
{
    static const pfl_planar_uav_t model = {0.5f, 4u, 0.5f, 0.05f};
    static const pfl_planar_uav_input_t u = {20.0f, 0.1f};
    move(pfl_planar_uav_predict, &model, &u);
}

KERNEL(planar_uav_euler)
{
    static const pfl_planar_uav_t model = {0.5f, 0u, 0.0f, 0.0f};
    static const pfl_planar_uav_input_t u = {20.0f, 0.1f};
    move(pfl_planar_uav_predict, &model, &u);
}

static const pfl_autopilot_t autopilot = {0.5f, 0.6f,  0.3f, 0.8f, 5.0f, 20.0f, 0.5f,
                                          3.0f, -2.0f, 1.0f, 0.0f, 4u,   0u,    0u};
static const pfl_autopilot_input_t autopilot_input = {15.0f, 100.0f, 0.3f, 0.05f, NULL};

KERNEL(autopilot)
{
    move(pfl_autopilot_predict, &autopilot, &autopilot_input);
}

KERNEL(autopilot_wind)
{
    static const pfl_autopilot_t model = {0.5f, 0.6f, 0.3f, 0.8f, 5.0f, 20.0f, 0.5f,
                                          0.0f, 0.0f, 1.0f, 0.1f, 4u,   6u,    0u};
    move(pfl_autopilot_predict, &model, &autopilot_input);
}

KERNEL(autopilot_route)
{
    static const pfl_waypoint_t waypoints[] = {{100.0f, 0.0f}, {100.0f, 100.0f}, {0.0f, 100.0f}};
    static const pfl_route_t route = {waypoints, 3u, true, PFL_SWITCH_RADIUS, 10.0f, 1.0f, 0.05f};
    static const pfl_autopilot_input_t u = {15.0f, 100.0f, 0.0f, 0.0f, &route};
    static const pfl_autopilot_t model = {0.5f, 0.6f,  0.3f, 0.8f, 5.0f, 20.0f, 0.5f,
                                          3.0f, -2.0f, 1.0f, 0.0f, 4u,   0u,    6u};
    move(pfl_autopilot_predict, &model, &u);
}

static void first_waypoint(void)
{
    for (uint32_t i = 0u; i < KERNEL_N; i++) {
        kernel_data.x[6][i] = 0.0f;
    }
}

KERNEL(coast)
{
    static const pfl_coast_t model = {3u, 1u};
    move(pfl_coast_predict, &model, NULL);
}

KERNEL(turn)
{
    static const pfl_turn_t model = {0.5f, 0.1f, 0.0f, 0.0f, 1u};
    move(pfl_turn_predict, &model, NULL);
}

KERNEL(turn_redraw)
{
    static const pfl_turn_t model = {0.5f, 0.1f, 3.0f, 0.3f, 1u};
    move(pfl_turn_predict, &model, NULL);
}

/* ---- The marginalised filter, around a model that does nothing ------------------------------------------------------- */

/* Two linear states at 1 and 2, a covariance each at 3 .. 5, the log-likelihood at 6; both or one of them drive. */
static const pfl_marginal_t marginal = {
    .linear = 2u,
    .mean = 1u,
    .driven = 1u,
    .state = {0u, 7u},
    .noise = {0u, 1u},
    .measured = 1u,
    .loglik_state = 6u,
    .drive = {{0.1f, 0.0f}, {0.0f, 0.1f}},
    .drive_variance = {0.3f, 0.3f},
    .transition = {{0.99f, 0.0f}, {0.0f, 0.99f}},
    .process_cov = {0.2f, 0.0f, 0.3f},
    .see = {{1.0f, -0.5f}},
    .see_variance = {0.4f},
};
static const float marginal_z[1] = {5.0f};
static const pfl_marginal_input_t marginal_input = {NULL, marginal_z};

KERNEL(marginal_shared)
{
    static pfl_marginal_shared_t shared;
    shared = (pfl_marginal_shared_t){.model = marginal, .cov = {2.0f, 0.0f, 1.0f}};
    shared.model.driven = 2u;
    shared.model.measured = 0u;
    pfl_marginal_shared_step(&shared, false);
    move(pfl_marginal_shared_predict, &shared, &marginal_input);
}

KERNEL(marginal_shared_seen)
{
    static pfl_marginal_shared_t shared;
    shared = (pfl_marginal_shared_t){.model = marginal, .cov = {2.0f, 0.0f, 1.0f}};
    pfl_marginal_shared_step(&shared, true);
    move(pfl_marginal_shared_predict, &shared, &marginal_input);
}

static void prepare_each(void)
{
    for (uint32_t i = 0u; i < KERNEL_N; i++) {
        kernel_data.x[4][i] -= 10.0f; /* beside variances of about 10 */
    }
}

KERNEL(marginal_each_seen)
{
    static float work[PFL_MARGINAL_WORK(2u, 1u)];
    static pfl_marginal_each_t each;
    each = (pfl_marginal_each_t){.model = marginal, .cov = 3u, .work = work};
    move(pfl_marginal_each_predict, &each, &marginal_input);
}

KERNEL(dead_reckoning_rest)
{
    static const pfl_dead_reckoning_t model = {0.1f, 0.99f, 0.07f, 0.1f};
    static const pfl_dead_reckoning_input_t u = {30.0f, -12.0f};
    move(pfl_dead_reckoning_rest_predict, &model, &u);
}

const kernel_t kernels_models[] = {
    {"land_vehicle", kernel_land_vehicle, NULL},
    {"land_vehicle_jitter", kernel_land_vehicle_jitter, NULL},
    {"constant_velocity", kernel_constant_velocity, NULL},
    {"constant_velocity_walk", kernel_constant_velocity_walk, NULL},
    {"odometry", kernel_odometry, NULL},
    {"road_target", kernel_road_target, NULL},
    {"lane_target", kernel_lane_target, NULL},
    {"planar_uav", kernel_planar_uav, NULL},
    {"planar_uav_euler", kernel_planar_uav_euler, NULL},
    {"autopilot", kernel_autopilot, NULL},
    {"autopilot_wind", kernel_autopilot_wind, NULL},
    {"autopilot_route", kernel_autopilot_route, first_waypoint},
    {"coast", kernel_coast, NULL},
    {"turn", kernel_turn, NULL},
    {"turn_redraw", kernel_turn_redraw, NULL},
    {"marginal_shared", kernel_marginal_shared, NULL},
    {"marginal_shared_seen", kernel_marginal_shared_seen, NULL},
    {"marginal_each_seen", kernel_marginal_each_seen, prepare_each},
    {"dead_reckoning_rest", kernel_dead_reckoning_rest, NULL},
};
const uint32_t kernels_models_count = sizeof kernels_models / sizeof kernels_models[0];

/* ---- Sensors --------------------------------------------------------------------------------------------------------- */

static const float seen[4] = {10.5f, 9.5f, 10.2f, 9.8f};
static const pfl_position_t position = {3u, {0u, 1u, 2u, 0u}, {0.5f, 0.5f, 0.5f, 0.0f}};
static const pfl_range_z_t range_z = {0.0f, 0.0f, 2.0f, 14.0f, 1.0f};

KERNEL(position)
{
    weigh(pfl_position_loglik, &position, seen);
}

KERNEL(position_one)
{
    static const pfl_position_t sensor = {1u, {0u, 0u, 0u, 0u}, {0.5f, 0.0f, 0.0f, 0.0f}};
    weigh(pfl_position_loglik, &sensor, seen);
}

KERNEL(position_distance)
{
    weigh(pfl_position_distance_loglik, &position, seen);
}

KERNEL(range)
{
    static const pfl_range_t sensor = {0u, 1u, 2.0f, 0.0f};
    weigh(pfl_range_loglik, &sensor, &range_z);
}

KERNEL(range_student)
{
    static const pfl_range_t sensor = {0u, 1u, 2.0f, 3.0f};
    weigh(pfl_range_loglik, &sensor, &range_z);
}

KERNEL(range_bearing)
{
    static const pfl_range_bearing_t sensor = {0u, 1u, 1.0f, 20.0f};
    static const pfl_range_bearing_z_t z = {0.0f, 0.0f, 14.0f, 0.8f};
    weigh(pfl_range_bearing_loglik, &sensor, &z);
}

KERNEL(coloured)
{
    static const pfl_coloured_t sensor = {2u, {0u, 1u, 0u, 0u}, {2u, 3u, 0u, 0u}, 0.9f, {1.0f, 1.0f, 0.0f, 0.0f}};
    static const pfl_coloured_z_t z = {{10.5f, 9.5f, 0.0f, 0.0f}, {10.2f, 9.8f, 0.0f, 0.0f}};
    weigh(pfl_coloured_loglik, &sensor, &z);
}

KERNEL(velocity)
{
    static const pfl_velocity_t sensor = {2u, 3u, 1.0f};
    weigh(pfl_velocity_loglik, &sensor, seen);
}

KERNEL(terrain)
{
    static int16_t height_m[32u * 32u];
    static const pfl_grid_t grid = {height_m, 32u, 32u, 0.0f, 0.0f, 1.0f, 1.0f};
    static const pfl_terrain_t sensor = {&grid, 0u, 1u, 2u, 0u, 0.12f, 0.01f, 15.0f, 6.5f, 1000.0f};
    static const pfl_terrain_z_t z = {900.0f, 890.0f, 3.5f, 1.0f};
    weigh(pfl_terrain_loglik, &sensor, &z);
}

const kernel_t kernels_sensors[] = {
    {"position", kernel_position, NULL},
    {"position_one", kernel_position_one, NULL},
    {"position_distance", kernel_position_distance, NULL},
    {"range", kernel_range, NULL},
    {"range_student", kernel_range_student, NULL},
    {"range_bearing", kernel_range_bearing, NULL},
    {"coloured", kernel_coloured, NULL},
    {"velocity", kernel_velocity, NULL},
    {"terrain", kernel_terrain, NULL},
};
const uint32_t kernels_sensors_count = sizeof kernels_sensors / sizeof kernels_sensors[0];
