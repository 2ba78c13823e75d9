/* What a person is shown of a filter, step by step: truth, estimate, spread, flags and particles in the plane of two states,
 * as lines of JSON. `tools/run SCENARIO --live` moves them on a page or in a terminal, the report draws them. Looking changes
 * no bit of the filter, and costs nothing in a run that nobody looks at. */
#ifndef RUNNER_LOOK_H
#define RUNNER_LOOK_H

#include "text.h"

#include "pflight/pflight.h"

#include <stdio.h>

#define LOOK_POINTS 200u /* particles of a cloud that are shown, at most */

/* Zero it, and set the first two, before use. */
typedef struct {
    uint32_t every;     /* a cloud goes with every so many steps, from the first on */
    FILE *stream;       /* where each line goes at once; null: into the text */
    text_t text;        /* all lines, or the one that is being made */
    uint32_t taken;     /* steps */
    uint32_t resampled; /* resamplings up to the last of them */
} look_t;

/* A step, after its filter cycle. truth: MISSING where it is not known. */
typedef struct {
    double t_s;
    uint16_t state[2];   /* across and up */
    const char *axis[2]; /* their names and units */
    double truth[2];
    const char *instead; /* of the truth, its name; null: it is the truth */
    double estimate[2];
    double variance[2]; /* beyond that of the particles, where part of the state is not in them */
} look_at_t;

/* Adds a step. Nothing happens when `look` is null: call it whether somebody looks or not. */
void look_take(look_t *look, const pfl_t *filter, const look_at_t *at);

/* Another line, and where it ends. */
void look_line(look_t *look);

#endif
