/* Threads that take the next run until none is left: see monte_carlo.h. */
#include "monte_carlo.h"

#include "hash.h"
#include "progress.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
    const study_t *study;
    const plan_t *plan;
    results_t *results;
    pthread_mutex_t mutex; /* guards all below */
    uint32_t next;         /* run to take */
    uint32_t done;
    uint32_t failed_run; /* lowest so far; study->runs: none */
    failure_t failure;   /* its reason */
    progress_t progress;
} work_t;

static bool take_run(work_t *work, uint32_t *run)
{
    pthread_mutex_lock(&work->mutex);
    *run = work->next;
    /* After a failure only runs of lower numbers go on, and those are all taken: the lowest failure gets known. */
    const bool taken = work->next < work->study->runs && work->failed_run == work->study->runs;
    work->next += taken ? 1u : 0u;
    pthread_mutex_unlock(&work->mutex);
    return taken;
}

static void finish_run(work_t *work, uint32_t run, bool good, const failure_t *failure)
{
    pthread_mutex_lock(&work->mutex);
    work->done++;
    if (!good && run < work->failed_run) {
        work->failed_run = run;
        work->failure = *failure;
    }
    progress_show(&work->progress, work->done, work->study->runs);
    pthread_mutex_unlock(&work->mutex);
}

/* The place of the i-th run among the results. */
static run_output_t output_of(const results_t *results, const plan_t *plan, uint32_t i)
{
    return (run_output_t){
        .value = results->value + i * plan->values,
        .series = results->series + i * plan->steps * plan->columns,
        .cycles_ns = results->cycles_ns + i * plan->cycles,
        .cycle = results->cycle + i * plan->cycles,
        .hash = HASH_START,
    };
}

static void *work_on_runs(void *argument)
{
    work_t *work = argument;
    const plan_t *plan = work->plan;
    const results_t *results = work->results;
    uint32_t run;

    while (take_run(work, &run)) {
        failure_t failure;
        run_output_t out = output_of(results, plan, run);
        const bool good = work->study->scenario->run(plan, run, &out, &failure);
        results->hash[run] = out.hash;
        finish_run(work, run, good, &failure);
    }
    return NULL;
}

static bool make_results(results_t *results, const plan_t *plan, size_t runs)
{
    /* One element more than needed: calloc may answer null to a request for nothing. */
    results->value = calloc(runs * plan->values + 1u, sizeof *results->value);
    results->series = calloc(runs * plan->steps * plan->columns + 1u, sizeof *results->series);
    results->cycles_ns = calloc(runs * plan->cycles + 1u, sizeof *results->cycles_ns);
    results->cycle = calloc(runs * plan->cycles + 1u, sizeof *results->cycle);
    results->hash = calloc(runs, sizeof *results->hash);
    return results->value != NULL && results->series != NULL && results->cycles_ns != NULL && results->cycle != NULL &&
           results->hash != NULL;
}

void results_free(results_t *results)
{
    free(results->value);
    free(results->series);
    free(results->cycles_ns);
    free(results->cycle);
    free(results->hash);
    free(results->trace);
    text_free(&results->cloud);
    text_free(&results->look.text);
    memset(results, 0, sizeof *results);
}

/* The calling thread works too, so a helper that cannot be started only costs time. */
static void work_with_helpers(work_t *work, unsigned helpers)
{
    pthread_t *thread = calloc(helpers + 1u, sizeof *thread);
    unsigned started = 0u;

    while (thread != NULL && started < helpers && pthread_create(&thread[started], NULL, work_on_runs, work) == 0) {
        started++;
    }
    (void)work_on_runs(work);
    while (started > 0u) {
        (void)pthread_join(thread[--started], NULL);
    }
    free(thread);
}

bool monte_carlo(const study_t *study, const plan_t *plan, unsigned threads, results_t *results, failure_t *failure)
{
    work_t work = {.study = study, .plan = plan, .results = results, .failed_run = study->runs};

    if (!make_results(results, plan, study->runs)) {
        results_free(results);
        return fail(failure, EXIT_HARNESS, "%s: not enough memory for %lu runs", study->scenario->name,
                    (unsigned long)study->runs);
    }
    if (pthread_mutex_init(&work.mutex, NULL) != 0) {
        results_free(results);
        return fail(failure, EXIT_HARNESS, "%s: the system has no mutex to give", study->scenario->name);
    }
    progress_begin(&work.progress, study->scenario->name);
    work_with_helpers(&work, (threads < study->runs ? threads : study->runs) - 1u);
    progress_end(&work.progress);
    (void)pthread_mutex_destroy(&work.mutex);
    if (work.failed_run < study->runs) {
        results_free(results);
        return fail(failure, EXIT_HARNESS, "%s: run %lu: %s", study->scenario->name, (unsigned long)work.failed_run,
                    work.failure.text);
    }
    return true;
}

bool monte_carlo_trace(const study_t *study, const plan_t *plan, uint32_t run, results_t *results, failure_t *failure)
{
    failure_t inner = {.exit_code = EXIT_HARNESS};

    const bool made = make_results(results, plan, 1u);
    results->trace = calloc(plan->steps * plan->trace_columns + 1u, sizeof *results->trace);
    if (!made || results->trace == NULL) {
        results_free(results);
        return fail(failure, EXIT_HARNESS, "%s: not enough memory for a trace", study->scenario->name);
    }
    run_output_t out = output_of(results, plan, 0u);
    out.trace = results->trace;
    out.cloud = &results->cloud;
    out.look = &results->look;
    if (!study->scenario->run(plan, run, &out, &inner)) {
        results_free(results);
        return fail(failure, EXIT_HARNESS, "%s: run %lu: %s", study->scenario->name, (unsigned long)run, inner.text);
    }
    results->hash[0] = out.hash;
    return true;
}
