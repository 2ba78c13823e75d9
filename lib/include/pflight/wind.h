/* Wind from GPS, airspeed and yaw in flight, and dead reckoning by it while GPS is out: a filter whose particles hold
 * what is not linear, the scale of the airspeed and the offset of the yaw, and carry what is linear given these, position,
 * wind and gust on each axis, as the mean of a Kalman filter (Rao-Blackwellised; Schoen, Gustafsson and Nordlund 2005).
 * The two axes and all particles share one 3 x 3 covariance, kept in pfl_wind_t, so 100 particles do where a filter that
 * draws all eight states fails with 3000. lib/src/wind.c; an optional module.
 *
 *     position' = wind + gust + scale air (cos, sin)(yaw + offset)      wind' = wind_walk n      scale' = scale_walk n
 *     gust and offset: coloured noise of first order, stationary, each with its sigma and correlation time
 *
 * The wind is what lasts, the gust what comes back to zero within its time. A filter cycle, with a fix:
 *     pfl_wind_move(&wind, dt_s);                      the shared covariance
 *     pfl_predict(f, t_us, &input);                    each particle's means; moves in what was fused before
 *     pfl_estimate(f, mean, NULL);
 *     pfl_wind_weigh(&wind, mean, &fix);               the gain
 *     pfl_update(f, 0, t_us, &fix);                    the weights
 *     pfl_estimate(f, mean, NULL);
 *     pfl_wind_fuse(&wind, mean, &fix);                covariance and mean; input.fused = &fix in the next predict
 * Without a fix only the first two, and input.fused = NULL: the fix is moved in once. The position's covariance is that of
 * the particles plus wind.cov[PFL_WIND_PP] on both axes. */
#ifndef PFLIGHT_WIND_H
#define PFLIGHT_WIND_H

#include "pflight/filter.h"

#ifdef __cplusplus
extern "C" {
#endif

/* States; x is north and y east, say, where yaw goes from x to y. Q = 2. */
enum {
    PFL_WIND_X = 0,      /* position [m] */
    PFL_WIND_X_WIND = 1, /* [m/s], where it blows to */
    PFL_WIND_X_GUST = 2,
    PFL_WIND_Y = 3,
    PFL_WIND_Y_WIND = 4,
    PFL_WIND_Y_GUST = 5,
    PFL_WIND_SCALE = 6,  /* true airspeed over the measured one */
    PFL_WIND_OFFSET = 7, /* direction of flight through the air less the measured yaw [rad] */
    PFL_WIND_STATES = 8
};

/* The shared covariance of position, wind and gust, above the diagonal too. */
enum {
    PFL_WIND_PP = 0,
    PFL_WIND_PW = 1,
    PFL_WIND_PG = 2,
    PFL_WIND_WW = 3,
    PFL_WIND_WG = 4,
    PFL_WIND_GG = 5,
    PFL_WIND_COV = 6
};

/* A GPS fix, and the air data that belong to its time: airspeeds are sooner at hand than fixes. */
typedef struct {
    float x_m, y_m;
    float vx_mps, vy_mps;
    float air_mps; /* the airspeed's part in the plane, measured */
    float yaw_rad;
    float widen; /* >= 1 widens sigma_velocity, in a sharp turn say; 1 for none */
} pfl_wind_fix_t;

/* What the wind and the air data do, and the covariance on its way. */
typedef struct {
    float wind_walk;          /* [m/s/sqrt(s)] */
    float gust_sigma_mps;     /* on each axis */
    float gust_time_s;        /* > 0 */
    float scale_walk;         /* [1/sqrt(s)] */
    float offset_sigma_rad;   /* >= 0 */
    float offset_time_s;      /* > 0 */
    float sigma_position_m;   /* of a fix, > 0 */
    float sigma_velocity_mps; /* of it and of the air data together, > 0 */
    float dof;                /* > 0: gross velocities are widened as by Student's t of so many degrees; 0: Gaussian */
    float start_x_m, start_y_m; /* pfl_wind_draw: where the first fix was */
    float start_wind_mps;       /* standard deviation of the wind on each axis, before anything is known */
    float start_scale;          /* likewise of the scale, about 1 */
    /* Owned by the calls below. */
    float cov[PFL_WIND_COV];
    float gain_position[3]; /* of position, wind and gust by a fix's position and velocity */
    float gain_velocity[3]; /* likewise, by its velocity */
    float inverse[3];       /* of the innovations' covariance: xx, xv, vv */
} pfl_wind_t;

/* Begins the shared covariance; before pfl_init. O(1). */
void pfl_wind_start(pfl_wind_t *wind);

/* The prior. user: pfl_wind_t. */
void pfl_wind_draw(void *user, const pfl_batch_t *p);

/* Moves the shared covariance by dt_s >= 0. O(1). */
void pfl_wind_move(pfl_wind_t *wind, float dt_s);

/* u of the model. */
typedef struct {
    const pfl_wind_fix_t *fused; /* fused by the last update and not moved in yet; null: none */
    float air_mps;               /* held over the step */
    float yaw_rad;
} pfl_wind_input_t;

/* user: pfl_wind_t, u: pfl_wind_input_t. */
void pfl_wind_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p);

/* Weights and gain of a fix, seen from the cloud's mean (PFL_WIND_STATES floats). O(1). */
void pfl_wind_weigh(pfl_wind_t *wind, const float *mean, const pfl_wind_fix_t *fix);

/* user: pfl_wind_t, after pfl_wind_weigh; z: pfl_wind_fix_t. -2 ll is a chi-square of 4 degrees of freedom. */
void pfl_wind_loglik(void *user, const void *z, const pfl_view_t *p, float *ll);

/* Fuses the fix into the shared covariance and into the cloud's mean, weighted by the update. O(1). */
void pfl_wind_fuse(pfl_wind_t *wind, float *mean, const pfl_wind_fix_t *fix);

#ifdef __cplusplus
}
#endif

#endif
