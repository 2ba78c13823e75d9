/* Where the moments' sums lie, for moments.c and circles.c. */
#ifndef PFL_MOMENTS_H
#define PFL_MOMENTS_H

#include "core.h"

#include "lanes.h"

/* Rows of f->lanes, eight partial sums each: w and w^2; w dev of each state; w sin dev and w cos dev of each state
 * (angles only); then the upper triangle of w dev_d dev_e. */
#define ROW_WEIGHT 0u
#define ROW_SQUARE 1u
#define ROW_MEAN 2u
#define ROW_CIRCLE(states) (ROW_MEAN + (states))
#define ROW_PRODUCT(states) (ROW_MEAN + (3u * (states)))
#define ROW_END(states) (ROW_PRODUCT(states) + (((states) * ((states) + 1u)) / 2u))

static inline float *pfl_row_at(const pfl_t *f, uint32_t row)
{
    return f->lanes + ((size_t)row * PFL_LANES);
}

static inline bool pfl_is_circular(const pfl_t *f, uint32_t d)
{
    return ((f->config->circular_mask >> d) & 1u) != 0u;
}

#endif
