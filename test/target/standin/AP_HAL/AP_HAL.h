/* Stand-in for ArduPilot's header: what port/ardupilot takes from it. */
#ifndef STANDIN_AP_HAL_H
#define STANDIN_AP_HAL_H

#include "platforms.h"

namespace AP_HAL {
inline uint64_t micros64()
{
    return standin_micros64();
}
} // namespace AP_HAL

#endif
