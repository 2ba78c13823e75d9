/* The land vehicle of the tracking scenario: models.h has its equations. */
#include "pflight/models.h"

#include "math_kernels.h"

/* What a step is for every particle, and the noise of both positions. */
typedef struct {
    float dt_s;
    float push;   /* engine power over mass */
    float drag;   /* per speed squared */
    float turn;   /* heading per speed */
    float spread; /* position per unit of noise */
    float speed_min_mps;
    const float *w_east;
    const float *w_north;
} step_t;

/* The columns are parameters: as such, gcc believes `restrict` and leaves out its checks for overlap, which cost a
 * batch as much as its particles. */
static void move(const step_t *step, uint32_t n, float *restrict east, float *restrict north, float *restrict speed,
                 float *restrict heading)
{
    const step_t k = *step;
    for (uint32_t i = 0u; i < n; i++) {
        float to_east;
        float to_north;
        const float v = speed[i];
        pfl_way_kernel(k.dt_s * v, heading[i], &to_east, &to_north);
        east[i] += to_east + (k.spread * k.w_east[i]);
        north[i] += to_north + (k.spread * k.w_north[i]);
        heading[i] += k.turn * v;
        speed[i] = v + ((k.push / ((v > k.speed_min_mps) ? v : k.speed_min_mps)) - (k.drag * (v * v)));
    }
}

void pfl_land_vehicle_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    const pfl_land_vehicle_t *m = (const pfl_land_vehicle_t *)user;
    const pfl_land_input_t *in = (const pfl_land_input_t *)u;
    float ahead;
    float across;
    pfl_way_kernel(1.0f, in->steer_rad, &ahead, &across);
    const float per_mass = dt_s / m->mass_kg;
    const step_t step = {
        .dt_s = dt_s,
        .push = m->power_w * in->throttle * per_mass,
        .drag = m->drag_area_m2 * per_mass,
        .turn = (dt_s * across) / (ahead * m->wheelbase_m),
        .spread = dt_s * m->sigma_position_mps,
        .speed_min_mps = m->speed_min_mps,
        .w_east = PFL_NOISE(p, 0),
        .w_north = PFL_NOISE(p, 1),
    };
    move(&step, p->n, PFL_STATE(p, PFL_LAND_EAST), PFL_STATE(p, PFL_LAND_NORTH), PFL_STATE(p, PFL_LAND_SPEED),
         PFL_STATE(p, PFL_LAND_HEADING));
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
