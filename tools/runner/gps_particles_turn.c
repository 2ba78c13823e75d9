/* The particle filter on the path with turns: the turn model, whose own noise keeps the particles apart, with GPS as if
 * it were white, GPS by differences, or radar. */
#include "gps.h"

#include <math.h>

#define KERNEL_WIDTH 0.5f

/* Around the measured start; with a radar, around its first measurement. */
static void draw(void *user, const pfl_batch_t *p)
{
    const gps_particles_t *particles = (const gps_particles_t *)user;
    const gps_study_t *study = particles->study;
    const gps_track_t *track = particles->track;

    for (uint32_t d = 0u; d < PFL_TURN_STATES; d++) {
        const float mean = (float)track->start[d];
        const float sigma = (float)track->start_sigma[d];
        for (uint32_t i = 0u; i < p->n; i++) {
            PFL_STATE(p, d)[i] = mean + sigma * PFL_NOISE(p, d)[i];
        }
    }
    for (uint32_t i = 0u; gps_is_radar(study) && i < p->n; i++) {
        const double range = track->range[0] + study->sigma_range * (double)PFL_NOISE(p, 0)[i];
        const double azimuth = track->azimuth[0] + study->sigma_azimuth * (double)PFL_NOISE(p, 1)[i];
        float s;
        float c;
        pfl_sincosf((float)azimuth, &s, &c);
        PFL_STATE(p, PFL_TURN_X)[i] = (float)range * c;
        PFL_STATE(p, PFL_TURN_Y)[i] = (float)range * s;
    }
    for (uint32_t i = 0u; particles->coloured && i < p->n; i++) {
        PFL_STATE(p, PFL_TURN_BEFORE_X)[i] = PFL_STATE(p, PFL_TURN_X)[i];
        PFL_STATE(p, PFL_TURN_BEFORE_Y)[i] = PFL_STATE(p, PFL_TURN_Y)[i];
    }
}

static void set_sensors(gps_particles_t *particles)
{
    const gps_study_t *study = particles->study;
    const float inv_noise = (float)(1.0 / study->noise_m);
    const float inv_position = particles->coloured ? inv_noise : (float)(1.0 / sqrt(study->r_m2));

    particles->position =
        (pfl_position_t){2u, {PFL_TURN_X, PFL_TURN_Y, 0u, 0u}, {inv_position, inv_position, 0.0f, 0.0f}};
    particles->difference = (pfl_coloured_t){
        .count = 2u,
        .state = {PFL_TURN_X, PFL_TURN_Y, 0u, 0u},
        .before = {PFL_TURN_BEFORE_X, PFL_TURN_BEFORE_Y, 0u, 0u},
        .decay = (float)study->decay,
        .inv_sigma = {inv_noise, inv_noise, 0.0f, 0.0f},
    };
    particles->velocity_polar = (pfl_velocity_t){PFL_TURN_SPEED, PFL_TURN_HEADING, (float)(1.0 / GPS_VELOCITY_SIGMA)};
    particles->sensor[0] = (pfl_sensor_t){.loglik = pfl_position_loglik, .user = &particles->position};
    particles->sensor[1] = (pfl_sensor_t){.loglik = pfl_coloured_loglik, .user = &particles->difference};
    particles->sensor[2] = (pfl_sensor_t){.loglik = pfl_velocity_loglik, .user = &particles->velocity_polar};
    if (gps_is_radar(study)) {
        particles->radar = (pfl_range_bearing_t){PFL_TURN_X, PFL_TURN_Y, (float)(1.0 / study->sigma_range),
                                                 (float)(1.0 / study->sigma_azimuth)};
        particles->sensor[0] = (pfl_sensor_t){.loglik = pfl_range_bearing_loglik, .user = &particles->radar};
    }
}

void gps_particles_turn(gps_particles_t *particles, pfl_config_t *config)
{
    particles->motion.turn = (pfl_turn_t){
        .sigma_speed = (float)GPS_TURN_SIGMA_SPEED,
        .sigma_rate = (float)GPS_TURN_SIGMA_RATE,
        .redraw_hz = (float)GPS_TURN_REDRAW_HZ,
        .redraw_sigma = (float)GPS_TURN_REDRAW_SIGMA,
        .remember = particles->coloured ? 1u : 0u,
    };
    particles->kernel =
        (pfl_kernel_t){.move = pfl_kernel_move, .width = KERNEL_WIDTH, .states_mask = (1u << PFL_TURN_STATES) - 1u};
    set_sensors(particles);
    config->states = particles->coloured ? PFL_TURN_REMEMBER_STATES : PFL_TURN_STATES;
    config->noises = 4u;
    config->circular_mask = 1u << PFL_TURN_HEADING;
    config->circular = pfl_circular_means;
    config->moments = (uint16_t)(particles->study->kernel ? PFL_MOMENTS_FULL : PFL_MOMENTS_MEAN);
    config->predict = pfl_turn_predict;
    config->draw = draw;
}
