/* The optimal proposal for measurements that are linear in the state (Doucet, Godsill and Andrieu 2000): particles move
 * to where the measurement says, p(x_k | x_k-1, z_k), and weigh p(z_k | x_k-1), which depends less on luck than
 * p(z_k | x_k). Worth it where a measurement is much sharper than the spread of one step; where it is not, it costs a
 * column of particles and some instructions for nothing.
 *
 * For models whose noise is added to the measured states, component k being
 *     x <- f(x_k-1) + sigma_noise w,    z = x + sigma_measured v,    w and v standard normal and independent.
 * A cycle is pfl_predict with a pfl_proposal_input_t that holds the measurement, and pfl_update with the sensor
 * pfl_proposal_loglik, at the same time. Exactly one model step may lie between two updates, one that dt_max_us does not
 * cut. One state more, `loglik_state`, carries the log-likelihood from the one to the other; it means nothing in
 * estimates: leave it out of a kernel step (states_mask), and unbounded in a state box. */
#ifndef PFLIGHT_PROPOSAL_H
#define PFLIGHT_PROPOSAL_H

#include "pflight/filter.h"
#include "pflight/sensors.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The sigmas are those of the step that comes: set them anew when its length changes. */
typedef struct {
    pfl_predict_fn predict;                 /* the model, without the noise below: its sigma for it at zero. Not null */
    void *user;                             /* handed to predict */
    uint16_t loglik_state;                  /* index of the state for the log-likelihood */
    uint16_t count;                         /* measured components, 1 .. PFL_POSITION_MAX */
    uint16_t state[PFL_POSITION_MAX];       /* index of the state that component k measures */
    uint16_t noise[PFL_POSITION_MAX];       /* noise column that drives it: one of its own for each component */
    uint16_t other[PFL_POSITION_MAX];       /* a state that the same noise drives too: the speed, say */
    float sigma_noise[PFL_POSITION_MAX];    /* of the measured state in a step; 0: no noise on it */
    float sigma_other[PFL_POSITION_MAX];    /* of the other in a step; 0: there is none */
    float sigma_measured[PFL_POSITION_MAX]; /* > 0 */
} pfl_proposal_t;

/* u of the proposal. */
typedef struct {
    const void *u;  /* of the model */
    const float *z; /* float[count], measured at the end of the step; null: nothing is, and the noise is the model's */
} pfl_proposal_input_t;

/* user: pfl_proposal_t, u: pfl_proposal_input_t. Q as the model with its noise. O(n count) on top of the model. */
void pfl_proposal_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p);

/* user: pfl_proposal_t; z: not null and not looked at, it was used in the predict. ll = -1/2 sum of (z - f)^2 /
 * (sigma_noise^2 + sigma_measured^2); 0 after a predict without a measurement. */
void pfl_proposal_loglik(void *user, const void *z, const pfl_view_t *p, float *ll);

#ifdef __cplusplus
}
#endif

#endif
