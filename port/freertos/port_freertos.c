/*
 * The port contract on FreeRTOS: the run-time statistics counter of your FreeRTOSConfig.h.
 *
 * FreeRTOS has no clock finer than its tick; that counter is the one that an application gives it. It must run through
 * all 32 bits: one that was divided (CYCCNT / 72) jumps back where CYCCNT wraps, and such intervals count as nothing.
 */
#include "pflight/port.h"

#include <FreeRTOS.h>
#include <task.h>

#if !defined(configGENERATE_RUN_TIME_STATS) || (configGENERATE_RUN_TIME_STATS != 1)
#error "configGENERATE_RUN_TIME_STATS is not 1: there is no counter; on a Cortex-M take port/cortex_m instead"
#endif
#ifndef PFL_PORT_COUNTER_HZ
#define PFL_PORT_COUNTER_HZ 0u /* the rate of the counter in hertz; 0: unknown */
#endif

/* Bounds the self-test by reads, never by a clock: enough of them for a counter of 32 kHz. */
#define SELF_TEST_READS 100000u
#define SELF_TEST_STEPS 3u
#define HALF_RANGE 0x80000000u

uint32_t pfl_port_cycles(void)
{
    return (uint32_t)portGET_RUN_TIME_COUNTER_VALUE();
}

uint32_t pfl_port_cycles_mask(void)
{
    return 0xFFFFFFFFu;
}

uint32_t pfl_port_cycles_hz(void)
{
    return (uint32_t)PFL_PORT_COUNTER_HZ;
}

/* Weak: define your own pfl_port_fault to log or to raise a flag. */
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
