/* What stands behind the stand-in headers: one counter, moved by the test, that every platform answers with. */
#include "platforms.h"

#include <drivers/drv_hrt.h>
#include <nuttx/clock.h>
#include <task.h>
#include <zephyr/kernel.h>

uint64_t standin_count;
uint32_t standin_stride;

static uint64_t next(void)
{
    standin_count += standin_stride;
    return standin_count;
}

uint32_t standin_counter(void) /* FreeRTOS's, and RISC-V's */
{
    return (uint32_t)next();
}

uint32_t k_cycle_get_32(void)
{
    return (uint32_t)next();
}

int sys_clock_hw_cycles_per_sec(void)
{
    return 64000000;
}

hrt_abstime hrt_absolute_time(void)
{
    return next();
}

clock_t perf_gettime(void)
{
    return (clock_t)next();
}

unsigned long perf_getfreq(void)
{
    return 216000000ul;
}

uint64_t standin_micros64(void)
{
    return next();
}
