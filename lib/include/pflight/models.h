/* Ready motion models, each a few lines on the block API in lib/src/model_*.c: use them, or read them as examples.
 * Each is a pfl_predict_fn whose `user` is its parameter structure; `u` is named beside it. All O(n) per batch. */
#ifndef PFLIGHT_MODELS_H
#define PFLIGHT_MODELS_H

#include "pflight/filter.h"

#ifdef __cplusplus
extern "C" {
#endif

/* ---- Land vehicle: engine power against drag, bicycle steering (forward Euler) --------------------------------- */
/* States: east [m], north [m], speed [m/s], heading from east [rad, not wrapped]. Noises: as many as sigmas used.
 *     e += dt v cos th + dt sigma_position w0        v  += dt (P throttle / max(v, v_min) - area Cd v^2) / m
 *     n += dt v sin th + dt sigma_position w1        th += dt v tan(steer) / wheelbase
 * With Q = 4 a jitter sigma_speed w2, sigma_heading w3 is added per step, to keep the particles of a filter that must
 * learn speed and heading apart. */
enum { PFL_LAND_EAST = 0, PFL_LAND_NORTH = 1, PFL_LAND_SPEED = 2, PFL_LAND_HEADING = 3, PFL_LAND_STATES = 4 };

typedef struct {
    float power_w;            /* > 0 */
    float drag_area_m2;       /* area times Cd; the equation has no air density, as in the paper */
    float mass_kg;            /* > 0 */
    float wheelbase_m;        /* > 0 */
    float speed_min_mps;      /* > 0: guards the division */
    float sigma_position_mps; /* of the velocity disturbance on each axis */
    float sigma_speed_mps;    /* jitter per step; used by pfl_land_vehicle_jitter_predict only */
    float sigma_heading_rad;  /* likewise */
} pfl_land_vehicle_t;

/* u of the land vehicle. */
typedef struct {
    float throttle;  /* share of the power */
    float steer_rad; /* of the front wheels */
} pfl_land_input_t;

/* Q = 2. user: pfl_land_vehicle_t, u: pfl_land_input_t. */
void pfl_land_vehicle_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p);

/* Q = 4: with jitter on speed and heading. */
void pfl_land_vehicle_jitter_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p);

/* ---- Constant velocity in the plane, driven by white acceleration ---------------------------------------------- */
/* States: x [m], y [m], vx [m/s], vy [m/s]. Acceleration a = sigma_accel w / sqrt(dt) on each axis, held over the
 * step: p += dt v + dt^2/2 a, v += dt a, so that the spread does not depend on the step length. Q = 2; Q = 4 where
 * sigma_position is used: then p += sigma_position sqrt(dt) w too. u: not used. */
enum { PFL_CV_X = 0, PFL_CV_Y = 1, PFL_CV_VX = 2, PFL_CV_VY = 3, PFL_CV_STATES = 4 };

typedef struct {
    float sigma_accel;    /* root of the acceleration's spectral density [m/s^2/sqrt(Hz)] */
    float sigma_position; /* of an extra random walk of the position [m/sqrt(s)]; 0: none */
} pfl_constant_velocity_t;

void pfl_constant_velocity_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p);

/* ---- Unicycle driven by odometry -------------------------------------------------------------------------------- */
/* States: x [m], y [m], heading [rad]; further states of a filter are left alone. Q = 4. Midpoint rule on the measured
 * speed and turn rate, each with an error that grows with it, and a random walk of the position. u:
 * pfl_odometry_input_t. */
enum { PFL_ODO_X = 0, PFL_ODO_Y = 1, PFL_ODO_HEADING = 2, PFL_ODO_STATES = 3 };

typedef struct {
    float speed_scale;    /* the speed is the measured one times this; 1 for a true wheel */
    float speed_share;    /* error of the way, as a share of speed [1/sqrt(Hz)] */
    float turn_share;     /* error of the turn, as a share of the rate [1/sqrt(Hz)] */
    float sigma_turn;     /* and at rest [rad/sqrt(s)] */
    float sigma_position; /* random walk of each position [m/sqrt(s)] */
} pfl_odometry_t;

typedef struct {
    float speed_mps;
    float turn_radps; /* from x to y positive */
} pfl_odometry_input_t;

void pfl_odometry_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p);

#ifdef __cplusplus
}
#endif

#endif
