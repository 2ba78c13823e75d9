/* What the files of the scenario `car` share: a recorded drive as one list of epochs. */
#ifndef RUNNER_CAR_H
#define RUNNER_CAR_H

#include "scenario.h"

#include "pflight/pflight.h"

/* The ranges of one time, and the odometry of the interval that ends there. */
typedef struct {
    double t_s;
    uint64_t t_us; /* from the first */
    pfl_pseudoranges_t ranges;
    pfl_odometry_input_t odometry;
    double truth_x_m, truth_y_m; /* for the score only */
} car_epoch_t;

typedef enum { CAR_MIXTURE, CAR_GAUSSIAN, CAR_ODOMETRY } car_filter_t;

typedef struct {
    car_filter_t filter;
    car_epoch_t *epoch;
    size_t epochs;
    double fix_x_m, fix_y_m; /* a plain least-squares fix of the first epoch: where the filter begins */
    double clock_m[2];       /* of either constellation then, over the nominal one */
    double fix_rmse_m;       /* of such fixes in all */
    uint32_t particles;
    uint64_t seed;
} car_study_t;

/* East of the first truth point, and the heading at the start, from the recording's description. */
#define CAR_HEADING_RAD 1.253

extern const scenario_t car_scenario;

bool car_load(car_study_t *s, const char *data, failure_t *failure);

/* Estimates (x, y) after each epoch, and the cycles. */
bool car_filter(const car_study_t *s, uint32_t run, float *estimate, run_output_t *out, failure_t *failure);

#endif
