/* Results as JSON: a study by itself, and as part of the summary of all. */
#ifndef RUNNER_JSON_H
#define RUNNER_JSON_H

#include "render.h"

/* A string with its quotes. */
void json_string(text_t *text, const char *string);

/* The one object of --json, and a newline. */
void json_study(const outcome_t *outcome, text_t *text);

/* The same object with more in it, for the summary: the paper's figure, the reference and the acceptance of each
 * metric, times of the resampling, notes, and the files beside the summary. `cloud`: there is one. */
void json_summary_study(const outcome_t *outcome, const char *id, bool cloud, text_t *text);

#endif
