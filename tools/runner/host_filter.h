/* A filter in memory from the heap, for scenarios: on a flight computer the arena is an array. */
#ifndef RUNNER_HOST_FILTER_H
#define RUNNER_HOST_FILTER_H

#include "failure.h"

#include "pflight/pflight.h"

/* Null after a failure, which it tells. `*arena` is to be freed in either case, after the filter's last call; the configuration
 * must live as long. */
pfl_t *host_filter(const pfl_config_t *config, void **arena, failure_t *failure);

#endif
