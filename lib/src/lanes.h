/* The sums over particles: eight lanes each, particle i in lane i mod 8, added up as a fixed tree, so that a scalar core
 * and any vector width give the same bits. Columns are padded to whole groups of eight with particles of weight zero.
 *
 * A group is PFL_LANE_PARTS registers, of vectors or of scalars: the restrict pointers let a compiler keep the sums
 * there over the loop. The attributes allow vectors to be read from columns of floats wherever these begin. */
#ifndef PFL_LANES_H
#define PFL_LANES_H

#include "bits.h"
#include "math_kernels.h"

#define PFL_LANES 8u
#define PFL_LANE_PARTS (PFL_LANES / PFL_VECTOR_LANES)

#if PFL_VECTOR_LANES > 1
typedef float pfl_part_t __attribute__((vector_size(4 * PFL_VECTOR_LANES), aligned(4), may_alias));
#else
typedef float pfl_part_t;
#endif

static inline float pfl_lane_sum(const float *row)
{
    return ((row[0] + row[1]) + (row[2] + row[3])) + ((row[4] + row[5]) + (row[6] + row[7]));
}

/* The sum of `columns` columns, `stride` apart, in any order: of use is only whether it is finite. */
#if PFL_VECTOR_LANES > 1
static inline float pfl_lanes_sum(const float *restrict columns_at, size_t stride, uint32_t columns, uint32_t n)
{
    const size_t near =
        (columns > 1u) ? stride : 0u; /* four at a time, some of them twice where there are not so many */
    const size_t far = ((columns > 3u) ? 2u : (columns - ((columns > 1u) ? 2u : 1u))) * stride;
    float row[PFL_LANES] = {0.0f};
    pfl_part_t *sum = (pfl_part_t *)row;
    for (uint32_t column = 0u; column < columns; column += 4u) {
        const uint32_t from = ((columns > 4u) && ((columns - column) < 4u)) ? (columns - 4u) : column;
        const float *x = &columns_at[from * stride];
        const pfl_part_t *a = (const pfl_part_t *)x;
        const pfl_part_t *b = (const pfl_part_t *)(x + near);
        const pfl_part_t *c = (const pfl_part_t *)(x + far);
        const pfl_part_t *d = (const pfl_part_t *)(x + near + far);
        for (uint32_t k = 0u; k < (n / PFL_VECTOR_LANES); k++) {
            sum[k % PFL_LANE_PARTS] += (a[k] + b[k]) + (c[k] + d[k]);
        }
    }
    return pfl_lane_sum(row);
}
#else
static inline float pfl_lanes_sum(const float *restrict columns_at, size_t stride, uint32_t columns, uint32_t n)
{
    float sum[4] = {0.0f, 0.0f, 0.0f, 0.0f};
    for (uint32_t column = 0u; column < columns; column++) {
        const float *x = &columns_at[column * stride];
        for (uint32_t quads = n / 4u; quads > 0u; quads--) {
            sum[0] += x[0];
            sum[1] += x[1];
            sum[2] += x[2];
            sum[3] += x[3];
            x += 4;
        }
    }
    return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}
#endif

/* row += w (x - centre) */
static inline void pfl_lanes_product(float *restrict row, const float *restrict w, const float *restrict x,
                                     const float *centre, uint32_t n)
{
    const float minus_c = -centre[0]; /* x86 subtracts from a register only, but adds from memory */
    pfl_part_t *sum = (pfl_part_t *)row;
    const pfl_part_t *weight = (const pfl_part_t *)w;
    const pfl_part_t *value = (const pfl_part_t *)x;
    for (uint32_t groups = n / PFL_LANES; groups > 0u; groups--) {
        for (uint32_t k = 0u; k < PFL_LANE_PARTS; k++) {
            sum[k] += weight[k] * (value[k] + minus_c);
        }
        weight += PFL_LANE_PARTS;
        value += PFL_LANE_PARTS;
    }
}

/* The same for two columns, `stride` apart, with rows and centres one after the other: they share the reading of the
 * weights, and more sums than these a scalar core cannot keep in its registers. */
static inline void pfl_lanes_products(float *restrict rows, const float *restrict w, const float *restrict x,
                                      uint32_t stride, const float *centres, uint32_t n)
{
    const float minus_c = -centres[0];
    const float minus_d = -centres[1];
    pfl_part_t *sum = (pfl_part_t *)rows;
    const pfl_part_t *weight = (const pfl_part_t *)w;
    const pfl_part_t *value = (const pfl_part_t *)x;
    const pfl_part_t *other = (const pfl_part_t *)(x + stride);
    for (uint32_t groups = n / PFL_LANES; groups > 0u; groups--) {
        for (uint32_t k = 0u; k < PFL_LANE_PARTS; k++) {
            const pfl_part_t part = weight[k];
            sum[k] += part * (value[k] + minus_c);
            sum[PFL_LANE_PARTS + k] += part * (other[k] + minus_d);
        }
        weight += PFL_LANE_PARTS;
        value += PFL_LANE_PARTS;
        other += PFL_LANE_PARTS;
    }
}

/* exp(-e) for e >= 0: 2^y, y = k + r, |r| <= 1/2. 0 below 2^-63, so that no square is a subnormal number, and a particle
 * without weight has none however far away it is. 0 for e < 0 and NaN too, which only damaged memory can give: what is
 * resampled by them must lie in 0 .. 1. */
static inline float pfl_weight_of(float e)
{
    const uint32_t most = 0x422E47AEu; /* 43.57; floats without sign are ordered as their bits */
#if PFL_VECTOR_LANES > 1
    const int32_t counts = -(int32_t)((uint32_t)pfl_bits(e) < most);
    const float y = pfl_from_bits(pfl_bits(e) & counts) * -1.44269504f;
#else
    if ((uint32_t)pfl_bits(e) >= most) {
        return 0.0f;
    }
    const int32_t counts = -1;
    const float y = e * -1.44269504f;
#endif
    const float biased = y + PFL_ROUND_MAGIC;
    const float r = y - (biased - PFL_ROUND_MAGIC);
    float p = 1.32764783e-3f; /* 7.5e-8 */
    p = (p * r) + 9.67554189e-3f;
    p = (p * r) + 5.55071309e-2f;
    p = (p * r) + 2.40221202e-1f;
    p = (p * r) + 6.93146944e-1f;
    p = (p * r) + 1.00000012f;
    const uint32_t power = (uint32_t)pfl_bits(p) + ((uint32_t)pfl_bits(biased) << 23);
    return pfl_from_bits((int32_t)power & counts);
}

/* w = exp(s - top); rows += w and w^2. A vector of weights is summed while it is at hand; a scalar core does better
 * with a loop for each, whose constants and sums stay in its registers. */
static inline void pfl_lanes_weigh(float *restrict rows, float *restrict w, const float *restrict s, float top,
                                   uint32_t n)
{
    const uint32_t piece = (PFL_VECTOR_LANES > 1) ? PFL_LANES : n;
    pfl_part_t *sum = (pfl_part_t *)rows;
    for (uint32_t pieces = (PFL_VECTOR_LANES > 1) ? (n / PFL_LANES) : 1u; pieces > 0u; pieces--) {
        for (uint32_t i = 0u; i < piece; i++) {
            w[i] = pfl_weight_of(top - s[i]);
        }
        const pfl_part_t *weight = (const pfl_part_t *)w;
        for (uint32_t groups = piece / PFL_LANES; groups > 0u; groups--) {
            for (uint32_t k = 0u; k < PFL_LANE_PARTS; k++) {
                const pfl_part_t part = weight[k];
                sum[k] += part;
                sum[PFL_LANE_PARTS + k] += part * part;
            }
            weight += PFL_LANE_PARTS;
        }
        s += piece;
        w += piece;
    }
}

/* to = from, without a call; n is a multiple of eight. */
static inline void pfl_lanes_copy(float *restrict to, const float *restrict from, uint32_t n)
{
    for (uint32_t i = 0u; i < n; i += PFL_LANES) {
#if PFL_VECTOR_LANES > 1
        for (uint32_t k = 0u; k < PFL_LANES; k += PFL_VECTOR_LANES) {
            *(pfl_part_t *)&to[i + k] = *(const pfl_part_t *)&from[i + k];
        }
#else
        PFL_COPY(&to[i], &from[i], PFL_LANES * sizeof(float));
#endif
    }
}

#endif
