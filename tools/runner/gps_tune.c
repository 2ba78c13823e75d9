/* How much acceleration a Kalman filter should believe in: the best of a few values, on runs that are not scored. */
#include "gps.h"

#include <math.h>
#include <stdlib.h>

/* Zero is the document's; the others the page's, which can only be roots of densities: as such they give its figures. */
static const double candidate[] = {0.0, 0.1, 0.15, 0.2, 0.3, 0.5, 0.8};
enum { CANDIDATES = sizeof candidate / sizeof candidate[0], TUNING_RUNS = 30 };

#define FIRST_TUNING_RUN 0x40000000u /* far from any run that is scored */

static double rmse(const gps_study_t *study, const gps_track_t *track, const gps_estimate_t *estimate)
{
    double squares = 0.0;

    for (unsigned k = 1u; k <= study->steps; k++) {
        for (int a = 0; a < study->axes; a++) {
            const double error = estimate->position[k][a] - track->position[k][a];
            squares += error * error;
        }
    }
    return sqrt(squares / (double)study->steps);
}

static bool try_all(const gps_study_t *study, bool coloured, gps_track_t *track, gps_estimate_t *estimate, double *sum,
                    failure_t *failure)
{
    for (uint32_t r = 0u; r < TUNING_RUNS; r++) {
        gps_make_track(study, FIRST_TUNING_RUN + r, track);
        for (int c = 0; c < CANDIDATES; c++) {
            if (!gps_kalman(study, coloured, candidate[c], track, estimate, failure)) {
                return false;
            }
            sum[c] += rmse(study, track, estimate);
        }
    }
    return true;
}

bool gps_tune(const gps_study_t *study, bool coloured, double *q, failure_t *failure)
{
    gps_track_t *track = malloc(sizeof *track);
    gps_estimate_t *estimate = malloc(sizeof *estimate);
    double sum[CANDIDATES] = {0.0};
    int best = 0;
    const bool done = track != NULL && estimate != NULL ? try_all(study, coloured, track, estimate, sum, failure)
                                                        : fail(failure, EXIT_HARNESS, "out of memory");

    free(track);
    free(estimate);
    for (int c = 1; c < CANDIDATES; c++) {
        best = sum[c] < sum[best] ? c : best;
    }
    *q = candidate[best];
    return done;
}
