/* Several models in one filter (a jump Markov system): each particle carries the number of its regime as a state and moves
 * by that regime's model; regimes change at random, at given rates, and the measurements tell which one it is. A target
 * that flies straight and turns, an actuator that works and sticks, a road with two kinds of vehicle.
 *
 * A regime that has been unlikely for long has few particles, perhaps none at the moment it begins: pfl_jump_resample
 * keeps a minimum in each (Blom and Bloem 2007), with weights that make up for it. docs/filters.md shows what that gives. */
#ifndef PFLIGHT_JUMP_H
#define PFLIGHT_JUMP_H

#include "pflight/filter.h"

#ifdef __cplusplus
extern "C" {
#endif

#define PFL_REGIMES_MAX 4u /* regimes of one filter */
/* Floats of pfl_jump_t.room for d states and q noises. */
#define PFL_JUMP_FLOATS(d, q) ((size_t)PFL_BATCH * ((size_t)(d) + (size_t)(q)))

/* One regime: a model. */
typedef struct {
    pfl_predict_fn predict; /* not null; may not change the regime's number */
    void *user;             /* handed to predict */
} pfl_regime_t;

/* All of them, and how they change. */
typedef struct {
    uint32_t regimes;                                /* 1 .. PFL_REGIMES_MAX */
    pfl_regime_t regime[PFL_REGIMES_MAX];            /* the models, of D states and Q noises */
    float rate_hz[PFL_REGIMES_MAX][PFL_REGIMES_MAX]; /* [i][j]: jumps from i to j a second; [i][i] is not looked at */
    uint32_t states;                                 /* D, of the filter */
    uint32_t noises;                                 /* Q, of the models; the filter has one more, the last one */
    uint32_t state;                                  /* index of the regime's number: 0, 1, ... */
    uint32_t least;                                  /* particles in each likely regime after pfl_jump_resample, at most
                                                             N / regimes^2; 0: none are kept */
    float ess_ratio;                                 /* pfl_jump_resample acts below this share of N */
    float *room;                                     /* PFL_JUMP_FLOATS(D, Q) floats of the caller's, for one filter */
} pfl_jump_t;

/* user: pfl_jump_t; u: the models'. Regimes jump first, then each particle moves by its own: noise columns 0 .. Q - 1 are the
 * models'. The probability to have left i within dt is 1 - e^(-dt sum_j rate), so steps of any length agree as long as two
 * jumps in one step are rare. O(n (2 D + Q + regimes)) on top of the models. */
void pfl_jump_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p);

/* Ends a cycle, in the place of the filter's own resampling (ess_ratio 0 in the configuration): systematic within each
 * regime, whose probability all of its particles then share. A regime of probability zero gets none. Only after an update:
 * the effective sample size that it judges by is that of the last one. No kernel step. PFL_OK, PFL_ERR_CONFIG
 * (regimes, states, state, least, or N below regimes^2), PFL_ERR_BUSY, PFL_ERR_ARG, PFL_ERR_CORRUPT. O(1) when not due, else O(N D). */
pfl_status_t pfl_jump_resample(pfl_t *f, const pfl_jump_t *m);

/* Probability of each regime by the weights of now. probability: m->regimes floats. As pfl_jump_resample. O(N). */
pfl_status_t pfl_jump_probabilities(pfl_t *f, const pfl_jump_t *m, float *probability);

#ifdef __cplusplus
}
#endif

#endif
