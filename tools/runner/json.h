/* Results as JSON: a study by itself, and as part of the summary of all. */
#ifndef RUNNER_JSON_H
#define RUNNER_JSON_H

#include "execute.h"
#include "render.h"

/* A string with its quotes. */
void json_string(text_t *text, const char *string);

/* The one object of --json, and a newline. */
void json_study(const outcome_t *outcome, text_t *text);

/* The same object with more in it, for the summary: the paper's figure, the reference and the acceptance of each
 * metric, times of the resampling, notes, and the files beside the summary. */
void json_summary_study(const outcome_t *outcome, const char *id, const traced_t *traced, text_t *text);

/* What is looked at (look.h): the beginning of its first line. */
void json_look(const study_t *study, const plan_t *plan, uint32_t run, text_t *text);

#endif
