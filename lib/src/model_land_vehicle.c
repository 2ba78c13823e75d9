/* The land vehicle of the tracking scenario: models.h has its equations. */
#include "pflight/models.h"

#include "math_kernels.h"

#include "pflight/math.h"

void pfl_land_vehicle_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    const pfl_land_vehicle_t *m = (const pfl_land_vehicle_t *)user;
    const pfl_land_input_t *in = (const pfl_land_input_t *)u;
    const float push = m->power_w * in->throttle * (dt_s / m->mass_kg);
    const float drag = m->drag_area_m2 * (dt_s / m->mass_kg);
    const float turn = dt_s * (pfl_tanf(in->steer_rad) / m->wheelbase_m);
    const float spread = dt_s * m->sigma_position_mps;
    const float slowest = m->speed_min_mps;
    float *restrict east = PFL_STATE(p, PFL_LAND_EAST);
    float *restrict north = PFL_STATE(p, PFL_LAND_NORTH);
    float *restrict speed = PFL_STATE(p, PFL_LAND_SPEED);
    float *restrict heading = PFL_STATE(p, PFL_LAND_HEADING);
    const float *restrict w_east = PFL_NOISE(p, 0);
    const float *restrict w_north = PFL_NOISE(p, 1);
    for (uint32_t i = 0u; i < p->n; i++) {
        float s;
        float c;
        const float v = speed[i];
        const float way = dt_s * v;
        pfl_sincos_kernel(heading[i], &s, &c);
        east[i] += (way * c) + (spread * w_east[i]);
        north[i] += (way * s) + (spread * w_north[i]);
        heading[i] += turn * v;
        speed[i] = v + ((push / ((v > slowest) ? v : slowest)) - (drag * (v * v)));
    }
}

void pfl_land_vehicle_jitter_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    const pfl_land_vehicle_t *m = (const pfl_land_vehicle_t *)user;
    float *restrict speed = PFL_STATE(p, PFL_LAND_SPEED);
    float *restrict heading = PFL_STATE(p, PFL_LAND_HEADING);
    const float *restrict w_speed = PFL_NOISE(p, 2);
    const float *restrict w_heading = PFL_NOISE(p, 3);
    pfl_land_vehicle_predict(user, u, dt_s, p);
    for (uint32_t i = 0u; i < p->n; i++) {
        speed[i] += m->sigma_speed_mps * w_speed[i];
        heading[i] += m->sigma_heading_rad * w_heading[i];
    }
}
