/* Ranges to fixed points, each with a bias that the filter learns: the bias of every anchor is a mean that each particle
 * carries along without drawing it, with one variance for all particles (Rao-Blackwellised). Drawing them instead needs
 * many times the particles, and a calibration needs the truth. lib/src/range_bias.c; an optional module.
 *
 *     range = |p - anchor| + bias of the anchor + error,  error / sigma Student's t
 *
 * A filter cycle: the model's predict callback calls pfl_range_bias_correct with what was fused before, and then moves;
 * pfl_range_bias_move once a step; pfl_update with pfl_range_bias_loglik; pfl_range_bias_fused. */
#ifndef PFLIGHT_RANGE_BIAS_H
#define PFLIGHT_RANGE_BIAS_H

#include "pflight/filter.h"

#ifdef __cplusplus
extern "C" {
#endif

#define PFL_RANGE_BIAS_MAX 8u /* anchors */

/* The sensor: states, noise, what is known of the biases. */
typedef struct {
    uint16_t x_state, y_state;
    uint16_t bias_state;                   /* of anchor 0; start them at the prior's mean */
    uint16_t anchors;                      /* 1 .. PFL_RANGE_BIAS_MAX */
    float sigma_m;                         /* > 0 */
    float dof;                             /* > 0: degrees of freedom of Student's t */
    float walk;                            /* of each bias [m/sqrt(s)] */
    float variance_m2[PFL_RANGE_BIAS_MAX]; /* of each bias: start at the prior's; then owned by the calls below */
    float gain;                            /* of what was fused last; owned by the calls below */
} pfl_range_bias_t;

/* One range, the measurement z. */
typedef struct {
    float anchor_x_m, anchor_y_m;
    float height_m; /* of the anchor over the particle's plane, or under it */
    float range_m;
    uint32_t anchor; /* 0 .. anchors - 1 */
} pfl_range_bias_z_t;

/* The biases walk for dt_s. O(anchors). */
void pfl_range_bias_move(pfl_range_bias_t *s, float dt_s);

/* Moves in the range that the last update weighed by; null: nothing. O(n). */
void pfl_range_bias_correct(const pfl_range_bias_t *s, const pfl_range_bias_z_t *fused, const pfl_batch_t *p);

/* user: pfl_range_bias_t, z: pfl_range_bias_z_t. */
void pfl_range_bias_loglik(void *user, const void *z, const pfl_view_t *p, float *ll);

/* A range was fused: its gain, for the next correction, and less variance. O(1). */
void pfl_range_bias_fused(pfl_range_bias_t *s, const pfl_range_bias_z_t *z);

#ifdef __cplusplus
}
#endif

#endif
