/* The scenario `manoeuvre`: a target that flies straight and turns, by one model and by two. */
#ifndef RUNNER_MANOEUVRE_H
#define RUNNER_MANOEUVRE_H

#include "scenario.h"

extern const scenario_t manoeuvre_scenario;

#endif
