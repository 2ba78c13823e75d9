/* What the Python module adds to the library: a model and a prior with a `user` each (the library hands one to both), a
 * Gaussian prior, and the hash of tools/run. */
#ifndef PFLIGHT_PYTHON_GLUE_H
#define PFLIGHT_PYTHON_GLUE_H

#include "pflight/filter.h"

typedef struct {
    pfl_predict_fn predict;
    void *user;
    pfl_draw_fn draw; /* not null */
    void *draw_user;
} pflight_motion_t;

void pflight_motion_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p);
void pflight_motion_draw(void *user, const pfl_batch_t *p);

/* x = mean + sigma w, each state by itself. */
typedef struct {
    uint32_t states;
    float mean[PFL_STATES_MAX];
    float sigma[PFL_STATES_MAX];
} pflight_gaussian_t;

void pflight_gaussian_draw(void *user, const pfl_batch_t *p);

/* 64-bit FNV-1a over the bits of floats, lowest byte first: the hash that tools/run prints of its estimates. */
uint64_t pflight_hash_floats(uint64_t hash, const float *x, size_t n);

#endif
