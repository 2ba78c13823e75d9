/* Stand-in for FreeRTOS: what port/freertos and examples/04_freertos_task.c take from it. The counter and the ticks are
 * those of freertos.c beside this file. */
#ifndef STANDIN_FREERTOS_H
#define STANDIN_FREERTOS_H

#include <stdint.h>

#define configGENERATE_RUN_TIME_STATS 1
#define configTICK_RATE_HZ 1000u
#define portGET_RUN_TIME_COUNTER_VALUE() standin_counter()
#define pdTRUE 1
#define pdFALSE 0
#define pdMS_TO_TICKS(ms) ((TickType_t)(((uint64_t)(ms)*configTICK_RATE_HZ) / 1000u))

typedef uint32_t TickType_t;
typedef long BaseType_t;

#include "platforms.h"

#endif
