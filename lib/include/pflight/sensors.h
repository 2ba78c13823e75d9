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

/* ---- Range to a fixed point, with tails that survive gross errors ---------------------------------------------- */
typedef struct {
    uint16_t x_state, y_state; /* position in the plane */
    float inv_sigma;           /* 1 / scale of the error [1/m] */
    float dof;                 /* degrees of freedom of Student's t: 1 .. 5 heavy tails; 0: Gaussian */
} pfl_range_t;

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

typedef struct {
    float from_x_m, from_y_m; /* where the sensor was */
    float range_m;
    float bearing_rad; /* atan2(y - from_y, x - from_x); any multiple of 2 pi */
} pfl_range_bearing_z_t;

/* z: pfl_range_bearing_z_t. Gaussian in both, the bearing's innovation wrapped. */
void pfl_range_bearing_loglik(void *user, const void *z, const pfl_view_t *p, float *ll);

#ifdef __cplusplus
}
#endif

#endif
