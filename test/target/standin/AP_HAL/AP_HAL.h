/* Stand-in for ArduPilot's header: what port/ardupilot takes from it. */
#ifndef STANDIN_AP_HAL_H
#define STANDIN_AP_HAL_H

#include <stdint.h>

namespace AP_HAL {
uint64_t micros64();
}

#endif
