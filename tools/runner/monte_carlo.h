/* Many runs of a study on several threads. Results are stored by run number, so that everything but the cycle times is
 * the same for any number of threads. */
#ifndef RUNNER_MONTE_CARLO_H
#define RUNNER_MONTE_CARLO_H

#include "scenario.h"

typedef struct {
    double *value;       /* runs x plan.values */
    double *series;      /* runs x plan.steps x plan.columns */
    uint32_t *cycles_ns; /* runs x plan.cycles */
    cycle_t *cycle;      /* runs x plan.cycles */
    uint64_t *hash;      /* runs */
    double *trace;       /* of a traced run: plan.steps x plan.trace_columns; else null */
    text_t cloud;        /* of a traced run; may be empty */
    look_t look;         /* likewise */
} results_t;

/* On failure (of the run with the lowest number that failed) the results are empty. */
bool monte_carlo(const study_t *study, const plan_t *plan, unsigned threads, results_t *results, failure_t *failure);
void results_free(results_t *results);

/* One run, traced. Its results are those of a single run; trace, cloud and look, which the caller sets up, are filled
 * too. */
bool monte_carlo_trace(const study_t *study, const plan_t *plan, uint32_t run, results_t *results, failure_t *failure);

#endif
