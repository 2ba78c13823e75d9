/* Start-up of a RISC-V image under emulation (machine mode): floating point on, rounding to nearest, memory set up; any
 * trap ends the run with status 101 instead of hanging it. No C library. */
#include "../../../port/qemu/semihosting.h"

extern uint32_t board_data_load[], board_data_start[], board_data_end[], board_bss_start[], board_bss_end[];
extern int main(void);
void board_reset(void);

__attribute__((used, aligned(4))) void board_trap(void)
{
    sh_print("FAULT: trap\n");
    sh_exit(101);
    for (;;) {
    }
}

__attribute__((naked, used, section(".vectors"))) void board_reset(void)
{
    __asm__ volatile(".option push\n .option norelax\n la gp, __global_pointer$\n .option pop\n"
                     "la sp, board_stack_top\n"
                     "la t0, board_trap\n csrw mtvec, t0\n"
                     "li t0, 0x2000\n csrs mstatus, t0\n" /* FS = initial */
                     "csrw fcsr, x0\n"
                     "call board_start\n"
                     "j .\n");
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
    sh_exit(main());
    for (;;) {
    }
}
