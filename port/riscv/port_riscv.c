/*
 * The port contract on RISC-V: the low 32 bits of the cycle counter, by machine mode (mcycle) or, with
 * PFL_PORT_RISCV_USER, by user mode (cycle; the machine must allow it in mcounteren).
 *
 * A CSR that is not there or not allowed traps; nothing here can find out before, so the choice is at compile time.
 *
 * PFL_PORT_CPU_HZ          the core clock in hertz; 0 or undefined = unknown
 * PFL_PORT_READ_CYCLES_H   a header that defines PFL_PORT_READ_CYCLES(), to read the counter in another way: the tests
 *                          put a fake one here
 */
#include "pflight/port.h"

#ifdef PFL_PORT_READ_CYCLES_H
#include PFL_PORT_READ_CYCLES_H
#endif

#ifndef PFL_PORT_CPU_HZ
#define PFL_PORT_CPU_HZ 0u
#endif

/* A counter at the core clock moves between any two reads; some count a whole memory access at once. */
#define SELF_TEST_READS 1024u
#define SELF_TEST_STEPS 3u
#define HALF_RANGE 0x80000000u

uint32_t pfl_port_cycles(void)
{
#if defined(PFL_PORT_READ_CYCLES)
    return PFL_PORT_READ_CYCLES();
#else
    uintptr_t count;
#if defined(PFL_PORT_RISCV_USER)
    __asm__ volatile("csrr %0, cycle" : "=r"(count));
#else
    __asm__ volatile("csrr %0, mcycle" : "=r"(count));
#endif
    return (uint32_t)count;
#endif
}

uint32_t pfl_port_cycles_mask(void)
{
    return 0xFFFFFFFFu;
}

uint32_t pfl_port_cycles_hz(void)
{
    return (uint32_t)PFL_PORT_CPU_HZ;
}

/* Weak: define your own pfl_port_fault to set a flag or record a trace event. */
__attribute__((weak)) void pfl_port_fault(int32_t status)
{
    (void)status;
}

/* mcountinhibit stops the counter in some start-up codes: then it stands still, and there is none. */
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
