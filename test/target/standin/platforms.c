/* What stands behind the stand-in headers: one counter, moved by the test, that every platform answers with. */
#include "platforms.h"

#include <Arduino.h>
#include <drivers/drv_hrt.h>
#include <esp_cpu.h>
#include <esp_rom_sys.h>
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

esp_cpu_cycle_count_t esp_cpu_get_cycle_count(void)
{
    return (uint32_t)next();
}

uint32_t esp_rom_get_cpu_ticks_per_us(void)
{
    return 240u;
}

unsigned long micros(void)
{
    return (uint32_t)next(); /* 32 bits wide, as on every board */
}
