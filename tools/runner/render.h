/* The results of a study as a table for people, and its time series as CSV. JSON: json.h. */
#ifndef RUNNER_RENDER_H
#define RUNNER_RENDER_H

#include "monte_carlo.h"
#include "scenario.h"

/* Times of some cycles; MISSING where there is none. */
typedef struct {
    double p50_us, p99_us, max_us;
} spread_t;

typedef struct {
    spread_t cycle;
    spread_t resampling;    /* in the cycles that resampled */
    double resampled_share; /* of the cycles */
    double budget_us;
    uint32_t overruns; /* filter cycles over the budget */
} timing_t;

/* All that came out of a study. */
typedef struct {
    const study_t *study;
    const plan_t *plan;
    const results_t *results;
    verdict_t verdict;
    timing_t timing;
    uint64_t hash;    /* over all estimates of all runs */
    double elapsed_s; /* that the runs took */
} outcome_t;

bool metric_is_judged(const metric_t *metric);
bool metric_is_accepted(const metric_t *metric);

/* Whether half of the filter cycles keep the budget; true without any cycle. */
bool timing_is_accepted(const timing_t *timing);

/* All that is judged about a study. */
bool outcome_is_accepted(const outcome_t *outcome);

void render_table(const outcome_t *outcome, text_t *text);

/* The time series, mean over the runs. What is MISSING is an empty field. */
void render_csv(const outcome_t *outcome, text_t *text);

/* The time series of a traced run, with its trace columns and what the filter did in each cycle. */
void render_trace(const plan_t *plan, const results_t *results, text_t *text);

#endif
