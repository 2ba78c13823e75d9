/* A run over time: the series that are averaged over runs, and the paths that only the trace of a single run has. */
#include "uav_trajectory.h"

#include <math.h>

enum {
    NOMINAL_X,
    NOMINAL_Y,
    ERROR,
    CLOUD_MEAN,
    CLOUD_MAX,
    CLOUD_STD,
    CLOUD_STD_UNRESAMPLED,
    WIND_ERROR,
    AHEAD_ERROR,
    AHEAD_STD,
    AHEAD_IGNORED_ERROR,
    COLUMNS
};

const char *const uav_column[UAV_COLUMNS] = {
    "nominal_x_m",
    "nominal_y_m",
    "error_m",
    "cloud_mean_m",
    "cloud_max_m",
    "cloud_std_m",
    "cloud_std_unresampled_m",
    "wind_error_mps",
    "ahead_error_m",
    "ahead_std_m",
    "ahead_ignored_error_m",
};

enum {
    TRUTH_X,
    TRUTH_Y,
    FIX_X,
    FIX_Y,
    ESTIMATE_X,
    ESTIMATE_Y,
    WIND_X,
    WIND_Y,
    AHEAD_X,
    AHEAD_Y,
    AHEAD_IGNORED_X,
    AHEAD_IGNORED_Y,
    AHEAD_BEGUN,
    TRACE_COLUMNS
};

const char *const uav_trace_column[UAV_TRACE_COLUMNS] = {
    "truth_x_m",  "truth_y_m", "fix_x_m",   "fix_y_m",           "estimate_x_m",      "estimate_y_m",  "wind_x_mps",
    "wind_y_mps", "ahead_x_m", "ahead_y_m", "ahead_ignored_x_m", "ahead_ignored_y_m", "ahead_begun_s",
};

/* A name for every column. */
typedef char columns_agree[(int)COLUMNS == (int)UAV_COLUMNS && (int)TRACE_COLUMNS == (int)UAV_TRACE_COLUMNS ? 1 : -1];

bool uav_is_shown(const uav_study_t *s, unsigned j)
{
    unsigned free_from = 0u;
    bool shown = false;

    for (unsigned i = 0u; i <= j && i < s->forecasts; i++) {
        shown = s->forecast_at[i] >= free_from;
        free_from = shown ? s->forecast_at[i] + s->ahead_s : free_from;
    }
    return shown;
}

/* The forecast shown at second k, or -1. */
static int shown_at(const uav_study_t *s, unsigned k)
{
    for (unsigned j = 0u; j < s->forecasts; j++) {
        if (uav_is_shown(s, j) && k > s->forecast_at[j] && k <= s->forecast_at[j] + s->ahead_s) {
            return (int)j;
        }
    }
    return -1;
}

static const uav_belief_t *belief_ahead(const uav_study_t *s, const uav_flight_t *flight, unsigned k)
{
    const int j = shown_at(s, k);

    return j < 0 ? NULL : &flight->ahead[j][k - s->forecast_at[j]];
}

static double *start_row(double *table, unsigned k, int columns)
{
    double *row = &table[(size_t)(k - 1u) * (size_t)columns];

    for (int c = 0; c < columns; c++) {
        row[c] = MISSING;
    }
    return row;
}

void uav_fill_series(const uav_study_t *s, const uav_track_t *track, const uav_flight_t *flight,
                     const uav_flight_t *unresampled, const uav_flight_t *ignored, double *series)
{
    for (unsigned k = 1u; k <= s->seconds; k++) {
        double *row = start_row(series, k, COLUMNS);
        const uav_belief_t *ahead = belief_ahead(s, flight, k);
        row[NOMINAL_X] = track->nominal[k][PFL_AUTOPILOT_X];
        row[NOMINAL_Y] = track->nominal[k][PFL_AUTOPILOT_Y];
        if (k <= s->filter_seconds) {
            row[ERROR] = sqrt(uav_square_error(&flight->at[k], track->truth[k]));
            row[CLOUD_MEAN] = s->ekf ? MISSING : flight->cloud[k].mean_m;
            row[CLOUD_MAX] = s->ekf ? MISSING : flight->cloud[k].max_m;
            row[CLOUD_STD] = flight->cloud[k].std_m;
            row[CLOUD_STD_UNRESAMPLED] = unresampled != NULL ? unresampled->cloud[k].std_m : MISSING;
            row[WIND_ERROR] = sqrt(uav_square_wind_error(&flight->at[k], track->wind));
        }
        if (ahead != NULL) {
            row[AHEAD_ERROR] = sqrt(uav_square_error(ahead, track->truth[k]));
            row[AHEAD_STD] = uav_spread(ahead);
        }
        if (ahead != NULL && ignored != NULL) {
            row[AHEAD_IGNORED_ERROR] = sqrt(uav_square_error(belief_ahead(s, ignored, k), track->truth[k]));
        }
    }
}

static void fill_paths(const uav_study_t *s, const uav_track_t *track, const uav_flight_t *flight, unsigned k,
                       double *row)
{
    row[TRUTH_X] = track->truth[k][PFL_AUTOPILOT_X];
    row[TRUTH_Y] = track->truth[k][PFL_AUTOPILOT_Y];
    if (k <= s->filter_seconds) {
        row[ESTIMATE_X] = flight->at[k].mean[PFL_AUTOPILOT_X];
        row[ESTIMATE_Y] = flight->at[k].mean[PFL_AUTOPILOT_Y];
        row[WIND_X] = flight->at[k].wind[0];
        row[WIND_Y] = flight->at[k].wind[1];
        row[FIX_X] = uav_has_fix(s, k) ? (double)track->z[k][0] : MISSING;
        row[FIX_Y] = uav_has_fix(s, k) ? (double)track->z[k][1] : MISSING;
    }
}

void uav_fill_trace(const uav_study_t *s, const uav_track_t *track, const uav_flight_t *flight,
                    const uav_flight_t *ignored, double *trace)
{
    for (unsigned k = 1u; k <= s->seconds && trace != NULL; k++) {
        double *row = start_row(trace, k, TRACE_COLUMNS);
        const uav_belief_t *ahead = belief_ahead(s, flight, k);
        fill_paths(s, track, flight, k, row);
        if (ahead != NULL) {
            row[AHEAD_X] = ahead->mean[PFL_AUTOPILOT_X];
            row[AHEAD_Y] = ahead->mean[PFL_AUTOPILOT_Y];
            row[AHEAD_BEGUN] = (double)s->forecast_at[shown_at(s, k)];
        }
        if (ahead != NULL && ignored != NULL) {
            const uav_belief_t *blind = belief_ahead(s, ignored, k);
            row[AHEAD_IGNORED_X] = blind->mean[PFL_AUTOPILOT_X];
            row[AHEAD_IGNORED_Y] = blind->mean[PFL_AUTOPILOT_Y];
        }
    }
}
