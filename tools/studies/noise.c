/* Other noise than independent normals: see noise.h. */
#include "noise.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

noise_kind_t noise_kind(const char *name)
{
    static const char *const names[] = {"plain", "antithetic", "quasi", "array"};
    unsigned k = 0u;

    while (k < NOISE_ARRAY && strcmp(names[k], name) != 0) {
        k++;
    }
    return (noise_kind_t)k;
}

/* The generalised golden ratio's lattice (Roberts 2018): powers of the root of x^(d+1) = x + 1. */
static void make_lattice(noise_t *noise, uint32_t dimensions)
{
    double root = 1.5;

    for (int i = 0; i < 60; i++) {
        root = pow(1.0 + root, 1.0 / (dimensions + 1.0));
    }
    for (uint32_t q = 0u; q < noise->noises; q++) {
        noise->step[q] = (uint32_t)(4294967296.0 * pow(root, -(double)(q + 1u)));
    }
}

bool noise_start(noise_t *noise, noise_kind_t kind, const pfl_config_t *config)
{
    *noise = (noise_t){.kind = kind, .count = config->particles, .states = config->states, .noises = config->noises};
    pfl_rng_seed(&noise->rng, config->seed ^ 0x6E6F697365u);
    make_lattice(noise, noise->noises);
    if (kind == NOISE_ARRAY) {
        noise->order = malloc(noise->count * sizeof *noise->order);
        noise->column = malloc(noise->count * sizeof *noise->column);
    }
    return (noise->count & (noise->count - 1u)) == 0u &&
           (kind != NOISE_ARRAY || (noise->order != NULL && noise->column != NULL));
}

void noise_free(noise_t *noise)
{
    free(noise->order);
    free(noise->column);
}

/* ---- Quasi-random --------------------------------------------------------------------------------------------------- */

/* The normal's quantile by Wichura's PPND7 (1988), good to 7 digits. */
static float quantile(float u)
{
    const float q = u - 0.5f;

    if (q < 0.425f && q > -0.425f) {
        const float r = 0.180625f - q * q;
        return q * (((59.109374720f * r + 159.29113202f) * r + 50.434271938f) * r + 3.3871327179f) /
               (((67.187563600f * r + 78.757757664f) * r + 17.895169469f) * r + 1.0f);
    }
    float r = pfl_sqrtf(-pfl_logf(q < 0.0f ? u : 1.0f - u));
    if (r <= 5.0f) {
        r -= 1.6f;
        r = (((0.17023821103f * r + 1.3067284816f) * r + 2.7568153900f) * r + 1.4234372777f) /
            ((0.12021132975f * r + 0.73700164250f) * r + 1.0f);
    } else {
        r -= 5.0f;
        r = (((0.017337203997f * r + 0.42868294337f) * r + 3.0812263860f) * r + 6.6579051150f) /
            ((0.012258202635f * r + 0.24197894225f) * r + 1.0f);
    }
    return q < 0.0f ? -r : r;
}

static uint32_t spread_bits(uint32_t x)
{
    x = (x | (x << 8)) & 0x00FF00FFu;
    x = (x | (x << 4)) & 0x0F0F0F0Fu;
    x = (x | (x << 2)) & 0x33333333u;
    return (x | (x << 1)) & 0x55555555u;
}

static int by_key(const void *a, const void *b)
{
    const uint64_t x = *(const uint64_t *)a;
    const uint64_t y = *(const uint64_t *)b;
    return (x > y) - (x < y);
}

/* Of a state, as 16 bits of its range. */
static void range_of(const float *x, uint32_t n, float *low, float *scale)
{
    float high = x[0];

    *low = x[0];
    for (uint32_t i = 1u; i < n; i++) {
        *low = x[i] < *low ? x[i] : *low;
        high = x[i] > high ? x[i] : high;
    }
    *scale = high > *low ? 65535.0f / (high - *low) : 0.0f;
}

/* Puts the particles in order; all weights being equal, they need not follow. */
static void sort_particles(noise_t *noise, const pfl_batch_t *p)
{
    const uint32_t second = noise->states > 1u ? 1u : 0u;
    float low[2], scale[2];

    range_of(PFL_STATE(p, 0), noise->count, &low[0], &scale[0]);
    range_of(PFL_STATE(p, second), noise->count, &low[1], &scale[1]);
    for (uint32_t i = 0u; i < noise->count; i++) {
        const uint32_t a = (uint32_t)((PFL_STATE(p, 0)[i] - low[0]) * scale[0]);
        const uint32_t b = (uint32_t)((PFL_STATE(p, second)[i] - low[1]) * scale[1]);
        noise->order[i] = ((uint64_t)(spread_bits(a) | (spread_bits(b) << 1)) << 32) | i;
    }
    qsort(noise->order, noise->count, sizeof *noise->order, by_key);
    for (uint32_t d = 0u; d < noise->states; d++) {
        float *x = PFL_STATE(p, d);
        for (uint32_t i = 0u; i < noise->count; i++) {
            noise->column[i] = x[noise->order[i] & 0xFFFFFFFFu];
        }
        memcpy(x, noise->column, noise->count * sizeof *x);
    }
}

static void begin_step(noise_t *noise, const pfl_batch_t *p)
{
    for (uint32_t q = 0u; q < noise->noises; q++) {
        noise->shift[q] = pfl_rng_u32(&noise->rng);
    }
    if (noise->kind == NOISE_ARRAY) {
        noise->odd = 1u;
        noise->mask = 0u;
        sort_particles(noise, p);
    } else {
        noise->odd = pfl_rng_u32(&noise->rng) | 1u;
        noise->mask = pfl_rng_u32(&noise->rng);
    }
}

void noise_fill(noise_t *noise, const pfl_batch_t *p, float *out)
{
    if (p->first == 0u) {
        begin_step(noise, p);
    }
    for (uint32_t q = 0u; q < noise->noises; q++) {
        for (uint32_t i = 0u; i < p->n; i++) {
            const uint32_t k = (((p->first + i) * noise->odd) ^ noise->mask) & (noise->count - 1u);
            const uint32_t u = k * noise->step[q] + noise->shift[q];
            out[q * PFL_BATCH + i] = quantile(((float)(u >> 9) + 0.5f) * 1.1920929e-7f); /* 2^-23 */
        }
    }
}
