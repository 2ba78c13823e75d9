/*
 * The port contract on Arduino: micros(), in microseconds.
 *
 * 32 bits, so that differences stay right across its wrap, every 71 minutes.
 */
#include "pflight/port.h"

#include <Arduino.h>

/* Bounds the self-test by reads, never by a clock: enough of them for a counter of 32 kHz. */
#define SELF_TEST_READS 100000u
#define SELF_TEST_STEPS 3u
#define HALF_RANGE 0x80000000u

uint32_t pfl_port_cycles(void)
{
    return (uint32_t)micros();
}

uint32_t pfl_port_cycles_mask(void)
{
    return 0xFFFFFFFFu;
}

uint32_t pfl_port_cycles_hz(void)
{
    return 1000000u;
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
