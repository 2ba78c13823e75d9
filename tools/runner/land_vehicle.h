/* The scenario `land-vehicle`: a car tracked from position and speed, by a particle filter, a Kalman filter and an
 * unscented one, all on the same truth and measurements. */
#ifndef RUNNER_LAND_VEHICLE_H
#define RUNNER_LAND_VEHICLE_H

#include "gaussian.h"
#include "scenario.h"

#include "pflight/pflight.h"

#include <stdbool.h>
#include <stdint.h>

enum { LAND_STEPS = 100, LAND_MEASURED = 3, LAND_CASES = 3 };

#define LAND_PERIOD_S 0.5
#define LAND_PERIOD_US 500000u

typedef enum { LAND_PF, LAND_KF, LAND_UKF } land_filter_t;

/* How the UKF sees its noise and its start. RAW is no filter at all: the measurements, with the heading given. */
typedef enum {
    LAND_UKF_TUNED,
    LAND_UKF_FORGOT_T,
    LAND_UKF_R_IDENTITY,
    LAND_UKF_Q_ZERO_P_IDENTITY,
    LAND_UKF_Q_ALL_SMALL,
    LAND_UKF_Q_ALL_LARGE,
    LAND_UKF_Q_ZERO_P_ZERO,
    LAND_UKF_RAW
} land_tuning_t;

/* A study of this scenario, its settings read. */
typedef struct {
    land_filter_t filter;
    land_tuning_t tuning;
    unsigned case_index; /* 0 .. 2 for the paper's 1 .. 3 */
    bool std_reading;    /* the paper's sigmas taken for standard deviations */
    bool uncertain;      /* start drawn instead of known */
    bool jitter;
    bool optimal; /* the optimal proposal instead of the model's noise */
    float theta;
    pfl_scheme_fn resampling;
    uint32_t particles;
    uint64_t seed;
    double w_variance; /* of the velocity disturbance on each axis [m^2/s^2] */
    double z_variance; /* of each measured component */
} land_study_t;

/* Truth and measurements of a run; index k = 0 .. LAND_STEPS, without a measurement at 0. */
typedef struct {
    double truth[LAND_STEPS + 1][PFL_LAND_STATES];
    float z[LAND_STEPS + 1][LAND_MEASURED];
} land_track_t;

/* What a filter made of it. */
typedef struct {
    double x[LAND_STEPS + 1][PFL_LAND_STATES];
    uint32_t cycles_ns[LAND_STEPS];
    cycle_t cycle[LAND_STEPS]; /* zeros of a Kalman filter */
} land_estimate_t;

extern const scenario_t land_vehicle_scenario;

/* ---- land_vehicle_model.c: the world ---------------------------------------------------------------------------- */

extern const pfl_land_vehicle_t land_vehicle_constants;            /* the disturbance and jitter left at zero */
extern const double land_start[PFL_LAND_STATES];                   /* x_0 */
extern const double land_start_sigma[PFL_LAND_STATES];             /* of the uncertain start */
pfl_land_input_t land_input(unsigned k);                           /* applied on step k -> k + 1 */
void land_move(unsigned k, const double *x, double *next);         /* the noise-free model, step k -> k + 1 */
void land_jacobian(unsigned k, const double *x, double *jacobian); /* of land_move, 4 x 4 */
double land_clip_start_speed(double speed_mps);                    /* of the uncertain start */
void land_make_track(const land_study_t *study, uint32_t run, land_track_t *track);

/* ---- land_vehicle_pf.c, land_vehicle_baselines.c: the filters ------------------------------------------------------ */

bool land_particle_filter(const land_study_t *study, uint32_t run, const land_track_t *track, land_estimate_t *estimate,
                          look_t *look, failure_t *failure);

/* With a known start the exact Kalman filter: speed and heading have no variance, none of their Jacobian's columns
 * counts, and each position axis is the scalar filter. With an uncertain start the extended Kalman filter. */
bool land_kalman_filter(const land_study_t *study, const land_track_t *track, land_estimate_t *estimate,
                        failure_t *failure);

bool land_unscented_filter(const land_study_t *study, land_tuning_t tuning, const land_track_t *track,
                           land_estimate_t *estimate, failure_t *failure);

/* ---- land_vehicle_judge.c: metrics beside the paper's and the page's ---------------------------------------------- */

/* Columns of the runs' values: the filter's eta, that of the baselines on the same data where the study has them,
 * and the share of steps that resampled. */
enum { LAND_ETA, LAND_ETA_KF, LAND_ETA_UKF, LAND_RESAMPLED, LAND_VALUES };

void land_judge(const plan_t *plan, table_t runs, verdict_t *verdict);

#endif
