/* Resampling by a list of parents: their indices, rising, stand in the log-weight column, how many copies each leaves in the
 * scratch column. */
#ifndef PFL_PARENTS_H
#define PFL_PARENTS_H

#include "core.h"

/* Parent k becomes particle k. */
void pfl_parents_gather(const pfl_t *f, uint32_t parents);

/* Further copies behind the parents. */
void pfl_parents_fill(const pfl_t *f, uint32_t parents);

#endif
