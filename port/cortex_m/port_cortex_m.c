/*
 * The port contract on Arm Cortex-M: the DWT cycle counter (32 bits), or SysTick (24 bits) where the DWT is
 * absent (Cortex-M0, M0+, M23) or stuck (most simulators, some locked debug units).
 *
 * Until pfl_port_self_test() has found a counter that moves, there is none: mask 0. It may be called again
 * at any time: it enables a counter but never sets one back, and it leaves a SysTick that somebody else
 * configured (an operating system's tick) alone.
 *
 * PFL_PORT_CPU_HZ          the core clock in hertz; 0 or undefined = unknown
 * PFL_PORT_REGISTERS_H     a header that defines PFL_PORT_READ and PFL_PORT_WRITE, to reach the registers in
 *                          another way: the unit tests put fake registers here
 */
#include "pflight/port.h"

#ifdef PFL_PORT_REGISTERS_H
#include PFL_PORT_REGISTERS_H
#else
#define PFL_PORT_READ(address) (*(const volatile uint32_t *)(uintptr_t)(address))
#define PFL_PORT_WRITE(address, value) (*(volatile uint32_t *)(uintptr_t)(address) = (value))
#endif

#ifndef PFL_PORT_CPU_HZ
#define PFL_PORT_CPU_HZ 0u
#endif

/* Addresses and bits: Armv7-M Architecture Reference Manual, sections B3.3 (SysTick), C1.6.5, C1.8 (DWT). */
#define SYST_CSR 0xE000E010u /* control: bit 0 enable, bit 1 interrupt, bit 2 core clock */
#define SYST_RVR 0xE000E014u /* reload value */
#define SYST_CVR 0xE000E018u /* current value, counts down */
#define DWT_CTRL 0xE0001000u
#define DWT_CYCCNT 0xE0001004u
#define DWT_LAR 0xE0001FB0u /* lock access: Cortex-M7 ignores writes to the DWT until it is unlocked */
#define DEMCR 0xE000EDFCu

#define DEMCR_TRCENA (1u << 24)
#define DWT_CTRL_CYCCNTENA (1u << 0)
#define DWT_CTRL_NOCYCCNT (1u << 25)
#define DWT_LAR_UNLOCK 0xC5ACCE55u
#define SYST_CSR_ENABLE (1u << 0)
#define SYST_CSR_CLKSOURCE (1u << 2)

#define DWT_MASK 0xFFFFFFFFu
#define SYST_MASK 0x00FFFFFFu

/* A counter at the core clock moves between any two reads; a slow clock or bus gets this many chances. */
#define SELF_TEST_READS 1024u
#define SELF_TEST_STEPS 3u

/* The mask tells the counters apart: one word, so that an interrupt never sees half a choice. */
static volatile uint32_t counter_mask;

static uint32_t read_counter(uint32_t mask)
{
    if (mask == DWT_MASK) {
        return PFL_PORT_READ(DWT_CYCCNT);
    }
    if (mask == SYST_MASK) {
        return (0u - PFL_PORT_READ(SYST_CVR)) & SYST_MASK; /* down to up: 0, FFFFFF, FFFFFE -> 0, 1, 2 */
    }
    return 0u;
}

uint32_t pfl_port_cycles(void)
{
    return read_counter(counter_mask);
}

uint32_t pfl_port_cycles_mask(void)
{
    return counter_mask;
}

uint32_t pfl_port_cycles_hz(void)
{
    return (counter_mask == 0u) ? 0u : (uint32_t)PFL_PORT_CPU_HZ;
}

/* Weak: define your own pfl_port_fault to set a flag or record a trace event. */
__attribute__((weak)) void pfl_port_fault(int32_t status)
{
    (void)status;
}

/* An interval of half the range or more between two neighbouring reads is a step backward. */
static bool moves_forward(uint32_t mask)
{
    uint32_t last = read_counter(mask);
    uint32_t steps = 0u;

    for (uint32_t read = 0u; read < SELF_TEST_READS && steps < SELF_TEST_STEPS; ++read) {
        const uint32_t now = read_counter(mask);

        if (((now - last) & mask) > mask / 2u) {
            return false;
        }
        if (now != last) {
            ++steps;
        }
        last = now;
    }
    return steps == SELF_TEST_STEPS;
}

static bool start_dwt(void)
{
    PFL_PORT_WRITE(DEMCR, PFL_PORT_READ(DEMCR) | DEMCR_TRCENA);
    if ((PFL_PORT_READ(DWT_CTRL) & DWT_CTRL_NOCYCCNT) != 0u) {
        return false;
    }
    PFL_PORT_WRITE(DWT_LAR, DWT_LAR_UNLOCK);
    PFL_PORT_WRITE(DWT_CTRL, PFL_PORT_READ(DWT_CTRL) | DWT_CTRL_CYCCNTENA);
    return moves_forward(DWT_MASK);
}

/* Takes SysTick only when it is off, or on as this function left it: full range, core clock. */
static bool start_systick(void)
{
    if ((PFL_PORT_READ(SYST_CSR) & SYST_CSR_ENABLE) == 0u) {
        PFL_PORT_WRITE(SYST_RVR, SYST_MASK);
        PFL_PORT_WRITE(SYST_CVR, 0u);
        PFL_PORT_WRITE(SYST_CSR, SYST_CSR_CLKSOURCE | SYST_CSR_ENABLE);
    } else if ((PFL_PORT_READ(SYST_RVR) & SYST_MASK) != SYST_MASK ||
               (PFL_PORT_READ(SYST_CSR) & SYST_CSR_CLKSOURCE) == 0u) {
        return false;
    }
    return moves_forward(SYST_MASK);
}

bool pfl_port_self_test(void)
{
    uint32_t mask = 0u;

    if (start_dwt()) {
        mask = DWT_MASK;
    } else if (start_systick()) {
        mask = SYST_MASK;
    }
    counter_mask = mask;
    return mask != 0u;
}
