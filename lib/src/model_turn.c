/* A vehicle in the plane that holds its turn rate and now and then takes another: models.h has its equations. */
#include "pflight/models.h"

#include "math_kernels.h"

#include "pflight/math.h"

static void remember(const pfl_batch_t *p)
{
    const float *restrict x = PFL_STATE(p, PFL_TURN_X);
    const float *restrict y = PFL_STATE(p, PFL_TURN_Y);
    float *restrict before_x = PFL_STATE(p, PFL_TURN_BEFORE_X);
    float *restrict before_y = PFL_STATE(p, PFL_TURN_BEFORE_Y);
    for (uint32_t i = 0u; i < p->n; i++) {
        before_x[i] = x[i];
        before_y[i] = y[i];
    }
}

static void walk(const pfl_turn_t *m, float dt_s, const pfl_batch_t *p)
{
    const float root = pfl_sqrtf(dt_s);
    const float speed_spread = m->sigma_speed * root;
    const float rate_spread = m->sigma_rate * root;
    float *restrict speed = PFL_STATE(p, PFL_TURN_SPEED);
    float *restrict rate = PFL_STATE(p, PFL_TURN_RATE);
    const float *restrict w_speed = PFL_NOISE(p, 0);
    const float *restrict w_rate = PFL_NOISE(p, 1);
    for (uint32_t i = 0u; i < p->n; i++) {
        speed[i] += speed_spread * w_speed[i];
        rate[i] += rate_spread * w_rate[i];
    }
}

/* The squared radius of two normals is exponential: it exceeds -2 log P with probability P. The rate's own noise is
 * free for the new value, as its walk is of no account any more. */
static void redraw(const pfl_turn_t *m, float dt_s, const pfl_batch_t *p)
{
    const float chance = m->redraw_hz * dt_s;
    const float limit = -2.0f * pfl_logf((chance < 1.0f) ? chance : 1.0f);
    const float sigma = m->redraw_sigma;
    float *restrict rate = PFL_STATE(p, PFL_TURN_RATE);
    const float *restrict w_rate = PFL_NOISE(p, 1);
    const float *restrict a = PFL_NOISE(p, 2);
    const float *restrict b = PFL_NOISE(p, 3);
    for (uint32_t i = 0u; i < p->n; i++) {
        const float radius2 = (a[i] * a[i]) + (b[i] * b[i]);
        rate[i] = (radius2 > limit) ? (sigma * w_rate[i]) : rate[i];
    }
}

static void move(float dt_s, const pfl_batch_t *p)
{
    float *restrict x = PFL_STATE(p, PFL_TURN_X);
    float *restrict y = PFL_STATE(p, PFL_TURN_Y);
    float *restrict heading = PFL_STATE(p, PFL_TURN_HEADING);
    const float *restrict speed = PFL_STATE(p, PFL_TURN_SPEED);
    const float *restrict rate = PFL_STATE(p, PFL_TURN_RATE);
    for (uint32_t i = 0u; i < p->n; i++) {
        float to_x;
        float to_y;
        const float turned = dt_s * rate[i];
        pfl_way_kernel(dt_s * speed[i], heading[i] + (0.5f * turned), &to_x, &to_y);
        x[i] += to_x;
        y[i] += to_y;
        heading[i] += turned;
    }
}

void pfl_turn_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    const pfl_turn_t *m = (const pfl_turn_t *)user;
    (void)u;
    if (m->remember != 0u) {
        remember(p);
    }
    walk(m, dt_s, p); /* first: so that copies of one particle part within the very step */
    if (m->redraw_hz > 0.0f) {
        redraw(m, dt_s, p);
    }
    move(dt_s, p);
}
