/* See calls.c. */
#ifndef CALLS_H
#define CALLS_H

#include "pflight/pflight.h"

pfl_status_t call_predict(pfl_t *f, uint64_t t_us, const void *u);
pfl_status_t call_update(pfl_t *f, uint16_t sensor, uint64_t t_us, const void *z);
pfl_status_t call_estimate(pfl_t *f, float *mean, float *cov);

#endif
