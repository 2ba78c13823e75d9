/* From a study to its results on paper: see execute.h. Everything is computed before anything is written. */
#include "execute.h"

#include "cloud.h"
#include "hash.h"
#include "json.h"
#include "monte_carlo.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>

#define LOOK_CLOUDS 24u /* of a run in the report, about so many */

/* ---- Results ------------------------------------------------------------------------------------------------------ */

/* Sorts them. */
static spread_t spread_of(uint32_t *ns, size_t n)
{
    if (n == 0u) {
        return (spread_t){MISSING, MISSING, MISSING};
    }
    stats_sort_u32(ns, n);
    return (spread_t){
        .p50_us = 1e-3 * (double)stats_quantile_u32(ns, n, 0.50),
        .p99_us = 1e-3 * (double)stats_quantile_u32(ns, n, 0.99),
        .max_us = 1e-3 * (double)ns[n - 1u],
    };
}

static timing_t time_cycles(const study_t *study, const plan_t *plan, const results_t *results)
{
    const size_t n = study->runs * plan->cycles;
    uint32_t *ns = results->cycles_ns;
    timing_t timing = {
        .cycle = spread_of(ns, n),
        .budget_us = study->budget_us > 0.0 ? study->budget_us : plan->budget_us,
    };
    size_t resampled = 0u;

    for (size_t i = n; i > 0u && 1e-3 * (double)ns[i - 1u] > timing.budget_us; i--) {
        timing.overruns++;
    }
    /* The cycle times have been counted: their room takes the times of resampling. */
    for (size_t i = 0u; i < n; i++) {
        if (results->cycle[i].resample_ns > 0u) {
            ns[resampled++] = results->cycle[i].resample_ns;
        }
    }
    timing.resampling = spread_of(ns, resampled);
    timing.resampled_share = n == 0u ? 0.0 : (double)resampled / (double)n;
    return timing;
}

/* Fills in verdict, timing and hash. */
static bool assess(outcome_t *outcome, failure_t *failure)
{
    const study_t *study = outcome->study;
    const plan_t *plan = outcome->plan;
    const table_t runs = {outcome->results->value, study->runs, plan->values};

    study->scenario->judge(plan, runs, &outcome->verdict);
    outcome->timing = time_cycles(study, plan, outcome->results);
    outcome->hash = HASH_START;
    for (uint32_t r = 0u; r < study->runs; r++) {
        outcome->hash = hash_u64(outcome->hash, outcome->results->hash[r]);
    }
    for (size_t i = 0u; i < outcome->verdict.count; i++) {
        const metric_t *metric = &outcome->verdict.metric[i];
        if (!isfinite(metric->ours.mean)) {
            return fail(failure, EXIT_HARNESS, "%s: the metric %s is not finite", study->scenario->name, metric->name);
        }
    }
    return true;
}

/* ---- Output ------------------------------------------------------------------------------------------------------- */

bool execute_write(render_fn render, const outcome_t *outcome, const char *path, failure_t *failure)
{
    text_t text = {0};

    render(outcome, &text);
    const bool written = text_write(&text, path, failure);
    text_free(&text);
    return written;
}

static bool write_csv(const outcome_t *outcome, const char *folder, failure_t *failure)
{
    const char *name = outcome->study->scenario->name;
    const size_t room = strlen(folder) + strlen(name) + 8u;
    char *path = malloc(room);

    if (path == NULL) {
        return fail(failure, EXIT_HARNESS, "out of memory");
    }
    bool written = mkdir(folder, 0777) == 0 || errno == EEXIST ||
                   fail(failure, EXIT_HARNESS, "--csv '%s': cannot make this folder: %s", folder, strerror(errno));
    (void)snprintf(path, room, "%s/%s.csv", folder, name);
    written = written && execute_write(render_csv, outcome, path, failure);
    free(path);
    return written;
}

static bool write_outputs(const cli_t *cli, const outcome_t *outcome, failure_t *failure)
{
    const bool json_only = cli->json != NULL && strcmp(cli->json, "-") == 0;

    return (cli->csv == NULL || write_csv(outcome, cli->csv, failure)) &&
           (cli->json == NULL || execute_write(json_study, outcome, cli->json, failure)) &&
           (json_only || execute_write(render_table, outcome, "-", failure));
}

/* ---- Studies ------------------------------------------------------------------------------------------------------ */

static double now_s(void)
{
    struct timespec now = {0, 0};

    (void)clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

bool execute_study(const cli_t *cli, const study_t *study, use_fn use, void *user, failure_t *failure)
{
    const double begin_s = now_s();
    plan_t plan;
    results_t results = {0};
    outcome_t outcome = {.study = study, .plan = &plan, .results = &results};

    if (!study->scenario->open(study, &plan, failure)) {
        return false;
    }
    bool done = monte_carlo(study, &plan, cli->threads, &results, failure) && assess(&outcome, failure);
    outcome.elapsed_s = now_s() - begin_s;
    done = done && use(user, &outcome, failure);
    text_free(&outcome.verdict.notes);
    results_free(&results);
    study->scenario->close(&plan);
    return done;
}

bool execute_trace(const study_t *study, uint32_t run, const char *trace, const char *cloud, const char *look,
                   traced_t *traced, failure_t *failure)
{
    plan_t plan;
    results_t results = {0};
    text_t text = {0};

    if (!study->scenario->open(study, &plan, failure)) {
        return false;
    }
    results.look.every = (uint32_t)(plan.cycles / LOOK_CLOUDS + 1u);
    json_look(study, &plan, run, &results.look.text);
    bool done = monte_carlo_trace(study, &plan, run, &results, failure);
    if (done) {
        render_trace(&plan, &results, &text);
        *traced = (traced_t){plan.steps, results.cloud.length > 0u, results.look.taken > 0u,
                             hash_u64(HASH_START, results.hash[0])};
        done = text_write(&text, trace, failure);
    }
    text_free(&text);
    if (done && cloud != NULL && traced->cloud) {
        text_add(&text, "%s%s", CLOUD_HEADER, results.cloud.bytes);
        text.spoilt = text.spoilt || results.cloud.spoilt;
        done = text_write(&text, cloud, failure);
    }
    done = done && (look == NULL || !traced->look || text_write(&results.look.text, look, failure));
    text_free(&text);
    results_free(&results);
    study->scenario->close(&plan);
    return done;
}

/* All steps of one run of a filter, each with its cloud; onto standard output as they come. */
static bool look_with(const study_t *study, uint32_t run, const char *path, bool *taken, failure_t *failure)
{
    const bool standard = strcmp(path, "-") == 0;
    plan_t plan;
    results_t results = {.look = {.every = 1u, .stream = standard ? stdout : NULL}};
    text_t *text = &results.look.text;

    if (!study->scenario->open(study, &plan, failure)) {
        return false;
    }
    json_look(study, &plan, run, text);
    bool done = monte_carlo_trace(study, &plan, run, &results, failure);
    *taken = done && results.look.taken > 0u;
    if (*taken) {
        text_add(text, "{\"hash\":\"%016llx\"}", (unsigned long long)hash_u64(HASH_START, results.hash[0]));
        look_line(&results.look);
        done = standard ? !text->spoilt && ferror(stdout) == 0 : text_write(text, path, failure);
        done = done || fail(failure, EXIT_HARNESS, "cannot write to standard output");
    }
    results_free(&results);
    study->scenario->close(&plan);
    return done;
}

/* The filter asked for, or else the first of the scenario's that has particles. */
static bool look_at_one(const cli_t *cli, study_t *study, failure_t *failure)
{
    const char *filters = cli->filter != NULL ? cli->filter : study->scenario->filters;
    bool taken = false;

    while (!taken && *filters != '\0') {
        const size_t length = strcspn(filters, "|");
        (void)snprintf(study->filter, sizeof study->filter, "%.*s", (int)length, filters);
        if (!look_with(study, cli->trace_run, cli->looks, &taken, failure) &&
            (cli->filter != NULL || failure->exit_code != EXIT_USAGE)) {
            return false; /* a filter that does not go with the settings is not the one to look at */
        }
        filters += length + (filters[length] == '|' ? 1u : 0u);
    }
    return taken || fail(failure, EXIT_USAGE, "%s: no particles to look at with these settings: give another --filter",
                         study->scenario->name);
}

static bool trace_one(const cli_t *cli, const study_t *study, failure_t *failure)
{
    traced_t traced;

    if (!execute_trace(study, cli->trace_run, cli->trace, cli->cloud, NULL, &traced, failure)) {
        return false;
    }
    if (cli->cloud != NULL && !traced.cloud) {
        return fail(failure, EXIT_HARNESS, "--cloud: %s has no particles to show with these settings",
                    study->scenario->name);
    }
    if (strcmp(cli->trace, "-") != 0) {
        (void)printf("%s: run %lu of seed %llu: %lu steps in %s; hash %016llx\n", study->scenario->name,
                     (unsigned long)cli->trace_run, (unsigned long long)study->seed, (unsigned long)traced.steps,
                     cli->trace, (unsigned long long)traced.hash);
    }
    return true;
}

typedef struct {
    const cli_t *cli;
    bool *accepted;
} one_t;

static bool use_one(void *user, const outcome_t *outcome, failure_t *failure)
{
    const one_t *one = user;

    *one->accepted = outcome_is_accepted(outcome);
    return write_outputs(one->cli, outcome, failure);
}

bool execute_one(const cli_t *cli, bool *accepted, failure_t *failure)
{
    one_t one = {cli, accepted};
    study_t study;

    *accepted = true;
    if (!cli_study(cli, cli->scenario, &study, failure)) {
        return false;
    }
    if (cli->looks != NULL) {
        return look_at_one(cli, &study, failure);
    }
    return cli->trace != NULL ? trace_one(cli, &study, failure) : execute_study(cli, &study, use_one, &one, failure);
}
