/* What a linear Kalman filter makes of a radar when range and azimuth are linearised once, at the start: it fails, and
 * that is what it is here for. */
#include "gps.h"
#include "kalman.h"

#include <math.h>
#include <string.h>

enum { NORTH, EAST, V_NORTH, V_EAST, N, M = 2 };

#define VELOCITY_VARIANCE 4.0

typedef struct {
    gaussian_t belief;
    double f[N * N];
    double q[N * N];
    double h[M * N]; /* slopes of range and azimuth at `at` */
    double r[M * M];
    double at[N];
    double seen[M]; /* range and azimuth there */
} frozen_t;

static void set_motion(frozen_t *filter, double acceleration)
{
    const double t = GPS_PERIOD_S;
    const double q = acceleration * acceleration;

    for (int i = 0; i < N; i++) {
        filter->f[i * N + i] = 1.0;
    }
    for (int a = 0; a < 2; a++) {
        filter->f[a * N + a + 2] = t;
        filter->q[a * N + a] = q * t * t * t / 3.0;
        filter->q[a * N + a + 2] = q * t * t / 2.0;
        filter->q[(a + 2) * N + a] = q * t * t / 2.0;
        filter->q[(a + 2) * N + a + 2] = q * t;
    }
}

static frozen_t start(const gps_study_t *study, double acceleration, const gps_track_t *track)
{
    const double first = fmax(study->sigma_range, study->sigma_azimuth * track->range[0]);
    const double n = track->gps[0][0];
    const double e = track->gps[0][1];
    const double range = hypot(n, e);
    frozen_t filter;

    memset(&filter, 0, sizeof filter);
    filter.belief.n = N;
    filter.at[NORTH] = n;
    filter.at[EAST] = e;
    memcpy(filter.belief.x, filter.at, sizeof filter.at);
    for (int a = 0; a < 2; a++) {
        filter.belief.p[a * N + a] = first * first;
        filter.belief.p[(a + 2) * N + a + 2] = VELOCITY_VARIANCE;
    }
    set_motion(&filter, acceleration);
    filter.h[NORTH] = n / range;
    filter.h[EAST] = e / range;
    filter.h[N + NORTH] = -e / (range * range);
    filter.h[N + EAST] = n / (range * range);
    filter.r[0] = study->sigma_range * study->sigma_range;
    filter.r[3] = study->sigma_azimuth * study->sigma_azimuth;
    filter.seen[0] = range;
    filter.seen[1] = atan2(e, n);
    return filter;
}

/* z such that z - h x is the innovation wanted, azimuth wrapped. */
static void innovate(const frozen_t *filter, double range, double azimuth, double *z)
{
    double hx[M];
    double h_at[M];

    matrix_multiply(filter->h, filter->belief.x, hx, M, N, 1);
    matrix_multiply(filter->h, filter->at, h_at, M, N, 1);
    z[0] = range - filter->seen[0] + h_at[0];
    z[1] = hx[1] + gps_wrap(azimuth - (filter->seen[1] + hx[1] - h_at[1]));
}

bool gps_radar_kalman(const gps_study_t *study, double acceleration, const gps_track_t *track, gps_estimate_t *estimate,
                      failure_t *failure)
{
    frozen_t filter = start(study, acceleration, track);

    memset(estimate, 0, sizeof *estimate);
    for (unsigned k = 1u; k <= study->steps; k++) {
        double next[N];
        double z[M];
        matrix_multiply(filter.f, filter.belief.x, next, N, N, 1);
        kalman_predict(&filter.belief, next, filter.f, filter.q);
        innovate(&filter, track->range[k], track->azimuth[k], z);
        if (!kalman_update(&filter.belief, z, filter.h, filter.r, M)) {
            return fail(failure, EXIT_HARNESS, "step %u: the innovation covariance is singular", k);
        }
        memcpy(estimate->position[k], &filter.belief.x[NORTH], 2u * sizeof(double));
        memcpy(estimate->velocity[k], &filter.belief.x[V_NORTH], 2u * sizeof(double));
        estimate->sigma[k] = sqrt(filter.belief.p[0]);
    }
    return true;
}
