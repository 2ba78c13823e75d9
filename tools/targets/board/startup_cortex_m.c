/* Start-up of a Cortex-M image under emulation: floating point on and in the mode that the library's bits depend on,
 * memory set up, faults that end the run with a status (101 hard, 102 memory, 103 bus, 104 usage fault, 105 anything
 * else) instead of hanging it. No CMSIS, no C library. */
#include "../../../port/qemu/semihosting.h"

#define CPACR (*(volatile uint32_t *)0xE000ED88u)
#define CCR (*(volatile uint32_t *)0xE000ED14u)
#define SHCSR (*(volatile uint32_t *)0xE000ED24u)
#define CCR_DIV_0_TRP (1u << 4)
#define SHCSR_MEM_BUS_USG (7u << 16)

extern uint32_t board_data_load[], board_data_start[], board_data_end[], board_bss_start[], board_bss_end[],
    board_stack_top[];
extern int main(void);
void board_reset(void);

static void stop(const char *text, int32_t status)
{
    sh_print(text);
    sh_exit(status);
    for (;;) {
    }
}

static void on_hard_fault(void)
{
    stop("FAULT: hard\n", 101);
}

static void on_memory_fault(void)
{
    stop("FAULT: memory\n", 102);
}

static void on_bus_fault(void)
{
    stop("FAULT: bus\n", 103);
}

static void on_usage_fault(void)
{
    stop("FAULT: usage\n", 104);
}

static void on_anything(void)
{
    stop("FAULT: unexpected exception\n", 105);
}

typedef struct {
    uint32_t *stack;
    void (*handler[15])(void);
} vectors_t;

__attribute__((section(".vectors"), used)) static const vectors_t vectors = {
    board_stack_top,
    {board_reset, on_anything, on_hard_fault, on_memory_fault, on_bus_fault, on_usage_fault, on_anything, on_anything,
     on_anything, on_anything, on_anything, on_anything, on_anything, on_anything, on_anything},
};

/* The compiler may use floating-point registers in any function: on before the first one. */
__attribute__((naked, used)) void board_reset(void)
{
    __asm__ volatile(
#if defined(__ARM_FP)
        "ldr r0, =0xE000ED88\n ldr r1, [r0]\n orr r1, r1, #0xF00000\n str r1, [r0]\n dsb\n isb\n"
#if defined(__ARM_FEATURE_MVE)
        "ldr r0, =0x40000\n vmsr fpscr, r0\n" /* LTPSIZE stays 4: else the first low-overhead loop is a fault */
#else
        "movs r0, #0\n vmsr fpscr, r0\n" /* to nearest, subnormals kept, no default NaN */
#endif
#endif
        "bl board_start\n"
        "b .\n");
}

__attribute__((noreturn, used)) void board_start(void)
{
    const uint32_t *from = board_data_load;
    for (uint32_t *to = board_data_start; to < board_data_end; to++) {
        *to = *from;
        from++;
    }
    for (uint32_t *to = board_bss_start; to < board_bss_end; to++) {
        *to = 0u;
    }
    SHCSR |= SHCSR_MEM_BUS_USG; /* faults of their own, not all hard ones */
    CCR |= CCR_DIV_0_TRP;
    sh_exit(main());
    for (;;) {
    }
}
