/* Time stamps of 64 bits from a hardware clock of 32. */
#ifndef PFLIGHT_CLOCK_H
#define PFLIGHT_CLOCK_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* The time nearest to last_us whose low 32 bits are clock_us: a microsecond clock that wraps every 71.6 minutes goes on
 * without a seam, as long as less than 35.7 minutes lie between two calls. A clock that jumped back gives a time before
 * last_us, which pfl_predict refuses; never one before zero. last_us: what it returned the time before, 0 at first.
 *
 *     now_us = pfl_clock_extend(now_us, TIM2->CNT);
 *
 * A value that runs through to a later call after such a refusal does no harm: the next good reading brings it back.
 * O(1). */
uint64_t pfl_clock_extend(uint64_t last_us, uint32_t clock_us);

#ifdef __cplusplus
}
#endif

#endif
