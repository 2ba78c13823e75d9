/* All scenarios into one folder: see campaign.h. The folder is tried before the first run, because the runs take
 * minutes; files of an earlier campaign go away, so that they are never taken for this one's. */
#include "campaign.h"

#include "execute.h"
#include "json.h"
#include "junit.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

typedef struct {
    const cli_t *cli;
    const char *study_id; /* of the study that runs */
    text_t studies;       /* JSON, with commas between */
    text_t skipped;       /* likewise */
    text_t junit;
    junit_suite_t suite; /* of the scenario that runs */
    bool accepted;
} campaign_run_t;

/* ---- The folder --------------------------------------------------------------------------------------------------- */

/* FOLDER/NAME.SUFFIX, to be freed; null when out of memory. */
static char *path_of(const char *folder, const char *name, const char *suffix)
{
    const size_t room = strlen(folder) + strlen(name) + strlen(suffix) + 2u;
    char *path = malloc(room);

    if (path != NULL) {
        (void)snprintf(path, room, "%s/%s%s", folder, name, suffix);
    }
    return path;
}

static bool make_folder(const cli_t *cli, const char *folder, failure_t *failure)
{
    if (mkdir(folder, 0777) != 0 && errno != EEXIST) {
        return fail(failure, EXIT_HARNESS, "--out '%s': cannot make the folder %s: %s", cli->out, folder,
                    strerror(errno));
    }
    return true;
}

/* Writes an empty file and removes it: whoever may not write there hears of it now. Then nothing old is there. */
static bool clear_file(const cli_t *cli, const char *name, failure_t *failure)
{
    char *path = path_of(cli->out, name, "");

    if (path == NULL) {
        return fail(failure, EXIT_HARNESS, "out of memory");
    }
    FILE *stream = fopen(path, "ab");
    bool cleared = stream != NULL && fclose(stream) == 0;
    cleared = cleared && remove(path) == 0;
    if (!cleared) {
        (void)fail(failure, EXIT_HARNESS, "--out '%s': cannot write %s: %s", cli->out, path, strerror(errno));
    }
    free(path);
    return cleared;
}

static bool prepare_folder(const cli_t *cli, failure_t *failure)
{
    char *csv = path_of(cli->out, "csv", "");
    const bool prepared = csv != NULL && make_folder(cli, cli->out, failure) && make_folder(cli, csv, failure) &&
                          clear_file(cli, "csv/.try", failure) && clear_file(cli, "summary.json", failure) &&
                          clear_file(cli, "junit.xml", failure) && clear_file(cli, "report.html", failure);

    free(csv);
    return csv == NULL ? fail(failure, EXIT_HARNESS, "out of memory") : prepared;
}

static bool write_text(const text_t *text, const cli_t *cli, const char *name, failure_t *failure)
{
    char *path = path_of(cli->out, name, "");
    const bool written = path != NULL ? text_write(text, path, failure) : fail(failure, EXIT_HARNESS, "out of memory");

    free(path);
    return written;
}

/* ---- A study ------------------------------------------------------------------------------------------------------ */

/* The study's files in csv/. */
static bool write_series(const campaign_run_t *run, const outcome_t *outcome, traced_t *traced, failure_t *failure)
{
    enum { SERIES, TRACE, CLOUD, LOOK, FILES };
    static const char *const suffix[FILES] = {".csv", ".trace.csv", ".cloud.csv", ".look.jsonl"};
    char *folder = path_of(run->cli->out, "csv", "");
    char *path[FILES];
    bool written = folder != NULL;

    for (int k = 0; k < FILES; k++) {
        path[k] = folder != NULL ? path_of(folder, run->study_id, suffix[k]) : NULL;
        written = written && path[k] != NULL;
    }
    if (!written) {
        (void)fail(failure, EXIT_HARNESS, "out of memory");
    }
    written = written && execute_write(render_csv, outcome, path[SERIES], failure) &&
              execute_trace(outcome->study, 0u, path[TRACE], path[CLOUD], path[LOOK], traced, failure);
    for (int k = 0; k < FILES; k++) {
        free(path[k]);
    }
    free(folder);
    return written;
}

static bool use_study(void *user, const outcome_t *outcome, failure_t *failure)
{
    campaign_run_t *run = user;
    traced_t traced;

    if (!execute_write(render_table, outcome, "-", failure) || !write_series(run, outcome, &traced, failure)) {
        return false;
    }
    text_add(&run->studies, run->studies.length > 0u ? ",\n" : "");
    json_summary_study(outcome, run->study_id, &traced, &run->studies);
    junit_add_study(&run->suite, outcome, run->study_id);
    run->accepted = run->accepted && outcome_is_accepted(outcome);
    return true;
}

/* A study of a campaign is a command line like any other. */
static bool run_entry(campaign_run_t *run, const scenario_t *scenario, const campaign_t *entry, failure_t *failure)
{
    cli_t line = *run->cli;
    study_t study;
    char id[STUDY_ID_MAX];

    line.filter = entry->filter;
    line.runs = line.runs != 0u ? line.runs : entry->runs;
    line.particles = entry->particles;
    while (line.sets < STUDY_SETS_MAX && entry->set[line.sets] != NULL) {
        line.set[line.sets] = entry->set[line.sets];
        line.sets++;
    }
    if (!cli_study(&line, scenario, &study, failure)) {
        return false;
    }
    study_id(&study, id);
    run->study_id = id;
    return execute_study(&line, &study, use_study, run, failure);
}

/* ---- All ---------------------------------------------------------------------------------------------------------- */

static void skip(campaign_run_t *run, const scenario_t *scenario, const char *reason)
{
    (void)printf("%s: skipped: %s; its recordings are published here: %s\n\n", scenario->name, reason,
                 scenario->recordings);
    text_add(&run->skipped, run->skipped.length > 0u ? ",\n{\"scenario\":" : "{\"scenario\":");
    json_string(&run->skipped, scenario->name);
    text_add(&run->skipped, ",\"reason\":");
    json_string(&run->skipped, reason);
    text_add(&run->skipped, ",\"recordings\":");
    json_string(&run->skipped, scenario->recordings);
    text_add(&run->skipped, "}");
    junit_add_skipped(&run->suite, scenario->name, reason);
}

static bool run_scenario(campaign_run_t *run, const scenario_t *scenario, failure_t *failure)
{
    for (size_t i = 0u; i < scenario->campaign_count; i++) {
        if (run_entry(run, scenario, &scenario->campaign[i], failure)) {
            continue;
        }
        if (!failure->recording_missing) {
            return false;
        }
        skip(run, scenario, failure->text);
        break;
    }
    junit_add_suite(&run->junit, scenario->name, &run->suite);
    run->suite = (junit_suite_t){0};
    return true;
}

static bool write_summary(campaign_run_t *run, failure_t *failure)
{
    text_t summary = {0};

    text_add(&summary, "{\"schema\":1,\"accepted\":%s,\"studies\":[\n%s\n],\"skipped\":[%s]}\n",
             run->accepted ? "true" : "false", run->studies.bytes != NULL ? run->studies.bytes : "",
             run->skipped.bytes != NULL ? run->skipped.bytes : "");
    summary.spoilt = summary.spoilt || run->studies.spoilt || run->skipped.spoilt;
    const bool written = write_text(&summary, run->cli, "summary.json", failure) &&
                         write_text(&run->junit, run->cli, "junit.xml", failure);
    text_free(&summary);
    return written;
}

bool campaign_run(const cli_t *cli, bool *accepted, failure_t *failure)
{
    campaign_run_t run = {.cli = cli, .accepted = true};

    if (!prepare_folder(cli, failure)) {
        return false;
    }
    bool done = true;
    junit_begin(&run.junit);
    for (size_t i = 0u; i < all_scenarios_count && done; i++) {
        done = run_scenario(&run, all_scenarios[i], failure);
    }
    junit_end(&run.junit);
    done = done && write_summary(&run, failure);
    text_free(&run.studies);
    text_free(&run.skipped);
    text_free(&run.junit);
    text_free(&run.suite.cases);
    *accepted = run.accepted;
    return done;
}
