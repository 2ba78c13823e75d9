/* The command line, and the study that it asks for. */
#ifndef RUNNER_CLI_H
#define RUNNER_CLI_H

#include "scenario.h"

#define CLI_SETS_MAX 64
#define CLI_SPELLED_MAX 128

typedef enum { COMMAND_ALL, COMMAND_ONE, COMMAND_LIST, COMMAND_HELP } command_t;

/* What stands on the command line; null or zero where it is silent. */
typedef struct {
    command_t command;
    const scenario_t *scenario; /* COMMAND_ONE */
    const char *filter;
    uint32_t particles;
    uint32_t runs;
    uint64_t seed;
    uint32_t threads; /* never zero */
    double budget_us;
    const char *data; /* never null */
    const char *json;
    const char *csv;
    const char *out;                             /* folder for the files of all scenarios; never null */
    const char *trace;                           /* replay one run into this file, instead of all else */
    const char *cloud;                           /* and its particles into this one */
    const char *looks;                           /* one run as steps to be looked at, likewise instead of all else */
    uint32_t trace_run;                          /* the run of either */
    const char *set[CLI_SETS_MAX];               /* "key=value" */
    char spelled[CLI_SETS_MAX][CLI_SPELLED_MAX]; /* room for those that stood as "--key value" */
    size_t sets;
} cli_t;

bool cli_parse(int argc, char **argv, cli_t *cli, failure_t *failure);

/* The study of a scenario: its defaults, overridden by the command line. Checks filter, keys and values. */
bool cli_study(const cli_t *cli, const scenario_t *scenario, study_t *study, failure_t *failure);

void cli_help(text_t *text);
void cli_list(text_t *text);

#endif
