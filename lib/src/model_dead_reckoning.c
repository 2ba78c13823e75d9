/* Dead reckoning by a velocity that has biases, beside a barometer that has one: terrain.h has the equations. */
#include "pflight/terrain.h"

static void walk(float *restrict x, float sigma, const float *restrict w, uint32_t n)
{
    for (uint32_t i = 0u; i < n; i++) {
        x[i] += sigma * w[i];
    }
}

static void move_axis(const pfl_dead_reckoning_t *m, float way, float dt_s, uint32_t axis, const pfl_batch_t *p)
{
    const float spread = dt_s * m->sigma_velocity_mps;
    const float *restrict w = PFL_NOISE(p, axis);
    const float *restrict w_bias = PFL_NOISE(p, 2u + axis);
    float *restrict x = PFL_STATE(p, PFL_DR_NORTH + axis);
    float *restrict bias = PFL_STATE(p, PFL_DR_BIAS_NORTH + axis);
    for (uint32_t i = 0u; i < p->n; i++) {
        x[i] += (way - (dt_s * bias[i])) + (spread * w[i]);
        bias[i] = (m->bias_decay * bias[i]) + (m->sigma_bias_mps * w_bias[i]);
    }
}

void pfl_dead_reckoning_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    const pfl_dead_reckoning_t *m = (const pfl_dead_reckoning_t *)user;
    const pfl_dead_reckoning_input_t *in = (const pfl_dead_reckoning_input_t *)u;
    move_axis(m, dt_s * in->north_mps, dt_s, 0u, p);
    move_axis(m, dt_s * in->east_mps, dt_s, 1u, p);
    walk(PFL_STATE(p, PFL_DR_BARO), m->sigma_baro_m, PFL_NOISE(p, 4), p->n);
}

void pfl_dead_reckoning_rest_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    const pfl_dead_reckoning_t *m = (const pfl_dead_reckoning_t *)user;
    const pfl_dead_reckoning_input_t *in = (const pfl_dead_reckoning_input_t *)u;
    const float way_north = dt_s * in->north_mps;
    const float way_east = dt_s * in->east_mps;
    float *restrict north = PFL_STATE(p, PFL_DR_NORTH);
    float *restrict east = PFL_STATE(p, PFL_DR_EAST);
    for (uint32_t i = 0u; i < p->n; i++) {
        north[i] += way_north;
        east[i] += way_east;
    }
    walk(PFL_STATE(p, PFL_DR_BARO), m->sigma_baro_m, PFL_NOISE(p, 2), p->n);
}
