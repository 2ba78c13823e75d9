/* Ready motion models, each a few lines on the block API in lib/src/model_*.c: use them, or read them as examples.
 * Each is a pfl_predict_fn whose `user` is its parameter structure; `u` is named beside it. All O(n) per batch. */
#ifndef PFLIGHT_MODELS_H
#define PFLIGHT_MODELS_H

#include "pflight/filter.h"
#include "pflight/waypoints.h"

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

/* u of the unicycle, measured. */
typedef struct {
    float speed_mps;
    float turn_radps; /* from x to y positive */
} pfl_odometry_input_t;

void pfl_odometry_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p);

/* ---- The same, with what its odometry gets wrong as states -------------------------------------------------------- */
/* States: x [m], y [m], heading [rad], scale of the speed, bias of the turn rate [rad/s]. Q = 6: the errors of
 * pfl_odometry_predict, and a random walk of scale and bias, which a filter then learns instead of being told them. u:
 * pfl_odometry_input_t. */
enum {
    PFL_WHEELS_X = 0,
    PFL_WHEELS_Y = 1,
    PFL_WHEELS_HEADING = 2,
    PFL_WHEELS_SCALE = 3,
    PFL_WHEELS_BIAS = 4,
    PFL_WHEELS_STATES = 5
};

typedef struct {
    float speed_share;    /* as in pfl_odometry_t */
    float turn_share;     /* likewise */
    float sigma_turn;     /* likewise */
    float sigma_position; /* likewise */
    float scale_walk;     /* [1/sqrt(s)] */
    float bias_walk;      /* [rad/s/sqrt(s)] */
} pfl_wheels_t;

void pfl_wheels_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p);

/* ---- A target on a ring road ------------------------------------------------------------------------------------ */
/* States as those of constant velocity: x, y [m], vx, vy [m/s]; Q = 2; u: not used. The velocity turns with the road, and
 * no particle leaves it. Accelerations a = sigma w / sqrt(dt), held over the step. With r the distance from the center,
 * th the angle there, vr and vt the speeds outwards and along:
 *     r += dt vr + dt^2/2 a0, vr += dt a0, th += (dt vt + dt^2/2 a1) / r, vt += dt a1
 * and r is clipped to the road, where vr loses what points off it. */
typedef struct {
    float center_x_m, center_y_m;
    float inner_m, outer_m; /* 0 < inner_m < outer_m */
    float sigma_across;     /* of a0 [m/s^2/sqrt(Hz)] */
    float sigma_along;      /* of a1 */
} pfl_road_target_t;

void pfl_road_target_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p);

/* ---- A target on a road of any shape, in the road's own coordinates ---------------------------------------------- */
/* States: arc length along the center line [m], speed [m/s], offset across [m]. Q = 2; u: not used. The speed is driven
 * by white acceleration, held over the step; the offset is coloured noise of first order, stationary, and clipped to the
 * road:    V += dt a, arc += dt (V_old + V) / 2, offset <- k offset + sqrt(1 - k^2) sigma_offset w1, k = exp(-dt/time)
 * A sensor has to know the road's shape. */
enum { PFL_LANE_ARC = 0, PFL_LANE_SPEED = 1, PFL_LANE_OFFSET = 2, PFL_LANE_STATES = 3 };

typedef struct {
    float sigma_along;                  /* of a [m/s^2/sqrt(Hz)] */
    float speed_min_mps, speed_max_mps; /* V is clipped to them; infinities for none */
    float half_width_m;
    float sigma_offset_m;
    float offset_time_s; /* correlation time of the offset, > 0 */
} pfl_lane_target_t;

void pfl_lane_target_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p);

/* ---- UAV in the plane whose speed and turn rate follow commands with a lag --------------------------------------- */
/* States: x [m], y [m], heading [rad, not wrapped], speed [m/s], turn rate [rad/s].
 *     x' = v cos psi, y' = v sin psi, psi' = om, v' = (command - v) / lag, om' likewise
 * The lags are exact and the way is integrated in pieces by the midpoint rule; or all by one forward Euler step. Q = 2,
 * a random walk on speed and turn rate; Q = 0 where both sigmas are zero. */
enum { PFL_UAV_X = 0, PFL_UAV_Y = 1, PFL_UAV_HEADING = 2, PFL_UAV_SPEED = 3, PFL_UAV_TURN = 4, PFL_UAV_STATES = 5 };

#define PFL_UAV_PIECES_MAX 64u

typedef struct {
    float lag_s;       /* > 0 */
    uint32_t pieces;   /* of a step, at most PFL_UAV_PIECES_MAX; 0: forward Euler */
    float sigma_speed; /* [m/s/sqrt(s)] */
    float sigma_turn;  /* [rad/s/sqrt(s)] */
} pfl_planar_uav_t;

/* u of the UAV: its commands. Limits are the caller's. */
typedef struct {
    float speed_mps;
    float turn_radps; /* from x to y positive */
} pfl_planar_uav_input_t;

void pfl_planar_uav_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p);

/* ---- UAV under its autopilot: loops for speed, heading and height, in wind (McLain and Beard 2005) --------------- */
/* States: x [m], y [m], height [m], airspeed [m/s], heading from x [rad, not wrapped], climb rate [m/s]; then, where
 * the parameters say so, the wind (x, y) [m/s] and the index of the waypoint steered for. Explicit Euler in `substeps`
 * equal pieces of the step, each all from its old state, D the piece's length:
 *     x += D (v cos psi + w_x)      psi += D clip(alpha_heading (psi_c - psi), -turn_max, turn_max)
 *     y += D (v sin psi + w_y)      v = clip(v + D alpha_speed (v_c - v), speed_min, speed_max)
 *     h += D climb                  climb += D (alpha_height (h_c - h) - alpha_climb climb)
 * The wind is w = wind + sigma_gust n, drawn for each particle once a step and held over it: the step is the gust's
 * period. Wind in the states then walks by wind_walk sqrt(dt) n; it is unknown, and copied by resampling with the
 * rest. Q = 2; Q = 4 with wind in the states. user: pfl_autopilot_t, u: pfl_autopilot_input_t. Stack: 1.6 KB. */
enum {
    PFL_AUTOPILOT_X = 0,
    PFL_AUTOPILOT_Y = 1,
    PFL_AUTOPILOT_HEIGHT = 2,
    PFL_AUTOPILOT_SPEED = 3,
    PFL_AUTOPILOT_HEADING = 4,
    PFL_AUTOPILOT_CLIMB = 5,
    PFL_AUTOPILOT_STATES = 6
};

typedef struct {
    float alpha_speed;       /* bandwidth of the speed loop [1/s] */
    float alpha_heading;     /* and of the heading loop [1/s] */
    float alpha_height;      /* spring of the height loop [1/s^2] */
    float alpha_climb;       /* and its damping [1/s] */
    float speed_min_mps;     /* < speed_max_mps */
    float speed_max_mps;     /* infinity: no limit */
    float turn_max_radps;    /* > 0; infinity: no limit */
    float wind_x_mps;        /* the known part of the wind, added to the states' */
    float wind_y_mps;        /* towards y */
    float sigma_gust_mps;    /* standard deviation of each component, about the mean */
    float wind_walk;         /* random walk of the wind in the states [m/s/sqrt(s)] */
    uint16_t substeps;       /* 0: as 1 */
    uint16_t wind_state;     /* index of the first of two states for the wind; 0: none */
    uint16_t waypoint_state; /* index of the state for the waypoint's index; 0: none */
} pfl_autopilot_t;

/* u of the UAV: what its pilot asks for, from the beginning of the step on. */
typedef struct {
    float speed_mps;
    float height_m;
    float heading_rad;        /* wanted at the beginning of the step: constant, or for a circle */
    float turn_radps;         /* and how fast it turns */
    const pfl_route_t *route; /* not null, with a waypoint state: straight to the waypoints, switching before each
                                 piece, and the two above are not used. Bearings are wrapped */
} pfl_autopilot_input_t;

void pfl_autopilot_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p);

/* ---- Constant velocity on 1 .. 3 axes, without noise ------------------------------------------------------------- */
/* With A axes: states 0 .. A-1 are positions [m], A .. 2A-1 velocities [m/s]: p += dt v. Where `remember` is not 0,
 * states 2A .. 3A-1 become the positions before the step, for pfl_coloured_loglik. Q = 0. Nothing here moves the copies
 * apart that resampling makes: use it with pfl_kernel_t, its mask on the first 2A states. u: not used. */
typedef struct {
    uint16_t axes;     /* 1 .. 3 */
    uint16_t remember; /* 1: keep the positions before the step */
} pfl_coast_t;

void pfl_coast_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p);

/* ---- Coordinated turn: a vehicle in the plane that holds speed and turn rate -------------------------------------- */
/* States: x [m], y [m], speed [m/s], heading from x towards y [rad, not wrapped], turn rate [rad/s]; where `remember` is
 * not 0 also the position before the step, for pfl_coloured_loglik. In this order:
 *     v     += sigma_speed sqrt(dt) w0
 *     omega += sigma_rate sqrt(dt) w1, or with probability redraw_hz dt, as a turn begins or ends: omega = redraw_sigma w1
 *     x += dt v cos(psi + dt omega / 2),  y += dt v sin(psi + dt omega / 2),  psi += dt omega
 * The noise comes first, so that copies of one particle part within the step: with few particles that is worth some
 * percent. Q = 2; Q = 4 with redraw_hz > 0. u: not used. */
enum {
    PFL_TURN_X = 0,
    PFL_TURN_Y = 1,
    PFL_TURN_SPEED = 2,
    PFL_TURN_HEADING = 3,
    PFL_TURN_RATE = 4,
    PFL_TURN_STATES = 5,
    PFL_TURN_BEFORE_X = 5,
    PFL_TURN_BEFORE_Y = 6,
    PFL_TURN_REMEMBER_STATES = 7
};

typedef struct {
    float sigma_speed;  /* random walk of the speed [m/s/sqrt(s)] */
    float sigma_rate;   /* random walk of the turn rate [rad/s/sqrt(s)] */
    float redraw_hz;    /* how often the turn rate is drawn anew, on average [1/s]; 0: never */
    float redraw_sigma; /* standard deviation of the new one [rad/s] */
    uint32_t remember;  /* 1: keep the position before the step */
} pfl_turn_t;

void pfl_turn_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p);

/* ---- A vehicle that hovers or wanders on 1 .. 3 axes ---------------------------------------------------------------- */
/* With A axes and B biases: states 0 .. A-1 are positions [m], A .. 2A-1 velocities [m/s], 2A .. 2A+B-1 biases, of a
 * barometer against GPS say. The velocities are coloured noise of first order and come back to zero, so that the
 * uncertainty without measurements grows as the root of time, not as its power of 3/2:
 *     v <- k v + sqrt(1 - k^2) sigma w, k = exp(-dt/time)      p += dt (v_old + v) / 2      b += bias_walk sqrt(dt) w
 * Q = A + B. u: not used. */
#define PFL_HOVER_AXES_MAX 3u
#define PFL_HOVER_BIASES_MAX 4u

typedef struct {
    uint16_t axes;                         /* 1 .. PFL_HOVER_AXES_MAX */
    uint16_t biases;                       /* 0 .. PFL_HOVER_BIASES_MAX */
    float time_s;                          /* correlation time of the velocities, > 0 */
    float sigma_mps[PFL_HOVER_AXES_MAX];   /* of each of them */
    float bias_walk[PFL_HOVER_BIASES_MAX]; /* [unit/sqrt(s)] */
} pfl_hover_t;

void pfl_hover_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p);

#ifdef __cplusplus
}
#endif

#endif
