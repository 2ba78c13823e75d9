/* What the files of the scenario `terrain` share: the map and the flight, and how a study flies over them. */
#ifndef RUNNER_TERRAIN_H
#define RUNNER_TERRAIN_H

#include "scenario.h"

#include "pflight/pflight.h"

#define TERRAIN_SCORED_FROM_S 200.0
#define TERRAIN_NEAR_M 60.0 /* converged: nearer than this, and staying there */

typedef enum { TERRAIN_RB, TERRAIN_PLAIN, TERRAIN_REGULARISED, TERRAIN_TEMPERED } terrain_filter_t;

typedef enum { TERRAIN_SHRINKING, TERRAIN_GAUSSIAN, TERRAIN_EPANECHNIKOV } terrain_shape_t;

/* A row of the flight. */
typedef struct {
    double t_s;
    uint64_t t_us;
    pfl_dead_reckoning_input_t velocity; /* over the interval that ends here */
    float altitude_m;
    float agl_m; /* NaN: lost */
    double truth_north_m, truth_east_m;
} terrain_row_t;

typedef struct {
    terrain_filter_t filter;
    bool second;       /* flight 2 */
    bool as_they_come; /* every setting but flight and adapt is as by default: the acceptance holds */
    bool adaptive;     /* the number of particles */
    terrain_shape_t kernel_shape;
    float kernel_width;
    float power_scale_m; /* of pfl_terrain_power; 0: the whole likelihood from the start */
    float power_least;
    float power_rise_s; /* `least` grows by the square of the time in it */
    pfl_grid_t grid;
    int16_t *height_m;
    terrain_row_t *row;
    size_t rows;
    float start_north_m, start_east_m; /* dead-reckoned */
    uint32_t particles;
    uint64_t seed;
} terrain_study_t;

/* An estimate after a row. */
typedef struct {
    float north_m, east_m, baro_m, sigma_m; /* sigma: horizontal deviation of the cloud */
    uint32_t particles;
} terrain_estimate_t;

extern const scenario_t terrain_scenario;

bool terrain_load(terrain_study_t *s, const char *data, failure_t *failure);
void terrain_unload(terrain_study_t *s);

bool terrain_fly(const terrain_study_t *s, uint32_t run, terrain_estimate_t *estimate, run_output_t *out,
                 failure_t *failure);

enum {
    TERRAIN_RMSE,
    TERRAIN_WORST,
    TERRAIN_CONVERGED,
    TERRAIN_SETTLED_S,
    TERRAIN_PARTICLES,
    TERRAIN_RESAMPLED,
    TERRAIN_VALUES
};
void terrain_judge(const plan_t *plan, table_t runs, verdict_t *verdict);

#endif
