/* The marginalised, or Rao-Blackwellised, particle filter (Schon, Gustafsson and Nordlund 2005): where a part l of the
 * state is linear and Gaussian once the rest of it, n, is known, only n needs particles. Each particle carries the mean
 * of its own Kalman filter for l. docs/marginal.md: when it pays, and what it costs. A step is, in this order,
 *     n <- f(n, u, w) + drive l + v          v normal, one independent variance for each driven state
 *     l <- transition l + drift + q          q normal, process_cov
 *     z  = h(n) + see l + e                  e normal, one independent variance for each component
 * Two forms. Shared: the matrices are the same for all particles, and so is the covariance of l, which depends on no
 * measured value; it is computed once a step, outside the filter. Each: the matrices depend on the particle, which
 * carries the covariance in states of its own.
 *
 * A cycle is pfl_predict with a pfl_marginal_input_t and, when something linear is measured (measured > 0), pfl_update
 * with the sensor pfl_marginal_loglik at the same time, as in proposal.h: exactly one model step may lie between the
 * two, one that dt_max_us does not cut, and the Kalman filters have used z even when the update is refused. Measurements
 * of n alone need none of that: they are ordinary sensors, and refused as such.
 *
 * Draw the means at their prior mean, all alike: the spread is in the covariance. An estimate's mean is right for l as it
 * stands; its covariance is that of the means alone, to which that of the Kalman filters comes on top. A kernel step may
 * move n and the means (states_mask), never covariances or the log-likelihood. */
#ifndef PFLIGHT_MARGINAL_H
#define PFLIGHT_MARGINAL_H

#include "pflight/filter.h"

#ifdef __cplusplus
extern "C" {
#endif

#define PFL_MARGINAL_MAX 4u    /* linear states, driven states, measured components */
#define PFL_MARGINAL_STRIP 16u /* particles in one call of a callback below, at most */
/* Elements of a covariance of `linear` states: its upper triangle, row by row. */
#define PFL_MARGINAL_COV(linear) (((linear) * ((linear) + 1u)) / 2u)

/* h[i] <- h(n_i), component k, with the particles where they are after the step. see (null in the shared form): column j
 * at see[j * PFL_MARGINAL_STRIP], filled with row k of `see`; what depends on the particle is written over it. Pure. */
typedef void (*pfl_marginal_measure_fn)(void *user, uint32_t k, const pfl_view_t *p, float *h, float *see);

/* Fills in what depends on the particle, before the step. Element (r, c) of a matrix with `linear` columns stands at
 * [(r linear + c) PFL_MARGINAL_STRIP], filled with the constant of pfl_marginal_t; where that is 0 it must stay so. Pure. */
typedef void (*pfl_marginal_matrices_fn)(void *user, const void *u, float dt_s, const pfl_view_t *p, float *drive,
                                         float *transition);

/* The model. Matrices and variances are those of the step that comes: set them anew when its length changes. */
typedef struct {
    pfl_predict_fn predict;           /* f: moves n, without drive and v, and leaves l alone; null: n stays */
    pfl_marginal_measure_fn measure;  /* h; null: zero */
    void *user;                       /* handed to all callbacks */
    uint16_t linear;                  /* linear states, 1 .. PFL_MARGINAL_MAX */
    uint16_t mean;                    /* index of the first of their means, which stand in a row */
    uint16_t driven;                  /* states of n that l drives, 0 .. PFL_MARGINAL_MAX */
    uint16_t measured;                /* components of z, 0 .. PFL_MARGINAL_MAX */
    uint16_t state[PFL_MARGINAL_MAX]; /* index of driven state k */
    uint16_t noise[PFL_MARGINAL_MAX]; /* its noise column: one of its own for each */
    uint16_t loglik_state;            /* with measured > 0: the state for the log-likelihood */
    float drive[PFL_MARGINAL_MAX][PFL_MARGINAL_MAX];
    float drive_variance[PFL_MARGINAL_MAX]; /* of v, > 0 */
    float transition[PFL_MARGINAL_MAX][PFL_MARGINAL_MAX];
    float drift[PFL_MARGINAL_MAX];
    float process_cov[PFL_MARGINAL_COV(PFL_MARGINAL_MAX)];
    float see[PFL_MARGINAL_MAX][PFL_MARGINAL_MAX];
    float see_variance[PFL_MARGINAL_MAX]; /* of e, > 0 */
} pfl_marginal_t;

/* u of the predict callbacks. */
typedef struct {
    const void *u;  /* of the model */
    const float *z; /* float[measured], at the end of the step; null: nothing linear is measured */
} pfl_marginal_input_t;

/* user: pfl_marginal_t, first in both forms; z: not null and not looked at, it was used in the predict. 0 after a
 * predict without one. O(n). */
void pfl_marginal_loglik(void *user, const void *z, const pfl_view_t *p, float *ll);

/* ---- One covariance for all particles ---------------------------------------------------------------------------- */

/* The covariance lives here, with the caller: copy it beside a snapshot and put it back with pfl_restore, set it to the
 * prior's with pfl_reset, save it around a forecast, which takes steps of its own. */
typedef struct {
    pfl_marginal_t model;                          /* first */
    float cov[PFL_MARGINAL_COV(PFL_MARGINAL_MAX)]; /* of l; the prior's at first */
    float drive_root[PFL_MARGINAL_MAX];            /* from here on: what pfl_marginal_shared_step leaves */
    float drive_gain[PFL_MARGINAL_MAX][PFL_MARGINAL_MAX];
    float see_weight[PFL_MARGINAL_MAX];
    float see_gain[PFL_MARGINAL_MAX][PFL_MARGINAL_MAX];
} pfl_marginal_shared_t;

/* Before each pfl_predict: takes the covariance one step on, and keeps that step's gains. measured: z will be given.
 * When the pfl_predict fails or is a no-op, put the structure back as it was. O(linear^3). */
void pfl_marginal_shared_step(pfl_marginal_shared_t *s, bool measured);

/* user: pfl_marginal_shared_t, u: pfl_marginal_input_t. O(n linear (driven + linear + measured)). Stack: about 550 B. */
void pfl_marginal_shared_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p);

/* ---- A covariance for each particle ------------------------------------------------------------------------------ */

/* Floats of workspace, reused by every call. */
#define PFL_MARGINAL_WORK(linear, driven) (PFL_MARGINAL_STRIP * ((linear) * (2u * (linear) + (driven) + 2u) + 2u))

typedef struct {
    pfl_marginal_t model;              /* first */
    pfl_marginal_matrices_fn matrices; /* null: the constants of the model */
    uint16_t cov;                      /* index of the first of PFL_MARGINAL_COV(linear) states, drawn as the prior's */
    uint16_t unused;                   /* 0 */
    float *work;                       /* PFL_MARGINAL_WORK(linear, driven), the caller's, for one filter at a time */
} pfl_marginal_each_t;

/* user: pfl_marginal_each_t, u: pfl_marginal_input_t. O(n linear^2 (linear + driven + measured)). Stack: about
 * 400 B. */
void pfl_marginal_each_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p);

#ifdef __cplusplus
}
#endif

#endif
