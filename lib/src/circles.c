/* Circular means: the sums of sine and cosine of the states that are angles. A configuration names pfl_circular_means when
 * it has such states; one without leaves this file out of the image. */
#include "moments.h"

#include "pflight/math.h"

/* Sine and cosine of angles about a centre into the first two work columns. */
PFL_NOINLINE static void circle(float *restrict sines, float *restrict cosines, const float *restrict x, float centre,
                                uint32_t n)
{
    for (uint32_t i = 0u; i < n; i++) {
        float s;
        float c;
        pfl_sincos_kernel(pfl_wrap_pi_kernel(x[i] - centre), &s, &c);
        sines[i] = s;
        cosines[i] = c;
    }
}

/* Sums of sine and cosine of the angles, about the most likely particle. */
PFL_NOINLINE static void circle_lanes(pfl_t *f, uint32_t first, uint32_t n)
{
    const uint32_t states = f->config->states;
    static const float no_centre[2];
    for (uint32_t d = 0u; d < states; d++) {
        if (pfl_is_circular(f, d)) {
            circle(f->work, &f->work[PFL_BATCH], &f->x[((size_t)d * f->stride) + first], f->centre[d], n);
            pfl_lanes_products(pfl_row_at(f, ROW_CIRCLE(states) + (2u * d)), &f->scratch[first], f->work, PFL_BATCH,
                               no_centre, n);
        }
    }
}

/* The circular means become the centres of the angles. */
PFL_NOINLINE static void centre_circles(const pfl_t *f)
{
    const uint32_t states = f->config->states;
    for (uint32_t d = 0u; d < states; d++) {
        if (pfl_is_circular(f, d)) {
            const uint32_t row = ROW_CIRCLE(states) + (2u * d);
            const float turn =
                pfl_atan2_kernel(pfl_lane_sum(pfl_row_at(f, row)), pfl_lane_sum(pfl_row_at(f, row + 1u)));
            const float near_pi = pfl_wrap_pi_kernel(f->centre[d] + turn); /* to 4e-4, after many turns */
            const float mean = pfl_wrap_pi_kernel(near_pi);
            f->centre[d] = ((mean >= PFL_PI) || (mean < -PFL_PI)) ? -PFL_PI : mean;
        }
    }
}

/* Without particles: all batches are in. */
void pfl_circular_means(pfl_t *f, uint32_t first, uint32_t n)
{
    if (n > 0u) {
        circle_lanes(f, first, n);
    } else {
        centre_circles(f);
    }
}
