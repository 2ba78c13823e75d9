/* The scenario `standoff`: one or two UAVs keep a distance to a target on a ring road, which they see with gaps, by the
 * estimate of a particle filter; filter and guidance are the library's, in a closed loop. */
#ifndef RUNNER_STANDOFF_H
#define RUNNER_STANDOFF_H

#include "gaussian.h"
#include "scenario.h"

#include "pflight/pflight.h"

#include <stdbool.h>
#include <stdint.h>

enum { STANDOFF_STEPS = 140, STANDOFF_UAVS = 2, STANDOFF_OUT_STEPS = 40 };
enum { TARGET_X = 0, TARGET_Y = 1, TARGET_VX = 2, TARGET_VY = 3, TARGET_STATES = 4 };

#define STANDOFF_PERIOD_S 0.5
#define STANDOFF_PERIOD_US 500000u

#define ROAD_INNER_M 96.0
#define ROAD_OUTER_M 100.0
#define ROAD_CENTER_LINE_M 98.0

#define SENSOR_RANGE_SIGMA_M 10.0
#define SENSOR_BEARING_SIGMA_RAD 0.1

#define UAV_CRUISE_MPS 15.0
#define UAV_SPEED_RANGE_MPS 7.0
#define UAV_TURN_MAX_RADPS 0.7
#define STANDOFF_MIN_M 30.0

typedef enum { MOTION_CV, MOTION_ROAD, MOTION_LANE } standoff_motion_t;
typedef enum { GUIDANCE_LVFG, GUIDANCE_LVFG_PLUS, GUIDANCE_NMPC, GUIDANCE_NMPC_PLUS } standoff_guidance_t;
typedef enum { FALLBACK_SLIDE, FALLBACK_CLAMP, FALLBACK_BOUNCE, FALLBACK_WEIGHT, FALLBACK_KEEP } standoff_fallback_t;

/* A study of this scenario, its settings read. */
typedef struct {
    bool ekf;         /* in road coordinates; else a particle filter */
    bool constrained; /* to the road */
    unsigned uavs;    /* 1, or 2 that share the filter */
    standoff_motion_t motion;
    standoff_guidance_t guidance;
    standoff_fallback_t fallback;
    bool outages;
    bool gated; /* a UAV measures only what its camera has in view */
    bool euler_plant;
    bool calm;
    uint32_t tries;
    double ess_ratio;    /* 1: resample at every visible step */
    double kernel_width; /* lane: of the kernel step after resampling; 0: none */
    uint32_t parts;      /* lane: the first measurement after a gap is fused in so many */
    bool farthest;       /* lane: the reach is that of the farthest particle, as with the other motions */
    double sigma_along;  /* accelerations of the model, held over a step [m/s^2] */
    double sigma_across; /* cv: not used, it has one for both axes */
    bool as_page;        /* none of the settings above from ess_ratio on was changed */
    uint32_t particles;
    uint64_t seed;
} standoff_study_t;

/* What chance decides: the target's way, the prior's error, and the measurements' errors in standard deviations. The
 * measurements themselves depend on where the UAVs are. Index k = 0 .. STANDOFF_STEPS. */
typedef struct {
    double target[STANDOFF_STEPS + 1][TARGET_STATES];
    double prior[TARGET_STATES];
    double noise[STANDOFF_STEPS + 1][STANDOFF_UAVS][2]; /* range, bearing */
} standoff_track_t;

typedef struct {
    double x_m, y_m, heading_rad, speed_mps, turn_radps;
} standoff_uav_t;

/* What a filter says after a step. */
typedef struct {
    double target[TARGET_STATES];
    double reach_m; /* how far from there the target may be */
} standoff_belief_t;

/* A measurement of one UAV. */
typedef struct {
    double from_x_m, from_y_m, range_m, bearing_rad;
    bool seen; /* by this UAV, in this step */
} standoff_sight_t;

/* What became of a flight. */
enum {
    STANDOFF_POSITION,
    STANDOFF_POSITION_OUT,
    STANDOFF_VELOCITY,
    STANDOFF_VELOCITY_OUT,
    STANDOFF_DISTANCE,
    STANDOFF_PHASE,
    STANDOFF_LOSS,
    STANDOFF_LOSS_ANY,
    STANDOFF_EFFORT_SPEED,
    STANDOFF_EFFORT_TURN,
    STANDOFF_CLOSEST,
    STANDOFF_DRAWS,
    STANDOFF_FALLBACK,
    STANDOFF_OFF_ROAD,
    STANDOFF_WANTED_OUT,      /* standoff distance before the limit of its rate, in the outages */
    STANDOFF_EVALUATIONS,     /* of the NMPC's cost, a call */
    STANDOFF_EVALUATIONS_MAX, /* and the most of any call */
    STANDOFF_FLIGHT_VALUES
};

extern const scenario_t standoff_scenario;

/* ---- standoff_world.c -------------------------------------------------------------------------------------------- */

void standoff_make_track(const standoff_study_t *s, uint32_t run, standoff_track_t *track);
bool standoff_is_out(unsigned k); /* the samples of the two outages */
void standoff_start_uav(const standoff_track_t *track, unsigned index, standoff_uav_t *uav);
void standoff_move_uav(bool euler, double speed_command, double turn_command, standoff_uav_t *uav);
standoff_sight_t standoff_see(const standoff_track_t *track, unsigned k, unsigned index, const standoff_uav_t *uav);
double standoff_lag_share(bool euler); /* of the lags of the plant, in one step */

/* ---- standoff_pf.c: pflight ---------------------------------------------------------------------------------------- */

typedef struct standoff_pf standoff_pf_t;

/* Null on a failure. To be closed. */
standoff_pf_t *standoff_pf_open(const standoff_study_t *s, uint32_t run, const double *prior, failure_t *failure);
void standoff_pf_close(standoff_pf_t *pf);

/* A filter cycle; sight: of each UAV, null when none sees the target. */
bool standoff_pf_step(standoff_pf_t *pf, unsigned k, const standoff_sight_t *sight, standoff_belief_t *belief,
                      uint32_t *cycles_ns, cycle_t *cycle, failure_t *failure);

/* The step, to be looked at; on a lane, whose particles are no points of the plane, nothing. */
void standoff_pf_show(const standoff_pf_t *pf, unsigned k, const double *target, const standoff_belief_t *belief,
                      look_t *look);

/* Draws per particle and step, share of particles that fell back, share of those with weight that were off the road. */
void standoff_pf_counts(const standoff_pf_t *pf, double *draws, double *fallback, double *off_road);

/* ---- standoff_lane.c: particles in the road's coordinates ------------------------------------------------------------ */

pfl_lane_target_t standoff_lane_model(double sigma_along);
void standoff_lane_start(const double *prior, float *start);       /* the prior's mean: PFL_LANE_STATES */
void standoff_lane_draw(const float *start, const pfl_batch_t *p); /* and particles around it */
void standoff_lane_loglik(void *user, const void *z, const pfl_view_t *p, float *ll); /* user: pfl_range_bearing_t */
void standoff_lane_belief(const float *mean, const float *cov, standoff_belief_t *belief); /* reach: 3 sigma */

/* ---- standoff_ekf.c ------------------------------------------------------------------------------------------------ */

/* States: arc on the center line [m], speed along it, offset to the outside [m]. */
typedef struct {
    gaussian_t belief;
    double sigma_along;
} standoff_ekf_t;

void standoff_ekf_start(const standoff_study_t *s, const double *prior, standoff_ekf_t *ekf);
bool standoff_ekf_step(const standoff_study_t *s, const standoff_sight_t *sight, standoff_ekf_t *ekf,
                       standoff_belief_t *belief);

/* ---- standoff_pilot.c: the guidance laws --------------------------------------------------------------------------- */

typedef struct {
    pfl_standoff_state_t standoff;
    pfl_nmpc_plan_t plan[STANDOFF_UAVS];
    uint32_t calls, evaluations, evaluations_max; /* of the NMPC */
} standoff_pilot_t;

void standoff_pilot_start(standoff_pilot_t *pilot);
bool standoff_pilot_step(const standoff_study_t *s, const standoff_uav_t *uav, const standoff_belief_t *belief,
                         standoff_pilot_t *pilot, pfl_planar_uav_input_t *command, failure_t *failure);

/* The settings of the laws, as the page has them; for the tests too. */
pfl_lvfg_t standoff_lvfg(bool plus);
pfl_nmpc_t standoff_nmpc(bool plus, bool euler, bool alone);

/* ---- standoff_flight.c: the closed loop ----------------------------------------------------------------------------- */

/* Columns of the time series. */
enum {
    SERIES_TARGET_X,
    SERIES_TARGET_Y,
    SERIES_ESTIMATE_X,
    SERIES_ESTIMATE_Y,
    SERIES_UAV1_X,
    SERIES_UAV1_Y,
    SERIES_UAV2_X,
    SERIES_UAV2_Y,
    SERIES_DISTANCE,
    SERIES_REACH,
    SERIES_POSITION,
    SERIES_VELOCITY,
    SERIES_STANDOFF_ERROR,
    SERIES_PHASE_ERROR,
    SERIES_COLUMNS
};
extern const char *const standoff_columns[SERIES_COLUMNS];

/* value: STANDOFF_FLIGHT_VALUES of them. out: series, cycle times and hash of the flight; null: not wanted. */
bool standoff_fly(const standoff_study_t *s, uint32_t run, double *value, run_output_t *out, failure_t *failure);

/* ---- standoff_judge.c ------------------------------------------------------------------------------------------------ */

/* Columns of the runs' values: those of the flight, then the positions of other filters on the same data. */
enum { STANDOFF_POSITION_PF = STANDOFF_FLIGHT_VALUES, STANDOFF_POSITION_CPF, STANDOFF_POSITION_EKF, STANDOFF_VALUES };

/* Are the other filters flown beside this study's? */
bool standoff_has_pf(const standoff_study_t *s);
bool standoff_has_cpf(const standoff_study_t *s);
bool standoff_has_ekf(const standoff_study_t *s);

/* What the paper and the page say of a figure, which goes by the column that it is made of. */
typedef struct {
    const char *key; /* the settings, in words */
    unsigned figure;
    double paper;            /* its truth is the page's first */
    double ours, limit;      /* the page's reference and its acceptance, with that truth */
    double calm, calm_limit; /* and with the calm one */
} standoff_reference_t;

/* standoff_reference.c; null when nothing is said. */
const standoff_reference_t *standoff_reference(const char *key, unsigned figure);

void standoff_judge(const plan_t *plan, table_t runs, verdict_t *verdict);

#endif
