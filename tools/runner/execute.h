/* Carries out studies: the one that the command line asks for, and each of those of `tools/run` alone. */
#ifndef RUNNER_EXECUTE_H
#define RUNNER_EXECUTE_H

#include "cli.h"
#include "render.h"

/* One scenario: tables on standard output (or the JSON object alone), files as asked; or the trace of a run. Answers
 * false when something failed; otherwise *accepted says whether all that was judged is within its acceptance. */
bool execute_one(const cli_t *cli, bool *accepted, failure_t *failure);

/* Makes all runs of a study and hands what came out to `use`. */
typedef bool (*use_fn)(void *user, const outcome_t *outcome, failure_t *failure);
bool execute_study(const cli_t *cli, const study_t *study, use_fn use, void *user, failure_t *failure);

typedef struct {
    size_t steps;
    bool cloud;    /* the scenario has particles to show */
    bool look;     /* and steps to be looked at */
    uint64_t hash; /* what the study's hash would be if this were its only run */
} traced_t;

/* Replays one run into a file, and its particles and steps to be looked at, if there are any, into others. cloud, look:
 * null: not wanted. */
bool execute_trace(const study_t *study, uint32_t run, const char *trace, const char *cloud, const char *look,
                   traced_t *traced, failure_t *failure);

/* Writes what a render function makes of an outcome. */
typedef void (*render_fn)(const outcome_t *outcome, text_t *text);
bool execute_write(render_fn render, const outcome_t *outcome, const char *path, failure_t *failure);

#endif
