/* The scenario `gps-fault`, for the list of scenarios. */
#ifndef RUNNER_GPS_FAULT_H
#define RUNNER_GPS_FAULT_H

#include "scenario.h"

extern const scenario_t gps_fault_scenario;

#endif
