/* Carries out what the command line asks for, and answers with the exit code. */
#ifndef RUNNER_EXECUTE_H
#define RUNNER_EXECUTE_H

#include "cli.h"

/* One scenario: tables on standard output (or the JSON object alone), files as asked. Answers false when something
 * failed; otherwise *accepted says whether all that was judged is within its acceptance. */
bool execute_one(const cli_t *cli, bool *accepted, failure_t *failure);

/* Every scenario with the studies of its campaign; those whose recordings are missing are named and skipped. */
bool execute_all(const cli_t *cli, bool *accepted, failure_t *failure);

#endif
