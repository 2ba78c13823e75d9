/* Antithetic noise (Hammersley and Morton 1956): particles in pairs, the second's noise the first's with all signs
 * changed. What is linear in the noise then cancels in the mean of a cloud, and half the normals are saved. docs/tuning.md
 * has what that gains, scenario by scenario. */
#ifndef PFLIGHT_ANTITHETIC_H
#define PFLIGHT_ANTITHETIC_H

#include "pflight/filter.h"

#ifdef __cplusplus
extern "C" {
#endif

/* pfl_config_t.noises that serve a model with q noises. */
#define PFL_ANTITHETIC_NOISES(q) (((q) + 1u) / 2u)
#define PFL_ANTITHETIC_MAX 4u /* noises of the model */

/* A model under antithetic noise. */
typedef struct {
    pfl_predict_fn predict; /* the model, not null */
    void *user;             /* handed to predict */
    uint32_t noises;        /* of the model, 1 .. PFL_ANTITHETIC_MAX */
} pfl_antithetic_t;

/* user: pfl_antithetic_t; u: the model's. Q = PFL_ANTITHETIC_NOISES(noises). Particles 2i and 2i + 1 of a batch are a
 * pair. O(n noises) on top of the model. Stack: 256 B a noise of PFL_ANTITHETIC_MAX, 1 KB. */
void pfl_antithetic_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p);

#ifdef __cplusplus
}
#endif

#endif
