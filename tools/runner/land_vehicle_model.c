/* The land vehicle's world in double: model, route, truth and measurements, as its scenario page has them. */
#include "host_random.h"
#include "land_vehicle.h"

#include <math.h>
#include <string.h>

/* The paper's constants. The truth uses them in double, the filter rounded to float. */
#define POWER_W 100000.0
#define DRAG_AREA_M2 0.3 /* A = 1 m2 times Cd = 0.3 */
#define MASS_KG 1250.0
#define WHEELBASE_M 2.5
#define THROTTLE 0.03
#define SPEED_MIN_MPS 0.5 /* guards the division; also clips the uncertain start */

const pfl_land_vehicle_t land_vehicle_constants = {
    .power_w = (float)POWER_W,
    .drag_area_m2 = (float)DRAG_AREA_M2,
    .mass_kg = (float)MASS_KG,
    .wheelbase_m = (float)WHEELBASE_M,
    .speed_min_mps = (float)SPEED_MIN_MPS,
};

const double land_start[PFL_LAND_STATES] = {0.0, 0.0, 4.0, 2.5};
const double land_start_sigma[PFL_LAND_STATES] = {5.0, 5.0, 1.0, 0.5};

static double steer_rad(unsigned k)
{
    if (k < 45u) {
        return -0.05;
    }
    if (k < 65u) {
        return -0.005;
    }
    return k < 80u ? 0.01 : -0.01;
}

pfl_land_input_t land_input(unsigned k)
{
    return (pfl_land_input_t){(float)THROTTLE, (float)steer_rad(k)};
}

void land_move(unsigned k, const double *x, double *next)
{
    const double t = LAND_PERIOD_S;
    const double v = x[PFL_LAND_SPEED];
    const double heading = x[PFL_LAND_HEADING];
    const double push = POWER_W * THROTTLE / fmax(v, SPEED_MIN_MPS);

    next[PFL_LAND_EAST] = x[PFL_LAND_EAST] + t * v * cos(heading);
    next[PFL_LAND_NORTH] = x[PFL_LAND_NORTH] + t * v * sin(heading);
    next[PFL_LAND_SPEED] = v + t * (push - DRAG_AREA_M2 * v * v) / MASS_KG;
    next[PFL_LAND_HEADING] = heading + t * v * tan(steer_rad(k)) / WHEELBASE_M;
}

void land_jacobian(unsigned k, const double *x, double *jacobian)
{
    const double t = LAND_PERIOD_S;
    const double v = x[PFL_LAND_SPEED];
    const double heading = x[PFL_LAND_HEADING];
    const double push_slope = v > SPEED_MIN_MPS ? -POWER_W * THROTTLE / (v * v) : 0.0;
    const double f[PFL_LAND_STATES][PFL_LAND_STATES] = {
        {1.0, 0.0, t * cos(heading), -t * v * sin(heading)},
        {0.0, 1.0, t * sin(heading), t * v * cos(heading)},
        {0.0, 0.0, 1.0 + t * (push_slope - 2.0 * DRAG_AREA_M2 * v) / MASS_KG, 0.0},
        {0.0, 0.0, t * tan(steer_rad(k)) / WHEELBASE_M, 1.0},
    };

    memcpy(jacobian, f, sizeof f);
}

double land_clip_start_speed(double speed_mps)
{
    return fmax(speed_mps, SPEED_MIN_MPS);
}

static void make_truth(const land_study_t *study, host_random_t *random, land_track_t *track)
{
    const double spread = LAND_PERIOD_S * sqrt(study->w_variance);

    memcpy(track->truth[0], land_start, sizeof land_start);
    if (study->uncertain) {
        for (int d = 0; d < PFL_LAND_STATES; d++) {
            track->truth[0][d] += land_start_sigma[d] * host_random_normal(random);
        }
        track->truth[0][PFL_LAND_SPEED] = land_clip_start_speed(track->truth[0][PFL_LAND_SPEED]);
    }
    for (unsigned k = 0u; k < LAND_STEPS; k++) {
        land_move(k, track->truth[k], track->truth[k + 1u]);
        track->truth[k + 1u][PFL_LAND_EAST] += spread * host_random_normal(random);
        track->truth[k + 1u][PFL_LAND_NORTH] += spread * host_random_normal(random);
    }
}

void land_make_track(const land_study_t *study, uint32_t run, land_track_t *track)
{
    const double noise = sqrt(study->z_variance);
    host_random_t random;

    memset(track, 0, sizeof *track);
    host_random_start(&random, study->seed, run, RANDOM_TRUTH);
    make_truth(study, &random, track);
    host_random_start(&random, study->seed, run, RANDOM_MEASUREMENT);
    for (unsigned k = 1u; k <= LAND_STEPS; k++) {
        for (int m = 0; m < LAND_MEASURED; m++) {
            track->z[k][m] = (float)(track->truth[k][m] + noise * host_random_normal(&random));
        }
    }
}
