/* Behind the stand-in of FreeRTOS: a counter of 168 MHz that moves 900 counts a read, as a batch of particles takes,
 * and leaps by 12 ms in every 97th read (somebody else ran); the tick follows it. */
#include <task.h>

#define COUNTS_PER_TICK 168000u
#define READ_COUNTS 900u
#define LEAP_EVERY 97u
#define LEAP_TICKS 12u /* longer than the task's period */

static uint64_t count;
static uint32_t reads;

uint32_t standin_counter(void)
{
    reads++;
    count += READ_COUNTS;
    if (reads % LEAP_EVERY == 0u) {
        count += (uint64_t)LEAP_TICKS * COUNTS_PER_TICK;
    }
    return (uint32_t)count;
}

TickType_t xTaskGetTickCount(void)
{
    return (TickType_t)(count / COUNTS_PER_TICK);
}

BaseType_t xTaskDelayUntil(TickType_t *previous_wake, TickType_t increment)
{
    const uint64_t wake = (uint64_t)*previous_wake + increment;
    const int in_time = wake > xTaskGetTickCount();

    *previous_wake = (TickType_t)wake;
    if (in_time) {
        count = wake * COUNTS_PER_TICK;
    }
    return in_time ? pdTRUE : pdFALSE;
}
