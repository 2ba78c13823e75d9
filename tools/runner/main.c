/* pflight_run, behind tools/run: runs the scenarios and says how the figures stand to those of the papers. */
#include "campaign.h"
#include "cli.h"
#include "execute.h"

#include <stdio.h>

static bool print(void (*write)(text_t *), failure_t *failure)
{
    text_t text = {0};

    write(&text);
    const bool printed = text_write(&text, "-", failure);
    text_free(&text);
    return printed;
}

static bool run_all(const cli_t *cli, bool *accepted, failure_t *failure)
{
    const bool done = campaign_run(cli, accepted, failure);

    if (done) {
        (void)printf("%s\n", *accepted ? "all within the stated acceptance" : "NOT all within the stated acceptance");
    }
    return done;
}

static bool carry_out(const cli_t *cli, bool *accepted, failure_t *failure)
{
    switch (cli->command) {
    case COMMAND_HELP:
        return print(cli_help, failure);
    case COMMAND_LIST:
        return print(cli_list, failure);
    case COMMAND_ONE:
        return execute_one(cli, accepted, failure);
    case COMMAND_ALL:
    default:
        return run_all(cli, accepted, failure);
    }
}

int main(int argc, char **argv)
{
    cli_t cli;
    failure_t failure = {.exit_code = EXIT_HARNESS};
    bool accepted = true;

    const bool done = cli_parse(argc, argv, &cli, &failure) && carry_out(&cli, &accepted, &failure) &&
                      (fflush(stdout) == 0 || fail(&failure, EXIT_HARNESS, "cannot write to standard output"));
    if (!done) {
        (void)fprintf(stderr, "run: %s\n", failure.text);
        return failure.exit_code;
    }
    return accepted ? EXIT_PASS : EXIT_OUTSIDE;
}
