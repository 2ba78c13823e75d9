/* What the guidance laws share: checks of their inputs, and clipping. Private to lib/. */
#ifndef PFL_GUIDANCE_CORE_H
#define PFL_GUIDANCE_CORE_H

#include "pflight/guidance.h"

#include "bits.h"

#define PFL_HEADING_MAX 1600.0f /* beyond it the sine's error grows */

static inline float pfl_clip(float x, float lo, float hi)
{
    const float low = (x < lo) ? lo : x;
    return (low > hi) ? hi : low;
}

static inline bool pfl_uav_is_good(const pfl_uav_t *u)
{
    return pfl_is_finite(u->x_m) && pfl_is_finite(u->y_m) && pfl_is_finite(u->speed_mps) &&
           pfl_is_finite(u->turn_radps) && (u->heading_rad >= -PFL_HEADING_MAX) && (u->heading_rad <= PFL_HEADING_MAX);
}

static inline bool pfl_target_is_good(const pfl_target_t *t)
{
    return (t != NULL) && pfl_is_finite(t->x_m) && pfl_is_finite(t->y_m) && pfl_is_finite(t->vx_mps) &&
           pfl_is_finite(t->vy_mps);
}

static inline bool pfl_limits_are_good(const pfl_uav_limits_t *l)
{
    return pfl_is_finite(l->cruise_mps) && (l->speed_range_mps > 0.0f) && (l->speed_range_mps < l->cruise_mps) &&
           pfl_is_finite(l->turn_max_radps) && (l->turn_max_radps > 0.0f);
}

#endif
