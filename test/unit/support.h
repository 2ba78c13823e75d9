/* What the unit tests share: arenas between red zones, and filters whose every number the test dictates. */
#ifndef PFL_UNIT_SUPPORT_H
#define PFL_UNIT_SUPPORT_H

#include "pflight/filter.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* ---- Arenas with a red zone on either side --------------------------------------------------------------------- */

/* An arena of exactly `bytes`, aligned to 8, filled with 0xA5; between two red zones. */
void *ut_arena(size_t bytes);

/* An arena for a filter of this configuration. */
void *ut_arena_for(const pfl_config_t *config, size_t *bytes);

/* True when nobody wrote into a red zone since the arenas were made. */
bool ut_red_zones_intact(void);

/* True when the first `bytes` of an arena still hold its first filling. */
bool ut_untouched(const void *arena, size_t bytes);

/* For tearDown: checks all red zones, and frees the arenas. */
void ut_arenas_end(void);

/* ---- A model and a sensor that the test dictates --------------------------------------------------------------- */

/* Particles as `states` columns of `particles` numbers each. */
typedef struct {
    const float *x;
    uint32_t particles;
    uint32_t states;
} ut_table_t;

void ut_table_draw(void *user, const pfl_batch_t *p);                               /* user: ut_table_t */
void ut_index_draw(void *user, const pfl_batch_t *p);                               /* state 0 <- index */
void ut_index_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p); /* likewise */
void ut_hold_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p);  /* nothing moves */
void ut_dictated_loglik(void *user, const void *z, const pfl_view_t *p, float *ll); /* z: float[N] */

/* A configuration of N particles and D states, held in place and weighed as dictated; never resampled on its own. */
pfl_config_t ut_dictated_config(uint32_t particles, uint16_t states);

/* ---- A linear Gaussian model ----------------------------------------------------------------------------------- */

/* Position and speed: x += v dt + 0.1 w0, v += 0.05 w1; prior N(0, 1); z: float, position with unit variance. */
void ut_linear_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p);
void ut_linear_draw(void *user, const pfl_batch_t *p);
void ut_linear_loglik(void *user, const void *z, const pfl_view_t *p, float *ll);
pfl_config_t ut_linear_config(uint32_t particles);

/* ---- Filters and their bytes ----------------------------------------------------------------------------------- */

/* Builds a filter at t = 0 in an arena of its own; the test fails unless it is PFL_OK. */
pfl_t *ut_filter(const pfl_config_t *config);

/* A snapshot, to be freed by ut_arenas_end. */
unsigned char *ut_snapshot(const pfl_t *f);

/* Are two snapshots of one filter the same, apart from the counters and the test ratio that even a refused call may
 * change? */
bool ut_same_posterior(const unsigned char *a, const unsigned char *b, size_t bytes);

/* ... and every byte the same. */
bool ut_same_bytes(const unsigned char *a, const unsigned char *b, size_t bytes);

/* A cycle of the linear filter: predict to t_us, update with z, estimate into a hash. */
uint64_t ut_fly_linear(pfl_t *f, uint64_t t_us, float z, uint64_t hash);

/* ---- Numbers ---------------------------------------------------------------------------------------------------- */

#define UT_FNV_SEED 0xCBF29CE484222325u

uint64_t ut_fnv(uint64_t hash, const void *bytes, size_t n);
uint32_t ut_bits(float x);
float ut_float(uint32_t bits);
bool ut_finite(float x);
float ut_infinity(void); /* +inf */
float ut_nan(bool negative);

/* A small generator of the tests' own (xorshift64*), for inputs. */
uint32_t ut_random(uint64_t *state);
double ut_uniform(uint64_t *state);  /* [0, 1) */
double ut_gaussian(uint64_t *state); /* mean 0, variance 1 */

/* Distance of a float from a double reference, in units of the last place of the float nearest to the reference. */
double ut_ulp(float got, double reference);

#endif
