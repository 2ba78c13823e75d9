/* A target on a road: models.h has the equations. On the ring, positions move along the road by turning the unit vector
 * from the center, so that no angle is ever formed. */
#include "pflight/models.h"

#include "math_kernels.h"
#include "sqrt_kernel.h"

#include "pflight/math.h"

#define NO_RADIUS 1.0e-12f /* nearer to the center than this there is no direction: any will do */

static inline float clip(float x, float lo, float hi)
{
    const float low = (x < lo) ? lo : x;
    return (low > hi) ? hi : low;
}

void pfl_road_target_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    const pfl_road_target_t m = *(const pfl_road_target_t *)user;
    const float root = pfl_sqrtf(dt_s);
    const float across = m.sigma_across * root; /* speed per unit of noise */
    const float along = m.sigma_along * root;
    const float half = 0.5f * dt_s;
    float *restrict x = PFL_STATE(p, PFL_CV_X);
    float *restrict y = PFL_STATE(p, PFL_CV_Y);
    float *restrict vx = PFL_STATE(p, PFL_CV_VX);
    float *restrict vy = PFL_STATE(p, PFL_CV_VY);
    const float *restrict w_across = PFL_NOISE(p, 0);
    const float *restrict w_along = PFL_NOISE(p, 1);
    (void)u;
    for (uint32_t i = 0u; i < p->n; i++) {
        float s;
        float c;
        const float dx = x[i] - m.center_x_m;
        const float dy = y[i] - m.center_y_m;
        const float r = pfl_sqrt_kernel((dx * dx) + (dy * dy));
        const int32_t nowhere = -(int32_t)(r < NO_RADIUS);
        const float length = pfl_select(nowhere, 1.0f, r);
        const float nx = pfl_select(nowhere, 1.0f, dx / length);
        const float ny = pfl_select(nowhere, 0.0f, dy / length);
        const float out = (vx[i] * nx) + (vy[i] * ny);
        const float on = (vy[i] * nx) - (vx[i] * ny);
        const float kick_out = across * w_across[i];
        const float kick_on = along * w_along[i];
        const float free = r + ((dt_s * out) + (half * kick_out));
        const float radius = clip(free, m.inner_m, m.outer_m);
        const float faster = out + kick_out;
        const int32_t leaving_out = -(int32_t)(free > m.outer_m) & -(int32_t)(faster > 0.0f);
        const int32_t leaving_in = -(int32_t)(free < m.inner_m) & -(int32_t)(faster < 0.0f);
        const float out_speed = pfl_select(leaving_out | leaving_in, 0.0f, faster);
        const float on_speed = on + kick_on;
        pfl_sincos_kernel(((dt_s * on) + (half * kick_on)) / radius, &s, &c);
        const float ex = (nx * c) - (ny * s);
        const float ey = (ny * c) + (nx * s);
        x[i] = m.center_x_m + (radius * ex);
        y[i] = m.center_y_m + (radius * ey);
        vx[i] = (out_speed * ex) - (on_speed * ey);
        vy[i] = (out_speed * ey) + (on_speed * ex);
    }
}

void pfl_lane_target_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    const pfl_lane_target_t m = *(const pfl_lane_target_t *)user;
    const float kick = m.sigma_along * pfl_sqrtf(dt_s);
    const float keep = pfl_expf(-dt_s / m.offset_time_s);
    const float spread = m.sigma_offset_m * pfl_sqrtf(1.0f - (keep * keep));
    const float half = 0.5f * dt_s;
    float *restrict arc = PFL_STATE(p, PFL_LANE_ARC);
    float *restrict speed = PFL_STATE(p, PFL_LANE_SPEED);
    float *restrict offset = PFL_STATE(p, PFL_LANE_OFFSET);
    const float *restrict w_along = PFL_NOISE(p, 0);
    const float *restrict w_offset = PFL_NOISE(p, 1);
    (void)u;
    for (uint32_t i = 0u; i < p->n; i++) {
        const float next = clip(speed[i] + (kick * w_along[i]), m.speed_min_mps, m.speed_max_mps);
        arc[i] += half * (speed[i] + next);
        speed[i] = next;
        offset[i] = clip((keep * offset[i]) + (spread * w_offset[i]), -m.half_width_m, m.half_width_m);
    }
}
