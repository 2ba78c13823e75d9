/* The mean square error of the Kalman filters on a straight line, exactly: with the gains known, filter error and GPS
 * error obey a linear recursion, and so does the matrix of their second moments. No sampling. */
#include "gps.h"

#include <math.h>
#include <string.h>

enum {
    N = 3
}; /* errors of position and velocity, and what is left of the GPS error after the filter's estimate of it */

/* moment <- f moment f'. */
static void carry(const double *f, double *moment)
{
    double half[N * N];

    matrix_multiply(f, moment, half, N, N, N);
    matrix_multiply_transposed(half, f, moment, N, N, N);
}

static void start(const gps_study_t *study, const gps_axis_t *axis, int index, double *moment)
{
    const double truth[GPS_AXES_MAX][2] = {{0.0, 1.0}, {0.0, 0.0}, {-5.0, 0.0}};
    const double error[2] = {truth[index][0] - axis->belief.x[GPS_P], truth[index][1] - axis->belief.x[GPS_V]};

    memset(moment, 0, sizeof(double) * N * N);
    for (int i = 0; i < 2; i++) {
        for (int j = 0; j < 2; j++) {
            moment[i * N + j] =
                study->drawn && index == 0 ? axis->belief.p[i * axis->belief.n + j] : error[i] * error[j];
        }
    }
    moment[GPS_E * N + GPS_E] = study->noise_m * study->noise_m;
}

static void predict(const gps_study_t *study, gps_axis_t *axis, double *moment)
{
    const double f[N * N] = {1.0, GPS_PERIOD_S, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, study->decay};

    gps_axis_predict(axis);
    carry(f, moment);
    moment[GPS_E * N + GPS_E] += study->noise_m * study->noise_m;
}

/* The innovation is the error of position plus what is left of the GPS error, and the error of velocity plus noise. */
static bool update(gps_axis_t *axis, double *moment)
{
    const int m = axis->measured;
    const int n = axis->belief.n;
    double gain[N * 2] = {0.0};
    double left[N * N] = {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};

    if (!gps_axis_gain(axis, gain) || !gps_axis_update(axis, 0.0, 0.0)) {
        return false;
    }
    for (int i = 0; i < n; i++) {
        left[i * N + GPS_P] -= gain[i * m];
        left[i * N + GPS_E] -= gain[i * m];
        left[i * N + GPS_V] -= m > 1 ? gain[i * m + 1] : 0.0;
    }
    carry(left, moment);
    for (int i = 0; i < n && m > 1; i++) {
        for (int j = 0; j < n; j++) {
            moment[i * N + j] += gain[i * m + 1] * axis->r[3] * gain[j * m + 1];
        }
    }
    return true;
}

/* Mean of the NEES: the trace of the inverse stated covariance times the true one. */
static double mean_nees(const gps_axis_t *axis, const double *moment)
{
    const double *p = axis->belief.p;
    const double p_pv = p[GPS_V];
    const double p_vv = p[axis->belief.n + GPS_V];

    return (p_vv * moment[0] - 2.0 * p_pv * moment[GPS_V] + p[0] * moment[N + GPS_V]) / (p[0] * p_vv - p_pv * p_pv);
}

static bool expect_axis(const gps_study_t *study, int index, gps_expected_t *sum)
{
    const bool raw = study->filter == GPS_RAW;
    const double q = study->filter == GPS_KF_TUNED ? study->q_tuned : 0.0;
    gps_axis_t axis = gps_axis_start(study, study->filter == GPS_KF_COLOURED, q, index);
    double moment[N * N];

    start(study, &axis, index, moment);
    if (axis.from_start && !update(&axis, moment)) {
        return false;
    }
    for (unsigned k = 1u; k <= study->steps; k++) {
        predict(study, &axis, moment);
        if (!raw && !update(&axis, moment)) {
            return false;
        }
        const double square = raw ? moment[GPS_E * N + GPS_E] : moment[GPS_P * N + GPS_P];
        sum->rmse_m += square / (double)study->steps;
        sum->nees += raw ? 0.0 : mean_nees(&axis, moment) / (double)study->steps / (double)study->axes;
        if (k == study->steps) {
            sum->final_position_m += square;
            sum->final_velocity_mps += raw ? 0.0 : moment[GPS_V * N + GPS_V];
        }
    }
    return true;
}

bool gps_expect(const gps_study_t *study, gps_expected_t *expected)
{
    const bool kalman = study->filter == GPS_KF || study->filter == GPS_KF_TUNED || study->filter == GPS_KF_COLOURED;
    bool done = study->variant == GPS_LINE && (kalman || study->filter == GPS_RAW);

    memset(expected, 0, sizeof *expected);
    for (int a = 0; a < study->axes && done; a++) {
        done = expect_axis(study, a, expected);
    }
    expected->rmse_m = sqrt(expected->rmse_m);
    expected->final_position_m = sqrt(expected->final_position_m);
    expected->final_velocity_mps = sqrt(expected->final_velocity_mps);
    return done;
}
