/* What a likelihood would do to the weights, found out before they are changed: for tempered and auxiliary filters. The
 * log-likelihoods lie in the scratch column, which is free before an update. */
#ifndef PFL_SCOUT_H
#define PFL_SCOUT_H

#include "core.h"

#include <limits.h>

/* Particles in the batch that begins with `first`. */
static inline uint32_t pfl_scout_batch(const pfl_t *f, uint32_t first)
{
    const uint32_t left = f->config->particles - first;
    return (left < PFL_BATCH) ? left : PFL_BATCH;
}

typedef struct {
    int32_t worst; /* largest bits of any, which tell a NaN or a positive one */
    float best;    /* the largest */
} pfl_scout_t;
#define PFL_SCOUT_NOTHING                                                                                              \
    {                                                                                                                  \
        INT32_MIN, -FLT_MAX                                                                                            \
    }

/* Log-likelihoods of a batch into its place in the scratch column. */
void pfl_scout_keep(pfl_scout_t *found, const float *ll, uint32_t n, float *scratch);

/* Of all batches: PFL_OK, PFL_ERR_NONFINITE, PFL_ERR_LOGLIK, as pfl_update would say. */
pfl_status_t pfl_scout_verdict(const pfl_scout_t *found);

/* Effective sample size of the weights times that power of the likelihood. Uses two work columns. */
float pfl_scout_ess(pfl_t *f, float power);

/* Multiplies the weights by that power of the likelihood; false, and nothing done, when nobody would be left. */
bool pfl_scout_weigh(pfl_t *f, float power);

#endif
