/* The auxiliary particle filter (Pitt and Shephard 1999): before the particles move, a look at the measurement to come
 * tells which of them are going to agree with it; these are resampled, and what they were favoured by is taken off their
 * weights again. Worth it where measurements are sharp and the model's noise small: a bootstrap filter finds out too late
 * that few particles went the right way. Where noise is large, proposal.h does more; together they are the fully adapted
 * filter. docs/filters.md has measurements.
 *
 * A cycle is pfl_auxiliary_look, pfl_predict and pfl_update, to the same time and with the same u and z. One state more
 * carries what is taken off; it means nothing in estimates: leave it out of a kernel step (states_mask), and unbounded in
 * a state box. */
#ifndef PFLIGHT_AUXILIARY_H
#define PFLIGHT_AUXILIARY_H

#include "pflight/filter.h"

#ifdef __cplusplus
extern "C" {
#endif

/* How to look. */
typedef struct {
    pfl_loglik_fn loglik; /* not null: the sensor, looking at particles that were moved without noise: its own deviation
                             must be the root of sensor's and model's variances. Too sharp, and luck decides again */
    void *user;           /* handed to loglik */
    float gate;           /* as pfl_sensor_t.gate: a measurement that is going to be refused changes nothing */
    float ess_ratio; /* look on where the effective sample size would stay above this share of N; 1: resample always;
                             0.5 .. 0.9 usual */
    uint32_t state;  /* index of the state for what is taken off */
} pfl_auxiliary_t;

/* Resamples by what the measurement at t_us will say. The cached estimate stays the one before. PFL_OK, also where nothing
 * had to be done; PFL_REJECTED (the gate, or impossible for every particle), PFL_ERR_NONFINITE, PFL_ERR_LOGLIK,
 * PFL_ERR_TIME, PFL_ERR_GAP, PFL_ERR_ARG, PFL_ERR_CONFIG (state), PFL_ERR_BUSY, PFL_ERR_CORRUPT: nothing changed.
 * O(N (D + Q)): a predict without random numbers, a sensor, and a resampling where one is due. */
pfl_status_t pfl_auxiliary_look(pfl_t *f, const pfl_auxiliary_t *a, uint64_t t_us, const void *u, const void *z);

#ifdef __cplusplus
}
#endif

#endif
