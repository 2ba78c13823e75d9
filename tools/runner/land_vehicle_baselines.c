/* The land vehicle's Kalman filter and unscented Kalman filter, well and badly tuned. */
#include "cloud.h"
#include "kalman.h"
#include "land_vehicle.h"
#include "ukf.h"

#include <math.h>
#include <string.h>

enum { N = PFL_LAND_STATES, M = LAND_MEASURED };

/* A belief and the noise that a filter believes in. */
typedef struct {
    gaussian_t belief;
    double q[N * N];
    double r[M * M];
} believed_t;

static void set_diagonal(double *matrix, int n, int first, int last, double value)
{
    for (int i = first; i <= last; i++) {
        matrix[i * n + i] = value;
    }
}

static believed_t tuned(const land_study_t *study)
{
    believed_t b;

    memset(&b, 0, sizeof b);
    b.belief.n = N;
    memcpy(b.belief.x, land_start, sizeof land_start);
    for (int d = 0; study->uncertain && d < N; d++) {
        b.belief.p[d * N + d] = land_start_sigma[d] * land_start_sigma[d];
    }
    set_diagonal(b.q, N, PFL_LAND_EAST, PFL_LAND_NORTH, LAND_PERIOD_S * LAND_PERIOD_S * study->w_variance);
    set_diagonal(b.r, M, 0, M - 1, study->z_variance);
    return b;
}

static believed_t mistuned(const land_study_t *study, land_tuning_t tuning)
{
    believed_t b = tuned(study);

    switch (tuning) {
    case LAND_UKF_FORGOT_T:
        set_diagonal(b.q, N, PFL_LAND_EAST, PFL_LAND_NORTH, study->w_variance);
        break;
    case LAND_UKF_R_IDENTITY:
        set_diagonal(b.r, M, 0, M - 1, 1.0);
        break;
    case LAND_UKF_Q_ZERO_P_IDENTITY:
        set_diagonal(b.q, N, 0, N - 1, 0.0);
        set_diagonal(b.belief.p, N, 0, N - 1, 1.0);
        break;
    case LAND_UKF_Q_ALL_SMALL:
        set_diagonal(b.q, N, 0, N - 1, LAND_PERIOD_S * LAND_PERIOD_S * study->w_variance);
        set_diagonal(b.belief.p, N, 0, N - 1, 1.0);
        break;
    case LAND_UKF_Q_ALL_LARGE:
        set_diagonal(b.q, N, 0, N - 1, study->w_variance);
        set_diagonal(b.belief.p, N, 0, N - 1, 1.0);
        break;
    case LAND_UKF_Q_ZERO_P_ZERO:
        set_diagonal(b.q, N, 0, N - 1, 0.0);
        set_diagonal(b.belief.p, N, 0, N - 1, 0.0);
        break;
    case LAND_UKF_TUNED:
    case LAND_UKF_RAW:
        break;
    }
    return b;
}

static void widen(const float *z, double *wide)
{
    for (int m = 0; m < M; m++) {
        wide[m] = (double)z[m];
    }
}

static bool kalman_step(believed_t *b, unsigned k, const double *z)
{
    static const double h[M * N] = {1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0};
    double jacobian[N * N];
    double next[N];

    land_jacobian(k - 1u, b->belief.x, jacobian);
    land_move(k - 1u, b->belief.x, next);
    kalman_predict(&b->belief, next, jacobian, b->q);
    return kalman_update(&b->belief, z, h, b->r, M);
}

static void ukf_model(const void *user, const double *in, double *out)
{
    land_move(*(const unsigned *)user, in, out);
}

static void ukf_measurement(const void *user, const double *in, double *out)
{
    (void)user;
    memcpy(out, in, M * sizeof *out); /* the first three states, seen directly */
}

static bool ukf_step(believed_t *b, unsigned k, const double *z)
{
    const unsigned from = k - 1u;

    ukf_predict(&b->belief, ukf_model, &from, b->q);
    return ukf_update(&b->belief, ukf_measurement, NULL, z, b->r, M);
}

static bool fly(believed_t *b, bool (*step)(believed_t *, unsigned, const double *), const land_track_t *track,
                land_estimate_t *estimate, failure_t *failure)
{
    for (unsigned k = 1u; k <= LAND_STEPS; k++) {
        const uint32_t begin = pfl_port_cycles();
        double z[M];

        widen(track->z[k], z);
        if (!step(b, k, z)) {
            return fail(failure, EXIT_HARNESS, "step %u: the innovation covariance is singular", k);
        }
        for (int d = 0; d < N; d++) {
            if (!isfinite(b->belief.x[d])) {
                return fail(failure, EXIT_HARNESS, "step %u: the estimate is not finite", k);
            }
        }
        memcpy(estimate->x[k], b->belief.x, sizeof estimate->x[k]);
        const uint32_t passed = (pfl_port_cycles() - begin) & pfl_port_cycles_mask();
        estimate->cycles_ns[k - 1u] = cycle_ns(passed);
    }
    return true;
}

bool land_kalman_filter(const land_study_t *study, const land_track_t *track, land_estimate_t *estimate,
                        failure_t *failure)
{
    believed_t b = tuned(study);

    return fly(&b, kalman_step, track, estimate, failure);
}

bool land_unscented_filter(const land_study_t *study, land_tuning_t tuning, const land_track_t *track,
                           land_estimate_t *estimate, failure_t *failure)
{
    if (tuning == LAND_UKF_RAW) {
        for (unsigned k = 1u; k <= LAND_STEPS; k++) {
            widen(track->z[k], estimate->x[k]);
            estimate->x[k][PFL_LAND_HEADING] = track->truth[k][PFL_LAND_HEADING];
        }
        return true;
    }
    believed_t b = mistuned(study, tuning);
    return fly(&b, ukf_step, track, estimate, failure);
}
