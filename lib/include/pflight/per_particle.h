/* For those who would rather write a function of one particle than a loop over a batch: macros that define a callback
 * from it. The function is static, in the same file, and best short, so that the compiler puts it into the loop:
 *
 *     static void fall(void *user, const void *u, float dt_s, float *x, const float *w)
 *     {
 *         x[0] += dt_s * x[1];
 *         x[1] += dt_s * (w[0] - 9.81f);
 *     }
 *     PFL_PER_PARTICLE_PREDICT(fall_predict, 2, 1, fall)      then .predict = fall_predict
 *
 * What it costs is printed by `tools/bench kernels`, beside the same models as batches (docs/performance.md). A function
 * of + - * / alone vectorises and costs what a batch costs. A call in it, of pfl_sincosf say, is made for every particle
 * by itself: a land vehicle so written takes nine times the instructions of the library's own on x86-64-v3, and 1.5 times
 * on a Cortex-M4F. Write that as a batch, with pfl_sincosf_n.
 *
 * The results are to the bit those of a loop that does the same arithmetic. Numbers of states and noises are constants,
 * 1 or more, at most those of the configuration; the particle's further states are left alone. */
#ifndef PFLIGHT_PER_PARTICLE_H
#define PFLIGHT_PER_PARTICLE_H

#include "pflight/filter.h"

/* Tells gcc what is true: no particle depends on another one. clang, asked likewise, warns wherever a function cannot be
 * made into vectors: it is left to its own judgement, which says no to some models of several states. */
#if defined(__GNUC__) && !defined(__clang__)
#define PFL_INDEPENDENT _Pragma("GCC ivdep")
#else
#define PFL_INDEPENDENT
#endif

/* A pfl_predict_fn `name` from  static void move(void *user, const void *u, float dt_s, float *x, const float *w):
 * x holds the particle's states, to be changed; w its standard normals. */
#define PFL_PER_PARTICLE_PREDICT(name, states, noises, move)                                                           \
    static void name(void *user, const void *u, float dt_s, const pfl_batch_t *p)                                      \
    {                                                                                                                  \
        PFL_INDEPENDENT                                                                                                \
        for (uint32_t i = 0u; i < p->n; i++) {                                                                         \
            float x[states];                                                                                           \
            float w[noises];                                                                                           \
            for (uint32_t d = 0u; d < (states); d++) {                                                                 \
                x[d] = PFL_STATE(p, d)[i];                                                                             \
            }                                                                                                          \
            for (uint32_t q = 0u; q < (noises); q++) {                                                                 \
                w[q] = PFL_NOISE(p, q)[i];                                                                             \
            }                                                                                                          \
            move(user, u, dt_s, x, w);                                                                                 \
            for (uint32_t d = 0u; d < (states); d++) {                                                                 \
                PFL_STATE(p, d)[i] = x[d];                                                                             \
            }                                                                                                          \
        }                                                                                                              \
    }

/* A pfl_loglik_fn `name` from  static float see(void *user, const void *z, const float *x):  the log-likelihood of one
 * particle, 0 for a perfect match. */
#define PFL_PER_PARTICLE_LOGLIK(name, states, see)                                                                     \
    static void name(void *user, const void *z, const pfl_view_t *p, float *ll)                                        \
    {                                                                                                                  \
        PFL_INDEPENDENT                                                                                                \
        for (uint32_t i = 0u; i < p->n; i++) {                                                                         \
            float x[states];                                                                                           \
            for (uint32_t d = 0u; d < (states); d++) {                                                                 \
                x[d] = PFL_STATE(p, d)[i];                                                                             \
            }                                                                                                          \
            ll[i] = see(user, z, x);                                                                                   \
        }                                                                                                              \
    }

/* A pfl_draw_fn `name` from  static void draw(void *user, float *x, const float *w):  sets all states of one particle,
 * w as many standard normals. */
#define PFL_PER_PARTICLE_DRAW(name, states, draw)                                                                      \
    static void name(void *user, const pfl_batch_t *p)                                                                 \
    {                                                                                                                  \
        PFL_INDEPENDENT                                                                                                \
        for (uint32_t i = 0u; i < p->n; i++) {                                                                         \
            float x[states];                                                                                           \
            float w[states];                                                                                           \
            for (uint32_t d = 0u; d < (states); d++) {                                                                 \
                w[d] = PFL_NOISE(p, d)[i];                                                                             \
            }                                                                                                          \
            draw(user, x, w);                                                                                          \
            for (uint32_t d = 0u; d < (states); d++) {                                                                 \
                PFL_STATE(p, d)[i] = x[d];                                                                             \
            }                                                                                                          \
        }                                                                                                              \
    }

#endif
