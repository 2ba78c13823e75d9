/* The world of `standoff` in double: the target on its road, what the UAVs see of it, and how they fly. */
#include "host_random.h"
#include "standoff.h"

#include <math.h>
#include <string.h>

#define PI 3.14159265358979323846
#define SWAY_M 1.0 /* of the target around the center line */
#define SWAY_PERIOD_S 20.0
#define LAG_S (1.0 / 3.0)
#define PIECES 10 /* of a step of the plant with exact lags */

static const double prior_sigma[TARGET_STATES] = {10.0, 10.0, 3.0, 3.0};

/* The target's speed along the road: start, noise of its acceleration, limits. */
typedef struct {
    double start_mps, noise_mps2, slowest_mps, fastest_mps;
} driving_t;

static const driving_t paper_driving = {4.0, 1.0, 1.5, 6.5};
static const driving_t calm_driving = {5.0, 0.25, 2.5, 7.5};

static void make_target(const driving_t *driving, host_random_t *random, standoff_track_t *track)
{
    const double rate = 2.0 * PI / SWAY_PERIOD_S;
    const double phase = 2.0 * PI * host_random_uniform(random);
    double speed = driving->start_mps;
    double arc = 0.0;

    for (unsigned k = 0u; k <= STANDOFF_STEPS; k++) {
        const double sway = rate * (double)k * STANDOFF_PERIOD_S + phase;
        const double rho = ROAD_CENTER_LINE_M + SWAY_M * sin(sway);
        const double outwards = SWAY_M * rate * cos(sway);
        const double along = speed * rho / ROAD_CENTER_LINE_M;
        const double c = cos(arc / ROAD_CENTER_LINE_M);
        const double s = sin(arc / ROAD_CENTER_LINE_M);
        track->target[k][TARGET_X] = rho * c;
        track->target[k][TARGET_Y] = rho * s;
        track->target[k][TARGET_VX] = outwards * c - along * s;
        track->target[k][TARGET_VY] = outwards * s + along * c;
        const double before = speed;
        speed += STANDOFF_PERIOD_S * driving->noise_mps2 * host_random_normal(random);
        speed = fmin(fmax(speed, driving->slowest_mps), driving->fastest_mps);
        arc += 0.5 * STANDOFF_PERIOD_S * (before + speed);
    }
}

void standoff_make_track(const standoff_study_t *s, uint32_t run, standoff_track_t *track)
{
    host_random_t random;

    memset(track, 0, sizeof *track);
    host_random_start(&random, s->seed, run, RANDOM_TRUTH);
    make_target(s->calm ? &calm_driving : &paper_driving, &random, track);
    host_random_start(&random, s->seed, run, RANDOM_MEASUREMENT);
    for (int d = 0; d < TARGET_STATES; d++) {
        track->prior[d] = track->target[0][d] + prior_sigma[d] * host_random_normal(&random);
    }
    /* Both UAVs' and all steps', whether used or not: every filter sees the same ones. */
    for (unsigned k = 1u; k <= STANDOFF_STEPS; k++) {
        for (unsigned i = 0u; i < STANDOFF_UAVS; i++) {
            track->noise[k][i][0] = host_random_normal(&random);
            track->noise[k][i][1] = host_random_normal(&random);
        }
    }
}

/* 20 s < t <= 30 s and 45 s < t <= 55 s, in steps. */
bool standoff_is_out(unsigned k)
{
    return (k > 40u && k <= 60u) || (k > 90u && k <= 110u);
}

void standoff_start_uav(const standoff_track_t *track, unsigned index, standoff_uav_t *uav)
{
    const double angle = PI * (double)index;

    uav->x_m = track->target[0][TARGET_X] + STANDOFF_MIN_M * cos(angle);
    uav->y_m = track->target[0][TARGET_Y] + STANDOFF_MIN_M * sin(angle);
    uav->heading_rad = angle + 0.5 * PI;
    uav->speed_mps = UAV_CRUISE_MPS;
    uav->turn_radps = UAV_CRUISE_MPS / STANDOFF_MIN_M;
}

double standoff_lag_share(bool euler)
{
    return euler ? STANDOFF_PERIOD_S / LAG_S : 1.0 - exp(-STANDOFF_PERIOD_S / LAG_S);
}

static void move_exactly(double speed_command, double turn_command, standoff_uav_t *uav)
{
    const double h = STANDOFF_PERIOD_S / (double)PIECES;
    const double keep = exp(-h / LAG_S);

    for (int i = 0; i < PIECES; i++) {
        const double speed = speed_command + (uav->speed_mps - speed_command) * keep;
        const double turn = turn_command + (uav->turn_radps - turn_command) * keep;
        const double way = h * 0.5 * (uav->speed_mps + speed);
        const double turned = h * 0.5 * (uav->turn_radps + turn);
        uav->x_m += way * cos(uav->heading_rad + 0.5 * turned);
        uav->y_m += way * sin(uav->heading_rad + 0.5 * turned);
        uav->heading_rad += turned;
        uav->speed_mps = speed;
        uav->turn_radps = turn;
    }
}

void standoff_move_uav(bool euler, double speed_command, double turn_command, standoff_uav_t *uav)
{
    if (!euler) {
        move_exactly(speed_command, turn_command, uav);
        return;
    }
    const double share = standoff_lag_share(true);
    uav->x_m += STANDOFF_PERIOD_S * uav->speed_mps * cos(uav->heading_rad);
    uav->y_m += STANDOFF_PERIOD_S * uav->speed_mps * sin(uav->heading_rad);
    uav->heading_rad += STANDOFF_PERIOD_S * uav->turn_radps;
    uav->speed_mps += share * (speed_command - uav->speed_mps);
    uav->turn_radps += share * (turn_command - uav->turn_radps);
}

standoff_sight_t standoff_see(const standoff_track_t *track, unsigned k, unsigned index, const standoff_uav_t *uav)
{
    const double dx = track->target[k][TARGET_X] - uav->x_m;
    const double dy = track->target[k][TARGET_Y] - uav->y_m;

    return (standoff_sight_t){
        uav->x_m,
        uav->y_m,
        hypot(dx, dy) + SENSOR_RANGE_SIGMA_M * track->noise[k][index][0],
        atan2(dy, dx) + SENSOR_BEARING_SIGMA_RAD * track->noise[k][index][1],
        true,
    };
}
