/* The standoff distance, and Lyapunov vector field guidance with phase keeping: guidance.h has the equations. */
#include "guidance_core.h"

#include "math_kernels.h"
#include "sqrt_kernel.h"

#define TWO_PI 6.28318531f

static bool rule_is_good(const pfl_standoff_t *rule)
{
    return (rule->reach_gain > 0.0f) && pfl_is_finite(rule->reach_gain) && (rule->min_m > 0.0f) &&
           (rule->min_m < rule->max_m) && pfl_is_finite(rule->max_m) && (rule->rate_max_mps > 0.0f);
}

static bool step_is_good(const pfl_standoff_t *standoff, float reach_m, float dt_s, const pfl_standoff_state_t *state)
{
    return (standoff != NULL) && (state != NULL) && (reach_m >= 0.0f) && (dt_s > 0.0f) && pfl_is_finite(dt_s) &&
           rule_is_good(standoff) && pfl_is_finite(state->distance_m);
}

pfl_status_t pfl_standoff_step(const pfl_standoff_t *standoff, float reach_m, float dt_s, pfl_standoff_state_t *state)
{
    if (!step_is_good(standoff, reach_m, dt_s, state)) {
        return PFL_ERR_ARG;
    }
    const float wanted = pfl_clip(standoff->reach_gain * reach_m, standoff->min_m, standoff->max_m);
    const float most = standoff->rate_max_mps * dt_s;
    const float change = (state->steps == 0u) ? 0.0f : pfl_clip(wanted - state->distance_m, -most, most);
    const float rate = change / dt_s;
    if (!pfl_is_finite(rate)) { /* the distance is: it stays between two that are */
        return PFL_ERR_NONFINITE;
    }
    state->distance_m = (state->steps == 0u) ? wanted : (state->distance_m + change);
    state->rate_mps = rate;
    state->wanted_m = wanted;
    state->steps += (state->steps < UINT32_MAX) ? 1u : 0u;
    return PFL_OK;
}

/* ---- The field --------------------------------------------------------------------------------------------------- */

typedef struct {
    float angle; /* of the UAV, seen from the target */
    float turn;  /* command, not clipped */
} field_t;

static field_t field_at(const pfl_lvfg_t *g, const pfl_uav_t *uav, const pfl_target_t *target,
                        const pfl_standoff_state_t *standoff)
{
    const float dx = uav->x_m - target->x_m;
    const float dy = uav->y_m - target->y_m;
    const float rd = standoff->distance_m;
    const float square = (dx * dx) + (dy * dy);
    const float r = pfl_sqrt_kernel(square);
    const float both = square + (rd * rd);
    const float angle = pfl_atan2_kernel(dy, dx);
    const float vd = g->limits.cruise_mps;
    float course = angle + (2.0f * pfl_atan2_kernel(r, rd));
    float scale = 1.0f;
    if (g->target_motion) {
        float fx;
        float fy;
        pfl_sincos_kernel(course, &fy, &fx);
        const float along = (fx * target->vx_mps) + (fy * target->vy_mps);
        const float speed2 = (target->vx_mps * target->vx_mps) + (target->vy_mps * target->vy_mps);
        const float root2 = (along * along) + ((vd * vd) - speed2);
        const float s =
            pfl_sqrt_kernel((root2 > 0.0f) ? root2 : 0.0f) - along; /* a faster target: as well as it goes */
        course = pfl_atan2_kernel((s * fy) + target->vy_mps, (s * fx) + target->vx_mps);
        scale = (s / vd) * (s / vd);
    }
    const float off = pfl_wrap_pi_kernel(uav->heading_rad - course);
    const float curve = ((4.0f * vd) * (rd * square)) / (both * both);
    const float widen = ((2.0f * r) * standoff->rate_mps) / both;
    const field_t field = {angle, ((scale * curve) - (g->turn_gain * off)) - widen};
    return field;
}

static bool settings_are_good(const pfl_lvfg_t *g, const pfl_standoff_state_t *standoff)
{
    return (g != NULL) && pfl_limits_are_good(&g->limits) && pfl_is_finite(g->turn_gain) &&
           pfl_is_finite(g->phase_gain) && (standoff != NULL) && pfl_is_finite(standoff->distance_m) &&
           (standoff->distance_m > 0.0f) && pfl_is_finite(standoff->rate_mps);
}

static bool uavs_are_good(const pfl_uav_t *uav, uint32_t count, const pfl_planar_uav_input_t *command)
{
    bool good = (uav != NULL) && (command != NULL) && (count >= 1u) && (count <= 2u);
    for (uint32_t i = 0u; good && (i < count); i++) {
        good = pfl_uav_is_good(&uav[i]);
    }
    return good;
}

/* How much faster the first of two is to fly, and slower the second: its gap to the first is to be pi. */
static float faster_of(const pfl_lvfg_t *g, float first_rad, float second_rad, float distance_m)
{
    const float wrapped = pfl_wrap_pi_kernel(second_rad - first_rad);
    const float gap = (wrapped < 0.0f) ? (wrapped + TWO_PI) : wrapped; /* in [0, 2 pi] */
    return g->phase_gain * ((gap - 3.14159265f) * distance_m);
}

static pfl_planar_uav_input_t clipped(const pfl_uav_limits_t *l, float speed, float turn)
{
    pfl_planar_uav_input_t command;
    command.speed_mps = pfl_clip(speed, l->cruise_mps - l->speed_range_mps, l->cruise_mps + l->speed_range_mps);
    command.turn_radps = pfl_clip(turn, -l->turn_max_radps, l->turn_max_radps);
    return command;
}

pfl_status_t pfl_lvfg_command(const pfl_lvfg_t *lvfg, const pfl_uav_t *uav, uint32_t count, const pfl_target_t *target,
                              const pfl_standoff_state_t *standoff, pfl_planar_uav_input_t *command)
{
    if (!settings_are_good(lvfg, standoff) || !uavs_are_good(uav, count, command) || !pfl_target_is_good(target)) {
        return PFL_ERR_ARG;
    }
    const bool pair = count == 2u;
    const field_t first = field_at(lvfg, &uav[0], target, standoff);
    const field_t second = pair ? field_at(lvfg, &uav[1], target, standoff) : first;
    const float faster = pair ? faster_of(lvfg, first.angle, second.angle, standoff->distance_m) : 0.0f;
    if (!pfl_is_finite(first.turn) || !pfl_is_finite(second.turn) || !pfl_is_finite(faster)) {
        return PFL_ERR_NONFINITE;
    }
    command[0] = clipped(&lvfg->limits, lvfg->limits.cruise_mps + faster, first.turn);
    if (pair) {
        command[1] = clipped(&lvfg->limits, lvfg->limits.cruise_mps - faster, second.turn);
    }
    return PFL_OK;
}
