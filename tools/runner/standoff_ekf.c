/* The yardstick of `standoff`: an extended Kalman filter in the coordinates of the road. */
#include "kalman.h"
#include "standoff.h"

#include <math.h>
#include <string.h>

#define OFFSET_SIGMA_M 0.7
#define OFFSET_KEPT 0.9
#define REACH_SIGMAS 3.0

enum { ARC = 0, SPEED = 1, OFFSET = 2, N = 3, M = 2 };

static double wrapped(double angle)
{
    return remainder(angle, 6.283185307179586476925);
}

void standoff_ekf_start(const standoff_study_t *s, const double *prior, standoff_ekf_t *ekf)
{
    const double angle = atan2(prior[TARGET_Y], prior[TARGET_X]);

    memset(ekf, 0, sizeof *ekf);
    ekf->sigma_along = s->sigma_along;
    ekf->belief.n = N;
    ekf->belief.x[ARC] = ROAD_CENTER_LINE_M * angle;
    ekf->belief.x[SPEED] = prior[TARGET_VY] * cos(angle) - prior[TARGET_VX] * sin(angle);
    ekf->belief.p[ARC * N + ARC] = 10.0 * 10.0;
    ekf->belief.p[SPEED * N + SPEED] = 3.0 * 3.0;
    ekf->belief.p[OFFSET * N + OFFSET] = OFFSET_SIGMA_M * OFFSET_SIGMA_M;
}

static void predict(standoff_ekf_t *ekf)
{
    static const double f[N * N] = {1.0, STANDOFF_PERIOD_S, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, OFFSET_KEPT};
    const double way = 0.5 * STANDOFF_PERIOD_S * STANDOFF_PERIOD_S * ekf->sigma_along;
    const double kick = STANDOFF_PERIOD_S * ekf->sigma_along;
    const double q[N * N] = {
        way * way,  way * kick,  0.0, /* arc */
        way * kick, kick * kick, 0.0, /* speed */
        0.0,        0.0,         OFFSET_SIGMA_M * OFFSET_SIGMA_M * (1.0 - OFFSET_KEPT * OFFSET_KEPT),
    };
    double next[N];

    matrix_multiply(f, ekf->belief.x, next, N, N, 1);
    kalman_predict(&ekf->belief, next, f, q);
}

/* One UAV's range and bearing. The Kalman update wants z = h x: it gets the innovation plus h x. */
static bool update(const standoff_sight_t *sight, standoff_ekf_t *ekf)
{
    static const double r[M * M] = {SENSOR_RANGE_SIGMA_M * SENSOR_RANGE_SIGMA_M, 0.0, 0.0,
                                    SENSOR_BEARING_SIGMA_RAD * SENSOR_BEARING_SIGMA_RAD};
    const double *x = ekf->belief.x;
    const double c = cos(x[ARC] / ROAD_CENTER_LINE_M);
    const double s = sin(x[ARC] / ROAD_CENTER_LINE_M);
    const double radius = ROAD_CENTER_LINE_M + x[OFFSET];
    const double share = radius / ROAD_CENTER_LINE_M;
    const double dx = radius * c - sight->from_x_m;
    const double dy = radius * s - sight->from_y_m;
    const double range = fmax(hypot(dx, dy), 1e-9);
    const double over2 = 1.0 / (range * range);
    const double by_x[M] = {dx / range, -dy * over2};
    const double by_y[M] = {dy / range, dx * over2};
    double h[M * N];
    double z[M];

    for (int m = 0; m < M; m++) {
        h[m * N + ARC] = share * (by_y[m] * c - by_x[m] * s);
        h[m * N + SPEED] = 0.0;
        h[m * N + OFFSET] = by_x[m] * c + by_y[m] * s;
    }
    matrix_multiply(h, x, z, M, N, 1);
    z[0] += sight->range_m - range;
    z[1] += wrapped(sight->bearing_rad - atan2(dy, dx));
    return kalman_update(&ekf->belief, z, h, r, M);
}

bool standoff_ekf_step(const standoff_study_t *s, const standoff_sight_t *sight, standoff_ekf_t *ekf,
                       standoff_belief_t *belief)
{
    const double *x = ekf->belief.x;
    bool done = true;

    predict(ekf);
    for (unsigned i = 0u; sight != NULL && done && i < s->uavs; i++) {
        done = !sight[i].seen || update(&sight[i], ekf);
    }
    const double c = cos(x[ARC] / ROAD_CENTER_LINE_M);
    const double sine = sin(x[ARC] / ROAD_CENTER_LINE_M);
    const double offset = fmin(fmax(x[OFFSET], ROAD_INNER_M - ROAD_CENTER_LINE_M), ROAD_OUTER_M - ROAD_CENTER_LINE_M);
    const double radius = ROAD_CENTER_LINE_M + offset;
    const double along = x[SPEED] * radius / ROAD_CENTER_LINE_M;
    belief->target[TARGET_X] = radius * c;
    belief->target[TARGET_Y] = radius * sine;
    belief->target[TARGET_VX] = -along * sine;
    belief->target[TARGET_VY] = along * c;
    belief->reach_m = REACH_SIGMAS * sqrt(ekf->belief.p[ARC * N + ARC]);
    return done;
}
