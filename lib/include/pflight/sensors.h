/* Ready sensors, each a few lines on the block API in lib/src/sensor_*.c: use them, or read them as examples.
 * Each is a pfl_loglik_fn whose `user` (pfl_sensor_t.user) is its parameter structure; `z` is named beside it. All
 * O(n) per batch; 0 is a perfect match. */
#ifndef PFLIGHT_SENSORS_H
#define PFLIGHT_SENSORS_H

#include "pflight/filter.h"

#ifdef __cplusplus
extern "C" {
#endif

/* ---- States seen directly, with Gaussian noise: position, position and speed ... ------------------------------- */
#define PFL_POSITION_MAX 4u

typedef struct {
    uint16_t count;                    /* components, 1 .. PFL_POSITION_MAX */
    uint16_t state[PFL_POSITION_MAX];  /* index of the state that component k measures */
    float inv_sigma[PFL_POSITION_MAX]; /* 1 / standard deviation of component k */
} pfl_position_t;

/* z: float[count]. ll = -1/2 sum ((x - z) / sigma)^2. */
void pfl_position_loglik(void *user, const void *z, const pfl_view_t *p, float *ll);

/* The same, weighed by the inverse squared distance, 1 / (d^2 + sigma^2): ll = -log(1 + sum ((x - z) / sigma)^2). Flat,
 * with heavy tails: it survives gross errors and learns slowly. */
void pfl_position_distance_loglik(void *user, const void *z, const pfl_view_t *p, float *ll);

/* ---- Range to a fixed point, with tails that survive gross errors ---------------------------------------------- */
typedef struct {
    uint16_t x_state, y_state; /* position in the plane */
    float inv_sigma;           /* 1 / scale of the error [1/m] */
    float dof;                 /* degrees of freedom of Student's t: 1 .. 5 heavy tails; 0: Gaussian */
} pfl_range_t;

/* A measurement. */
typedef struct {
    float anchor_x_m, anchor_y_m;
    float height_m; /* of the anchor over the particle's plane, or under it */
    float range_m;  /* measured, already less a known bias */
    float scale;    /* >= 1 widens sigma for this one measurement; 1 for none */
} pfl_range_z_t;

/* z: pfl_range_z_t. With e = (|p - anchor| - range) / (sigma scale): ll = -e^2/2, or -(dof + 1)/2 log(1 + e^2/dof). */
void pfl_range_loglik(void *user, const void *z, const pfl_view_t *p, float *ll);

/* ---- Range and bearing from a known place ----------------------------------------------------------------------- */
typedef struct {
    uint16_t x_state, y_state;
    float inv_sigma_range;   /* [1/m] */
    float inv_sigma_bearing; /* [1/rad] */
} pfl_range_bearing_t;

/* A measurement. */
typedef struct {
    float from_x_m, from_y_m; /* where the sensor was */
    float range_m;
    float bearing_rad; /* atan2(y - from_y, x - from_x); any multiple of 2 pi */
} pfl_range_bearing_z_t;

/* z: pfl_range_bearing_z_t. Gaussian in both, the bearing's innovation wrapped. A radar that measures azimuth from
 * north over east has x_state = north and y_state = east. */
void pfl_range_bearing_loglik(void *user, const void *z, const pfl_view_t *p, float *ll);

/* ---- Position with an error that is correlated in time ------------------------------------------------------------ */
/* A receiver whose error is e_k = decay e_{k-1} + w_k: each measurement less `decay` times the one before has a white
 * error, w_k. Taking the errors for independent instead makes a filter far too sure of itself. The model keeps each
 * particle's own position of the last measurement in states of its own (pfl_coast_t.remember, pfl_turn_t.remember), so
 * exactly one predict must lie between two updates, one that dt_max_us does not cut. The first measurement has none
 * before: pfl_position_loglik with the deviation of the error then. */
typedef struct {
    uint16_t count;                    /* axes, 1 .. PFL_POSITION_MAX */
    uint16_t state[PFL_POSITION_MAX];  /* index of the position on axis k */
    uint16_t before[PFL_POSITION_MAX]; /* and of the position at the measurement before */
    float decay;                       /* of the error from one measurement to the next, 0 .. 1 */
    float inv_sigma[PFL_POSITION_MAX]; /* 1 / standard deviation of w_k on axis k [1/m] */
} pfl_coloured_t;

typedef struct {
    float now[PFL_POSITION_MAX];
    float before[PFL_POSITION_MAX]; /* the measurement before */
} pfl_coloured_z_t;

/* z: pfl_coloured_z_t. ll = -1/2 sum (((z - x) - decay (z_before - x_before)) / sigma)^2. */
void pfl_coloured_loglik(void *user, const void *z, const pfl_view_t *p, float *ll);

/* ---- Velocity in the plane, for states that hold speed and heading ----------------------------------------------- */
/* Where the states hold the velocity's components, pfl_position_loglik on those states is the sensor. */
typedef struct {
    uint16_t speed_state, heading_state; /* heading from x towards y */
    float inv_sigma;                     /* 1 / standard deviation of each component [s/m] */
} pfl_velocity_t;

/* z: float[2], along x and y. ll = -1/2 |(v cos psi, v sin psi) - z|^2 / sigma^2. */
void pfl_velocity_loglik(void *user, const void *z, const pfl_view_t *p, float *ll);

/* ---- States seen directly, some through a bias that the filter estimates ------------------------------------------ */
#define PFL_BIASED_MAX 6u
#define PFL_UNBIASED 0xFFFFu /* in pfl_biased_t.bias */

typedef struct {
    uint16_t count;                  /* components, 1 .. PFL_BIASED_MAX */
    uint16_t state[PFL_BIASED_MAX];  /* index of the state that component k measures */
    uint16_t bias[PFL_BIASED_MAX];   /* index of the state that adds to it; PFL_UNBIASED: none */
    float inv_sigma[PFL_BIASED_MAX]; /* 1 / standard deviation of component k */
} pfl_biased_t;

/* z: float[count]. ll = -1/2 sum ((x + b - z) / sigma)^2. */
void pfl_biased_loglik(void *user, const void *z, const pfl_view_t *p, float *ll);

#ifdef __cplusplus
}
#endif

#endif
