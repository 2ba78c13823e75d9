/* One fault: where, what, when, for how long; and the places in the aircraft where it is let in. */
#ifndef SURVIVAL_FAULT_H
#define SURVIVAL_FAULT_H

#include "world.h"

#include <stdio.h>

typedef enum {
    REGION_CONFIG = 0, /* configuration and its arrays, in RAM */
    REGION_CONTROL,    /* control block */
    REGION_SEAL,       /* its copy and seal */
    REGION_TRACKS,     /* what the watch keeps of each sensor */
    REGION_PARTICLES,
    REGION_WEIGHTS, /* log-weights */
    REGION_WORK,    /* scratch column, workspace, moments */
    REGION_RANDOM,
    REGION_CANARIES,
    REGION_SNAPSHOT,
    REGION_CALLBACK,
    REGION_SENSOR,
    REGION_TIME,
    REGION_COUNTER,
    REGION_BUDGET,
    REGIONS
} region_t;

#define MEMORY_REGIONS ((uint32_t)REGION_SNAPSHOT) /* the ones before it */

typedef struct {
    region_t region;
    uint32_t kind;   /* of a region's own list: fault_kind_name */
    bool inside;     /* while a callback runs, not between two calls */
    uint32_t first;  /* cycle */
    uint32_t cycles; /* how many */
    uint32_t point;  /* number of the callback, or of the place between calls */
    uint32_t sensor;
    uint64_t where[2];
    double size; /* 0 .. 1 */
} fault_t;

typedef struct {
    bool struck; /* the fault came to pass */
    uint32_t number;
    uint32_t callbacks; /* in this cycle */
    instant_t held;     /* for sensors that stand still or are late */
} fault_state_t;

extern fault_t fault;             /* of this run */
extern fault_state_t fault_state; /* and what became of it */

const char *fault_region_name(const fault_t *f);
const char *fault_kind_name(const fault_t *f);
bool fault_lasts(const fault_t *f); /* to the end of the flight: nothing can recover from it */

/* The fault of a run, cycles first .. last being those it may begin in. */
fault_t fault_of_run(uint64_t run_seed, uint32_t first, uint32_t last, uint32_t cycles);
fault_t fault_none(void);
void fault_print(FILE *out, const fault_t *f);

/* Where it is let in. */
void fault_begin_cycle(uint32_t number, const instant_t *instant);
void fault_between_calls(uint32_t place);
void fault_in_predict(const pfl_batch_t *p);
void fault_in_loglik(uint32_t sensor, const pfl_view_t *p, float *ll);
uint32_t fault_clock(uint32_t us); /* the hardware's clock as it reads now */
uint32_t fault_counter(uint32_t count);
uint32_t fault_callback_cost(uint32_t particles);
bool fault_asleep(void); /* the application does not run in this cycle */
/* How often a sensor's sample is handed over: 0, 1 or 2 times; may change it and its time. */
uint32_t fault_sample(uint32_t sensor, float z[2], uint64_t *t_us);
bool fault_wants_blob(void);
void fault_blob(unsigned char *blob, size_t *bytes);

#endif
