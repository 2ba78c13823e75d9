/* Constant velocity with white acceleration: models.h has its equations. */
#include "pflight/models.h"

#include "pflight/math.h"

void pfl_constant_velocity_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    const pfl_constant_velocity_t *m = (const pfl_constant_velocity_t *)user;
    const float kick = m->sigma_accel * pfl_sqrtf(dt_s); /* speed per unit of noise */
    const float shift = 0.5f * dt_s * kick;
    float *restrict x = PFL_STATE(p, PFL_CV_X);
    float *restrict y = PFL_STATE(p, PFL_CV_Y);
    float *restrict vx = PFL_STATE(p, PFL_CV_VX);
    float *restrict vy = PFL_STATE(p, PFL_CV_VY);
    const float *restrict wx = PFL_NOISE(p, 0);
    const float *restrict wy = PFL_NOISE(p, 1);
    (void)u;
    for (uint32_t i = 0u; i < p->n; i++) {
        x[i] += (dt_s * vx[i]) + (shift * wx[i]);
        y[i] += (dt_s * vy[i]) + (shift * wy[i]);
        vx[i] += kick * wx[i];
        vy[i] += kick * wy[i];
    }
    if (m->sigma_position > 0.0f) {
        const float spread = m->sigma_position * pfl_sqrtf(dt_s);
        const float *restrict px = PFL_NOISE(p, 2);
        const float *restrict py = PFL_NOISE(p, 3);
        for (uint32_t i = 0u; i < p->n; i++) {
            x[i] += spread * px[i];
            y[i] += spread * py[i];
        }
    }
}
