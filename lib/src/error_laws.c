/* Laws of measurement errors: errors.h has the equations. Without branches in the loops, so that they become vectors. */
#include "pflight/errors.h"

#include "math_kernels.h"

void pfl_gaussian_law(const void *law, float *values, uint32_t n)
{
    const float inv_sigma = ((const pfl_gaussian_law_t *)law)->inv_sigma;
    for (uint32_t i = 0u; i < n; i++) {
        const float y = values[i] * inv_sigma;
        values[i] = -0.5f * (y * y);
    }
}

void pfl_student_law(const void *law, float *values, uint32_t n)
{
    const pfl_student_law_t *l = (const pfl_student_law_t *)law;
    const float inv_sigma = l->inv_sigma;
    const float inv_dof = 1.0f / l->dof;
    const float power = -0.5f * (l->dof + 1.0f);
    for (uint32_t i = 0u; i < n; i++) {
        const float y = values[i] * inv_sigma;
        values[i] = power * pfl_log_kernel(1.0f + ((y * y) * inv_dof));
    }
}

/* One side of a split law. */
typedef struct {
    float inv_sigma;
    float inv_dof;
    float power;
    int32_t is_gaussian; /* mask */
} side_t;

static side_t side_of(const pfl_split_law_t *l, uint32_t k)
{
    const bool gaussian = !(l->dof[k] > 0.0f);
    const side_t side = {l->inv_sigma[k], gaussian ? 0.0f : (1.0f / l->dof[k]), -0.5f * (l->dof[k] + 1.0f),
                         gaussian ? -1 : 0};
    return side;
}

void pfl_split_law(const void *law, float *values, uint32_t n)
{
    const side_t below = side_of((const pfl_split_law_t *)law, 0u);
    const side_t above = side_of((const pfl_split_law_t *)law, 1u);
    for (uint32_t i = 0u; i < n; i++) {
        const int32_t negative = pfl_bits(values[i]) >> 31;
        const float y = values[i] * pfl_select(negative, below.inv_sigma, above.inv_sigma);
        const float y2 = y * y;
        const float inv_dof = pfl_select(negative, below.inv_dof, above.inv_dof);
        const float power = pfl_select(negative, below.power, above.power);
        const int32_t gaussian = (below.is_gaussian & negative) | (above.is_gaussian & ~negative);
        values[i] = pfl_select(gaussian, -0.5f * y2, power * pfl_log_kernel(1.0f + (y2 * inv_dof)));
    }
}

/* The logarithm of a sum of exponentials, with the larger taken out: nothing underflows. */
void pfl_mixture_law(const void *law, float *values, uint32_t n)
{
    const pfl_mixture_law_t *l = (const pfl_mixture_law_t *)law;
    const float inv_sigma = l->inv_sigma;
    const float narrow = 0.5f * l->narrow;
    const float below = pfl_log_kernel(l->height[0]);
    const float above = pfl_log_kernel(l->height[1]);
    const float most = pfl_log_kernel(1.0f + ((l->height[0] > l->height[1]) ? l->height[0] : l->height[1]));
    for (uint32_t i = 0u; i < n; i++) {
        const float height = pfl_select(pfl_bits(values[i]) >> 31, below, above);
        const float y = values[i] * inv_sigma;
        const int32_t finite = -(int32_t)(pfl_bits(y * y) != 0x7F800000); /* an infinity times narrow = 0 were NaN */
        const float y2 = pfl_select(finite, y * y, FLT_MAX);
        const float good = -0.5f * y2;
        const float outlier = height - (narrow * y2);
        const int32_t is_good = pfl_bits(outlier - good) >> 31;
        const float larger = pfl_select(is_good, good, outlier);
        const float apart = pfl_from_bits(pfl_bits(outlier - good) & 0x7FFFFFFF);
        values[i] = (larger + pfl_log_kernel(1.0f + pfl_exp_kernel(-apart))) - most;
    }
}
