/* Pseudoranges to navigation satellites, among buildings that reflect them: a likelihood whose long side forgives, and a
 * clock for each of two constellations that each particle carries along without drawing it (as a Rao-Blackwellised filter
 * would, with one gain for all). lib/src/pseudorange.c; an optional module.
 *
 *     range = |satellite - receiver| + clock of the constellation + error
 * Ranges of 2e7 m are no numbers for floats: the caller takes off, in double, the distance from a point of reference (at
 * the receiver's height) and a nominal clock, and hands over the rest with the direction to the satellite. Within a
 * kilometre or two of that point what is left out is below 0.1 m. With (x, y) from there and (ux, uy) towards the satellite
 *     e = range + ux x + uy y - clock
 * is distributed as a mixture: with probability 1 - reflected Student's t of 3 degrees of freedom and scale sigma, else an
 * exponential of mean tail_m on the long side only. Errors of reflections last, so that the epochs are not independent:
 * `power` takes log-likelihoods for less than they say, about the time between epochs over that for which errors last.
 *
 * A filter cycle: the model's predict callback calls pfl_clocks_predict and then moves the positions; pfl_update with
 * pfl_pseudorange_loglik; pfl_clocks_fused, and the same ranges as `fused` in the next predict. */
#ifndef PFLIGHT_PSEUDORANGE_H
#define PFLIGHT_PSEUDORANGE_H

#include "pflight/filter.h"

#ifdef __cplusplus
extern "C" {
#endif

#define PFL_SATELLITES_MAX 32u /* of an epoch */
#define PFL_CLOCK_STATES 3u    /* clock of constellation 0 and of 1 [m], drift of both [m/s] */

/* One satellite of an epoch. */
typedef struct {
    float ux, uy;    /* unit vector from the point of reference to the satellite, its part in the plane */
    float range_m;   /* measured, less the reference's distance and the nominal clock */
    float reflected; /* probability that the range is a reflection's, before seeing it: 0 .. 1 */
    uint32_t system; /* constellation, 0 or 1 */
} pfl_satellite_t;

/* An epoch, the measurement z. */
typedef struct {
    uint32_t count; /* <= PFL_SATELLITES_MAX */
    pfl_satellite_t satellite[PFL_SATELLITES_MAX];
} pfl_pseudoranges_t;

/* The sensor: states, noise, clocks. */
typedef struct {
    uint16_t x_state, y_state;
    uint16_t
        clock_state;  /* the first of PFL_CLOCK_STATES; start them at the median of the first ranges, the drift at 0 */
    float sigma_m;    /* > 0 */
    float tail_m;     /* > 0; 0: no reflections, and a Gaussian */
    float power;      /* 0 .. 1 */
    float clip_m;     /* errors pull a clock no more than this */
    float leak;       /* a range that is taken for a reflection still pulls with this share */
    float gain;       /* of the clocks in the end, 0 .. 1; in the beginning that of a line's least squares */
    float interval_s; /* between epochs, > 0 */
    /* Owned by pfl_clocks_fused; zero in the beginning. */
    uint32_t epochs;
    float gain_clock, gain_drift;
} pfl_pseudorange_t;

/* Moves in what was fused last (null: nothing), then the clocks by dt_s. Call it from the model's predict before the
 * positions move. O(n satellites). */
void pfl_clocks_predict(const pfl_pseudorange_t *s, const pfl_pseudoranges_t *fused, float dt_s, const pfl_batch_t *p);

/* An epoch was fused: the gains by which the next predict moves it in. O(1). */
void pfl_clocks_fused(pfl_pseudorange_t *s);

/* user: pfl_pseudorange_t, z: pfl_pseudoranges_t. O(n satellites). */
void pfl_pseudorange_loglik(void *user, const void *z, const pfl_view_t *p, float *ll);

#ifdef __cplusplus
}
#endif

#endif
