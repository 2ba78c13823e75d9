/* The Kalman filters of the scenario `gps`: each axis is a filter of its own, as nothing couples them. The document's,
 * the same with a believed acceleration, and the one whose state holds the GPS error. */
#include "cloud.h"
#include "gps.h"
#include "kalman.h"

#include <math.h>
#include <string.h>

#define RADAR_VELOCITY_VARIANCE 4.0
#define NO_VOLUME 1e-6 /* share of the product of variances: the rounding of a covariance in single precision */

static void set_motion(gps_axis_t *axis, double decay, double e_variance, double acceleration)
{
    const double t = GPS_PERIOD_S;
    const int n = axis->belief.n;
    const double q = acceleration * acceleration;
    const double white[2][2] = {{q * t * t * t / 3.0, q * t * t / 2.0}, {q * t * t / 2.0, q * t}};

    for (int i = 0; i < n; i++) {
        axis->f[i * n + i] = 1.0;
    }
    axis->f[GPS_P * n + GPS_V] = t;
    for (int i = 0; i < 2; i++) {
        for (int j = 0; j < 2; j++) {
            axis->q[i * n + j] = white[i][j];
        }
    }
    if (n > GPS_E) {
        axis->f[GPS_E * n + GPS_E] = decay;
        axis->q[GPS_E * n + GPS_E] = e_variance;
    }
}

static void set_measurement(gps_axis_t *axis, bool coloured, bool velocity, double r_m2)
{
    const int n = axis->belief.n;

    axis->measured = velocity ? 2 : 1;
    axis->h[GPS_P] = 1.0;
    if (coloured) {
        axis->h[GPS_E] = 1.0;
    }
    axis->r[0] = coloured ? 0.0 : r_m2; /* the whole error is a state */
    if (velocity) {
        axis->h[n + GPS_V] = 1.0;
        axis->r[3] = GPS_VELOCITY_SIGMA * GPS_VELOCITY_SIGMA;
    }
}

/* The document's guess for north, ours for the other axes; the curve's filters know the speed. */
static void set_guess(const gps_study_t *study, int index, gaussian_t *belief)
{
    static const double line[GPS_AXES_MAX][2] = {{0.0, 0.5}, {0.0, 0.0}, {-5.0, 0.0}};
    static const double curve[GPS_AXES_MAX][2] = {{0.0, 2.0}, {0.0, 0.0}, {0.0, 0.0}};
    const bool far = study->guess != GPS_GUESS_DOCUMENT && index == 0;
    const bool wide = study->guess == GPS_GUESS_FAR_WIDE && index == 0;
    const double *guess = study->variant == GPS_LINE ? line[index] : curve[index];
    const int n = belief->n;

    belief->x[GPS_P] = far ? 5.0 : guess[0];
    belief->x[GPS_V] = far ? 0.0 : guess[1];
    belief->p[GPS_P * n + GPS_P] = wide ? 25.0 : 0.5;
    belief->p[GPS_V * n + GPS_V] = wide ? 1.0 : 0.7;
}

gps_axis_t gps_axis_start(const gps_study_t *study, bool coloured, double acceleration, int index)
{
    const double e_variance = study->noise_m * study->noise_m;
    gps_axis_t axis;

    memset(&axis, 0, sizeof axis);
    axis.belief.n = coloured ? 3 : 2;
    axis.from_start = coloured;
    set_motion(&axis, study->decay, e_variance, acceleration);
    set_measurement(&axis, coloured, study->velocity, study->r_m2);
    set_guess(study, index, &axis.belief);
    if (coloured) {
        axis.belief.p[GPS_E * 3 + GPS_E] = e_variance;
    }
    return axis;
}

void gps_axis_predict(gps_axis_t *axis)
{
    double next[GPS_AXIS_STATES_MAX];

    matrix_multiply(axis->f, axis->belief.x, next, axis->belief.n, axis->belief.n, 1);
    kalman_predict(&axis->belief, next, axis->f, axis->q);
}

bool gps_axis_update(gps_axis_t *axis, double position, double velocity)
{
    const double z[2] = {position, velocity};

    return kalman_update(&axis->belief, z, axis->h, axis->r, axis->measured);
}

/* The gain is what an update makes of a unit measurement when it starts from zero. */
bool gps_axis_gain(const gps_axis_t *axis, double *gain)
{
    for (int j = 0; j < axis->measured; j++) {
        gaussian_t probe = axis->belief;
        double z[2] = {0.0, 0.0};
        z[j] = 1.0;
        memset(probe.x, 0, sizeof probe.x);
        if (!kalman_update(&probe, z, axis->h, axis->r, axis->measured)) {
            return false;
        }
        for (int i = 0; i < probe.n; i++) {
            gain[i * axis->measured + j] = probe.x[i];
        }
    }
    return true;
}

double gps_nees(const double *error, double p_pp, double p_pv, double p_vv)
{
    const double determinant = p_pp * p_vv - p_pv * p_pv;

    if (!(determinant > NO_VOLUME * p_pp * p_vv)) {
        return MISSING;
    }
    return (p_vv * error[0] * error[0] - 2.0 * p_pv * error[0] * error[1] + p_pp * error[1] * error[1]) / determinant;
}

/* A radar's measurement becomes a position with one round variance; the first one is the start. */
static void start_at_radar(const gps_study_t *study, const gps_track_t *track, int index, gps_axis_t *axis)
{
    const double first = fmax(study->sigma_range, study->sigma_azimuth * track->range[0]);
    double mean_range = 0.0;

    for (unsigned k = 1u; k <= study->steps; k++) {
        mean_range += hypot(track->position[k][0], track->position[k][1]) / (double)study->steps;
    }
    const double across = study->sigma_azimuth * mean_range;
    axis->r[0] = (study->sigma_range * study->sigma_range + across * across) / 2.0;
    axis->belief.x[GPS_P] = track->gps[0][index];
    axis->belief.x[GPS_V] = 0.0;
    axis->belief.p[0] = first * first;
    axis->belief.p[3] = RADAR_VELOCITY_VARIANCE;
}

static void keep(const gps_axis_t *axis, const gps_track_t *track, unsigned k, int index, int axes,
                 gps_estimate_t *estimate)
{
    const gaussian_t *b = &axis->belief;
    const double error[2] = {b->x[GPS_P] - track->position[k][index], b->x[GPS_V] - track->velocity[k][index]};

    estimate->position[k][index] = b->x[GPS_P];
    estimate->velocity[k][index] = b->x[GPS_V];
    estimate->nees[k] += gps_nees(error, b->p[0], b->p[GPS_V], b->p[b->n + GPS_V]) / (double)axes;
    if (index == 0) {
        estimate->sigma[k] = sqrt(b->p[0]);
    }
}

bool gps_kalman(const gps_study_t *study, bool coloured, double acceleration, const gps_track_t *track,
                gps_estimate_t *estimate, failure_t *failure)
{
    memset(estimate, 0, sizeof *estimate);
    for (int a = 0; a < study->axes; a++) {
        gps_axis_t axis = gps_axis_start(study, coloured, acceleration, a);
        if (gps_is_radar(study)) {
            start_at_radar(study, track, a, &axis);
        }
        for (unsigned k = 0u; k <= study->steps; k++) {
            const uint32_t begin = pfl_port_cycles();
            if (k > 0u) {
                gps_axis_predict(&axis);
            }
            if ((k > 0u || axis.from_start) && !gps_axis_update(&axis, track->gps[k][a], track->gps_velocity[k][a])) {
                return fail(failure, EXIT_HARNESS, "step %u: the innovation covariance is singular", k);
            }
            if (k > 0u) {
                const uint32_t cycles = (pfl_port_cycles() - begin) & pfl_port_cycles_mask();
                estimate->cycles_ns[k - 1u] += cycle_ns(cycles);
            }
            keep(&axis, track, k, a, study->axes, estimate);
        }
    }
    return true;
}
