/* The standoff distance, and Lyapunov vector field guidance with phase keeping: guidance.h has the equations. */
#include "guidance_core.h"

#include "math_kernels.h"
#include "sqrt_kernel.h"

#define TWO_PI 6.28318531f

pfl_status_t pfl_standoff_step(const pfl_standoff_t *standoff, float reach_m, float dt_s, pfl_standoff_state_t *state)
{
    if ((standoff == NULL) || (state == NULL) || !(reach_m >= 0.0f) || !(dt_s > 0.0f) || !pfl_is_finite(dt_s)) {
        return PFL_ERR_ARG;
    }
    if (!(standoff->reach_gain > 0.0f) || !(standoff->min_m > 0.0f) || !(standoff->min_m < standoff->max_m) ||
        !pfl_is_finite(standoff->max_m) || !(standoff->rate_max_mps > 0.0f) || !pfl_is_finite(state->distance_m)) {
        return PFL_ERR_ARG;
    }
    const float wanted = pfl_clip(standoff->reach_gain * reach_m, standoff->min_m, standoff->max_m);
    const float most = standoff->rate_max_mps * dt_s;
    const float change = (state->steps == 0u) ? 0.0f : pfl_clip(wanted - state->distance_m, -most, most);
    state->distance_m = (state->steps == 0u) ? wanted : (state->distance_m + change);
    state->rate_mps = change / dt_s;
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

static bool inputs_are_good(const pfl_lvfg_t *g, const pfl_uav_t *uav, uint32_t count, const pfl_target_t *target,
                            const pfl_standoff_state_t *standoff)
{
    bool good = pfl_limits_are_good(&g->limits) && pfl_is_finite(g->turn_gain) && pfl_is_finite(g->phase_gain) &&
                pfl_target_is_good(target) && pfl_is_finite(standoff->distance_m) && (standoff->distance_m > 0.0f) &&
                pfl_is_finite(standoff->rate_mps) && (count >= 1u) && (count <= 2u);
    for (uint32_t i = 0u; good && (i < count); i++) {
        good = pfl_uav_is_good(&uav[i]);
    }
    return good;
}

pfl_status_t pfl_lvfg_command(const pfl_lvfg_t *lvfg, const pfl_uav_t *uav, uint32_t count, const pfl_target_t *target,
                              const pfl_standoff_state_t *standoff, pfl_planar_uav_input_t *command)
{
    if ((lvfg == NULL) || (uav == NULL) || (target == NULL) || (standoff == NULL) || (command == NULL) ||
        !inputs_are_good(lvfg, uav, count, target, standoff)) {
        return PFL_ERR_ARG;
    }
    const pfl_uav_limits_t *limits = &lvfg->limits;
    const field_t first = field_at(lvfg, &uav[0], target, standoff);
    const field_t second = (count == 2u) ? field_at(lvfg, &uav[1], target, standoff) : first;
    float faster = 0.0f;
    if (count == 2u) { /* the gap of the second to the first, in [0, 2 pi], is to be pi */
        const float wrapped = pfl_wrap_pi_kernel(second.angle - first.angle);
        const float gap = (wrapped < 0.0f) ? (wrapped + TWO_PI) : wrapped;
        faster = lvfg->phase_gain * ((gap - 3.14159265f) * standoff->distance_m);
    }
    if (!pfl_is_finite(first.turn) || !pfl_is_finite(second.turn) || !pfl_is_finite(faster)) {
        return PFL_ERR_NONFINITE;
    }
    for (uint32_t i = 0u; i < count; i++) {
        const float speed = limits->cruise_mps + ((i == 0u) ? faster : -faster);
        const float turn = (i == 0u) ? first.turn : second.turn;
        command[i].speed_mps =
            pfl_clip(speed, limits->cruise_mps - limits->speed_range_mps, limits->cruise_mps + limits->speed_range_mps);
        command[i].turn_radps = pfl_clip(turn, -limits->turn_max_radps, limits->turn_max_radps);
    }
    return PFL_OK;
}
