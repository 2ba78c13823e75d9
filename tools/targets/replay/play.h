/* The calls of a tape, one function each, and what they share. */
#ifndef TARGETS_PLAY_H
#define TARGETS_PLAY_H

#include "words.h"

#define PLAY_SENSORS_MAX 8u
#define PLAY_NMPC_STEPS_BYTES 64u

typedef struct {
    pfl_t *filter;
    pfl_t *ahead; /* the fork of the last forecast */
    uint32_t steps_max;
    float ess_ratio; /* < 0: the tape's */
    float sharpen;
    bool mirror; /* antithetic noise */
    uint32_t cycles;
    uint32_t calls;
    uint32_t arena_bytes; /* of the last pfl_init */
    uint64_t hash;        /* of all means that pfl_estimate gave */
} play_t;

/* ---- A call to be counted: play_mark() right before it, play_count() right after it --------------------------------- */

#if defined(__arm__) && !defined(__linux__)
#define PLAY_STACK_POINTER(sp) __asm__ volatile("mov %0, sp" : "=r"(sp))
#elif defined(__riscv) && !defined(__linux__)
#define PLAY_STACK_POINTER(sp) __asm__ volatile("mv %0, sp" : "=r"(sp))
#else
#define PLAY_STACK_POINTER(sp) ((sp) = NULL)
#endif

typedef struct {
    uint32_t *sp;
    uint32_t start;
} mark_t;

#define PLAY_MARK(m)                                                                                                   \
    do {                                                                                                               \
        PLAY_STACK_POINTER((m).sp);                                                                                    \
        play_paint((m).sp);                                                                                            \
        (m).start = pfl_port_cycles();                                                                                 \
    } while (0)

void play_paint(const uint32_t *sp);

/* Writes the record of a call to tape.ticks: operation, counts of the port, bytes of stack, resamplings so far. */
void play_count(const play_t *p, tape_op_t op, mark_t mark, uint32_t stop);

/* ---- Calls; false when the tape makes no sense ------------------------------------------------------------------------- */

bool play_init(play_t *p);
bool play_predict(play_t *p);
bool play_update(play_t *p);
bool play_estimate(play_t *p);
bool play_resample(play_t *p);
bool play_reset(play_t *p);
bool play_farthest(play_t *p);
bool play_ess(play_t *p);
bool play_forecast(play_t *p);
bool play_standoff(play_t *p);
bool play_lvfg(play_t *p);
bool play_nmpc_solve(play_t *p);

#endif
