/* A run's values, from the truth and what a filter made of it. */
#include "uav_trajectory.h"

#include <math.h>
#include <string.h>

#define SETTLED_S 20u    /* the estimate's error counts from here on */
#define ELLIPSE_95 5.991 /* chi-square, two degrees of freedom */
#define CLOUD_AT_S 60u   /* the spread that is compared with and without resampling */

double uav_square_error(const uav_belief_t *belief, const double *truth)
{
    const double dx = belief->mean[PFL_AUTOPILOT_X] - truth[PFL_AUTOPILOT_X];
    const double dy = belief->mean[PFL_AUTOPILOT_Y] - truth[PFL_AUTOPILOT_Y];

    return dx * dx + dy * dy;
}

double uav_square_wind_error(const uav_belief_t *belief, const double *wind)
{
    const double dx = belief->wind[0] - wind[0];
    const double dy = belief->wind[1] - wind[1];

    return dx * dx + dy * dy;
}

double uav_spread(const uav_belief_t *belief)
{
    return sqrt((belief->xx + belief->yy) / 2.0);
}

static bool covers(const uav_belief_t *belief, const double *truth)
{
    const double dx = truth[PFL_AUTOPILOT_X] - belief->mean[PFL_AUTOPILOT_X];
    const double dy = truth[PFL_AUTOPILOT_Y] - belief->mean[PFL_AUTOPILOT_Y];
    const double determinant = belief->xx * belief->yy - belief->xy * belief->xy;

    /* Mahalanobis distance, without a division that a cloud of one point would not survive. */
    return dx * dx * belief->yy - 2.0 * dx * dy * belief->xy + dy * dy * belief->xx <= ELLIPSE_95 * determinant;
}

void uav_score_clouds(const uav_study_t *s, const uav_track_t *track, const uav_flight_t *flight, double *value)
{
    const double clouds = (double)(s->filter_seconds + 1u);
    unsigned settled = 0u;

    for (unsigned k = 0u; k <= s->filter_seconds; k++) {
        value[UAV_MEAN] += flight->cloud[k].mean_m / clouds;
        value[UAV_STD] += flight->cloud[k].std_m / clouds;
        value[UAV_MAX] = fmax(value[UAV_MAX], flight->cloud[k].max_m);
        if (k >= SETTLED_S) {
            value[UAV_SQUARE] += uav_square_error(&flight->at[k], track->truth[k]);
            settled++;
        }
    }
    value[UAV_SQUARE] /= settled > 0u ? (double)settled : 1.0;
    if (s->filter_seconds >= CLOUD_AT_S) {
        value[UAV_CLOUD_60S] = flight->cloud[CLOUD_AT_S].std_m;
    }
    value[UAV_RESAMPLED] = (double)flight->resampled;
}

void uav_score_forecasts(const uav_study_t *s, const uav_track_t *track, const uav_flight_t *flight, double *value)
{
    const double share = 1.0 / (double)s->forecasts;

    for (unsigned j = 0u; j < s->forecasts; j++) {
        for (unsigned h = 0u; h < s->horizons; h++) {
            const uav_belief_t *belief = &flight->ahead[j][s->horizon_s[h]];
            const double *truth = track->truth[s->forecast_at[j] + s->horizon_s[h]];
            double *of = &value[UAV_HORIZON + h * UAV_OF_HORIZON];
            of[UAV_OF_SQUARE] += share * uav_square_error(belief, truth);
            of[UAV_OF_CLOUD] += share * uav_spread(belief);
            of[UAV_OF_COVERED] += covers(belief, truth) ? share : 0.0;
        }
        value[UAV_WIND_SQUARE] += share * uav_square_wind_error(&flight->ahead[j][0], track->wind);
        value[UAV_REACH] += share * flight->reach_m[j];
    }
}

void uav_score_ignored(const uav_study_t *s, const uav_track_t *track, const uav_flight_t *flight, double *value)
{
    for (unsigned j = 0u; j < s->forecasts; j++) {
        for (unsigned h = 0u; h < s->horizons; h++) {
            value[UAV_HORIZON + h * UAV_OF_HORIZON + UAV_OF_IGNORED_SQUARE] +=
                uav_square_error(&flight->ahead[j][s->horizon_s[h]],
                                 track->truth[s->forecast_at[j] + s->horizon_s[h]]) /
                (double)s->forecasts;
        }
    }
}
