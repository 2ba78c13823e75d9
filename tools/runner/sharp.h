/* The scenario `sharp`: a measurement far sharper than one step of the model spreads a particle. */
#ifndef RUNNER_SHARP_H
#define RUNNER_SHARP_H

#include "scenario.h"

extern const scenario_t sharp_scenario;

#endif
