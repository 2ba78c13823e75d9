/* The scenario `uav-trajectory`: a UAV under its autopilot in uncertain wind; where it is, and where it will be. Its
 * world, its particle filter, the extended Kalman filter beside it, and the metrics. */
#ifndef RUNNER_UAV_TRAJECTORY_H
#define RUNNER_UAV_TRAJECTORY_H

#include "cloud.h"
#include "scenario.h"

#include "pflight/pflight.h"

#include <stdbool.h>
#include <stdint.h>

/* One cycle a second, ten Euler steps each. A state of the world: the six of the ready model. */
enum {
    UAV_STATES = PFL_AUTOPILOT_STATES,
    UAV_SECONDS_MAX = 120,
    UAV_AHEAD_MAX = 60,    /* seconds of a forecast */
    UAV_FORECASTS_MAX = 8, /* forecasts of a run */
    UAV_HORIZONS_MAX = 4,  /* instants of a forecast that are scored */
    UAV_WINDS = 4,         /* of Table 1 */
    UAV_FIX = 3            /* x, y, height */
};

#define UAV_PERIOD_US 1000000u
#define UAV_SUBSTEPS 10

typedef enum { UAV_LINE, UAV_CIRCLE, UAV_WINDS_TABLE, UAV_FORECAST, UAV_WIND, UAV_REPLAY } uav_sim_t;

/* What the filter makes of the wind. */
typedef enum { UAV_WIND_KNOWN, UAV_WIND_IGNORED, UAV_WIND_IN_STATE } uav_wind_model_t;

/* The page's parameter sets S and G. */
typedef struct {
    char name;
    double sigma_gust_mps;
    double sigma_fix_m;
    unsigned fix_period_s;
    double start_sigma[UAV_STATES];
} uav_set_t;

/* A study of this scenario, its settings read. */
typedef struct {
    uav_sim_t sim;
    bool ekf;
    uav_set_t set;
    bool wind_drawn; /* the truth's mean wind comes from the prior, else it is `wind` */
    double wind[2];
    double wind_sigma_mps; /* the prior's */
    uav_wind_model_t wind_model;
    double wind_walk;
    bool resampling;
    pfl_scheme_fn scheme;
    double resample_below; /* share of N */
    bool kernel;
    bool optimal;  /* the optimal proposal instead of the gusts as they are */
    bool distance; /* weights by the inverse squared distance */
    bool fixes;
    unsigned seconds;        /* of the world */
    unsigned filter_seconds; /* with the filter on, from 0 on */
    unsigned forecasts;
    unsigned forecast_at[UAV_FORECASTS_MAX];
    unsigned ahead_s; /* length of each */
    unsigned horizons;
    unsigned horizon_s[UAV_HORIZONS_MAX]; /* scored, from the forecast's beginning */
    bool as_page; /* the settings are the page's for this simulation, but for wind and particles */
    uint32_t particles;
    uint64_t seed;
} uav_study_t;

/* Truth and fixes of a run; index k is the second. */
typedef struct {
    double wind[2]; /* mean */
    double measured_start[UAV_STATES];
    double truth[UAV_SECONDS_MAX + 1][UAV_STATES];
    double nominal[UAV_SECONDS_MAX + 1][UAV_STATES]; /* exact start, mean wind, no gust */
    float z[UAV_SECONDS_MAX + 1][UAV_FIX];           /* where uav_has_fix */
} uav_track_t;

/* Mean and horizontal covariance of a belief. */
typedef struct {
    double mean[UAV_STATES];
    double wind[2];
    double xx, xy, yy;
} uav_belief_t;

/* A cloud as it would be plotted: without weights. Distances from the true position. */
typedef struct {
    double mean_m, max_m, std_m;
} uav_cloud_t;

/* What a filter made of a track. */
typedef struct {
    uav_belief_t at[UAV_SECONDS_MAX + 1]; /* up to filter_seconds; with the weights of the second's fix */
    uav_cloud_t cloud[UAV_SECONDS_MAX + 1];
    uav_belief_t ahead[UAV_FORECASTS_MAX][UAV_AHEAD_MAX + 1]; /* 0: where the forecast began */
    double reach_m[UAV_FORECASTS_MAX]; /* of the cloud's farthest particle from its mean, at the end of a forecast */
    uint32_t cycles_ns[UAV_SECONDS_MAX];
    cycle_t cycle[UAV_SECONDS_MAX];
    uint32_t resampled;
} uav_flight_t;

/* Where clouds of particles go, and under which names; null for none. */
typedef struct {
    text_t *text;
    look_t *look;         /* each step of the filter, for look_take */
    const char *filtered; /* the filter's */
    const char *forecast; /* and those ahead of it */
} uav_clouds_t;

extern const scenario_t uav_trajectory_scenario;

/* ---- uav_world.c ------------------------------------------------------------------------------------------------- */

extern const pfl_autopilot_t uav_vehicle; /* without wind */
extern const pfl_route_t uav_route;       /* of the replay */
extern const double uav_table_wind[UAV_WINDS][2];

/* What the pilot asks for from second k on. */
pfl_autopilot_input_t uav_reference(const uav_study_t *s, unsigned k);

/* One Euler step, the j-th of a second, of the vehicle in double. With a route, the waypoint's index is switched. */
void uav_euler_step(const pfl_autopilot_t *vehicle, const pfl_autopilot_input_t *wanted, unsigned j, const double *wind,
                    double *x, uint32_t *waypoint);

double uav_wrap(double angle_rad);
bool uav_has_fix(const uav_study_t *s, unsigned k);

/* stream: the random numbers' run. */
void uav_make_track(const uav_study_t *s, uint32_t stream, uav_track_t *track);

/* ---- uav_pf.c, uav_ekf.c: the filters ---------------------------------------------------------------------------- */

bool uav_particle_filter(const uav_study_t *s, uint32_t stream, const uav_track_t *track, const uav_clouds_t *clouds,
                         uav_flight_t *flight, failure_t *failure);

/* Without clouds of particles: only the standard deviation in `cloud`, of the belief. */
bool uav_kalman_filter(const uav_study_t *s, const uav_track_t *track, uav_flight_t *flight, failure_t *failure);

/* ---- uav_score.c: a run's values --------------------------------------------------------------------------------- */

/* Columns of the runs' values; the last two are blocks, of UAV_OF_HORIZON a horizon and of UAV_OF_WIND a wind. */
enum {
    UAV_MEAN,
    UAV_MAX,
    UAV_STD,
    UAV_SQUARE, /* of the estimate's error, mean from 20 s on */
    UAV_RESAMPLED,
    UAV_CLOUD_60S,
    UAV_CLOUD_60S_UNRESAMPLED, /* of a twin filter that never resamples, on the same data */
    UAV_WIND_SQUARE,           /* of the wind's error, where forecasts begin */
    UAV_REACH,
    UAV_HORIZON
};
enum { UAV_OF_SQUARE, UAV_OF_CLOUD, UAV_OF_COVERED, UAV_OF_IGNORED_SQUARE, UAV_OF_HORIZON };
enum { UAV_OF_MEAN, UAV_OF_MAX, UAV_OF_STD, UAV_OF_WIND };
enum {
    UAV_BY_WIND = UAV_HORIZON + UAV_HORIZONS_MAX * UAV_OF_HORIZON,
    UAV_VALUES = UAV_BY_WIND + UAV_WINDS * UAV_OF_WIND
};

/* Horizontal, squared; of the wind, squared; and the standard deviation of an axis, root mean square of both. */
double uav_square_error(const uav_belief_t *belief, const double *truth);
double uav_square_wind_error(const uav_belief_t *belief, const double *wind);
double uav_spread(const uav_belief_t *belief);

/* Metrics of Table 1, from the clouds of the seconds 0 .. filter_seconds. */
void uav_score_clouds(const uav_study_t *s, const uav_track_t *track, const uav_flight_t *flight, double *value);

/* Errors, spread and coverage at each horizon, mean over the run's forecasts; wind error and reach. */
void uav_score_forecasts(const uav_study_t *s, const uav_track_t *track, const uav_flight_t *flight, double *value);

/* Only the squared errors at each horizon of a filter that ignores the wind. */
void uav_score_ignored(const uav_study_t *s, const uav_track_t *track, const uav_flight_t *flight, double *value);

/* ---- uav_series.c: a run over time ------------------------------------------------------------------------------- */

/* The time series, and what a trace has beside it. */
enum { UAV_COLUMNS = 11, UAV_TRACE_COLUMNS = 13 };
extern const char *const uav_column[UAV_COLUMNS];
extern const char *const uav_trace_column[UAV_TRACE_COLUMNS];

/* Is forecast j among those that the series shows, one after the other? The earliest, and then those that overlap with
 * none before. */
bool uav_is_shown(const uav_study_t *s, unsigned j);

/* unresampled, ignored: flights of the twins, or null. */
void uav_fill_series(const uav_study_t *s, const uav_track_t *track, const uav_flight_t *flight,
                     const uav_flight_t *unresampled, const uav_flight_t *ignored, double *series);
void uav_fill_trace(const uav_study_t *s, const uav_track_t *track, const uav_flight_t *flight,
                    const uav_flight_t *ignored, double *trace);

/* ---- uav_judge.c: metrics beside the paper's and the page's ------------------------------------------------------- */

void uav_judge(const plan_t *plan, table_t runs, verdict_t *verdict);

#endif
