/*
 * The port contract on QEMU's Arm boards: a timer of the board that counts INSTRUCTIONS, not cycles, when QEMU runs
 * with -icount. Repeatable to the last digit, and no measure of time on silicon.
 *
 * Default: TIM2 of netduinoplus2 (STM32F405). QEMU runs it at 1 GHz whatever the prescaler of the clock tree, so with
 * -icount shift=0 one count is one instruction. On silicon the same registers count at 84 MHz; take port/cortex_m.
 *
 * PFL_PORT_QEMU_CMSDK   TIMER0 of the mps2 boards instead: 25 MHz. Run with -icount shift=7, where an instruction is
 *                       128 ns and 16 counts are 5 instructions.
 */
#include "pflight/port.h"

#define MASK 0xFFFFFFFFu
#define REGISTER(address) (*(volatile uint32_t *)(uintptr_t)(address))

#if defined(PFL_PORT_QEMU_CMSDK)

#define TIMER_CTRL 0x40000000u /* bit 0: enable */
#define TIMER_VALUE 0x40000004u
#define TIMER_RELOAD 0x40000008u

static void start(void)
{
    if ((REGISTER(TIMER_CTRL) & 1u) == 0u) {
        REGISTER(TIMER_RELOAD) = 0xFFFFFFFFu;
        REGISTER(TIMER_VALUE) = 0xFFFFFFFFu;
        REGISTER(TIMER_CTRL) = 1u;
    }
}

uint32_t pfl_port_cycles(void)
{
    return 0xFFFFFFFFu - REGISTER(TIMER_VALUE); /* it counts down */
}

#else

#define TIM2_CR1 0x40000000u /* bit 0: enable */
#define TIM2_EGR 0x40000014u
#define TIM2_CNT 0x40000024u
#define TIM2_PSC 0x40000028u
#define TIM2_ARR 0x4000002Cu

static void start(void)
{
    if ((REGISTER(TIM2_CR1) & 1u) == 0u) {
        REGISTER(TIM2_ARR) = 0xFFFFFFFFu;
        REGISTER(TIM2_PSC) = 0u;
        REGISTER(TIM2_EGR) = 1u; /* takes both over */
        REGISTER(TIM2_CR1) = 1u;
    }
}

uint32_t pfl_port_cycles(void)
{
    return REGISTER(TIM2_CNT);
}

#endif

uint32_t pfl_port_cycles_mask(void)
{
    return MASK;
}

/* Instructions have no rate. */
uint32_t pfl_port_cycles_hz(void)
{
    return 0u;
}

/* Weak: define your own pfl_port_fault to print or stop. */
__attribute__((weak)) void pfl_port_fault(int32_t status)
{
    (void)status;
}

bool pfl_port_self_test(void)
{
    start();
    uint32_t steps = 0u;
    uint32_t last = pfl_port_cycles();
    for (uint32_t read = 0u; (read < 1000u) && (steps < 3u); read++) {
        const uint32_t now = pfl_port_cycles();
        if (((now - last) & MASK) > (MASK / 2u)) {
            return false;
        }
        steps += (now != last) ? 1u : 0u;
        last = now;
    }
    return steps == 3u;
}
