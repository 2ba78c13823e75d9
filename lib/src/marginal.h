/* What both forms of the marginalised filter share: strips of a batch, and sums of columns. Private to lib/. */
#ifndef PFL_MARGINAL_PRIVATE_H
#define PFL_MARGINAL_PRIVATE_H

#include "pflight/marginal.h"

#include "bits.h"

#define STRIP PFL_MARGINAL_STRIP

/* Position of element (r, c) of a symmetric matrix of which the upper triangle is stored row by row. */
static inline uint32_t pfl_marginal_at(uint32_t linear, uint32_t r, uint32_t c)
{
    const uint32_t low = (r < c) ? r : c;
    const uint32_t high = (r < c) ? c : r;
    return ((low * ((2u * linear) - low + 1u)) / 2u) + (high - low);
}

/* Zeros of the constant matrices cost nothing. */
static inline bool pfl_marginal_is_zero(float x)
{
    return (pfl_bits(x) & 0x7FFFFFFF) == 0;
}

static inline pfl_batch_t pfl_marginal_strip(const pfl_batch_t *p, uint32_t from)
{
    const uint32_t left = p->n - from;
    const pfl_batch_t strip = {p->x + from, p->stride, p->noise + from, p->first + from, (left < STRIP) ? left : STRIP};
    return strip;
}

/* sum <- sum + factor a */
static inline void pfl_marginal_add_scaled(float *restrict sum, float factor, const float *restrict a, uint32_t n)
{
    for (uint32_t i = 0u; i < n; i++) {
        sum[i] += factor * a[i];
    }
}

static inline void pfl_marginal_fill(float *restrict column, float value, uint32_t n)
{
    for (uint32_t i = 0u; i < n; i++) {
        column[i] = value;
    }
}

/* h of component k into a column of zeros. */
static inline void pfl_marginal_measure(const pfl_marginal_t *m, uint32_t k, const pfl_batch_t *p, float *h, float *see)
{
    pfl_marginal_fill(h, 0.0f, p->n);
    if (m->measure != NULL) {
        const pfl_view_t view = {p->x, p->stride, p->first, p->n};
        m->measure(m->user, k, &view, h, see);
    }
}

#endif
