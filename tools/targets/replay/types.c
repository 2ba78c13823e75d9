/* The structures that go into the library's callbacks and guidance, field by field, so that a tape means the same on a
 * machine with another byte order, and which callback takes which. A new model or sensor of lib/ is named here. */
#include "tape.h"

#define COUNT(array) (sizeof(array) / sizeof((array)[0]))
#define MEMBER(type, member, kind, width)                                                                              \
    {                                                                                                                  \
        (uint16_t) offsetof(type, member), (uint8_t)(kind), (uint8_t)(sizeof(((type *)0)->member) / (width))           \
    }
#define WORD(type, member) MEMBER(type, member, FIELD_WORD, 4u)
#define HALF(type, member) MEMBER(type, member, FIELD_HALF, 2u)
#define FLAG(type, member) MEMBER(type, member, FIELD_BOOL, sizeof(bool))
#define INV_SIGMA(type, member) MEMBER(type, member, FIELD_INV_SIGMA, 4u)
#define WORDS_FROM(type, member, last)                                                                                 \
    {                                                                                                                  \
        (uint16_t) offsetof(type, member), (uint8_t)FIELD_WORD,                                                        \
            (uint8_t)((offsetof(type, last) - offsetof(type, member)) / 4u + 1u)                                       \
    }
/* A structure of 32-bit members only. */
#define ALL_WORDS(type)                                                                                                \
    {                                                                                                                  \
        0u, (uint8_t)FIELD_WORD, (uint8_t)(sizeof(type) / 4u)                                                          \
    }
#define TYPE(fields, type)                                                                                             \
    {                                                                                                                  \
        fields, (uint16_t)COUNT(fields), (uint16_t)sizeof(type)                                                        \
    }

/* ---- Models -------------------------------------------------------------------------------------------------------- */

static const field_t land_vehicle_fields[] = {ALL_WORDS(pfl_land_vehicle_t)};
static const field_t land_input_fields[] = {ALL_WORDS(pfl_land_input_t)};
static const field_t constant_velocity_fields[] = {ALL_WORDS(pfl_constant_velocity_t)};
static const field_t odometry_fields[] = {ALL_WORDS(pfl_odometry_t)};
static const field_t odometry_input_fields[] = {ALL_WORDS(pfl_odometry_input_t)};
static const field_t road_target_fields[] = {ALL_WORDS(pfl_road_target_t)};
static const field_t lane_target_fields[] = {ALL_WORDS(pfl_lane_target_t)};
static const field_t autopilot_fields[] = {
    WORDS_FROM(pfl_autopilot_t, alpha_speed, wind_walk),
    HALF(pfl_autopilot_t, substeps),
    HALF(pfl_autopilot_t, wind_state),
    HALF(pfl_autopilot_t, waypoint_state),
};
static const field_t autopilot_input_fields[] = {
    WORDS_FROM(pfl_autopilot_input_t, speed_mps, turn_radps),
    {(uint16_t)offsetof(pfl_autopilot_input_t, route), (uint8_t)FIELD_ROUTE, 1u},
};
static const field_t coast_fields[] = {HALF(pfl_coast_t, axes), HALF(pfl_coast_t, remember)};
static const field_t turn_fields[] = {ALL_WORDS(pfl_turn_t)};

static const field_t hover_fields[] = {
    HALF(pfl_hover_t, axes),
    HALF(pfl_hover_t, biases),
    WORDS_FROM(pfl_hover_t, time_s, bias_walk[PFL_HOVER_BIASES_MAX - 1u]),
};

static const type_t land_vehicle = TYPE(land_vehicle_fields, pfl_land_vehicle_t);
static const type_t land_input = TYPE(land_input_fields, pfl_land_input_t);
static const type_t constant_velocity = TYPE(constant_velocity_fields, pfl_constant_velocity_t);
static const type_t odometry = TYPE(odometry_fields, pfl_odometry_t);
static const type_t odometry_input = TYPE(odometry_input_fields, pfl_odometry_input_t);
static const type_t road_target = TYPE(road_target_fields, pfl_road_target_t);
static const type_t lane_target = TYPE(lane_target_fields, pfl_lane_target_t);
static const type_t autopilot = TYPE(autopilot_fields, pfl_autopilot_t);
static const type_t autopilot_input = TYPE(autopilot_input_fields, pfl_autopilot_input_t);
static const type_t coast = TYPE(coast_fields, pfl_coast_t);
static const type_t turn = TYPE(turn_fields, pfl_turn_t);
static const type_t hover = TYPE(hover_fields, pfl_hover_t);

const tape_model_t tape_models[] = {
    {NULL, NULL, NULL},
    {pfl_land_vehicle_predict, &land_vehicle, &land_input},
    {pfl_land_vehicle_jitter_predict, &land_vehicle, &land_input},
    {pfl_constant_velocity_predict, &constant_velocity, NULL},
    {pfl_odometry_predict, &odometry, &odometry_input},
    {pfl_road_target_predict, &road_target, NULL},
    {pfl_lane_target_predict, &lane_target, NULL},
    {pfl_autopilot_predict, &autopilot, &autopilot_input},
    {pfl_coast_predict, &coast, NULL},
    {pfl_turn_predict, &turn, NULL},
    {pfl_hover_predict, &hover, NULL},
};
const uint32_t tape_models_count = COUNT(tape_models);

/* ---- Sensors ------------------------------------------------------------------------------------------------------- */

static const field_t position_fields[] = {
    HALF(pfl_position_t, count),
    HALF(pfl_position_t, state),
    INV_SIGMA(pfl_position_t, inv_sigma),
};
static const field_t range_fields[] = {
    HALF(pfl_range_t, x_state),
    HALF(pfl_range_t, y_state),
    INV_SIGMA(pfl_range_t, inv_sigma),
    WORD(pfl_range_t, dof),
};
static const field_t range_z_fields[] = {ALL_WORDS(pfl_range_z_t)};
static const field_t range_bearing_fields[] = {
    HALF(pfl_range_bearing_t, x_state),
    HALF(pfl_range_bearing_t, y_state),
    INV_SIGMA(pfl_range_bearing_t, inv_sigma_range),
    INV_SIGMA(pfl_range_bearing_t, inv_sigma_bearing),
};
static const field_t range_bearing_z_fields[] = {ALL_WORDS(pfl_range_bearing_z_t)};
static const field_t coloured_fields[] = {
    HALF(pfl_coloured_t, count), HALF(pfl_coloured_t, state),          HALF(pfl_coloured_t, before),
    WORD(pfl_coloured_t, decay), INV_SIGMA(pfl_coloured_t, inv_sigma),
};
static const field_t coloured_z_fields[] = {ALL_WORDS(pfl_coloured_z_t)};
static const field_t velocity_fields[] = {
    HALF(pfl_velocity_t, speed_state),
    HALF(pfl_velocity_t, heading_state),
    INV_SIGMA(pfl_velocity_t, inv_sigma),
};
static const field_t pair_fields[] = {{0u, (uint8_t)FIELD_WORD, 2u}};

static const field_t biased_fields[] = {
    HALF(pfl_biased_t, count),
    HALF(pfl_biased_t, state),
    HALF(pfl_biased_t, bias),
    INV_SIGMA(pfl_biased_t, inv_sigma),
};

static const type_t position = TYPE(position_fields, pfl_position_t);
static const type_t range = TYPE(range_fields, pfl_range_t);
static const type_t range_z = TYPE(range_z_fields, pfl_range_z_t);
static const type_t range_bearing = TYPE(range_bearing_fields, pfl_range_bearing_t);
static const type_t range_bearing_z = TYPE(range_bearing_z_fields, pfl_range_bearing_z_t);
static const type_t coloured = TYPE(coloured_fields, pfl_coloured_t);
static const type_t coloured_z = TYPE(coloured_z_fields, pfl_coloured_z_t);
static const type_t velocity = TYPE(velocity_fields, pfl_velocity_t);
static const type_t biased = TYPE(biased_fields, pfl_biased_t);
static const type_t pair = TYPE(pair_fields, float[2]);

const tape_sensor_t tape_sensors[] = {
    {NULL, NULL, NULL},
    {pfl_position_loglik, &position, NULL},
    {pfl_position_distance_loglik, &position, NULL},
    {pfl_range_loglik, &range, &range_z},
    {pfl_range_bearing_loglik, &range_bearing, &range_bearing_z},
    {pfl_coloured_loglik, &coloured, &coloured_z},
    {pfl_velocity_loglik, &velocity, &pair},
    {pfl_biased_loglik, &biased, NULL},
};
const uint32_t tape_sensors_count = COUNT(tape_sensors);

/* ---- Constraint and guidance ----------------------------------------------------------------------------------------- */

static const field_t ring_fields[] = {
    HALF(pfl_ring_t, x_state),
    HALF(pfl_ring_t, y_state),
    HALF(pfl_ring_t, vx_state),
    HALF(pfl_ring_t, vy_state),
    WORDS_FROM(pfl_ring_t, center_x_m, outer_m),
};
static const field_t uav_fields[] = {ALL_WORDS(pfl_uav_t)};
static const field_t target_fields[] = {ALL_WORDS(pfl_target_t)};
static const field_t standoff_fields[] = {ALL_WORDS(pfl_standoff_t)};
static const field_t standoff_state_fields[] = {ALL_WORDS(pfl_standoff_state_t)};
static const field_t lvfg_fields[] = {
    WORDS_FROM(pfl_lvfg_t, limits, phase_gain),
    FLAG(pfl_lvfg_t, target_motion),
};
static const field_t command_fields[] = {ALL_WORDS(pfl_planar_uav_input_t)};
static const field_t nmpc_fields[] = {ALL_WORDS(pfl_nmpc_t)};
static const field_t nmpc_plan_fields[] = {ALL_WORDS(pfl_nmpc_plan_t)};
static const field_t nmpc_path_fields[] = {ALL_WORDS(pfl_nmpc_path_t)};
static const field_t nmpc_report_fields[] = {ALL_WORDS(pfl_nmpc_report_t)};

const tape_project_t tape_projects[] = {{NULL}, {pfl_ring_slide}, {pfl_ring_bounce}, {pfl_ring_clamp}};
const uint32_t tape_projects_count = COUNT(tape_projects);

const type_t tape_ring = TYPE(ring_fields, pfl_ring_t);
const type_t tape_uav = TYPE(uav_fields, pfl_uav_t);
const type_t tape_target = TYPE(target_fields, pfl_target_t);
const type_t tape_standoff = TYPE(standoff_fields, pfl_standoff_t);
const type_t tape_standoff_state = TYPE(standoff_state_fields, pfl_standoff_state_t);
const type_t tape_lvfg = TYPE(lvfg_fields, pfl_lvfg_t);
const type_t tape_command = TYPE(command_fields, pfl_planar_uav_input_t);
const type_t tape_nmpc = TYPE(nmpc_fields, pfl_nmpc_t);
const type_t tape_nmpc_plan = TYPE(nmpc_plan_fields, pfl_nmpc_plan_t);
const type_t tape_nmpc_path = TYPE(nmpc_path_fields, pfl_nmpc_path_t);
const type_t tape_nmpc_report = TYPE(nmpc_report_fields, pfl_nmpc_report_t);
