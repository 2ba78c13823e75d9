/* The library's guidance laws as `standoff` uses them, with the settings of its page. */
#include "standoff.h"

#include <math.h>
#include <string.h>

#define PHASE_SHARE (1.0f / 6.0f) /* weights of a step over those at the horizon */

static const pfl_uav_limits_t limits = {
    (float)UAV_CRUISE_MPS,
    (float)UAV_SPEED_RANGE_MPS,
    (float)UAV_TURN_MAX_RADPS,
};

/* 80 degrees of view with a margin of 20: twice the reach. */
static const pfl_standoff_t standoff_rule = {
    .reach_gain = 2.0f,
    .min_m = (float)STANDOFF_MIN_M,
    .max_m = 100.0f,
    .rate_max_mps = 5.0f,
};

pfl_lvfg_t standoff_lvfg(bool plus)
{
    return (pfl_lvfg_t){
        .limits = limits,
        .turn_gain = plus ? 1.5f : 0.5f,
        .phase_gain = 1.2f,
        .target_motion = plus,
    };
}

pfl_nmpc_t standoff_nmpc(bool plus, bool euler, bool alone)
{
    const float distance = 500.0f;
    const float phase = alone ? 0.0f : (plus ? 500.0f : 100.0f);

    return (pfl_nmpc_t){
        .limits = limits,
        .dt_s = (float)STANDOFF_PERIOD_S,
        .lag_share = (float)standoff_lag_share(euler),
        .turn_nominal_radps = (float)(UAV_CRUISE_MPS / STANDOFF_MIN_M),
        .distance_weight = distance * PHASE_SHARE,
        .phase_weight = phase * PHASE_SHARE,
        .distance_weight_last = distance,
        .phase_weight_last = phase,
        .speed_weight = plus ? 20.0f : 100.0f,
        .turn_weight = 50.0f,
        .penalty = 1000.0f,
        .separation_m = 30.0f,
        .phase_form = plus ? PFL_PHASE_DIRECTION : PFL_PHASE_PRODUCT,
    };
}

void standoff_pilot_start(standoff_pilot_t *pilot)
{
    memset(pilot, 0, sizeof *pilot);
    for (unsigned i = 0u; i < STANDOFF_UAVS; i++) {
        for (unsigned k = 0u; k < PFL_NMPC_STEPS; k++) {
            pilot->plan[i].speed_mps[k] = (float)UAV_CRUISE_MPS;
            pilot->plan[i].turn_radps[k] = (float)(UAV_CRUISE_MPS / STANDOFF_MIN_M);
        }
    }
}

static bool check(pfl_status_t status, const char *call, failure_t *failure)
{
    return status >= 0 || fail(failure, EXIT_HARNESS, "%s: %s", call, pfl_status_string(status));
}

/* Where the target will be: straight on, and on the road. */
static bool foresee(const pfl_nmpc_t *nmpc, const pfl_target_t *target, pfl_nmpc_path_t *path, failure_t *failure)
{
    const pfl_ring_t road = {.inner_m = (float)ROAD_INNER_M, .outer_m = (float)ROAD_OUTER_M};

    if (!check(pfl_nmpc_extrapolate(nmpc, target, path), "pfl_nmpc_extrapolate", failure)) {
        return false;
    }
    for (unsigned k = 0u; k <= PFL_NMPC_STEPS; k++) {
        pfl_ring_nearest(&road, &path->x_m[k], &path->y_m[k]);
    }
    return true;
}

/* Each UAV plans against what the other planned a step ago. */
static bool plan_all(const standoff_study_t *s, const pfl_uav_t *uav, const pfl_target_t *target,
                     standoff_pilot_t *pilot, failure_t *failure)
{
    const pfl_nmpc_t nmpc = standoff_nmpc(s->guidance == GUIDANCE_NMPC_PLUS, s->euler_plant, s->uavs == 1u);
    pfl_nmpc_path_t ahead;
    pfl_nmpc_path_t path[STANDOFF_UAVS];

    if (!foresee(&nmpc, target, &ahead, failure)) {
        return false;
    }
    for (unsigned i = 0u; i < s->uavs; i++) {
        pfl_nmpc_shift(&pilot->plan[i]);
        if (!check(pfl_nmpc_rollout(&nmpc, &uav[i], &pilot->plan[i], &path[i], NULL), "pfl_nmpc_rollout", failure)) {
            return false;
        }
    }
    for (unsigned i = 0u; i < s->uavs; i++) {
        const pfl_nmpc_problem_t problem = {uav[i], &ahead, s->uavs == 1u ? NULL : &path[1u - i],
                                            pilot->standoff.distance_m};
        pfl_nmpc_work_t work;
        pfl_nmpc_report_t report;
        if (!check(pfl_nmpc_solve(&nmpc, &problem, &pilot->plan[i], &work, &report), "pfl_nmpc_solve", failure)) {
            return false;
        }
        pilot->calls++;
        pilot->evaluations += report.evaluations;
        pilot->evaluations_max =
            report.evaluations > pilot->evaluations_max ? report.evaluations : pilot->evaluations_max;
    }
    return true;
}

bool standoff_pilot_step(const standoff_study_t *s, const standoff_uav_t *uav, const standoff_belief_t *belief,
                         standoff_pilot_t *pilot, pfl_planar_uav_input_t *command, failure_t *failure)
{
    const pfl_target_t target = {(float)belief->target[TARGET_X], (float)belief->target[TARGET_Y],
                                 (float)belief->target[TARGET_VX], (float)belief->target[TARGET_VY]};
    pfl_uav_t seen[STANDOFF_UAVS];

    for (unsigned i = 0u; i < s->uavs; i++) {
        seen[i] = (pfl_uav_t){(float)uav[i].x_m, (float)uav[i].y_m, (float)uav[i].heading_rad, (float)uav[i].speed_mps,
                              (float)uav[i].turn_radps};
    }
    if (!check(pfl_standoff_step(&standoff_rule, (float)belief->reach_m, (float)STANDOFF_PERIOD_S, &pilot->standoff),
               "pfl_standoff_step", failure)) {
        return false;
    }
    if (s->guidance == GUIDANCE_LVFG || s->guidance == GUIDANCE_LVFG_PLUS) {
        const pfl_lvfg_t lvfg = standoff_lvfg(s->guidance == GUIDANCE_LVFG_PLUS);
        return check(pfl_lvfg_command(&lvfg, seen, s->uavs, &target, &pilot->standoff, command), "pfl_lvfg_command",
                     failure);
    }
    if (!plan_all(s, seen, &target, pilot, failure)) {
        return false;
    }
    for (unsigned i = 0u; i < s->uavs; i++) {
        command[i] = (pfl_planar_uav_input_t){pilot->plan[i].speed_mps[0], pilot->plan[i].turn_radps[0]};
    }
    return true;
}
