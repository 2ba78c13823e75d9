/* first version */
#include "standoff.h"

#include <math.h>

bool standoff_has_pf(const standoff_study_t *s)
{
    return s->constrained && s->uavs == 1u && s->motion == MOTION_CV && s->guidance == GUIDANCE_LVFG;
}
bool standoff_has_cpf(const standoff_study_t *s)
{
    return s->constrained && s->uavs == 2u && s->guidance == GUIDANCE_LVFG;
}
bool standoff_has_ekf(const standoff_study_t *s)
{
    return s->constrained && s->guidance == GUIDANCE_LVFG;
}
static const char *const names[] = {
    "position_m",     "position_out_m", "velocity_mps",   "velocity_out_mps", "standoff_m",     "phase_deg",
    "loss",           "loss_any",       "effort_speed_m", "effort_turn_rad",  "closest_pair_m", "draws_per_particle",
    "fallback_share", "off_road",       "mean_rd_out_m",  "evaluations",      "evaluations_max"};
void standoff_judge(const plan_t *plan, table_t runs, verdict_t *verdict)
{
    const standoff_study_t *s = plan->own;
    for (size_t i = 0; i < STANDOFF_FLIGHT_VALUES; i++)
        verdict_add(verdict, names[i], stats_mean(runs, i));
    if (standoff_has_pf(s))
        verdict_add(verdict, "ratio_pf", stats_ratio(runs, STANDOFF_POSITION, STANDOFF_POSITION_PF));
    if (standoff_has_cpf(s))
        verdict_add(verdict, "ratio_cpf", stats_ratio(runs, STANDOFF_POSITION, STANDOFF_POSITION_CPF));
    if (standoff_has_ekf(s))
        verdict_add(verdict, "ratio_ekf", stats_ratio(runs, STANDOFF_POSITION, STANDOFF_POSITION_EKF));
}
