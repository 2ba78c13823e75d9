/* Where the words under test come from: the library's eight uniform streams in the order in which pfl_rng_normals takes
 * them, or its normals as uniform words. */
#ifndef RANDOMNESS_SOURCE_H
#define RANDOMNESS_SOURCE_H

#include "pflight/rng.h"

#include <stdint.h>

#define SOURCE_ROWS 512u /* of eight words, or of normals in groups of sixteen, made at once */

typedef enum { SOURCE_UNIFORM, SOURCE_NORMAL } source_kind_t;

typedef struct {
    pfl_rng_t rng;
    source_kind_t kind;
    uint64_t numbers; /* of the generator under test, handed out so far */
    uint32_t next;    /* in `word` */
    uint32_t word[SOURCE_ROWS * PFL_RNG_LANES];
} source_t;

/* stream: how many long jumps from the seed's start, so that tests side by side never share a number. */
void source_start(source_t *source, source_kind_t kind, uint64_t seed, unsigned stream);

/* Uniform: the next 32 bits. Normal: the first 16 bits of Phi(z) of two normals, one after the other. A float near 1
 * has steps of 2^-23 and with them Phi(z) of some 2^-25: of its first 16 bits all are the generator's doing, of the
 * next eight less and less. Twenty would still be fair to a single test; with sixteen two fill a word. */
uint32_t source_word(source_t *source);

/* A hash of the bits of the first 65536 numbers: a result that was stored holds as long as this is the same. */
uint64_t source_fingerprint(source_kind_t kind, uint64_t seed);

/* The distribution function of the normal, to 1e-14, for |z| < 8. */
double normal_cdf(float z);

#endif
