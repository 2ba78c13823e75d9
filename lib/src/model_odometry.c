/* A unicycle moved by its odometry: models.h has its equations. */
#include "pflight/models.h"

#include "math_kernels.h"

#include "pflight/math.h"

void pfl_odometry_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    const pfl_odometry_t *m = (const pfl_odometry_t *)user;
    const pfl_odometry_input_t *in = (const pfl_odometry_input_t *)u;
    const float root = pfl_sqrtf(dt_s);
    const float way = dt_s * m->speed_scale * in->speed_mps;
    const float turn = dt_s * in->turn_radps;
    const float speed = (in->speed_mps < 0.0f) ? -in->speed_mps : in->speed_mps;
    const float rate = (in->turn_radps < 0.0f) ? -in->turn_radps : in->turn_radps;
    const float way_spread = root * (m->speed_share * speed);
    const float turn_spread = root * (m->sigma_turn + (m->turn_share * rate));
    const float spread = root * m->sigma_position;
    float *restrict x = PFL_STATE(p, PFL_ODO_X);
    float *restrict y = PFL_STATE(p, PFL_ODO_Y);
    float *restrict heading = PFL_STATE(p, PFL_ODO_HEADING);
    const float *restrict w_way = PFL_NOISE(p, 0);
    const float *restrict w_turn = PFL_NOISE(p, 1);
    const float *restrict w_x = PFL_NOISE(p, 2);
    const float *restrict w_y = PFL_NOISE(p, 3);
    for (uint32_t i = 0u; i < p->n; i++) {
        float to_x;
        float to_y;
        const float moved = way + (way_spread * w_way[i]);
        const float turned = turn + (turn_spread * w_turn[i]);
        pfl_way_kernel(moved, heading[i] + (0.5f * turned), &to_x, &to_y);
        x[i] += to_x + (spread * w_x[i]);
        y[i] += to_y + (spread * w_y[i]);
        heading[i] += turned;
    }
}
