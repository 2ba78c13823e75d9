/* What the files of the scenario `replay` share: any log as one list of measurements, and any of four filters to fly on
 * it. tools/python/src/pflight/replay.py flies the same, to the bit: change both. */
#ifndef RUNNER_REPLAY_H
#define RUNNER_REPLAY_H

#include "scenario.h"

#include "pflight/pflight.h"

#define REPLAY_NUMBERS 2u /* of a measurement, at most */
#define REPLAY_STATES_MAX 7u

/* In the order of the setting's choices. */
typedef enum { REPLAY_CV, REPLAY_HOVER, REPLAY_TURN, REPLAY_ODOMETRY, REPLAY_MODELS } replay_model_t;
typedef enum {
    REPLAY_GPS,
    REPLAY_FIX,
    REPLAY_VELOCITY,
    REPLAY_HEIGHT,
    REPLAY_BARO,
    REPLAY_RANGE,
    REPLAY_SENSORS
} replay_sensor_t;

typedef struct {
    double t_s;
    uint64_t t_us; /* from the first measurement */
    replay_sensor_t sensor;
    uint32_t row; /* as it was read: measurements of one time and sensor keep their order */
    float z[REPLAY_NUMBERS];
    pfl_range_z_t range; /* of a range, made of z: anchor and range */
    double truth[2];     /* position, for the score only; MISSING where there is none */
    pfl_odometry_input_t odometry;
} replay_event_t;

typedef struct {
    replay_model_t model;
    bool wanted[REPLAY_SENSORS];
    float sigma[REPLAY_SENSORS];
    float motion, turning; /* noise of the model */
    float start_speed;     /* standard deviation of the velocity before it was measured */
    float ess_ratio, gate;
    float range_dof, anchors_over_m;
    double from_s; /* scored from then on */
    double gap_s;  /* without measurements, behind which the filter starts anew; 0: never */
    replay_event_t *event;
    size_t events;
    const char *compared; /* the file of the truth, or of what else the position is compared with; null: none */
    uint32_t particles;
    uint64_t seed;
} replay_study_t;

extern const scenario_t replay_scenario;

/* Columns 0 and 1 of a position are x and y: north and east, but for the model with odometry, whose heading counts from
 * east: east and north. */
bool replay_load(replay_study_t *s, const char *data, failure_t *failure);

/* Index of this sensor's first event that is not before `from`; s->events without one. */
size_t replay_first(const replay_study_t *s, replay_sensor_t sensor, size_t from);
bool replay_is_position(replay_sensor_t sensor);

/* Flies the filter over the log. */
bool replay_fly(const replay_study_t *s, uint32_t run, run_output_t *out, failure_t *failure);

enum {
    REPLAY_INNOVATION, /* rms of position measured less predicted */
    REPLAY_NIS,        /* its mean square, normalised by its covariance: 2 for a consistent filter */
    REPLAY_INSIDE,     /* share of it below the 95 % quantile */
    REPLAY_ERROR,      /* rms against truth */
    REPLAY_NEES,
    REPLAY_REJECTED,
    REPLAY_RESTARTS,
    REPLAY_RESAMPLED,
    REPLAY_ESS,
    REPLAY_ARENA,
    REPLAY_SCORED, /* positions */
    REPLAY_VALUES
};
void replay_judge(const plan_t *plan, table_t runs, verdict_t *verdict);

/* Rows of the time series. */
enum {
    REPLAY_COLUMN_T,
    REPLAY_COLUMN_X,
    REPLAY_COLUMN_Y,
    REPLAY_COLUMN_MEASURED_X,
    REPLAY_COLUMN_MEASURED_Y,
    REPLAY_COLUMN_TRUTH_X,
    REPLAY_COLUMN_TRUTH_Y,
    REPLAY_COLUMN_SIGMA,
    REPLAY_COLUMN_NIS,
    REPLAY_COLUMN_NEES,
    REPLAY_COLUMNS
};

#endif
