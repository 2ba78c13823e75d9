/* Stand-in for FreeRTOS: the calls of a periodic task. */
#ifndef STANDIN_FREERTOS_TASK_H
#define STANDIN_FREERTOS_TASK_H

#include "FreeRTOS.h"

TickType_t xTaskGetTickCount(void);

/* pdFALSE when the time to wake at had passed already. */
BaseType_t xTaskDelayUntil(TickType_t *previous_wake, TickType_t increment);

#endif
