/* pfl_self_test under a floating-point mode that somebody's start-up code might set: WRONG_FPSCR is or'ed into the
 * control register first (bit 24 flushes subnormals to zero, bits 23 and 22 choose the rounding). Exit status: 0 when
 * the self-test passes, 1 when it refuses. */
#include "pflight/pflight.h"

#ifndef WRONG_FPSCR
#define WRONG_FPSCR 0u
#endif

int main(void)
{
    static uint64_t arena[(PFL_SELF_TEST_BYTES + 7u) / 8u];
    uint32_t mode;

    __asm__ volatile("vmrs %0, fpscr" : "=r"(mode));
    mode |= WRONG_FPSCR;
    __asm__ volatile("vmsr fpscr, %0" ::"r"(mode));
    return (pfl_self_test(arena, sizeof arena) == PFL_OK) ? 0 : 1;
}
