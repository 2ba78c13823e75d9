/* Other noise for a model's particles than independent normals; experiments of tools/study. */
#ifndef STUDIES_NOISE_H
#define STUDIES_NOISE_H

#include "pflight/pflight.h"

#include <stdbool.h>
#include <stdint.h>

typedef enum {
    NOISE_PLAIN,      /* the library's */
    NOISE_ANTITHETIC, /* the library's too (pflight/antithetic.h): not made here */
    NOISE_QUASI, /* all N particles share a lattice of Q dimensions, shifted at random and in random order each step */
    NOISE_ARRAY  /* the particles are sorted along a Z-curve through their first two states, and the lattice has one
                         dimension more: the place in that order (array-RQMC; L'Ecuyer, Lecot and Tuffin 2008). Equal
                         weights, so ess_ratio = 1. */
} noise_kind_t;

typedef struct {
    noise_kind_t kind;
    uint32_t count, states, noises;
    pfl_rng_t rng;
    uint32_t step[PFL_NOISES_MAX];  /* of the lattice, 2^-32 each */
    uint32_t shift[PFL_NOISES_MAX]; /* of this step */
    uint32_t odd, mask;             /* of this step's order; N is a power of two */
    uint64_t *order;                /* NOISE_ARRAY: key and index */
    float *column;
} noise_t;

noise_kind_t noise_kind(const char *name);

/* False when out of memory, or when N is not a power of two. */
bool noise_start(noise_t *noise, noise_kind_t kind, const pfl_config_t *config);
void noise_free(noise_t *noise);

/* The noise of a batch, PFL_BATCH apart, as in pfl_batch_t. A batch that begins with particle 0 begins a step. */
void noise_fill(noise_t *noise, const pfl_batch_t *p, float *out);

#endif
