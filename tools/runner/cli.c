/* Reads the command line: see cli.h. Every refusal names the option and says what is right. */
#include "cli.h"

#include "pflight/filter.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define RUNS_MAX 20000u
#define THREADS_MAX 256u
#define LIST_MAX 512

typedef enum {
    OPTION_FILTER,
    OPTION_PARTICLES,
    OPTION_RUNS,
    OPTION_SEED,
    OPTION_THREADS,
    OPTION_SET,
    OPTION_DATA,
    OPTION_JSON,
    OPTION_CSV,
    OPTION_BUDGET,
    OPTION_TRACE,
    OPTION_TRACE_RUN,
    OPTION_CLOUD,
    OPTION_LOOKS,
    OPTION_OUT
} option_id_t;

/* With what an option makes sense: with both; a single scenario; a traced run of it; all scenarios. */
typedef enum { FOR_ANY, FOR_ONE, FOR_TRACE, FOR_ALL } scope_t;

typedef struct {
    const char *name;
    const char *argument;
    const char *meaning;
    scope_t scope;
} option_t;

static const option_t options[] = {
    [OPTION_FILTER] = {"--filter", "F", "the filter: one of those that `list` shows", FOR_ONE},
    [OPTION_PARTICLES] = {"--particles", "N", "number of particles", FOR_ONE},
    [OPTION_RUNS] = {"--runs", "R", "number of Monte Carlo runs", FOR_ANY},
    [OPTION_SEED] = {"--seed", "S", "seed of everything random (default 2)", FOR_ANY},
    [OPTION_THREADS] = {"--threads", "T", "threads (default: processors); the results do not depend on it", FOR_ANY},
    [OPTION_SET] = {"--set", "key=value", "a setting of the scenario: one of those that `list` shows", FOR_ONE},
    [OPTION_DATA] = {"--data", "DIR", "folder of the recordings (default: $PFLIGHT_DATA, or ../shared/data)", FOR_ANY},
    [OPTION_JSON] = {"--json", "FILE|-", "results as one JSON object; - is standard output, without tables", FOR_ONE},
    [OPTION_CSV] = {"--csv", "DIR", "the time series, mean over the runs, as DIR/SCENARIO.csv", FOR_ONE},
    [OPTION_BUDGET] = {"--budget-us", "B", "time budget of a filter cycle in microseconds; its p50 must keep it",
                       FOR_ONE},
    [OPTION_TRACE] = {"--trace", "FILE|-", "instead of all else: replay one run, step by step, as CSV", FOR_ONE},
    [OPTION_TRACE_RUN] = {"--trace-run", "R", "with --trace or --looks: the number of the run (default 0)", FOR_TRACE},
    [OPTION_CLOUD] = {"--cloud", "FILE", "with --trace: its particles at some times, as CSV", FOR_TRACE},
    [OPTION_LOOKS] = {"--looks", "FILE|-", "instead of all else: what --live shows of one run, as lines of JSON",
                      FOR_ONE},
    [OPTION_OUT] = {"--out", "DIR", "folder for summary, report and time series of all scenarios (default out)",
                    FOR_ALL},
};
enum { OPTIONS = sizeof options / sizeof options[0] };

/* ---- Values ------------------------------------------------------------------------------------------------------ */

static bool parse_whole(const char *name, const char *text, uint64_t lo, uint64_t hi, uint64_t *value,
                        failure_t *failure)
{
    const size_t length = strlen(text);

    errno = 0;
    *value = strtoull(text, NULL, 10);
    if (length == 0u || strspn(text, "0123456789") != length || errno != 0 || *value < lo || *value > hi) {
        return fail(failure, EXIT_USAGE, "%s '%s': give a whole number from %llu to %llu", name, text,
                    (unsigned long long)lo, (unsigned long long)hi);
    }
    return true;
}

static bool parse_real(const char *text, double *value)
{
    const size_t length = strlen(text);
    char *end;

    *value = strtod(text, &end);
    return length > 0u && strspn(text, "0123456789.eE+-") == length && *end == '\0' && isfinite(*value);
}

/* "a|b|c" as "a, b, c", for people. */
static const char *spell(const char *choices, char *room)
{
    size_t length = 0u;

    for (; *choices != '\0' && length + 3u < LIST_MAX; choices++) {
        if (*choices == '|') {
            room[length++] = ',';
            room[length++] = ' ';
        } else {
            room[length++] = *choices;
        }
    }
    room[length] = '\0';
    return room;
}

static bool is_choice(const char *choices, const char *value)
{
    const size_t length = strlen(value);

    if (length == 0u || strchr(value, '|') != NULL) {
        return false;
    }
    while (strncmp(choices, value, length) != 0 || (choices[length] != '|' && choices[length] != '\0')) {
        choices = strchr(choices, '|');
        if (choices == NULL) {
            return false;
        }
        choices++;
    }
    return true;
}

/* Where the last choice is "...": names of the others, with commas between. */
static bool is_list_of_choices(const char *choices, const char *value)
{
    const size_t length = strlen(choices);
    char one[LIST_MAX];

    if (length < 4u || strcmp(choices + length - 4u, "|...") != 0) {
        return false;
    }
    for (;;) {
        const size_t end = strcspn(value, ",");
        (void)snprintf(one, sizeof one, "%.*s", (int)end, value);
        if (!is_choice(choices, one) || strcmp(one, "...") == 0) {
            return false;
        }
        if (value[end] == '\0') {
            return true;
        }
        value += end + 1u;
    }
}

/* All names of scenarios, with commas. */
static const char *scenario_names(char *room)
{
    size_t length = 0u;

    room[0] = '\0';
    for (size_t i = 0u; i < all_scenarios_count && length < LIST_MAX; i++) {
        const int more =
            snprintf(room + length, LIST_MAX - length, "%s%s", i == 0u ? "" : ", ", all_scenarios[i]->name);
        length += (size_t)more;
    }
    return room;
}

/* ---- Options ----------------------------------------------------------------------------------------------------- */

static bool parse_budget(const char *text, double *budget_us, failure_t *failure)
{
    if (!parse_real(text, budget_us) || !(*budget_us > 0.0)) {
        return fail(failure, EXIT_USAGE, "--budget-us '%s': give a number of microseconds above 0", text);
    }
    return true;
}

static bool parse_path(option_id_t id, const char *text, const char **path, failure_t *failure)
{
    const bool folder = strcmp(options[id].argument, "DIR") == 0;
    const bool standard = strcmp(options[id].argument, "FILE|-") == 0;

    *path = text;
    return text[0] != '\0' || fail(failure, EXIT_USAGE, "%s '': give a %s%s", options[id].name,
                                   folder ? "folder" : "file", standard ? ", or - for standard output" : "");
}

static bool add_setting(cli_t *cli, const char *text, failure_t *failure)
{
    if (cli->sets == CLI_SETS_MAX) {
        return fail(failure, EXIT_USAGE, "--set '%s': at most %d settings", text, CLI_SETS_MAX);
    }
    cli->set[cli->sets++] = text;
    return true;
}

/* A whole number that fits into 32 bits. */
static bool parse_count(const char *name, const char *text, uint32_t lo, uint32_t hi, uint32_t *count,
                        failure_t *failure)
{
    uint64_t whole = 0u;

    if (!parse_whole(name, text, lo, hi, &whole, failure)) {
        return false;
    }
    *count = (uint32_t)whole;
    return true;
}

static bool apply_option(cli_t *cli, option_id_t id, const char *text, failure_t *failure)
{
    const char *name = options[id].name;

    switch (id) {
    case OPTION_FILTER:
        cli->filter = text; /* checked against the scenario by cli_study */
        return true;
    case OPTION_PARTICLES:
        return parse_count(name, text, 1u, PFL_PARTICLES_MAX, &cli->particles, failure);
    case OPTION_RUNS:
        return parse_count(name, text, 1u, RUNS_MAX, &cli->runs, failure);
    case OPTION_SEED:
        return parse_whole(name, text, 0u, UINT64_MAX, &cli->seed, failure);
    case OPTION_THREADS:
        return parse_count(name, text, 1u, THREADS_MAX, &cli->threads, failure);
    case OPTION_SET:
        return add_setting(cli, text, failure);
    case OPTION_DATA:
        return parse_path(id, text, &cli->data, failure);
    case OPTION_JSON:
        return parse_path(id, text, &cli->json, failure);
    case OPTION_CSV:
        return parse_path(id, text, &cli->csv, failure);
    case OPTION_TRACE:
        return parse_path(id, text, &cli->trace, failure);
    case OPTION_TRACE_RUN:
        return parse_count(name, text, 0u, RUNS_MAX - 1u, &cli->trace_run, failure);
    case OPTION_CLOUD:
        return parse_path(id, text, &cli->cloud, failure);
    case OPTION_LOOKS:
        return parse_path(id, text, &cli->looks, failure);
    case OPTION_OUT:
        return parse_path(id, text, &cli->out, failure);
    case OPTION_BUDGET:
    default:
        return parse_budget(text, &cli->budget_us, failure);
    }
}

/* "--key value" of a setting of the scenario before it is "--set key=value". */
static bool is_setting(const cli_t *cli, const char *text)
{
    for (size_t i = 0u; cli->scenario != NULL && i < cli->scenario->settings_count; i++) {
        if (strncmp(text, "--", 2u) == 0 && strcmp(text + 2, cli->scenario->settings[i].key) == 0) {
            return true;
        }
    }
    return false;
}

static bool spell_setting(cli_t *cli, const char *text, const char *value, failure_t *failure)
{
    char *room = cli->spelled[cli->sets < CLI_SETS_MAX ? cli->sets : 0u];

    if ((size_t)snprintf(room, CLI_SPELLED_MAX, "%s=%s", text + 2, value) >= CLI_SPELLED_MAX) {
        return fail(failure, EXIT_USAGE, "%s: the value is too long", text);
    }
    return add_setting(cli, room, failure);
}

static bool find_option(const char *text, option_id_t *id, failure_t *failure)
{
    char names[LIST_MAX] = "";
    size_t length = 0u;

    for (unsigned i = 0u; i < OPTIONS; i++) {
        if (strcmp(options[i].name, text) == 0) {
            *id = (option_id_t)i;
            return true;
        }
        length += (size_t)snprintf(names + length, sizeof names - length, ", %s", options[i].name);
    }
    return fail(failure, EXIT_USAGE, "unknown option '%s'; the options are: --help, --live%s", text, names);
}

/* ---- The whole line ---------------------------------------------------------------------------------------------- */

static bool take_word(cli_t *cli, const char *word, failure_t *failure)
{
    char names[LIST_MAX];

    if (cli->command != COMMAND_ALL) {
        return fail(failure, EXIT_USAGE, "unexpected '%s': give one scenario, or none for all", word);
    }
    if (strcmp(word, "list") == 0) {
        cli->command = COMMAND_LIST;
        return true;
    }
    cli->scenario = scenario_find(word);
    cli->command = COMMAND_ONE;
    return cli->scenario != NULL ||
           fail(failure, EXIT_USAGE, "unknown scenario '%s'; the scenarios are: %s", word, scenario_names(names));
}

static void set_defaults(cli_t *cli)
{
    long processors = 1;
    const char *data = getenv("PFLIGHT_DATA");

#ifdef _SC_NPROCESSORS_ONLN
    processors = sysconf(_SC_NPROCESSORS_ONLN);
#endif
    memset(cli, 0, sizeof *cli);
    cli->seed = 2u;
    cli->threads = processors < 1 ? 1u : (uint32_t)processors;
    cli->threads = cli->threads > THREADS_MAX ? THREADS_MAX : cli->threads;
    cli->out = "out";
    cli->data = data != NULL && data[0] != '\0' ? data : PFLIGHT_SOURCE_DIR "/../shared/data";
}

/* Options that want one that replays a single run. */
static bool lacks_replay(const cli_t *cli, option_id_t id)
{
    return options[id].scope == FOR_TRACE && cli->trace == NULL && (id == OPTION_CLOUD || cli->looks == NULL);
}

/* And those that do not go with one. */
static bool check_replay(const cli_t *cli, option_id_t id, failure_t *failure)
{
    const bool of_all_runs = id == OPTION_JSON || id == OPTION_CSV;

    if (cli->trace != NULL && (of_all_runs || id == OPTION_LOOKS)) {
        return fail(failure, EXIT_USAGE, "%s does not go with --trace, which replays a single run", options[id].name);
    }
    return cli->looks == NULL || !of_all_runs ||
           fail(failure, EXIT_USAGE, "%s does not go with --looks, which replays a single run", options[id].name);
}

static bool check_scope(const cli_t *cli, option_id_t id, failure_t *failure)
{
    char names[LIST_MAX];
    const char *name = options[id].name;
    const scope_t scope = options[id].scope;

    if (cli->command == COMMAND_ALL && scope != FOR_ALL) {
        return fail(failure, EXIT_USAGE, "%s needs a scenario: tools/run SCENARIO %s ...; the scenarios are: %s", name,
                    name, scenario_names(names));
    }
    if (cli->command == COMMAND_ONE && scope == FOR_ALL) {
        return fail(failure, EXIT_USAGE, "%s is for all scenarios: tools/run %s %s; for one use --json and --csv", name,
                    name, options[id].argument);
    }
    if (lacks_replay(cli, id)) {
        return fail(failure, EXIT_USAGE, "%s needs --trace FILE", name);
    }
    return check_replay(cli, id, failure);
}

/* Do the options go together? given: by their position, whether an option is there. */
static bool check_scopes(const cli_t *cli, const bool *given, failure_t *failure)
{
    for (unsigned i = 0u; i < OPTIONS; i++) {
        if (given[i] && options[i].scope != FOR_ANY && !check_scope(cli, (option_id_t)i, failure)) {
            return false;
        }
    }
    return true;
}

/* An option and the value behind it; null: none is there. */
static bool take_option(cli_t *cli, const char *word, const char *value, bool *given, failure_t *failure)
{
    option_id_t id = OPTION_SET;
    const bool setting = strcmp(word, "--set") != 0 && is_setting(cli, word); /* uwb-range has a setting `set` */

    if (!setting && !find_option(word, &id, failure)) {
        return false;
    }
    if (value == NULL || strncmp(value, "--", 2) == 0) {
        return fail(failure, EXIT_USAGE, "%s needs a value: %s %s", word, word,
                    setting ? "VALUE" : options[id].argument);
    }
    given[id] = true;
    return setting ? spell_setting(cli, word, value, failure) : apply_option(cli, id, value, failure);
}

bool cli_parse(int argc, char **argv, cli_t *cli, failure_t *failure)
{
    bool given[OPTIONS] = {false};

    set_defaults(cli);
    for (int i = 1; i < argc; i++) {
        const char *word = argv[i];
        if (strcmp(word, "--help") == 0 || strcmp(word, "-h") == 0) {
            cli->command = COMMAND_HELP;
            return true;
        }
        if (word[0] != '-') {
            if (!take_word(cli, word, failure)) {
                return false;
            }
            continue;
        }
        if (!take_option(cli, word, i + 1 < argc ? argv[i + 1] : NULL, given, failure)) {
            return false;
        }
        i++;
    }
    if (cli->command == COMMAND_LIST && argc > 2) {
        return fail(failure, EXIT_USAGE, "'list' stands alone: tools/run list");
    }
    return check_scopes(cli, given, failure);
}

/* ---- The study --------------------------------------------------------------------------------------------------- */

static bool is_in_range(const setting_t *setting, const char *text)
{
    double number;

    return parse_real(text, &number) && number >= setting->lo && number <= setting->hi;
}

/* Are these numbers with commas between, as many as one of the choices has signs '#'? */
static bool is_choice_of_numbers(const setting_t *setting, const char *value)
{
    char pattern[LIST_MAX];
    size_t length = 0u;

    do {
        char number[64];
        const size_t digits = strcspn(value, ",");
        if (digits >= sizeof number || length + 3u > sizeof pattern) {
            return false;
        }
        memcpy(number, value, digits);
        number[digits] = '\0';
        if (!is_in_range(setting, number)) {
            return false;
        }
        value += digits;
        pattern[length++] = '#';
        pattern[length++] = *value; /* a comma, or the end */
    } while (*value++ != '\0');
    return is_choice(setting->choices, pattern);
}

static bool check_choice(const setting_t *setting, const char *value, failure_t *failure)
{
    char room[LIST_MAX];
    char numbers[64] = "";

    if (strchr(value, '#') == NULL && strcmp(value, "...") != 0 &&
        (is_choice(setting->choices, value) || is_list_of_choices(setting->choices, value) ||
         is_choice_of_numbers(setting, value))) {
        return true;
    }
    if (strchr(setting->choices, '#') != NULL) {
        (void)snprintf(numbers, sizeof numbers, "; # stands for a number from %g to %g", setting->lo, setting->hi);
    }
    return fail(failure, EXIT_USAGE, "--set %s='%s': the values are: %s%s", setting->key, value,
                spell(setting->choices, room), numbers);
}

static bool check_value(const setting_t *setting, const char *value, failure_t *failure)
{
    if (setting->choices != NULL) {
        return check_choice(setting, value, failure);
    }
    if (!is_in_range(setting, value)) {
        return fail(failure, EXIT_USAGE, "--set %s='%s': give a number from %g to %g", setting->key, value, setting->lo,
                    setting->hi);
    }
    return true;
}

static bool apply_setting(study_t *study, const char *text, failure_t *failure)
{
    const scenario_t *scenario = study->scenario;
    const char *equals = strchr(text, '=');
    char keys[LIST_MAX] = "";
    size_t length = 0u;

    for (size_t i = 0u; i < scenario->settings_count; i++) {
        const char *key = scenario->settings[i].key;
        if (equals != NULL && strlen(key) == (size_t)(equals - text) && strncmp(key, text, strlen(key)) == 0) {
            study->value[i] = equals + 1;
            return check_value(&scenario->settings[i], equals + 1, failure);
        }
        length += (size_t)snprintf(keys + length, sizeof keys - length, "%s%s", i == 0u ? "" : ", ", key);
    }
    return fail(failure, EXIT_USAGE, "--set '%s': give key=value; the keys of %s are: %s", text, scenario->name, keys);
}

/* The filter asked for, or the first of the scenario's. */
static bool choose_filter(const char *filter, study_t *study, failure_t *failure)
{
    char names[LIST_MAX];
    const char *filters = study->scenario->filters;

    if (filter != NULL && !is_choice(filters, filter)) {
        return fail(failure, EXIT_USAGE, "--filter '%s': the filters of %s are: %s", filter, study->scenario->name,
                    spell(filters, names));
    }
    (void)snprintf(study->filter, sizeof study->filter, "%.*s", (int)strcspn(filters, "|"), filters);
    if (filter != NULL) {
        (void)snprintf(study->filter, sizeof study->filter, "%s", filter);
    }
    return true;
}

bool cli_study(const cli_t *cli, const scenario_t *scenario, study_t *study, failure_t *failure)
{
    *study = (study_t){
        .scenario = scenario,
        .particles = cli->particles != 0u ? cli->particles : scenario->particles,
        .runs = cli->runs != 0u ? cli->runs : scenario->runs,
        .seed = cli->seed,
        .budget_us = cli->budget_us,
        .data = cli->data,
    };
    for (size_t i = 0u; i < scenario->settings_count; i++) {
        study->value[i] = scenario->settings[i].fallback;
    }
    if (!choose_filter(cli->filter, study, failure)) {
        return false;
    }
    for (size_t i = 0u; i < cli->sets; i++) {
        if (!apply_setting(study, cli->set[i], failure)) {
            return false;
        }
    }
    return true;
}

/* ---- For people -------------------------------------------------------------------------------------------------- */

void cli_help(text_t *text)
{
    text_add(text,
             "usage: tools/run [OPTION...]           all scenarios, with a report in out/\n"
             "       tools/run list                  the scenarios, their filters and settings\n"
             "       tools/run SCENARIO [OPTION...]  one scenario; --key value sets a setting too\n"
             "       tools/run SCENARIO --live [page|terminal] [--rate R]  one run's particles, moving, R times as\n"
             "                                       fast as they were; in a browser, or in the terminal\n"
             "       tools/run compare A.json B.json two results: deltas, and are they beyond chance?\n\n");
    for (unsigned i = 0u; i < OPTIONS; i++) {
        char left[64];
        (void)snprintf(left, sizeof left, "%s %s", options[i].name, options[i].argument);
        text_add(text, "  %-20s %s\n", left, options[i].meaning);
    }
    text_add(text, "\nexit code: 0 within the stated acceptance and time budget, 1 outside, 2 wrong usage, "
                   "3 harness error\n");
}

void cli_list(text_t *text)
{
    for (size_t i = 0u; i < all_scenarios_count; i++) {
        const scenario_t *s = all_scenarios[i];
        text_add(text, "%-16s %s\n", s->name, s->summary);
        text_add(text, "    --filter %s (default the first), --particles %lu, --runs %lu\n", s->filters,
                 (unsigned long)s->particles, (unsigned long)s->runs);
        for (size_t j = 0u; j < s->settings_count; j++) {
            const setting_t *k = &s->settings[j];
            if (k->choices != NULL) {
                text_add(text, "    --set %s=%s (default %s): %s\n", k->key, k->choices, k->fallback, k->meaning);
            } else {
                text_add(text, "    --set %s=%g..%g (default %s): %s\n", k->key, k->lo, k->hi, k->fallback, k->meaning);
            }
        }
        if (s->recordings != NULL) {
            text_add(text, "    needs recordings: %s\n", s->recordings);
        }
    }
}
