/* What the resampling schemes share: weights as integers, and the comb of evenly spaced points. resample.c tells how. */
#ifndef PFL_RESAMPLE_H
#define PFL_RESAMPLE_H

#include "core.h"

typedef struct {
    uint32_t factor; /* M */
    uint32_t shift;  /* F */
} comb_t;

/* 0 < count <= 2^20, 2^30 < total < 2^31. */
comb_t pfl_comb_of(uint32_t count, uint32_t total);

/* h(c) */
static inline uint32_t height(uint32_t factor, uint32_t c)
{
    return (uint32_t)(((uint64_t)c * factor) >> 32);
}

/* The weights in the scratch column to integers; returns their sum. */
uint32_t pfl_quantise(pfl_t *f);

#endif
