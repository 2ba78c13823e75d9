/* Extends a 32-bit clock by its difference to the time before, modulo 2^32: more than half of the range is a step back. */
#include "pflight/clock.h"

uint64_t pfl_clock_extend(uint64_t last_us, uint32_t clock_us)
{
    const uint32_t ahead = clock_us - (uint32_t)last_us;
    const uint32_t back = 0u - ahead;
    return ((ahead > UINT32_C(0x7FFFFFFF)) && (back <= last_us)) ? (last_us - back) : (last_us + ahead);
}
