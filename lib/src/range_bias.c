/* Ranges whose biases particles carry along: range_bias.h has the equations. */
#include "pflight/range_bias.h"

#include "math_kernels.h"
#include "sqrt_kernel.h"

void pfl_range_bias_move(pfl_range_bias_t *s, float dt_s)
{
    for (uint32_t k = 0u; k < s->anchors; k++) {
        s->variance_m2[k] += dt_s * (s->walk * s->walk);
    }
}

static inline float distance(float dx, float dy, float height2)
{
    return pfl_sqrt_kernel(((dx * dx) + (dy * dy)) + height2);
}

/* Student's t pulls by (dof + 1) / (dof + e^2) times what a Gaussian does, and by no more than that. */
void pfl_range_bias_correct(const pfl_range_bias_t *s, const pfl_range_bias_z_t *fused, const pfl_batch_t *p)
{
    if (fused == NULL) {
        return;
    }
    const pfl_range_bias_z_t z = *fused;
    const float *restrict x = PFL_STATE(p, s->x_state);
    const float *restrict y = PFL_STATE(p, s->y_state);
    float *restrict bias = PFL_STATE(p, s->bias_state + z.anchor);
    const float height2 = z.height_m * z.height_m;
    const float dof = s->dof;
    const float gain = s->gain;
    const float inv_variance = (1.0f - gain) / (s->sigma_m * s->sigma_m); /* of the innovation that the gain was for */
    for (uint32_t i = 0u; i < p->n; i++) {
        const float e = (z.range_m - distance(x[i] - z.anchor_x_m, y[i] - z.anchor_y_m, height2)) - bias[i];
        const float robust = (dof + 1.0f) / (dof + ((e * e) * inv_variance));
        const int32_t more = -(int32_t)(robust > 1.0f);
        bias[i] += (gain * pfl_select(more, 1.0f, robust)) * e;
    }
}

void pfl_range_bias_loglik(void *user, const void *z, const pfl_view_t *p, float *ll)
{
    const pfl_range_bias_t *s = (const pfl_range_bias_t *)user;
    const pfl_range_bias_z_t m = *(const pfl_range_bias_z_t *)z;
    const float *restrict x = PFL_STATE(p, s->x_state);
    const float *restrict y = PFL_STATE(p, s->y_state);
    const float *restrict bias = PFL_STATE(p, s->bias_state + m.anchor);
    float *restrict out = ll;
    const float height2 = m.height_m * m.height_m;
    const float scale = 1.0f / (s->dof * ((s->sigma_m * s->sigma_m) + s->variance_m2[m.anchor]));
    const float power = -0.5f * (s->dof + 1.0f);
    for (uint32_t i = 0u; i < p->n; i++) {
        const float e = (m.range_m - distance(x[i] - m.anchor_x_m, y[i] - m.anchor_y_m, height2)) - bias[i];
        out[i] = power * pfl_log_positive_kernel(1.0f + ((e * e) * scale));
    }
    pfl_log_tells(out, (m.anchor_x_m + m.anchor_y_m) + (m.height_m + m.range_m));
}

void pfl_range_bias_fused(pfl_range_bias_t *s, const pfl_range_bias_z_t *z)
{
    const float variance = s->variance_m2[z->anchor];
    s->gain = variance / (variance + (s->sigma_m * s->sigma_m));
    s->variance_m2[z->anchor] = variance * (1.0f - s->gain);
}
