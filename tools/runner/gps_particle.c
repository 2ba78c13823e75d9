/* pflight in the scenario `gps`: the loop that a flight computer would run, for whatever gps_particles_line and
 * gps_particles_turn configured. */
#include "cloud.h"
#include "gps.h"
#include "host_filter.h"
#include "host_random.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SENSOR_POSITION, SENSOR_DIFFERENCE, SENSOR_VELOCITY };

/* A status below zero is an error; gate and budget are off, so there are no refusals. */
static bool check(pfl_status_t status, const char *call, unsigned k, failure_t *failure)
{
    return status >= 0 || fail(failure, EXIT_HARNESS, "step %u: %s: %s", k, call, pfl_status_string(status));
}

static pfl_config_t make_config(gps_particles_t *p, uint32_t run)
{
    const gps_study_t *study = p->study;
    host_random_t random;

    host_random_start(&random, study->seed, run, RANDOM_FILTER_SEED);
    pfl_config_t config = {
        .abi = PFL_ABI,
        .particles = study->particles,
        .sensor_count = GPS_SENSORS,
        .ess_ratio = 0.5f,
        .seed = host_random_u64(&random),
        .sensors = p->sensor,
        .kernel = study->kernel ? &p->kernel : NULL,
        .user = p,
    };
    if (study->variant == GPS_LINE) {
        gps_particles_line(p, &config);
    } else {
        gps_particles_turn(p, &config);
    }
    return config;
}

static void narrow(const double *wide, int n, float *out)
{
    for (int a = 0; a < n; a++) {
        out[a] = (float)wide[a];
    }
}

static bool update_difference(pfl_t *filter, const gps_track_t *track, int axes, unsigned k, failure_t *failure)
{
    pfl_coloured_z_t z;

    narrow(track->gps[k], axes, z.now);
    narrow(track->gps[k - 1u], axes, z.before);
    return check(pfl_update(filter, SENSOR_DIFFERENCE, (uint64_t)k * GPS_PERIOD_US, &z), "pfl_update", k, failure);
}

static bool update_direct(const gps_particles_t *p, pfl_t *filter, unsigned k, failure_t *failure)
{
    const gps_track_t *track = p->track;
    const pfl_range_bearing_z_t radar = {0.0f, 0.0f, (float)track->range[k], (float)track->azimuth[k]};
    float position[GPS_AXES_MAX];
    const void *z = gps_is_radar(p->study) ? (const void *)&radar : (const void *)position;

    narrow(track->gps[k], GPS_AXES_MAX, position);
    return check(pfl_update(filter, SENSOR_POSITION, (uint64_t)k * GPS_PERIOD_US, z), "pfl_update", k, failure);
}

/* All measurements of sample k. The coloured filter begins with sample 0, the others with 1. */
static bool update(const gps_particles_t *p, pfl_t *filter, unsigned k, failure_t *failure)
{
    float velocity[GPS_AXES_MAX];

    if (k == 0u && !p->coloured) {
        return true;
    }
    const bool fused = p->coloured && k > 0u ? update_difference(filter, p->track, p->study->axes, k, failure)
                                             : update_direct(p, filter, k, failure);
    if (!fused || !p->study->velocity) {
        return fused;
    }
    narrow(p->track->gps_velocity[k], GPS_AXES_MAX, velocity);
    return check(pfl_update(filter, SENSOR_VELOCITY, (uint64_t)k * GPS_PERIOD_US, velocity), "pfl_update", k, failure);
}

static void keep_line(const gps_particles_t *p, unsigned k, uint32_t states, const float *mean, const float *cov,
                      gps_estimate_t *estimate)
{
    const uint32_t axes = (uint32_t)p->study->axes;

    for (uint32_t a = 0u; a < axes; a++) {
        const uint32_t v = axes + a;
        const double error[2] = {(double)mean[a] - p->track->position[k][a],
                                 (double)mean[v] - p->track->velocity[k][a]};
        estimate->position[k][a] = (double)mean[a];
        estimate->velocity[k][a] = (double)mean[v];
        estimate->nees[k] +=
            gps_nees(error, (double)cov[a * states + a], (double)cov[a * states + v], (double)cov[v * states + v]) /
            (double)axes;
    }
    estimate->sigma[k] = sqrt((double)cov[0]);
}

static void keep_turn(unsigned k, const float *mean, gps_estimate_t *estimate)
{
    const double v = (double)mean[PFL_TURN_SPEED];

    estimate->position[k][0] = (double)mean[PFL_TURN_X];
    estimate->position[k][1] = (double)mean[PFL_TURN_Y];
    estimate->velocity[k][0] = v * cos((double)mean[PFL_TURN_HEADING]);
    estimate->velocity[k][1] = v * sin((double)mean[PFL_TURN_HEADING]);
}

/* On a line of one axis its speed stands across it. */
static void show(const gps_particles_t *p, unsigned k, const float *mean, const pfl_t *filter, look_t *look)
{
    const bool plane = p->study->axes > 1;
    const gps_track_t *track = p->track;
    const look_at_t at = {
        .t_s = GPS_PERIOD_S * (double)k,
        .state = {1u, 0u},
        .axis = {plane ? "east [m]" : "speed [m/s]", "north [m]"},
        .truth = {plane ? track->position[k][1] : track->velocity[k][0], track->position[k][0]},
        .estimate = {(double)mean[1], (double)mean[0]},
    };

    look_take(look, filter, &at);
}

static bool fly(const gps_particles_t *p, const pfl_config_t *config, pfl_t *filter, gps_estimate_t *estimate,
                look_t *look, failure_t *failure)
{
    const bool line = p->study->variant == GPS_LINE;
    float mean[PFL_STATES_MAX];
    float cov[PFL_STATES_MAX * PFL_STATES_MAX];
    pfl_health_t health;

    for (unsigned k = 0u; k <= p->study->steps; k++) {
        if (!check(pfl_predict(filter, (uint64_t)k * GPS_PERIOD_US, NULL), "pfl_predict", k, failure) ||
            !update(p, filter, k, failure) ||
            !check(pfl_estimate(filter, mean, line ? cov : NULL), "pfl_estimate", k, failure) ||
            !check(pfl_health(filter, &health), "pfl_health", k, failure)) {
            return false;
        }
        if (line) {
            keep_line(p, k, config->states, mean, cov, estimate);
        } else {
            keep_turn(k, mean, estimate);
        }
        if (k > 0u) {
            estimate->cycles_ns[k - 1u] = cycle_ns(health.cycles_last);
            estimate->cycle[k - 1u] = cycle_of(&health);
        }
        show(p, k, mean, filter, look);
    }
    return true;
}

bool gps_particle_filter(const gps_study_t *study, bool coloured, uint32_t run, const gps_track_t *track,
                         gps_estimate_t *estimate, look_t *look, failure_t *failure)
{
    gps_particles_t particles;

    memset(&particles, 0, sizeof particles);
    memset(estimate, 0, sizeof *estimate);
    particles.study = study;
    particles.track = track;
    particles.coloured = coloured;
    const pfl_config_t config = make_config(&particles, run);
    void *arena;
    pfl_t *filter = host_filter(&config, &arena, failure);
    const bool flown = filter != NULL && fly(&particles, &config, filter, estimate, look, failure);
    free(arena);
    return flown;
}
