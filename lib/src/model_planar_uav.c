/* A UAV in the plane with lags of speed and turn rate: models.h has its equations. */
#include "pflight/models.h"

#include "math_kernels.h"

#include "pflight/math.h"

/* One piece of the exact-lag step: speed and turn rate are exact, the way is the midpoint rule's. */
static void move(const pfl_batch_t *p, const pfl_planar_uav_input_t *in, float h_s, float keep)
{
    float *restrict x = PFL_STATE(p, PFL_UAV_X);
    float *restrict y = PFL_STATE(p, PFL_UAV_Y);
    float *restrict heading = PFL_STATE(p, PFL_UAV_HEADING);
    float *restrict speed = PFL_STATE(p, PFL_UAV_SPEED);
    float *restrict turn = PFL_STATE(p, PFL_UAV_TURN);
    const float speed_command = in->speed_mps;
    const float turn_command = in->turn_radps;
    for (uint32_t i = 0u; i < p->n; i++) {
        float to_x;
        float to_y;
        const float faster = speed_command + ((speed[i] - speed_command) * keep);
        const float tighter = turn_command + ((turn[i] - turn_command) * keep);
        const float way = h_s * (0.5f * (speed[i] + faster));
        const float turned = h_s * (0.5f * (turn[i] + tighter));
        pfl_way_kernel(way, heading[i] + (0.5f * turned), &to_x, &to_y);
        x[i] += to_x;
        y[i] += to_y;
        heading[i] += turned;
        speed[i] = faster;
        turn[i] = tighter;
    }
}

/* The whole step by forward Euler. */
static void leap(const pfl_batch_t *p, const pfl_planar_uav_input_t *in, float dt_s, float share)
{
    float *restrict x = PFL_STATE(p, PFL_UAV_X);
    float *restrict y = PFL_STATE(p, PFL_UAV_Y);
    float *restrict heading = PFL_STATE(p, PFL_UAV_HEADING);
    float *restrict speed = PFL_STATE(p, PFL_UAV_SPEED);
    float *restrict turn = PFL_STATE(p, PFL_UAV_TURN);
    const float speed_command = in->speed_mps;
    const float turn_command = in->turn_radps;
    for (uint32_t i = 0u; i < p->n; i++) {
        float to_x;
        float to_y;
        pfl_way_kernel(dt_s * speed[i], heading[i], &to_x, &to_y);
        x[i] += to_x;
        y[i] += to_y;
        heading[i] += dt_s * turn[i];
        speed[i] += share * (speed_command - speed[i]);
        turn[i] += share * (turn_command - turn[i]);
    }
}

static void disturb(const pfl_planar_uav_t *m, float dt_s, const pfl_batch_t *p)
{
    const float root = pfl_sqrtf(dt_s);
    float *restrict speed = PFL_STATE(p, PFL_UAV_SPEED);
    float *restrict turn = PFL_STATE(p, PFL_UAV_TURN);
    const float *restrict w_speed = PFL_NOISE(p, 0);
    const float *restrict w_turn = PFL_NOISE(p, 1);
    for (uint32_t i = 0u; i < p->n; i++) {
        speed[i] += (m->sigma_speed * root) * w_speed[i];
        turn[i] += (m->sigma_turn * root) * w_turn[i];
    }
}

void pfl_planar_uav_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    const pfl_planar_uav_t *m = (const pfl_planar_uav_t *)user;
    const pfl_planar_uav_input_t *in = (const pfl_planar_uav_input_t *)u;
    if (m->pieces == 0u) {
        leap(p, in, dt_s, dt_s / m->lag_s);
    } else {
        const uint32_t pieces = (m->pieces < PFL_UAV_PIECES_MAX) ? m->pieces : PFL_UAV_PIECES_MAX;
        const float h_s = dt_s / (float)pieces;
        const float keep = pfl_expf(-h_s / m->lag_s);
        for (uint32_t k = 0u; k < pieces; k++) {
            move(p, in, h_s, keep);
        }
    }
    if ((m->sigma_speed > 0.0f) || (m->sigma_turn > 0.0f)) {
        disturb(m, dt_s, p);
    }
}
