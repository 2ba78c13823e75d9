/*
 * The port contract on a POSIX host: CLOCK_MONOTONIC in nanoseconds, truncated to 32 bits (period 4.29 s).
 *
 * For tests, simulation and companion computers. The monotonic clock is never set back, and the truncated
 * count stays right across the wrap because 2^32 divides the range of the 64-bit sum.
 */
#define _POSIX_C_SOURCE 200809L

#include "pflight/port.h"

#include <stdint.h>
#include <time.h>

/* Far more reads than one step of even a coarse 10 ms clock takes. */
#define SELF_TEST_READS 10000000u
#define SELF_TEST_STEPS 3u
#define HALF_RANGE 0x80000000u

uint32_t pfl_port_cycles(void)
{
    struct timespec now;

    if (clock_gettime(CLOCK_MONOTONIC, &now) != 0) {
        return 0u;
    }
    return (uint32_t)((uint64_t)now.tv_sec * 1000000000u + (uint64_t)now.tv_nsec);
}

uint32_t pfl_port_cycles_mask(void)
{
    return 0xFFFFFFFFu;
}

uint32_t pfl_port_cycles_hz(void)
{
    return 1000000000u;
}

/* Weak: define your own pfl_port_fault to log, count or raise. */
__attribute__((weak)) void pfl_port_fault(int32_t status)
{
    (void)status;
}

bool pfl_port_self_test(void)
{
    uint32_t last = pfl_port_cycles();
    uint32_t steps = 0u;

    for (uint32_t read = 0u; read < SELF_TEST_READS && steps < SELF_TEST_STEPS; ++read) {
        const uint32_t now = pfl_port_cycles();

        if (now - last >= HALF_RANGE) {
            return false;
        }
        if (now != last) {
            ++steps;
        }
        last = now;
    }
    return steps == SELF_TEST_STEPS;
}
