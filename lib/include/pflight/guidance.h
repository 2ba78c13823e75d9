/* Guidance of one or two UAVs that keep a distance to a moving target (standoff tracking), fed by a filter's estimate.
 * An optional module: nothing in the filter needs it. No allocation, no state of its own, every loop of fixed length;
 * scalar floats with the same bits on every CPU. Angles grow from x to y; orbits too.
 *
 *     pfl_standoff_step    how far to stay away, from the reach of the particle cloud (pfl_farthest)
 *     pfl_lvfg_command     commands by a Lyapunov vector field, one step ahead: some 400 instructions a UAV
 *     pfl_nmpc_solve       commands by nonlinear model predictive control, PFL_NMPC_STEPS ahead: some 90 times that,
 *                          and three times as much again in the worst case
 *
 * All are O(1), re-entrant, and answer PFL_OK; PFL_ERR_ARG for a null pointer, a parameter out of range or an input that
 * is not finite; PFL_ERR_NONFINITE when the result would not be finite. On an error no output is touched. */
#ifndef PFLIGHT_GUIDANCE_H
#define PFLIGHT_GUIDANCE_H

#include "pflight/models.h"
#include "pflight/status.h"

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* A UAV as the model pfl_planar_uav_predict has it; its commands are a pfl_planar_uav_input_t. */
typedef struct {
    float x_m, y_m;
    float heading_rad; /* any multiple of 2 pi, |heading_rad| <= 1600 */
    float speed_mps;
    float turn_radps;
} pfl_uav_t;

/* The target as the filter estimates it. */
typedef struct {
    float x_m, y_m;
    float vx_mps, vy_mps;
} pfl_target_t;

/* What a UAV can do: commands are clipped to cruise +- speed_range and to +- turn_max. */
typedef struct {
    float cruise_mps;      /* > 0 */
    float speed_range_mps; /* 0 < speed_range < cruise */
    float turn_max_radps;  /* > 0 */
} pfl_uav_limits_t;

/* ---- Standoff distance ------------------------------------------------------------------------------------------- */

typedef struct {
    float reach_gain;   /* > 0, finite; 1 / sin(half the usable view angle) keeps a cloud of that reach in view */
    float min_m, max_m; /* 0 < min < max */
    float rate_max_mps; /* how fast the distance may change: a cloud that collapses must not make it jump. > 0 */
} pfl_standoff_t;

/* Zero it before the first step, which takes the distance as it comes, without a rate. */
typedef struct {
    float distance_m;
    float rate_mps;
    float wanted_m; /* without the limit of its rate */
    uint32_t steps;
} pfl_standoff_state_t;

/* reach_m: largest distance of a particle from the estimate, >= 0; dt_s > 0: time since the last step. PFL_OK, PFL_ERR_ARG,
 * PFL_ERR_NONFINITE (a rate beyond single precision); `state` is untouched then. O(1). */
pfl_status_t pfl_standoff_step(const pfl_standoff_t *standoff, float reach_m, float dt_s, pfl_standoff_state_t *state);

/* ---- Lyapunov vector field guidance -------------------------------------------------------------------------------- */
/* Heading psi_d = th + 2 atan(r / rd) at the place (r, th) around the target: along the orbit at r = rd, inwards outside,
 * outwards inside (Lawrence 2003; Frew, Lawrence and Morris 2008). Speed keeps two UAVs half an orbit apart. */
typedef struct {
    pfl_uav_limits_t limits;
    float turn_gain;    /* kw [1/s]: 0.5; 1.5 with target_motion */
    float phase_gain;   /* kv [1/s]: 1.2 */
    bool target_motion; /* the field moves with the target: psi_d is the direction of s f + v_target, |.| = cruise */
} pfl_lvfg_t;

/* uav: `count` of them, 1 or 2; command: as many. */
pfl_status_t pfl_lvfg_command(const pfl_lvfg_t *lvfg, const pfl_uav_t *uav, uint32_t count, const pfl_target_t *target,
                              const pfl_standoff_state_t *standoff, pfl_planar_uav_input_t *command);

/* ---- Nonlinear model predictive control ----------------------------------------------------------------------------- */
/* Minimises, over the commands of PFL_NMPC_STEPS steps, the squared errors of distance and phase, the effort, and
 * penalties on limits and on the separation of the pair; by gradient descent with the adjoint's gradient and steps after
 * Barzilai and Borwein (1988). A fixed number of iterations, each with a bounded number of trials: the worst case is
 * PFL_NMPC_EVALUATIONS_MAX predictions and PFL_NMPC_ITERATIONS gradients, whatever the input. */
#define PFL_NMPC_STEPS 6u
#define PFL_NMPC_ITERATIONS 8u
#define PFL_NMPC_TRIALS 6u
#define PFL_NMPC_EVALUATIONS_MAX (1u + (PFL_NMPC_ITERATIONS * PFL_NMPC_TRIALS))

/* How the phase error of a pair is measured, with r, rp the places of the UAV and of its pair seen from the target. */
typedef enum {
    PFL_PHASE_PRODUCT = 0,  /* ((r.rp + |r||rp|) / rd^2)^2: of fourth order in the angle, hence soft near zero */
    PFL_PHASE_DIRECTION = 1 /* |r/|r| + rp/|rp||^2: of second order */
} pfl_phase_form_t;

typedef struct {
    pfl_uav_limits_t limits;
    float dt_s;                 /* of a step, > 0 */
    float lag_share;            /* of a lag that a step covers: 1 - exp(-dt/lag); dt/lag for an Euler plant */
    float turn_nominal_radps;   /* the turn rate that costs nothing: cruise / smallest distance */
    float distance_weight;      /* qr: 83.3 */
    float phase_weight;         /* qd: 16.7 */
    float distance_weight_last; /* pr, at the horizon: 500 */
    float phase_weight_last;    /* pd: 100 */
    float speed_weight;         /* rv: 100 */
    float turn_weight;          /* rw: 50 */
    float penalty;              /* mu: 1000 */
    float separation_m;         /* the pair stays further apart than this: 30. > 0 */
    uint32_t phase_form;        /* pfl_phase_form_t */
} pfl_nmpc_t;

/* Commands of the steps ahead. */
typedef struct {
    float speed_mps[PFL_NMPC_STEPS];
    float turn_radps[PFL_NMPC_STEPS];
} pfl_nmpc_plan_t;

/* Places now and at the end of each step. */
typedef struct {
    float x_m[PFL_NMPC_STEPS + 1u];
    float y_m[PFL_NMPC_STEPS + 1u];
} pfl_nmpc_path_t;

/* What to solve. */
typedef struct {
    pfl_uav_t uav;
    const pfl_nmpc_path_t *target;
    const pfl_nmpc_path_t *pair; /* null: a single UAV, without phase and separation */
    float distance_m;            /* rd, held over the horizon; > 0 */
} pfl_nmpc_problem_t;

/* Room for a solution on its way, kept off the stack; the caller's, and free again after the call. */
typedef struct {
    float numbers[(16u * PFL_NMPC_STEPS) + 8u];
} pfl_nmpc_work_t;

/* What came of it. */
typedef struct {
    float cost;
    uint32_t evaluations; /* predictions made, at most PFL_NMPC_EVALUATIONS_MAX */
} pfl_nmpc_report_t;

/* The plan that begins a step later; its last commands are repeated. */
void pfl_nmpc_shift(pfl_nmpc_plan_t *plan);

/* Where a UAV goes with a plan; *last, if wanted, is the UAV at the horizon. */
pfl_status_t pfl_nmpc_rollout(const pfl_nmpc_t *nmpc, const pfl_uav_t *uav, const pfl_nmpc_plan_t *plan,
                              pfl_nmpc_path_t *path, pfl_uav_t *last);

/* The target on its straight line. */
pfl_status_t pfl_nmpc_extrapolate(const pfl_nmpc_t *nmpc, const pfl_target_t *target, pfl_nmpc_path_t *path);

/* Cost of a plan, and its gradient (null: not wanted), laid out like the plan. */
pfl_status_t pfl_nmpc_cost(const pfl_nmpc_t *nmpc, const pfl_nmpc_problem_t *problem, const pfl_nmpc_plan_t *plan,
                           pfl_nmpc_work_t *work, float *cost, pfl_nmpc_plan_t *gradient);

/* Improves a plan (the one of the step before, shifted) and clips it to the limits; its first commands are to be flown.
 * report: may be null. */
pfl_status_t pfl_nmpc_solve(const pfl_nmpc_t *nmpc, const pfl_nmpc_problem_t *problem, pfl_nmpc_plan_t *plan,
                            pfl_nmpc_work_t *work, pfl_nmpc_report_t *report);

#ifdef __cplusplus
}
#endif

#endif
