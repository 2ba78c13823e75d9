/* A resampling that moves its parents together, for modules whose N or weights are not equal after it: parents.h. */
#include "parents.h"

void pfl_parents_gather(const pfl_t *f, uint32_t parents)
{
    for (uint32_t d = 0u; d < f->config->states; d++) {
        float *x = &f->x[(size_t)d * f->stride];
        for (uint32_t k = 0u; k < parents; k++) {
            x[k] = x[pfl_load_u32(&f->log_weight[k])]; /* which is k or behind it */
        }
    }
}

void pfl_parents_fill(const pfl_t *f, uint32_t parents)
{
    for (uint32_t d = 0u; d < f->config->states; d++) {
        float *x = &f->x[(size_t)d * f->stride];
        float *slot = &x[parents];
        for (uint32_t k = 0u; k < parents; k++) {
            for (uint32_t left = pfl_load_u32(&f->scratch[k]); left > 1u; left--) {
                *slot = x[k];
                slot++;
            }
        }
    }
}
