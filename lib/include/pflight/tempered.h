/* The tempered update: a measurement much sharper than the cloud is fused in steps, each with a part of its
 * log-likelihood, and between them the cloud is resampled and its copies moved apart. Where the whole likelihood at once
 * would leave one particle in a thousand, the steps lead the cloud to where the measurement is (annealing: Neal 2001; in
 * particle filters: Deutscher, Blake and Reid 2000). A step takes as much as leaves the effective sample size above a
 * share of N, the last step all that is left. Where the whole does, there is but one step, and it gives the bits of
 * pfl_update.
 *
 * A sensor becomes a tempered one by a pfl_tempered_t of its own as `user` and pfl_tempered_loglik as `loglik`; its
 * measurements go through pfl_tempered_update. The configuration needs a kernel step: without one copies stay copies,
 * and steps gain nothing. docs/filters.md tells when it is worth what it costs. */
#ifndef PFLIGHT_TEMPERED_H
#define PFLIGHT_TEMPERED_H

#include "pflight/filter.h"

#ifdef __cplusplus
extern "C" {
#endif

#define PFL_TEMPERED_STEPS_MAX 16u /* steps of one measurement */

/* In memory that can be written; one filter's alone. */
typedef struct {
    pfl_loglik_fn loglik; /* the sensor itself, not null */
    void *user;           /* handed to loglik */
    float ess_share;      /* of N, that a step leaves: 0 < share < 1; 0.3 .. 0.5 usual */
    uint32_t steps;       /* at most, 1 .. PFL_TEMPERED_STEPS_MAX; 1: as pfl_update */
    const float *held;    /* null: the library's own, only during a call */
    float power;          /* likewise */
    uint32_t taken;       /* steps of the last update; the library's answer */
} pfl_tempered_t;

/* user: pfl_tempered_t. Called by pfl_update itself it is the sensor as it is. */
void pfl_tempered_loglik(void *user, const void *z, const pfl_view_t *p, float *ll);

/* pfl_update in steps, for a sensor whose loglik is pfl_tempered_loglik; any other one: PFL_ERR_SENSOR. The gate judges
 * the whole log-likelihood, the measurement counts as one, and refusals leave the posterior as pfl_update does. A step
 * after the first that fails ends the update with its status, the steps before stand. When the budget is spent the next
 * step is the last. Each step: one pass of the sensor, one over the weights and five more where the step is not
 * the last, a resampling with its kernel step. The cached moments and the effective sample size are those of the last
 * step. O(steps N D^2). */
pfl_status_t pfl_tempered_update(pfl_t *f, uint16_t sensor, uint64_t t_us, const void *z);

#ifdef __cplusplus
}
#endif

#endif
