/* Errors of real sensors: laws with heavy and one-sided tails, biases, and noise that is correlated in time.
 *
 * A law turns errors, measured less predicted, into log-likelihoods, a whole batch in place: 0 for no error. What each is
 * for, its tails, and which gates suit it: docs/filters.md. In a sensor of your own, with h the prediction:
 *
 *     for (i = 0; i < p->n; i++) ll[i] = z - h[i];
 *     pfl_student_law(&law, ll, p->n);
 *
 * A NaN among the errors stays NaN, so that the filter refuses the measurement. */
#ifndef PFLIGHT_ERRORS_H
#define PFLIGHT_ERRORS_H

#include "pflight/filter.h"

#ifdef __cplusplus
extern "C" {
#endif

/* ---- Laws ---------------------------------------------------------------------------------------------------------- */

/* values: errors in, log-likelihoods out; n of them. Pure. O(n). */
typedef void (*pfl_law_fn)(const void *law, float *values, uint32_t n);

/* Gauss: -y^2 / 2, y = error / sigma. */
typedef struct {
    float inv_sigma;
} pfl_gaussian_law_t;
void pfl_gaussian_law(const void *law, float *values, uint32_t n);

/* Student's t: -(dof + 1)/2 log(1 + y^2 / dof). dof 1 .. 5: heavy tails; > 0. An error twice as large costs the same
 * (dof + 1) log 2, however large it is. */
typedef struct {
    float inv_sigma; /* 1 / scale */
    float dof;
} pfl_student_law_t;
void pfl_student_law(const void *law, float *values, uint32_t n);

/* Either side by itself: [0] for errors below zero (measured too small), [1] above (too large). Reflections make a range
 * too large, tree tops a radar height too small: a wide scale and few degrees of freedom on that side. The most likely
 * error is 0 still. */
typedef struct {
    float inv_sigma[2];
    float dof[2]; /* 0: Gauss on that side */
} pfl_split_law_t;
void pfl_split_law(const void *law, float *values, uint32_t n);

/* Good errors, Gaussian, and outliers among them: log((e^(-y^2/2) + h e^(-narrow y^2/2)) / (1 + h)). However large an error
 * is, it costs no more than log(1 + 1/h) where outliers are spread evenly (narrow = 0): one bad measurement moves no
 * particle's weight by more. height h: of the outliers' density over that of the good ones at 0, by sides as above; for a
 * share e of outliers spread evenly over a length L, h = 2.5 e sigma / ((1 - e) L); for Gaussian ones of deviation S,
 * h = e sigma / ((1 - e) S). Neither below 0. */
typedef struct {
    float inv_sigma;
    float height[2];
    float narrow; /* (sigma / S)^2; 0: spread evenly */
} pfl_mixture_law_t;
void pfl_mixture_law(const void *law, float *values, uint32_t n);

/* ---- Sensors with any law, and a bias that is a state ----------------------------------------------------------------- */

#define PFL_NO_BIAS 0xFFFFu

/* A state seen directly. */
typedef struct {
    uint16_t state;
    uint16_t bias_state; /* added to it in what is measured; PFL_NO_BIAS: none */
    pfl_law_fn law;      /* not null */
    const void *parameters;
} pfl_scalar_t;

/* user: pfl_scalar_t; z: float. */
void pfl_scalar_loglik(void *user, const void *z, const pfl_view_t *p, float *ll);

/* A range to a fixed point, as in sensors.h. */
typedef struct {
    uint16_t x_state, y_state;
    uint16_t bias_state;
    uint16_t unused; /* 0 */
    pfl_law_fn law;
    const void *parameters;
} pfl_ranging_t;

/* user: pfl_ranging_t; z: pfl_range_z_t (sensors.h), its `scale` dividing the error. */
void pfl_ranging_loglik(void *user, const void *z, const pfl_view_t *p, float *ll);

/* ---- States that drift: biases and coloured noise ---------------------------------------------------------------------- */

#define PFL_DRIFTS_MAX 8u

/* States that are no motion: x <- c x + sigma sqrt(1 - c^2) w with c = e^(-dt/tau), a Gauss-Markov process of deviation
 * sigma; without tau a random walk, x <- x + sigma sqrt(dt) w; with sigma = 0 a constant, or what decays to zero. Its start
 * is the prior's. A sensor whose noise is coloured measures state and noise, with a law for what is white in it. */
typedef struct {
    pfl_predict_fn predict;         /* the model of the other states, moved first; null: none move */
    void *user;                     /* handed to predict */
    uint32_t count;                 /* 0 .. PFL_DRIFTS_MAX */
    uint16_t state[PFL_DRIFTS_MAX]; /* index of state k */
    uint16_t noise[PFL_DRIFTS_MAX]; /* its noise column, that no other state uses */
    float sigma[PFL_DRIFTS_MAX];    /* of the process; of the random walk after a second */
    float tau_s[PFL_DRIFTS_MAX];    /* correlation time; 0: random walk */
} pfl_drift_t;

/* user: pfl_drift_t; u: the model's. O(n count) on top of the model. */
void pfl_drift_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p);

#ifdef __cplusplus
}
#endif

#endif
