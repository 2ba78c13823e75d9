/* The extended Kalman filter on the UAV: the yardstick of the scenario page, exact but for the turns and the limits.
 * A cycle is the ten Euler steps of the mean with their Jacobians; the gust, held over the second, enters at its end. */
#include "uav_trajectory.h"

#include "kalman.h"

#include <math.h>
#include <string.h>

enum { N = UAV_STATES + 2, WIND = UAV_STATES, M = UAV_FIX };

#define STEP_S (1.0 / UAV_SUBSTEPS)

typedef struct {
    const uav_study_t *study;
    pfl_autopilot_t vehicle;
    gaussian_t belief;
    uint32_t waypoint;
} ekf_t;

static void start(const uav_study_t *s, const uav_track_t *track, ekf_t *e)
{
    memset(e, 0, sizeof *e);
    e->study = s;
    e->vehicle = uav_vehicle;
    e->belief.n = N;
    for (int d = 0; d < UAV_STATES; d++) {
        e->belief.x[d] = track->measured_start[d];
        e->belief.p[d * N + d] = s->set.start_sigma[d] * s->set.start_sigma[d];
    }
    for (int i = 0; i < 2; i++) {
        const double sigma = s->wind_model == UAV_WIND_IN_STATE ? s->wind_sigma_mps : 0.0;
        e->belief.x[WIND + i] = s->wind_model == UAV_WIND_KNOWN ? track->wind[i] : 0.0;
        e->belief.p[(WIND + i) * N + WIND + i] = sigma * sigma;
    }
}

/* The heading's row: how the wanted heading depends on the position, and the loop on the heading. */
static void heading_row(const ekf_t *e, const pfl_autopilot_input_t *wanted, const double *x, double moved, double *f)
{
    const double gain = STEP_S * (double)e->vehicle.alpha_heading;
    double *row = &f[PFL_AUTOPILOT_HEADING * N];

    if (fabs(moved) >= STEP_S * (double)e->vehicle.turn_max_radps - 1e-12) {
        return; /* at its limit the turn depends on nothing */
    }
    row[PFL_AUTOPILOT_HEADING] -= gain;
    if (wanted->route != NULL) {
        const pfl_waypoint_t *to = &wanted->route->waypoint[e->waypoint];
        const double dx = (double)to->x_m - x[PFL_AUTOPILOT_X];
        const double dy = (double)to->y_m - x[PFL_AUTOPILOT_Y];
        row[PFL_AUTOPILOT_X] += gain * dy / (dx * dx + dy * dy);
        row[PFL_AUTOPILOT_Y] -= gain * dx / (dx * dx + dy * dy);
    }
}

/* Of the Euler step from x to next. */
static void jacobian(const ekf_t *e, const pfl_autopilot_input_t *wanted, const double *x, const double *next,
                     double *f)
{
    const double v = x[PFL_AUTOPILOT_SPEED];
    const double heading = x[PFL_AUTOPILOT_HEADING];

    memset(f, 0, N * N * sizeof *f);
    for (int d = 0; d < N; d++) {
        f[d * N + d] = 1.0;
    }
    f[PFL_AUTOPILOT_X * N + PFL_AUTOPILOT_SPEED] = STEP_S * cos(heading);
    f[PFL_AUTOPILOT_X * N + PFL_AUTOPILOT_HEADING] = -STEP_S * v * sin(heading);
    f[PFL_AUTOPILOT_X * N + WIND] = STEP_S;
    f[PFL_AUTOPILOT_Y * N + PFL_AUTOPILOT_SPEED] = STEP_S * sin(heading);
    f[PFL_AUTOPILOT_Y * N + PFL_AUTOPILOT_HEADING] = STEP_S * v * cos(heading);
    f[PFL_AUTOPILOT_Y * N + WIND + 1] = STEP_S;
    f[PFL_AUTOPILOT_SPEED * N + PFL_AUTOPILOT_SPEED] -= STEP_S * (double)e->vehicle.alpha_speed;
    f[PFL_AUTOPILOT_HEIGHT * N + PFL_AUTOPILOT_CLIMB] = STEP_S;
    f[PFL_AUTOPILOT_CLIMB * N + PFL_AUTOPILOT_HEIGHT] = -STEP_S * (double)e->vehicle.alpha_height;
    f[PFL_AUTOPILOT_CLIMB * N + PFL_AUTOPILOT_CLIMB] -= STEP_S * (double)e->vehicle.alpha_climb;
    heading_row(e, wanted, x, next[PFL_AUTOPILOT_HEADING] - heading, f);
}

/* From second k - 1 to k. */
static void predict(ekf_t *e, unsigned k)
{
    const pfl_autopilot_input_t wanted = uav_reference(e->study, k - 1u);
    const double walk = e->study->wind_model == UAV_WIND_IN_STATE ? e->study->wind_walk : 0.0;
    const double gust = e->study->set.sigma_gust_mps;
    double q[N * N] = {0.0};
    double f[N * N];
    double next[N];

    for (unsigned j = 0u; j < UAV_SUBSTEPS; j++) {
        if (j == UAV_SUBSTEPS - 1u) {
            q[PFL_AUTOPILOT_X * N + PFL_AUTOPILOT_X] = gust * gust;
            q[PFL_AUTOPILOT_Y * N + PFL_AUTOPILOT_Y] = gust * gust;
            q[WIND * N + WIND] = walk * walk;
            q[(WIND + 1) * N + WIND + 1] = walk * walk;
        }
        memcpy(next, e->belief.x, sizeof next);
        uav_euler_step(&e->vehicle, &wanted, j, &e->belief.x[WIND], next, &e->waypoint);
        jacobian(e, &wanted, e->belief.x, next, f);
        kalman_predict(&e->belief, next, f, q);
    }
}

static bool update(ekf_t *e, const float *fix, failure_t *failure)
{
    const double variance = e->study->set.sigma_fix_m * e->study->set.sigma_fix_m;
    const double r[M * M] = {variance, 0.0, 0.0, 0.0, variance, 0.0, 0.0, 0.0, variance};
    double h[M * N] = {0.0};
    double z[M];

    h[0 * N + PFL_AUTOPILOT_X] = 1.0;
    h[1 * N + PFL_AUTOPILOT_Y] = 1.0;
    h[2 * N + PFL_AUTOPILOT_HEIGHT] = 1.0;
    for (int m = 0; m < M; m++) {
        z[m] = (double)fix[m];
    }
    return kalman_update(&e->belief, z, h, r, M) ||
           fail(failure, EXIT_HARNESS, "Kalman filter: an innovation without variance");
}

static uav_belief_t belief_of(const ekf_t *e)
{
    const double *p = e->belief.p;
    uav_belief_t belief = {
        .wind = {e->belief.x[WIND], e->belief.x[WIND + 1]},
        .xx = p[PFL_AUTOPILOT_X * N + PFL_AUTOPILOT_X],
        .xy = p[PFL_AUTOPILOT_X * N + PFL_AUTOPILOT_Y],
        .yy = p[PFL_AUTOPILOT_Y * N + PFL_AUTOPILOT_Y],
    };

    memcpy(belief.mean, e->belief.x, sizeof belief.mean);
    return belief;
}

static void look_ahead(const ekf_t *from, unsigned j, uav_flight_t *flight)
{
    ekf_t e = *from;
    const unsigned k = e.study->forecast_at[j];

    flight->ahead[j][0] = belief_of(&e);
    for (unsigned i = 1u; i <= e.study->ahead_s; i++) {
        predict(&e, k + i);
        flight->ahead[j][i] = belief_of(&e);
    }
}

bool uav_kalman_filter(const uav_study_t *s, const uav_track_t *track, uav_flight_t *flight, failure_t *failure)
{
    ekf_t e;

    start(s, track, &e);
    for (unsigned k = 0u; k <= s->filter_seconds; k++) {
        if (k > 0u) {
            predict(&e, k);
        }
        if (uav_has_fix(s, k) && !update(&e, track->z[k], failure)) {
            return false;
        }
        flight->at[k] = belief_of(&e);
        flight->cloud[k].std_m = sqrt((flight->at[k].xx + flight->at[k].yy) / 2.0);
        for (unsigned j = 0u; j < s->forecasts; j++) {
            if (s->forecast_at[j] == k) {
                look_ahead(&e, j, flight);
            }
        }
    }
    return true;
}
