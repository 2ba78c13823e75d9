/* The world of the scenario `gps` in double: the straight line and the path with turns, the receiver with its coloured
 * error, and the radar. Every draw is made in every study, so that a run has the same dice whatever the settings. */
#include "gps.h"
#include "gps_geodesy.h"
#include "host_random.h"

#include <math.h>
#include <string.h>

#define TWO_PI 6.283185307179586476925

static const geodetic_t origin = {42.2825, -71.343, 53.0352};

/* The path with turns, phase by phase. */
#define TURN_BEGIN_K 100u
#define TURN_END_K 300u
#define TURN_RADPS 0.2
#define ACCELERATION_MPS2 0.1
#define PATH_SPEED_MPS 2.0

bool gps_is_radar(const gps_study_t *study)
{
    return study->variant == GPS_RADAR || study->variant == GPS_RADAR_COARSE;
}

double gps_wrap(double angle_rad)
{
    return remainder(angle_rad, TWO_PI);
}

double gps_colour(double decay, double before, double innovation)
{
    return decay * before + innovation;
}

/* ---- Truth --------------------------------------------------------------------------------------------------------- */

static void make_line(const gps_study_t *study, host_random_t *random, gps_track_t *track)
{
    const double p_draw = host_random_normal(random);
    const double v_draw = host_random_normal(random);
    double p0 = 0.0;
    double v0 = 1.0;

    if (study->drawn) {
        const gps_axis_t prior = gps_axis_start(study, false, 0.0, 0);
        p0 = prior.belief.x[GPS_P] + sqrt(prior.belief.p[0]) * p_draw;
        v0 = prior.belief.x[GPS_V] + sqrt(prior.belief.p[3]) * v_draw;
    }
    for (unsigned k = 0u; k <= study->steps; k++) {
        track->position[k][0] = p0 + GPS_PERIOD_S * (double)k * v0;
        track->position[k][2] = -5.0;
        track->velocity[k][0] = v0;
    }
}

/* Order of the states: pfl_turn_predict's, of which this is the noise-free twin. */
static void make_path(const gps_study_t *study, gps_track_t *track)
{
    const double t = GPS_PERIOD_S;
    const bool radar = gps_is_radar(study);
    double n = radar ? -30.0 : 0.0;
    double e = radar ? -12.0 : 0.0;
    double v = PATH_SPEED_MPS;
    double psi = radar ? 0.3 : 0.0;

    for (unsigned k = 0u; k <= study->steps; k++) {
        const double omega = k >= TURN_BEGIN_K && k < TURN_END_K ? TURN_RADPS : 0.0;
        track->position[k][0] = n;
        track->position[k][1] = e;
        track->velocity[k][0] = v * cos(psi);
        track->velocity[k][1] = v * sin(psi);
        n += t * v * cos(psi + 0.5 * t * omega);
        e += t * v * sin(psi + 0.5 * t * omega);
        v += k >= TURN_END_K ? t * ACCELERATION_MPS2 : 0.0;
        psi += t * omega;
    }
}

/* ---- Measurements --------------------------------------------------------------------------------------------------- */

/* The receiver gives latitude, longitude and altitude; the filters work in metres about the origin. */
static void make_gps(const gps_study_t *study, host_random_t *random, gps_track_t *track)
{
    const flat_earth_t earth = flat_earth_at(origin);
    double error[GPS_AXES_MAX] = {0.0, 0.0, 0.0};

    for (unsigned k = 0u; k <= study->steps; k++) {
        double ned[GPS_AXES_MAX];
        for (int a = 0; a < GPS_AXES_MAX; a++) {
            error[a] = gps_colour(study->decay, error[a], study->noise_m * host_random_normal(random));
            ned[a] = track->position[k][a] + error[a];
        }
        flat_earth_to_ned(&earth, flat_earth_from_ned(&earth, ned), track->gps[k]);
        for (int a = 0; a < GPS_AXES_MAX; a++) {
            track->gps_velocity[k][a] = track->velocity[k][a] + GPS_VELOCITY_SIGMA * host_random_normal(random);
        }
    }
}

static void make_radar(const gps_study_t *study, host_random_t *random, gps_track_t *track)
{
    for (unsigned k = 0u; k <= study->steps; k++) {
        const double *p = track->position[k];
        track->range[k] = hypot(p[0], p[1]) + study->sigma_range * host_random_normal(random);
        track->azimuth[k] = gps_wrap(atan2(p[1], p[0]) + study->sigma_azimuth * host_random_normal(random));
        track->gps[k][0] = track->range[k] * cos(track->azimuth[k]);
        track->gps[k][1] = track->range[k] * sin(track->azimuth[k]);
    }
}

/* What a filter with the turn model knows at first. GPS: a measured state, with errors as large as it says. Radar: the
 * first measurement, which the filters take from the track themselves, a fair guess at the speed and a measured
 * heading. */
static void make_start(const gps_study_t *study, host_random_t *random, gps_track_t *track)
{
    static const double sigma_gps[PFL_TURN_STATES] = {1.0, 1.0, 0.5, 0.3, 0.05};
    const bool radar = gps_is_radar(study);
    const double truth[PFL_TURN_STATES] = {track->position[0][0], track->position[0][1], PATH_SPEED_MPS,
                                           radar ? 0.3 : 0.0, 0.0};

    memcpy(track->start_sigma, sigma_gps, sizeof sigma_gps);
    for (int d = 0; d < PFL_TURN_STATES; d++) {
        const double draw = host_random_normal(random);
        if (radar && d == PFL_TURN_HEADING) {
            track->start_sigma[d] = study->sigma_heading;
        }
        const bool off = !radar || d == PFL_TURN_HEADING;
        track->start[d] = truth[d] + (off ? track->start_sigma[d] * draw : 0.0);
    }
}

void gps_make_track(const gps_study_t *study, uint32_t run, gps_track_t *track)
{
    host_random_t random;

    memset(track, 0, sizeof *track);
    host_random_start(&random, study->seed, run, RANDOM_TRUTH);
    if (study->variant == GPS_LINE) {
        make_line(study, &random, track);
    } else {
        make_path(study, track);
        make_start(study, &random, track);
    }
    host_random_start(&random, study->seed, run, RANDOM_MEASUREMENT);
    if (gps_is_radar(study)) {
        make_radar(study, &random, track);
    } else {
        make_gps(study, &random, track);
    }
}
