/* From a study to its results on paper: see execute.h. Everything is computed before anything is written. */
#include "execute.h"

#include "hash.h"
#include "monte_carlo.h"
#include "render.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

/* ---- Results ------------------------------------------------------------------------------------------------------ */

static timing_t time_cycles(const study_t *study, const plan_t *plan, uint32_t *cycles_ns)
{
    const size_t n = study->runs * plan->cycles;
    timing_t timing = {.budget_us = study->budget_us > 0.0 ? study->budget_us : plan->budget_us};

    if (n == 0u) {
        return timing;
    }
    stats_sort_u32(cycles_ns, n);
    timing.p50_us = 1e-3 * (double)stats_quantile_u32(cycles_ns, n, 0.50);
    timing.p99_us = 1e-3 * (double)stats_quantile_u32(cycles_ns, n, 0.99);
    timing.max_us = 1e-3 * (double)cycles_ns[n - 1u];
    for (size_t i = n; i > 0u && 1e-3 * (double)cycles_ns[i - 1u] > timing.budget_us; i--) {
        timing.overruns++;
    }
    return timing;
}

/* Fills in verdict, timing and hash. */
static bool assess(outcome_t *outcome, failure_t *failure)
{
    const study_t *study = outcome->study;
    const plan_t *plan = outcome->plan;
    const table_t runs = {outcome->results->value, study->runs, plan->values};

    study->scenario->judge(plan, runs, &outcome->verdict);
    outcome->timing = time_cycles(study, plan, outcome->results->cycles_ns);
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

static bool all_accepted(const verdict_t *verdict)
{
    for (size_t i = 0u; i < verdict->count; i++) {
        if (metric_is_judged(&verdict->metric[i]) && !metric_is_accepted(&verdict->metric[i])) {
            return false;
        }
    }
    return true;
}

/* ---- Output ------------------------------------------------------------------------------------------------------- */

typedef void (*render_fn)(const outcome_t *outcome, text_t *text);

static bool write_rendered(render_fn render, const outcome_t *outcome, const char *path, failure_t *failure)
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
    written = written && write_rendered(render_csv, outcome, path, failure);
    free(path);
    return written;
}

static bool write_outputs(const cli_t *cli, const outcome_t *outcome, failure_t *failure)
{
    const bool json_only = cli->json != NULL && strcmp(cli->json, "-") == 0;

    return (cli->csv == NULL || write_csv(outcome, cli->csv, failure)) &&
           (cli->json == NULL || write_rendered(render_json, outcome, cli->json, failure)) &&
           (json_only || write_rendered(render_table, outcome, "-", failure));
}

/* ---- Studies ------------------------------------------------------------------------------------------------------ */

static bool run_study(const cli_t *cli, const study_t *study, bool *accepted, failure_t *failure)
{
    plan_t plan;
    results_t results = {0};
    outcome_t outcome = {.study = study, .plan = &plan, .results = &results};

    if (!study->scenario->open(study, &plan, failure)) {
        return false;
    }
    const bool done = monte_carlo(study, &plan, cli->threads, &results, failure) && assess(&outcome, failure) &&
                      write_outputs(cli, &outcome, failure);
    *accepted = *accepted && all_accepted(&outcome.verdict);
    text_free(&outcome.verdict.notes);
    results_free(&results);
    study->scenario->close(&plan);
    return done;
}

bool execute_one(const cli_t *cli, bool *accepted, failure_t *failure)
{
    study_t study;

    *accepted = true;
    return cli_study(cli, cli->scenario, &study, failure) && run_study(cli, &study, accepted, failure);
}

/* A study of a campaign is a command line like any other. */
static bool run_campaign_entry(const cli_t *cli, const scenario_t *scenario, const campaign_t *entry, bool *accepted,
                               failure_t *failure)
{
    cli_t line = *cli;
    study_t study;

    line.filter = entry->filter;
    line.runs = cli->runs != 0u ? cli->runs : entry->runs;
    while (line.sets < STUDY_SETS_MAX && entry->set[line.sets] != NULL) {
        line.set[line.sets] = entry->set[line.sets];
        line.sets++;
    }
    return cli_study(&line, scenario, &study, failure) && run_study(&line, &study, accepted, failure);
}

static bool run_campaign(const cli_t *cli, const scenario_t *scenario, bool *accepted, failure_t *failure)
{
    for (size_t i = 0u; i < scenario->campaign_count; i++) {
        if (run_campaign_entry(cli, scenario, &scenario->campaign[i], accepted, failure)) {
            continue;
        }
        if (!failure->recording_missing) {
            return false;
        }
        (void)printf("%s: skipped: %s; its recordings are published here: %s\n\n", scenario->name, failure->text,
                     scenario->recordings);
        return true;
    }
    return true;
}

bool execute_all(const cli_t *cli, bool *accepted, failure_t *failure)
{
    *accepted = true;
    for (size_t i = 0u; i < all_scenarios_count; i++) {
        if (!run_campaign(cli, all_scenarios[i], accepted, failure)) {
            return false;
        }
    }
    return true;
}
