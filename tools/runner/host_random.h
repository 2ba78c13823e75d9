/* The runner's own random numbers, for truth and measurements: independent of the library's generator, so that a
 * defect of that one cannot hide in the data. xoshiro256** (Blackman and Vigna 2018) with Box and Muller's normals. */
#ifndef RUNNER_HOST_RANDOM_H
#define RUNNER_HOST_RANDOM_H

#include <stdbool.h>
#include <stdint.h>

/* What a stream is for. A stream of one purpose never depends on how much another was used, hence every filter sees
 * the same truth and the same measurements. */
typedef enum { RANDOM_TRUTH = 1, RANDOM_MEASUREMENT = 2, RANDOM_FILTER_SEED = 3 } random_purpose_t;

typedef struct {
    uint64_t s[4];
    double spare;
    bool has_spare;
} host_random_t;

/* A stream that is a pure function of (seed, run, purpose). */
void host_random_start(host_random_t *random, uint64_t seed, uint64_t run, random_purpose_t purpose);

uint64_t host_random_u64(host_random_t *random);
double host_random_uniform(host_random_t *random); /* in (0, 1], 53 bits */
double host_random_normal(host_random_t *random);

#endif
