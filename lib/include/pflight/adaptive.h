/* A number of particles that follows the need and the time there is, inside an arena laid out once for the most.
 *
 * By need (KLD sampling: Fox 2003): as many as keep the distance between the particles' distribution and the true one,
 * both seen through a grid, below `error` with the probability that belongs to `quantile`, whatever the truth. Clouds that
 * cover few cells of the grid need few particles: many while a vehicle is being found, few once it is.
 *
 * By time (deadline): as many as fit `budget_cycles` of the configuration, by what a cycle has cost a particle at worst so
 * far. It begins with the fewest and grows, so that the budget holds from the first cycle on.
 *
 * A cycle is pfl_predict, pfl_update for each measurement, and pfl_adapt, which does the resampling: the configuration's
 * ess_ratio is 0. The configuration lies in memory that can be written, because its `particles` changes; the guards follow.
 * Snapshots restore into a filter of the same N: pfl_set_particles first. docs/filters.md tells what it saves and costs. */
#ifndef PFLIGHT_ADAPTIVE_H
#define PFLIGHT_ADAPTIVE_H

#include "pflight/filter.h"

#ifdef __cplusplus
extern "C" {
#endif

#define PFL_BINS_DIMENSIONS 4u /* states that span the grid, at most */

/* One filter's alone. Zeroed fields mean what their comments say. */
typedef struct {
    pfl_config_t config; /* of the filter: ess_ratio 0, resampling null (it is systematic), particles = most */
    uint32_t most;       /* N at most, config.particles at first */
    uint32_t least;      /* N at least, 1 .. most; clouds of a hundred and more keep estimates from jumping */
    float ess_ratio;     /* pfl_adapt resamples when the effective sample size < ess_ratio N; 0.5 usual */

    float error;    /* 0.01 .. 0.1 usual; 0: not by need */
    float quantile; /* of the standard normal: 2.33 for 99 % */
    uint32_t bits; /* 2^5 .. 2^24, a power of two, twice as many as cells are ever covered; below that the count is good
                       to some percent, beyond the cells go on being counted up to bits log(bits) */
    uint32_t *bins;                       /* bits / 32 words of the caller's, for the library to write */
    uint32_t dimensions;                  /* 1 .. PFL_BINS_DIMENSIONS */
    uint16_t state[PFL_BINS_DIMENSIONS];  /* that span the grid; those of circular_mask are wrapped */
    float inv_width[PFL_BINS_DIMENSIONS]; /* 1 / width of a cell: a deviation of the converged cloud or two */

    float budget_share; /* of config.budget_cycles, to be used: 0.9 usual; 0: not by time */

    float rate;       /* the library's own: cycles a particle, at worst; 0 before the first cycle */
    uint32_t covered; /* its answer: cells that the last resampling covered */
    uint32_t wanted;  /* and the particles that would need */
} pfl_adaptive_t;

/* pfl_init with a->config; by time, the filter then goes on with a->least. Answers as pfl_init, and PFL_ERR_CONFIG for an
 * `a` that is out of range. O(N D). */
pfl_status_t pfl_adaptive_init(void *arena, size_t arena_bytes, pfl_adaptive_t *a, uint64_t t_us, pfl_t **out);

/* Ends a cycle: resamples when that is due, into as many particles as are needed and as there is time for. The effective
 * sample size is that of the last update, at most the new N. PFL_OK, PFL_ERR_CONFIG (`a` is out of range or not this
 * filter's), and as pfl_resample. O(1) when nothing is due, else O(N (D + dimensions)). */
pfl_status_t pfl_adapt(pfl_t *f, pfl_adaptive_t *a);

/* Resamples now into n particles, 1 .. a->most, equal weights afterwards. PFL_OK, PFL_ERR_ARG (n), as pfl_adapt. */
pfl_status_t pfl_set_particles(pfl_t *f, pfl_adaptive_t *a, uint32_t n);

/* Fox's bound: (k - 1) / (2 error) (1 - a + sqrt(a) quantile)^3, a = 2 / (9 (k - 1)), rounded up; 1 for k < 2 cells, at
 * most PFL_PARTICLES_MAX. O(1). */
uint32_t pfl_kld_particles(float cells, float error, float quantile);

#ifdef __cplusplus
}
#endif

#endif
