/* This library on the work of the peers. */
#include "work.h"

#include "pflight/pflight.h"

static pfl_land_vehicle_t vehicle;
static pfl_position_t seen;
static pfl_sensor_t sensor = {.loglik = pfl_position_loglik, .user = &seen};
static pfl_config_t config;
static float start[4];
static pfl_t *filter;
static void *arena;
static uint64_t step_us, t_us;

static void draw(void *user, const pfl_batch_t *p)
{
    (void)user;
    for (uint32_t d = 0; d < 4u; d++) {
        for (uint32_t i = 0; i < p->n; i++) {
            PFL_STATE(p, d)[i] = start[d];
        }
    }
}

void peer_start(const work_t *w, unsigned n, unsigned seed)
{
    memset(&config, 0, sizeof config);
    vehicle = (pfl_land_vehicle_t){.power_w = (float)w->power,
                                   .drag_area_m2 = (float)w->drag_area,
                                   .mass_kg = (float)w->mass,
                                   .wheelbase_m = (float)w->wheelbase,
                                   .speed_min_mps = (float)w->speed_min,
                                   .sigma_position_mps = (float)w->sigma_position};
    seen.count = 3u;
    for (uint16_t k = 0; k < 3u; k++) {
        seen.state[k] = k;
        seen.inv_sigma[k] = (float)(1.0 / w->sigma_seen);
    }
    for (int d = 0; d < 4; d++) {
        start[d] = (float)w->start[d];
    }
    config.abi = PFL_ABI;
    config.particles = n;
    config.states = 4u;
    config.noises = 2u;
    config.sensor_count = 1u;
    config.moments = PFL_MOMENTS_MEAN;
    config.ess_ratio = 0.5f;
    config.seed = seed;
    config.sensors = &sensor;
    config.predict = pfl_land_vehicle_predict;
    config.draw = draw;
    config.user = &vehicle;
    t_us = 0;
    step_us = (uint64_t)(w->dt * 1e6 + 0.5);
    free(arena);
    const size_t bytes = pfl_arena_bytes(&config);
    arena = malloc(bytes);
    if (arena == NULL || pfl_init(arena, bytes, &config, 0u, &filter) != PFL_OK) {
        exit(3);
    }
}

void peer_cycle(double throttle, double steer, const double *z, double *mean)
{
    const pfl_land_input_t u = {(float)throttle, (float)steer};
    const float measured[3] = {(float)z[0], (float)z[1], (float)z[2]};
    float x[4];
    t_us += step_us;
    if (pfl_predict(filter, t_us, &u) != PFL_OK || pfl_update(filter, 0u, t_us, measured) != PFL_OK ||
        pfl_estimate(filter, x, NULL) != PFL_OK) {
        exit(3);
    }
    for (int d = 0; d < 4; d++) {
        mean[d] = (double)x[d];
    }
}

unsigned peer_resampled(void)
{
    pfl_health_t health;
    return (pfl_health(filter, &health) == PFL_OK) ? health.resampled : 0u;
}
