/* Particles of a traced run, to be looked at: a scenario hands over the clouds that are worth it, as CSV. */
#ifndef RUNNER_CLOUD_H
#define RUNNER_CLOUD_H

#include "scenario.h"

#include "pflight/pflight.h"

/* Counter cycles as time. */
uint32_t cycle_ns(uint32_t cycles);

/* What a cycle did, out of the health of the filter after it. */
cycle_t cycle_of(const pfl_health_t *health);

/* Adds the filter's cloud in the plane of two states, thinned to at most CLOUD_POINTS particles. `set` names the filter
 * where a run has several. Nothing happens when `cloud` is null: call it whether the run is traced or not. */
#define CLOUD_POINTS 200u
void cloud_take(text_t *cloud, const char *set, double t_s, const pfl_t *filter, uint16_t x_state, uint16_t y_state);

/* The line above the clouds. */
#define CLOUD_HEADER "set,t_s,x,y\n"

#endif
