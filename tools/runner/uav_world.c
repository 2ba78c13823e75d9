/* The UAV's world in double: vehicle, what its pilot asks for, wind, truth and fixes, as its scenario page has them. */
#include "uav_trajectory.h"

#include "host_random.h"

#include <math.h>
#include <string.h>

#define SPEED_MPS 20.0
#define HEIGHT_M 100.0
#define TURN_RADPS 0.1 /* of the circle, radius 200 m */
#define STEP_S (1.0 / UAV_SUBSTEPS)
#define HALF_PI 1.57079632679489661923
#define TWO_PI 6.28318530717958647692

/* The replay's truth: gusts of a first-order Gauss-Markov process, and loops slower than the filter believes. */
#define GUST_STD_MPS 0.7
#define GUST_TAU_S 10.0
#define SLOWER 0.9f

const pfl_autopilot_t uav_vehicle = {
    .alpha_speed = 0.5f,
    .alpha_heading = 1.0f,
    .alpha_height = 0.36f,
    .alpha_climb = 1.2f,
    .speed_min_mps = 15.0f,
    .speed_max_mps = 25.0f,
    .turn_max_radps = 0.4f,
    .substeps = UAV_SUBSTEPS,
};

static const pfl_waypoint_t waypoints[] = {{400.0f, 0.0f}, {400.0f, 400.0f}, {0.0f, 400.0f}, {0.0f, 0.0f}};
const pfl_route_t uav_route = {
    .waypoint = waypoints,
    .count = sizeof waypoints / sizeof waypoints[0],
    .closed = true,
    .switching = PFL_SWITCH_RADIUS,
    .reach_m = 40.0f,
};

const double uav_table_wind[UAV_WINDS][2] = {{0.0, 1.0}, {1.0, 0.0}, {-1.0, 0.0}, {0.0, -1.0}};

static bool circles(const uav_study_t *s)
{
    return s->sim != UAV_LINE && s->sim != UAV_REPLAY;
}

pfl_autopilot_input_t uav_reference(const uav_study_t *s, unsigned k)
{
    pfl_autopilot_input_t wanted = {.speed_mps = (float)SPEED_MPS, .height_m = (float)HEIGHT_M};

    if (circles(s)) { /* ahead of the tangent by what the heading loop lags */
        wanted.turn_radps = (float)TURN_RADPS;
        wanted.heading_rad = (float)(HALF_PI + TURN_RADPS * (double)k + TURN_RADPS / (double)uav_vehicle.alpha_heading);
    } else if (s->sim == UAV_REPLAY) {
        wanted.route = &uav_route;
    }
    return wanted;
}

double uav_wrap(double angle_rad)
{
    return angle_rad - TWO_PI * floor(angle_rad / TWO_PI + 0.5);
}

static double clip(double x, double lo, double hi)
{
    return fmin(fmax(x, lo), hi);
}

/* The truth's own switching, so that a defect of the library's cannot hide in the data. */
static double heading_error(const pfl_autopilot_input_t *wanted, unsigned j, const double *x, uint32_t *waypoint)
{
    const double heading = x[PFL_AUTOPILOT_HEADING];
    const pfl_route_t *route = wanted->route;

    if (route == NULL) {
        return (double)wanted->heading_rad + (double)wanted->turn_radps * STEP_S * (double)j - heading;
    }
    const pfl_waypoint_t *to = &route->waypoint[*waypoint];
    if (hypot((double)to->x_m - x[PFL_AUTOPILOT_X], (double)to->y_m - x[PFL_AUTOPILOT_Y]) < (double)route->reach_m) {
        *waypoint = (*waypoint + 1u) % route->count;
        to = &route->waypoint[*waypoint];
    }
    return uav_wrap(atan2((double)to->y_m - x[PFL_AUTOPILOT_Y], (double)to->x_m - x[PFL_AUTOPILOT_X]) - heading);
}

void uav_euler_step(const pfl_autopilot_t *vehicle, const pfl_autopilot_input_t *wanted, unsigned j, const double *wind,
                    double *x, uint32_t *waypoint)
{
    const double error = heading_error(wanted, j, x, waypoint);
    const double v = x[PFL_AUTOPILOT_SPEED];
    const double heading = x[PFL_AUTOPILOT_HEADING];
    const double height = x[PFL_AUTOPILOT_HEIGHT];
    const double climb = x[PFL_AUTOPILOT_CLIMB];
    const double turn_max = (double)vehicle->turn_max_radps;

    x[PFL_AUTOPILOT_X] += STEP_S * (v * cos(heading) + wind[0]);
    x[PFL_AUTOPILOT_Y] += STEP_S * (v * sin(heading) + wind[1]);
    x[PFL_AUTOPILOT_HEADING] += STEP_S * clip((double)vehicle->alpha_heading * error, -turn_max, turn_max);
    x[PFL_AUTOPILOT_SPEED] = clip(v + STEP_S * (double)vehicle->alpha_speed * ((double)wanted->speed_mps - v),
                                  (double)vehicle->speed_min_mps, (double)vehicle->speed_max_mps);
    x[PFL_AUTOPILOT_HEIGHT] += STEP_S * climb;
    x[PFL_AUTOPILOT_CLIMB] += STEP_S * ((double)vehicle->alpha_height * ((double)wanted->height_m - height) -
                                        (double)vehicle->alpha_climb * climb);
}

bool uav_has_fix(const uav_study_t *s, unsigned k)
{
    return s->fixes && k > 0u && k % s->set.fix_period_s == 0u;
}

/* ---- Truth ------------------------------------------------------------------------------------------------------ */

static void set_start(const uav_study_t *s, double *x)
{
    memset(x, 0, UAV_STATES * sizeof *x);
    x[PFL_AUTOPILOT_SPEED] = SPEED_MPS;
    x[PFL_AUTOPILOT_HEIGHT] = HEIGHT_M;
    if (circles(s)) {
        x[PFL_AUTOPILOT_X] = SPEED_MPS / TURN_RADPS;
        x[PFL_AUTOPILOT_HEADING] = HALF_PI;
    }
}

/* The truth that is drawn like a particle; the nominal one starts exactly and has no gust. */
static bool is_drawn(const uav_study_t *s)
{
    return s->sim == UAV_FORECAST || s->sim == UAV_WIND;
}

/* Wind of each second. */
static void make_gusts(const uav_study_t *s, host_random_t *random, double gust[][2])
{
    const double keep = exp(-1.0 / GUST_TAU_S);

    for (unsigned k = 0u; k < s->seconds; k++) {
        for (int i = 0; i < 2; i++) {
            gust[k][i] = 0.0;
            if (is_drawn(s)) {
                gust[k][i] = s->set.sigma_gust_mps * host_random_normal(random);
            } else if (s->sim == UAV_REPLAY) {
                const double fresh = GUST_STD_MPS * host_random_normal(random);
                gust[k][i] = k == 0u ? fresh : keep * gust[k - 1u][i] + sqrt(1.0 - keep * keep) * fresh;
            }
        }
    }
}

static void fly(const uav_study_t *s, const pfl_autopilot_t *vehicle, const double *wind, double gust[][2],
                double path[][UAV_STATES])
{
    uint32_t waypoint = 0u;

    for (unsigned k = 0u; k < s->seconds; k++) {
        const pfl_autopilot_input_t wanted = uav_reference(s, k);
        const double air[2] = {wind[0] + (gust != NULL ? gust[k][0] : 0.0),
                               wind[1] + (gust != NULL ? gust[k][1] : 0.0)};
        memcpy(path[k + 1u], path[k], sizeof path[k]);
        for (unsigned j = 0u; j < UAV_SUBSTEPS; j++) {
            uav_euler_step(vehicle, &wanted, j, air, path[k + 1u], &waypoint);
        }
    }
}

static void make_truth(const uav_study_t *s, host_random_t *random, uav_track_t *track)
{
    pfl_autopilot_t vehicle = uav_vehicle;
    double gust[UAV_SECONDS_MAX][2];

    if (s->sim == UAV_REPLAY) {
        vehicle.alpha_speed *= SLOWER;
        vehicle.alpha_heading *= SLOWER;
    }
    for (int i = 0; i < 2; i++) {
        track->wind[i] = s->wind_drawn ? s->wind_sigma_mps * host_random_normal(random) : s->wind[i];
    }
    set_start(s, track->nominal[0]);
    set_start(s, track->truth[0]);
    for (int d = 0; is_drawn(s) && d < UAV_STATES; d++) {
        track->truth[0][d] += s->set.start_sigma[d] * host_random_normal(random);
    }
    make_gusts(s, random, gust);
    fly(s, &uav_vehicle, track->wind, NULL, track->nominal);
    fly(s, &vehicle, track->wind, gust, track->truth);
}

void uav_make_track(const uav_study_t *s, uint32_t stream, uav_track_t *track)
{
    static const int seen[UAV_FIX] = {PFL_AUTOPILOT_X, PFL_AUTOPILOT_Y, PFL_AUTOPILOT_HEIGHT};
    host_random_t random;

    memset(track, 0, sizeof *track);
    host_random_start(&random, s->seed, stream, RANDOM_TRUTH);
    make_truth(s, &random, track);
    host_random_start(&random, s->seed, stream, RANDOM_MEASUREMENT);
    for (int d = 0; d < UAV_STATES; d++) {
        track->measured_start[d] = track->truth[0][d] + s->set.start_sigma[d] * host_random_normal(&random);
    }
    for (unsigned k = 1u; k <= s->seconds; k++) {
        for (int m = 0; m < UAV_FIX && uav_has_fix(s, k); m++) {
            track->z[k][m] = (float)(track->truth[k][seen[m]] + s->set.sigma_fix_m * host_random_normal(&random));
        }
    }
}
