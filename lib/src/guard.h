/* The guards against memory that changes by itself and callbacks that write where they should not: which of them are
 * built in, and what each costs where it is not.
 *
 *   PFL_GUARD_CONFIG    the configuration, by a hash of its bytes, at the start of every call. With 2 for a
 *                       configuration in RAM: the filter lives on a copy of it, which is made anew after each callback, so
 *                       that what changes in either during a call does no harm; the arena is larger by the copy, and
 *                       pfl_arena_bytes, not PFL_ARENA_BYTES, tells its size
 *   PFL_GUARD_CONTROL   the control block, by a sealed copy, at the start and end of every call, and the part that never
 *                       changes after each callback
 *   PFL_GUARD_CANARIES  words between the columns of the arena, at the end of every call, and around what a
 *                       log-likelihood callback writes
 *   PFL_GUARD_VIEW      a log-likelihood callback sees a copy of the particles: for one that casts the const away
 *
 * The first three are on unless the compiler is told -DPFL_GUARD_...=0, the last, which costs as much as the others
 * together, is off unless it is told =1. The layout of the arena does not depend on them but for PFL_GUARD_CONFIG 2. */
#ifndef PFL_GUARD_H
#define PFL_GUARD_H

#include "core.h"

#ifndef PFL_GUARD_CONTROL
#define PFL_GUARD_CONTROL 1
#endif
#ifndef PFL_GUARD_CANARIES
#define PFL_GUARD_CANARIES 1
#endif
#ifndef PFL_GUARD_VIEW
#define PFL_GUARD_VIEW 0
#endif

/* At the start of a call: PFL_OK, PFL_ERR_CONFIG, or PFL_ERR_CORRUPT when the block is beyond repair. */
pfl_status_t pfl_guard_open(pfl_t *f);

/* The same for a caller that may not change the filter: nothing is mended. */
pfl_status_t pfl_guard_look(const pfl_t *f);

/* At the end of a call: canaries, then the seal. Returns `status`, or PFL_ERR_CORRUPT when something wrote outside. */
pfl_status_t pfl_guard_close(pfl_t *f, pfl_status_t status);

/* A new filter's hash of its configuration, canaries and seal. */
void pfl_guard_start(pfl_t *f);

/* What callbacks must not see changed is taken from the copy where it was: after each callback what the loop over the
 * batches lives on, and after the last one all of it. */
void pfl_guard_after_callback(pfl_t *f);
void pfl_guard_after_batches(pfl_t *f);

/* The library itself has changed that, by a resampling in the midst of a call, whose columns change places. */
void pfl_guard_take_over(pfl_t *f);

/* What a log-likelihood callback may read, and write: a bay of the workspace whose first and last number are NaN, so that
 * one who stops early, or does nothing, is found out. */
pfl_view_t pfl_guard_view(pfl_t *f, uint32_t first, uint32_t n);
float *pfl_guard_bay(pfl_t *f, uint32_t n);
bool pfl_guard_bay_is_whole(const float *bay, uint32_t n); /* nothing was written behind the n-th */

#endif
