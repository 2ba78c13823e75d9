/* The particle filter on the document's model: constant velocity without noise, particles moved apart by the kernel
 * step alone; and the same on the coloured model, with each particle's own position before. */
#include "gps.h"

#include <math.h>

#define KERNEL_WIDTH 0.5f

/* N(x0, P0) on each axis. */
static void draw(void *user, const pfl_batch_t *p)
{
    const gps_particles_t *particles = (const gps_particles_t *)user;
    const uint32_t axes = (uint32_t)particles->study->axes;

    for (uint32_t a = 0u; a < axes; a++) {
        const gaussian_t belief = gps_axis_start(particles->study, false, 0.0, (int)a).belief;
        for (uint32_t s = 0u; s < 2u; s++) {
            const uint32_t d = s * axes + a;
            const float mean = (float)belief.x[s];
            const float sigma = (float)sqrt(belief.p[3u * s]);
            for (uint32_t i = 0u; i < p->n; i++) {
                PFL_STATE(p, d)[i] = mean + sigma * PFL_NOISE(p, d)[i];
            }
        }
        for (uint32_t i = 0u; particles->coloured && i < p->n; i++) {
            PFL_STATE(p, 2u * axes + a)[i] = PFL_STATE(p, a)[i];
        }
    }
}

static void set_sensors(gps_particles_t *particles)
{
    const gps_study_t *study = particles->study;
    const uint16_t axes = (uint16_t)study->axes;
    const float inv_noise = (float)(1.0 / study->noise_m);

    particles->position.count = axes;
    particles->difference.count = axes;
    particles->difference.decay = (float)study->decay;
    particles->velocity_axes.count = axes;
    for (uint16_t a = 0u; a < axes; a++) {
        particles->position.state[a] = a;
        particles->position.inv_sigma[a] = particles->coloured ? inv_noise : (float)(1.0 / sqrt(study->r_m2));
        particles->difference.state[a] = a;
        particles->difference.before[a] = (uint16_t)(2u * axes + a);
        particles->difference.inv_sigma[a] = inv_noise;
        particles->velocity_axes.state[a] = (uint16_t)(axes + a);
        particles->velocity_axes.inv_sigma[a] = (float)(1.0 / GPS_VELOCITY_SIGMA);
    }
    particles->sensor[0] = (pfl_sensor_t){.loglik = pfl_position_loglik, .user = &particles->position};
    particles->sensor[1] = (pfl_sensor_t){.loglik = pfl_coloured_loglik, .user = &particles->difference};
    particles->sensor[2] = (pfl_sensor_t){.loglik = pfl_position_loglik, .user = &particles->velocity_axes};
}

void gps_particles_line(gps_particles_t *particles, pfl_config_t *config)
{
    const uint16_t axes = (uint16_t)particles->study->axes;

    particles->motion.coast = (pfl_coast_t){.axes = axes, .remember = particles->coloured ? 1u : 0u};
    /* The position before is left to the model, which writes it before anyone reads it. */
    particles->kernel =
        (pfl_kernel_t){.move = pfl_kernel_move, .width = KERNEL_WIDTH, .states_mask = (1u << (2u * axes)) - 1u};
    set_sensors(particles);
    config->states = (uint16_t)(axes * (particles->coloured ? 3u : 2u));
    config->noises = 0u;
    config->moments = PFL_MOMENTS_FULL;
    config->predict = pfl_coast_predict;
    config->draw = draw;
}
