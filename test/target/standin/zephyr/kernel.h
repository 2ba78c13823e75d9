/* Stand-in for Zephyr's header: what port/zephyr takes from it. */
#ifndef STANDIN_ZEPHYR_KERNEL_H
#define STANDIN_ZEPHYR_KERNEL_H

#include <stdint.h>

uint32_t k_cycle_get_32(void);
int sys_clock_hw_cycles_per_sec(void);

#endif
