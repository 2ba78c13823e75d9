/* What a flight of flight_cycle.c needs to know of the filter that it measures. */
#ifndef BENCHMARK_WORK_H
#define BENCHMARK_WORK_H

#include "pflight/pflight.h"

#define WORK_STEP_US 500000u
#define WORK_STEPS_MAX 1000u
#define WORK_MEASURED_MAX 8u /* floats of a measurement */

typedef struct {
    uint16_t states, noises;
    pfl_predict_fn predict;
    pfl_draw_fn draw;
    pfl_loglik_fn loglik;
    void *model, *sensor;             /* users of the callbacks */
    const void *(*input)(uint32_t k); /* of step k */
    const float *(*measured)(uint32_t k);
} work_t;

/* The land vehicle of the reference work: position and speed seen, case 1 read as variances, T = 0.5 s, known start. */
const work_t *work_land_vehicle(void);

/* The same with antithetic noise. */
const work_t *work_land_vehicle_antithetic(void);

/* `states` / 2 masses, each moving at a speed that white noise drives, each position seen. 2 to 16 states, even. */
const work_t *work_chain(uint16_t states);

#endif
