/* What the resampling schemes share: weights as integers, and the comb of evenly spaced points. resample.c tells how. */
#ifndef PFL_RESAMPLE_H
#define PFL_RESAMPLE_H

#include "core.h"

typedef struct {
    uint32_t factor; /* M */
    uint32_t shift;  /* F */
} comb_t;

/* 0 < count <= 2^20, 2^30 < total < 2^31. */
/*@ requires 0 < count <= PFL_PARTICLES_MAX;
    assigns \nothing;
    ensures 9 <= \result.shift <= 29; */
comb_t pfl_comb_of(uint32_t count, uint32_t total);

/* h(c) */
/*@ assigns \nothing; */
static inline uint32_t height(uint32_t factor, uint32_t c)
{
    return (uint32_t)(((uint64_t)c * factor) >> 32);
}

/* The weights in the scratch column to integers; returns their sum. */
/*@ requires sized(f) && column(f->scratch, f);
    assigns f->scratch[0 .. padded(f) - 1]; */
uint32_t pfl_quantise(pfl_t *f);

#endif
