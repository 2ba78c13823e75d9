/* The scenario `gps`: a position from GPS with coloured noise, or from a radar, made better by Kalman filters and
 * particle filters, all on the same truth and measurements. North, east, down; index k = 0 .. steps, 10 a second. */
#ifndef RUNNER_GPS_H
#define RUNNER_GPS_H

#include "gaussian.h"
#include "scenario.h"

#include "pflight/pflight.h"

#include <stdbool.h>
#include <stdint.h>

enum { GPS_STEPS_LINE = 100, GPS_STEPS_CURVE = 400, GPS_STEPS_MAX = 400, GPS_AXES_MAX = 3 };

#define GPS_PERIOD_S 0.1
#define GPS_PERIOD_US 100000u
#define GPS_LOST_M 5.0 /* a run with a larger error is lost */

typedef enum { GPS_LINE, GPS_CURVE, GPS_RADAR, GPS_RADAR_COARSE } gps_variant_t;
typedef enum { GPS_KF, GPS_KF_TUNED, GPS_KF_COLOURED, GPS_EKF, GPS_PF, GPS_PF_COLOURED, GPS_RAW } gps_filter_t;
typedef enum { GPS_GUESS_DOCUMENT, GPS_GUESS_FAR, GPS_GUESS_FAR_WIDE } gps_guess_t;

/* A study of this scenario, its settings read. */
typedef struct {
    gps_filter_t filter;
    gps_variant_t variant;
    gps_guess_t guess;
    unsigned steps;
    int axes;           /* that are filtered and scored: 1 .. 3 on the line, else 2 */
    bool white;         /* GPS noise without colour */
    bool longrun;       /* filters take the noise's long-run variance for R */
    bool velocity;      /* GPS velocity is used as well */
    bool drawn;         /* truth starts where the prior says, at random */
    bool linear;        /* radar: Kalman filters on range and azimuth, linearised once */
    bool kernel;        /* particles move apart after resampling */
    double decay;       /* of the GPS error from one sample to the next; 0 when white */
    double accuracy_m;  /* sigma of the receiver's data sheet */
    double noise_m;     /* standard deviation of the innovation of the GPS error */
    double r_m2;        /* its variance as the filters see it that take it for white */
    double sigma_range; /* of the radar [m] */
    double sigma_azimuth;
    double sigma_heading; /* of what is known of the heading at the radar's start */
    double q_tuned;       /* of the tuned Kalman filter: root of the spectral density of the white acceleration that it
                             believes in [m/s^2/sqrt(Hz)], as in pfl_constant_velocity_t */
    double q_coloured;    /* and of the one with colour; both 0 where the study has none */
    uint32_t particles;
    uint64_t seed;
} gps_study_t;

/* Truth and measurements of a run. */
typedef struct {
    double position[GPS_STEPS_MAX + 1][GPS_AXES_MAX];
    double velocity[GPS_STEPS_MAX + 1][GPS_AXES_MAX];
    double gps[GPS_STEPS_MAX + 1][GPS_AXES_MAX]; /* out of latitude, longitude and altitude; radar: out of the polar */
    double gps_velocity[GPS_STEPS_MAX + 1][GPS_AXES_MAX];
    double range[GPS_STEPS_MAX + 1];
    double azimuth[GPS_STEPS_MAX + 1];
    double start[PFL_TURN_STATES]; /* what a filter with the turn model knows at first, order of its states */
    double start_sigma[PFL_TURN_STATES];
} gps_track_t;

/* What a filter made of it; index 0 is not scored. */
typedef struct {
    double position[GPS_STEPS_MAX + 1][GPS_AXES_MAX];
    double velocity[GPS_STEPS_MAX + 1][GPS_AXES_MAX];
    double sigma[GPS_STEPS_MAX + 1]; /* the filter's own, of the position north; 0: none */
    double nees[GPS_STEPS_MAX + 1];  /* of position and velocity, mean over the axes; 0: none */
    uint32_t cycles_ns[GPS_STEPS_MAX];
    cycle_t cycle[GPS_STEPS_MAX]; /* of a particle filter */
} gps_estimate_t;

extern const scenario_t gps_scenario;

/* ---- gps_track.c: truth and measurements ------------------------------------------------------------------------- */

#define GPS_VELOCITY_SIGMA 0.1 /* white, each axis [m/s] */

bool gps_is_radar(const gps_study_t *study);
void gps_make_track(const gps_study_t *study, uint32_t run, gps_track_t *track);
double gps_wrap(double angle_rad);

/* A stage of the receiver's noise model: e = decay e + w, from zero. */
double gps_colour(double decay, double before, double innovation);

/* ---- gps_kalman.c: Kalman filters, one for each axis -------------------------------------------------------------- */

enum { GPS_P, GPS_V, GPS_E, GPS_AXIS_STATES_MAX };

/* One axis: position and velocity, and the GPS error where it is modelled. */
typedef struct {
    gaussian_t belief;
    double f[9];     /* transition */
    double q[9];     /* process noise */
    double h[6];     /* measured: position, and velocity where it is used */
    double r[4];     /* their noise */
    int measured;    /* 1 or 2 */
    bool from_start; /* sample 0 is used */
} gps_axis_t;

/* The filter of an axis before its first step; coloured: with the GPS error as a state. */
gps_axis_t gps_axis_start(const gps_study_t *study, bool coloured, double acceleration, int axis);
void gps_axis_predict(gps_axis_t *axis);
bool gps_axis_update(gps_axis_t *axis, double position, double velocity);

/* Kalman's gain that the next update would have, states x measured. */
bool gps_axis_gain(const gps_axis_t *axis, double *gain);

/* NEES of position and velocity; MISSING for a covariance without volume, as of particles that all sit at one point. */
double gps_nees(const double *error, double p_pp, double p_pv, double p_vv);

/* acceleration: what the filter believes in, as q_tuned. */
bool gps_kalman(const gps_study_t *study, bool coloured, double acceleration, const gps_track_t *track,
                gps_estimate_t *estimate, failure_t *failure);

/* ---- gps_tune.c: the best acceleration for a study, found on runs of its own ------------------------------------------- */

bool gps_tune(const gps_study_t *study, bool coloured, double *q, failure_t *failure);

/* ---- gps_expected.c: the Kalman filters' errors without sampling -------------------------------------------------- */

typedef struct {
    double rmse_m; /* root of the exact mean square over k = 1 .. steps */
    double final_position_m;
    double final_velocity_mps;
    double nees; /* mean over k = 1 .. steps and the axes */
} gps_expected_t;

/* Of the study's own filter, on a straight line. False for the others. GPS alone has no NEES and no velocity: zeros. */
bool gps_expect(const gps_study_t *study, gps_expected_t *expected);

/* ---- gps_radar_kalman.c: the linear filter on range and azimuth ---------------------------------------------------- */

bool gps_radar_kalman(const gps_study_t *study, double acceleration, const gps_track_t *track, gps_estimate_t *estimate,
                      failure_t *failure);

/* ---- gps_turn_kalman.c: the extended Kalman filter with the turn model -------------------------------------------- */

bool gps_turn_kalman(const gps_study_t *study, const gps_track_t *track, gps_estimate_t *estimate, failure_t *failure);

/* ---- gps_particle_*.c: pflight itself ------------------------------------------------------------------------------ */

/* The turn model's noise, the particle filter's and the extended Kalman filter's. */
#define GPS_TURN_SIGMA_SPEED 0.15
#define GPS_TURN_SIGMA_RATE 0.05
#define GPS_TURN_SIGMA_RATE_EKF 0.08
#define GPS_TURN_REDRAW_HZ 0.1
#define GPS_TURN_REDRAW_SIGMA 0.3

/* look: for look_take, or null. */
bool gps_particle_filter(const gps_study_t *study, bool coloured, uint32_t run, const gps_track_t *track,
                         gps_estimate_t *estimate, look_t *look, failure_t *failure);

/* What differs between the straight line and the path with turns: states, model and sensors. Sensor 0 takes the first
 * measurement or all of them, sensor 1 the later ones of the coloured filter, sensor 2 the velocity. */
enum { GPS_SENSORS = 3 };

typedef struct {
    union {
        pfl_coast_t coast;
        pfl_turn_t turn;
    } motion; /* first: the ready models take a pointer to the whole for a pointer to it */
    const gps_study_t *study;
    const gps_track_t *track;
    bool coloured;
    pfl_position_t position;
    pfl_coloured_t difference;
    pfl_range_bearing_t radar;
    pfl_position_t velocity_axes;
    pfl_velocity_t velocity_polar;
    pfl_kernel_t kernel;
    pfl_sensor_t sensor[GPS_SENSORS];
} gps_particles_t;

void gps_particles_line(gps_particles_t *particles, pfl_config_t *config);
void gps_particles_turn(gps_particles_t *particles, pfl_config_t *config);

/* ---- gps_judge.c, gps_reference.c: metrics beside the page's ------------------------------------------------------- */

/* Columns of the runs' values. Those of filters that the study does not run are zero. */
enum {
    GPS_RMSE,
    GPS_RMSE_RAW,      /* GPS or radar alone, same data */
    GPS_RMSE_KF,       /* the Kalman filter of the same model */
    GPS_RMSE_TUNED,    /* the tuned Kalman filter */
    GPS_RMSE_DOCUMENT, /* the same kind of filter on the document's model */
    GPS_FINAL_POSITION_2,
    GPS_FINAL_VELOCITY_2,
    GPS_NEES,
    GPS_TO_KF_2, /* mean square distance to the Kalman filter of the same model */
    GPS_RESAMPLED,
    GPS_LOST,
    GPS_BEATS_RAW,
    GPS_VALUES
};

/* Which partners a study has. */
bool gps_has_kf_partner(const gps_study_t *study);
bool gps_has_tuned_partner(const gps_study_t *study);
bool gps_has_document_partner(const gps_study_t *study);

/* A figure of the page, and half a unit of its last digit. MISSING where it has none for these very settings. */
typedef struct {
    double value;
    double rounding;
} gps_reference_t;

gps_reference_t gps_reference_rmse(const gps_study_t *study);     /* mean of runs */
gps_reference_t gps_reference_expected(const gps_study_t *study); /* root of the exact mean square */
gps_reference_t gps_reference_nees(const gps_study_t *study);     /* likewise exact */
gps_reference_t gps_reference_to_kf(const gps_study_t *study); /* distance of a particle filter to its Kalman filter */

/* Settings of which the page speaks. */
bool gps_is_standard(const gps_study_t *study); /* all but filter, R, particles and kernel as the document has them */
bool gps_is_value(double x, double value);

/* Largest deviation of the document's filter from the page's gain and covariances, k = 1, 10, 50, 100. */
bool gps_document_deviation(double *deviation);

void gps_judge(const plan_t *plan, table_t runs, verdict_t *verdict);

#endif
