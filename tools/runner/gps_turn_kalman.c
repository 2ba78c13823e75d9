/* The extended Kalman filter with the turn model, on GPS or radar: the yardstick of the particle filter there. States as
 * pfl_turn_predict has them. */
#include "cloud.h"
#include "gps.h"
#include "kalman.h"

#include <math.h>
#include <string.h>

enum { N = PFL_TURN_STATES, M_MAX = 4 };
enum { X = PFL_TURN_X, Y = PFL_TURN_Y, V = PFL_TURN_SPEED, PSI = PFL_TURN_HEADING, OMEGA = PFL_TURN_RATE };

/* What is measured, seen from the predicted state. */
typedef struct {
    int count;
    double h[M_MAX * N];
    double r[M_MAX * M_MAX];
    double innovation[M_MAX];
} seen_t;

static gaussian_t start(const gps_study_t *study, const gps_track_t *track)
{
    gaussian_t belief;

    memset(&belief, 0, sizeof belief);
    belief.n = N;
    for (int d = 0; d < N; d++) {
        belief.x[d] = track->start[d];
        belief.p[d * N + d] = track->start_sigma[d] * track->start_sigma[d];
    }
    if (gps_is_radar(study)) {
        const double s = sin(track->azimuth[0]);
        const double c = cos(track->azimuth[0]);
        const double along = study->sigma_range * study->sigma_range;
        const double across = pow(study->sigma_azimuth * track->range[0], 2.0);
        belief.x[X] = track->gps[0][0];
        belief.x[Y] = track->gps[0][1];
        belief.p[X * N + X] = along * c * c + across * s * s;
        belief.p[Y * N + Y] = along * s * s + across * c * c;
        belief.p[X * N + Y] = (along - across) * s * c;
        belief.p[Y * N + X] = belief.p[X * N + Y];
    }
    return belief;
}

static void predict(gaussian_t *b)
{
    const double t = GPS_PERIOD_S;
    const double s = sin(b->x[PSI] + 0.5 * t * b->x[OMEGA]);
    const double c = cos(b->x[PSI] + 0.5 * t * b->x[OMEGA]);
    const double v = b->x[V];
    const double next[N] = {b->x[X] + t * v * c, b->x[Y] + t * v * s, v, b->x[PSI] + t * b->x[OMEGA], b->x[OMEGA]};
    const double f[N * N] = {
        1.0, 0.0, t * c, -t * v * s, -0.5 * t * t * v * s, /* x */
        0.0, 1.0, t * s, t * v * c,  0.5 * t * t * v * c,  /* y */
        0.0, 0.0, 1.0,   0.0,        0.0,                  /* speed */
        0.0, 0.0, 0.0,   1.0,        t,                    /* heading */
        0.0, 0.0, 0.0,   0.0,        1.0,                  /* turn rate */
    };
    double q[N * N] = {0.0};

    q[V * N + V] = GPS_TURN_SIGMA_SPEED * GPS_TURN_SIGMA_SPEED * t;
    q[OMEGA * N + OMEGA] = GPS_TURN_SIGMA_RATE_EKF * GPS_TURN_SIGMA_RATE_EKF * t;
    kalman_predict(b, next, f, q);
}

static void see_radar(const gps_study_t *study, const gps_track_t *track, unsigned k, const double *x, seen_t *seen)
{
    const double range = hypot(x[X], x[Y]);

    seen->count = 2;
    seen->h[X] = x[X] / range;
    seen->h[Y] = x[Y] / range;
    seen->h[N + X] = -x[Y] / (range * range);
    seen->h[N + Y] = x[X] / (range * range);
    seen->r[0] = study->sigma_range * study->sigma_range;
    seen->r[3] = study->sigma_azimuth * study->sigma_azimuth;
    seen->innovation[0] = track->range[k] - range;
    seen->innovation[1] = gps_wrap(track->azimuth[k] - atan2(x[Y], x[X]));
}

static void see_gps(const gps_study_t *study, const gps_track_t *track, unsigned k, const double *x, seen_t *seen)
{
    const double s = sin(x[PSI]);
    const double c = cos(x[PSI]);
    const int m = study->velocity ? 4 : 2;

    seen->count = m;
    for (int a = 0; a < 2; a++) {
        seen->h[a * N + a] = 1.0;
        seen->r[a * m + a] = study->r_m2;
        seen->innovation[a] = track->gps[k][a] - x[a];
    }
    if (study->velocity) {
        seen->h[2 * N + V] = c;
        seen->h[2 * N + PSI] = -x[V] * s;
        seen->h[3 * N + V] = s;
        seen->h[3 * N + PSI] = x[V] * c;
        seen->r[2 * m + 2] = GPS_VELOCITY_SIGMA * GPS_VELOCITY_SIGMA;
        seen->r[3 * m + 3] = GPS_VELOCITY_SIGMA * GPS_VELOCITY_SIGMA;
        seen->innovation[2] = track->gps_velocity[k][0] - x[V] * c;
        seen->innovation[3] = track->gps_velocity[k][1] - x[V] * s;
    }
}

static bool update(const gps_study_t *study, const gps_track_t *track, unsigned k, gaussian_t *b)
{
    seen_t seen;
    double z[M_MAX];

    memset(&seen, 0, sizeof seen);
    if (gps_is_radar(study)) {
        see_radar(study, track, k, b->x, &seen);
    } else {
        see_gps(study, track, k, b->x, &seen);
    }
    matrix_multiply(seen.h, b->x, z, seen.count, N, 1);
    for (int i = 0; i < seen.count; i++) {
        z[i] += seen.innovation[i];
    }
    return kalman_update(b, z, seen.h, seen.r, seen.count);
}

bool gps_turn_kalman(const gps_study_t *study, const gps_track_t *track, gps_estimate_t *estimate, failure_t *failure)
{
    gaussian_t belief = start(study, track);

    memset(estimate, 0, sizeof *estimate);
    for (unsigned k = 1u; k <= study->steps; k++) {
        const uint32_t begin = pfl_port_cycles();
        predict(&belief);
        if (!update(study, track, k, &belief)) {
            return fail(failure, EXIT_HARNESS, "step %u: the innovation covariance is singular", k);
        }
        const uint32_t cycles = (pfl_port_cycles() - begin) & pfl_port_cycles_mask();
        estimate->cycles_ns[k - 1u] = cycle_ns(cycles);
        estimate->position[k][0] = belief.x[X];
        estimate->position[k][1] = belief.x[Y];
        estimate->velocity[k][0] = belief.x[V] * cos(belief.x[PSI]);
        estimate->velocity[k][1] = belief.x[V] * sin(belief.x[PSI]);
        estimate->sigma[k] = sqrt(belief.p[0]);
    }
    return true;
}
