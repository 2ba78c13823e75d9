/* A unicycle moved by its odometry, whose speed scale and turn-rate bias are states: models.h has its equations. */
#include "pflight/models.h"

#include "math_kernels.h"

#include "pflight/math.h"

#define PART 32u /* particles at a time: ways and directions stay on the stack, which is small */

/* What one step's errors are like. */
typedef struct {
    float way;
    float turn;
    float way_spread;
    float turn_spread;
    float position_spread;
    float scale_spread;
    float bias_spread;
    float dt_s;
} rolling_t;

static void learn(const rolling_t *s, const pfl_batch_t *p)
{
    float *restrict scale = PFL_STATE(p, PFL_WHEELS_SCALE);
    float *restrict bias = PFL_STATE(p, PFL_WHEELS_BIAS);
    const float *restrict w_scale = PFL_NOISE(p, 4);
    const float *restrict w_bias = PFL_NOISE(p, 5);
    for (uint32_t i = 0u; i < p->n; i++) {
        scale[i] += s->scale_spread * w_scale[i];
        bias[i] += s->bias_spread * w_bias[i];
    }
}

static void move(const rolling_t *s, const pfl_batch_t *p)
{
    float way[PART];
    float direction[PART];
    const float *restrict scale = PFL_STATE(p, PFL_WHEELS_SCALE);
    const float *restrict bias = PFL_STATE(p, PFL_WHEELS_BIAS);
    float *restrict heading = PFL_STATE(p, PFL_WHEELS_HEADING);
    float *restrict x = PFL_STATE(p, PFL_WHEELS_X);
    float *restrict y = PFL_STATE(p, PFL_WHEELS_Y);
    const float *restrict w_way = PFL_NOISE(p, 0);
    const float *restrict w_turn = PFL_NOISE(p, 1);
    const float *restrict w_x = PFL_NOISE(p, 2);
    const float *restrict w_y = PFL_NOISE(p, 3);
    for (uint32_t i = 0u; i < p->n; i++) {
        const float turned = (s->turn + (s->dt_s * bias[i])) + (s->turn_spread * w_turn[i]);
        way[i] = (scale[i] * s->way) + (s->way_spread * w_way[i]);
        direction[i] = heading[i] + (0.5f * turned);
        heading[i] += turned;
    }
    for (uint32_t i = 0u; i < p->n; i++) {
        float to_x;
        float to_y;
        pfl_way_kernel(way[i], direction[i], &to_x, &to_y);
        x[i] += to_x + (s->position_spread * w_x[i]);
        y[i] += to_y + (s->position_spread * w_y[i]);
    }
}

void pfl_wheels_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    const pfl_wheels_t *m = (const pfl_wheels_t *)user;
    const pfl_odometry_input_t *in = (const pfl_odometry_input_t *)u;
    const float root = pfl_sqrtf(dt_s);
    const float speed = (in->speed_mps < 0.0f) ? -in->speed_mps : in->speed_mps;
    const float rate = (in->turn_radps < 0.0f) ? -in->turn_radps : in->turn_radps;
    const rolling_t step = {dt_s * in->speed_mps,
                            dt_s * in->turn_radps,
                            root * (m->speed_share * speed),
                            root * (m->sigma_turn + (m->turn_share * rate)),
                            root * m->sigma_position,
                            root * m->scale_walk,
                            root * m->bias_walk,
                            dt_s};
    learn(&step, p);
    for (uint32_t from = 0u; from < p->n; from += PART) {
        const uint32_t left = p->n - from;
        const pfl_batch_t part = {p->x + from, p->stride, p->noise + from, p->first + from,
                                  (left < PART) ? left : PART};
        move(&step, &part);
    }
}
