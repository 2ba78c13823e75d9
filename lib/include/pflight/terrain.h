/* Position from the ground below (terrain-referenced navigation): the height above ground that a radar altimeter measures,
 * against an elevation grid. With a dead-reckoned velocity and a barometer this finds a vehicle that has no satellite
 * navigation. docs/marginal.md shows it: a start error of a kilometre, real hills. */
#ifndef PFLIGHT_TERRAIN_H
#define PFLIGHT_TERRAIN_H

#include "pflight/filter.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Heights on a grid, the caller's: in flash, or a window of a larger map. Row r, column c at height_m[r * columns + c], r
 * going north and c east. */
typedef struct {
    const int16_t *height_m;
    uint32_t rows, columns;          /* >= 2 each, rows * columns < 2^31 */
    float north_m, east_m;           /* of row 0, column 0 */
    float rows_per_m, columns_per_m; /* 1 / distance of two rows, of two columns; > 0 */
} pfl_grid_t;

/* Height at a place, between the grid's points bilinear; beyond its edges that of the edge. O(1). */
float pfl_grid_height(const pfl_grid_t *grid, float north_m, float east_m);

/* A radar altimeter over vegetation. Echoes are good, or come from tree tops and are short, or are anything. */
typedef struct {
    const pfl_grid_t *grid;
    uint16_t north_state, east_state; /* position [m] */
    uint16_t bias_state;              /* by how much the barometer reads high [m]; PFL_TERRAIN_NO_BIAS: none */
    uint16_t unused;                  /* 0 */
    float tree_share, gross_share;    /* of all echoes; their sum < 1 */
    float tree_mean_m, tree_sigma_m;  /* by how much an echo from trees is short */
    float gross_span_m;               /* gross errors spread evenly over a range so wide; 0 with gross_share 0 */
} pfl_terrain_t;

#define PFL_TERRAIN_NO_BIAS 0xFFFFu /* for bias_state */

/* A measurement. */
typedef struct {
    float altitude_m; /* by the barometer */
    float agl_m;      /* above ground, by the altimeter */
    float sigma_m;    /* of a good echo, and of the barometer with it; > 0 */
    float power;      /* of the likelihood: 1; less while the cloud is too thin for so sharp a measurement */
} pfl_terrain_z_t;

/* user: pfl_terrain_t, z: pfl_terrain_z_t. With e = (altitude - bias - height of the ground) - agl:
 * ll = power log(good(e) + tree(e) + gross) less the most that this can be. O(n). */
void pfl_terrain_loglik(void *user, const void *z, const pfl_view_t *p, float *ll);

/* The power for a cloud so thin that the ground changes from one particle to the next: with `spread_m` the cloud's
 * horizontal deviation, 1 / (1 + (spread / scale)^2), at least `least`. O(1). */
float pfl_terrain_power(float spread_m, float scale_m, float least);

/* Dead reckoning: north += dt (v_north - bias_north + sigma w0), east likewise with w1; the biases decay by `decay` a step
 * and walk by sigma_bias w2, w3; the barometer's bias walks by sigma_baro w4. States in this order. */
enum {
    PFL_DR_NORTH = 0,
    PFL_DR_EAST = 1,
    PFL_DR_BARO = 2,
    PFL_DR_BIAS_NORTH = 3,
    PFL_DR_BIAS_EAST = 4,
    PFL_DR_STATES = 5
};

/* The model's parameters. */
typedef struct {
    float sigma_velocity_mps; /* white, of one step */
    float bias_decay;         /* of the velocity's bias, in a step: e^(-dt / tau) */
    float sigma_bias_mps;     /* and its noise in a step */
    float sigma_baro_m;       /* of the barometer's bias, in a step */
} pfl_dead_reckoning_t;

/* Its input: the velocity that is integrated. */
typedef struct {
    float north_mps, east_mps;
} pfl_dead_reckoning_input_t;

/* Q = 5. user: pfl_dead_reckoning_t, u: pfl_dead_reckoning_input_t. */
void pfl_dead_reckoning_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p);

/* What is left of it for particles when marginal.h takes care of the velocity's biases: PFL_DR_BIAS_ are means then, and
 * drive -dt of them and sigma_velocity are its business. Its noise is w2 (Q = 3): w0 and w1 are for the driven states. */
void pfl_dead_reckoning_rest_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p);

#ifdef __cplusplus
}
#endif

#endif
