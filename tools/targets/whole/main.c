/* One run of a scenario of tools/run, all of it on a machine without an operating system: reading the recordings, making
 * the truth, the filter, the guidance, the scores. The arguments of tools/run stand in the file `arguments`, a line each.
 * Prints the hash that tools/run prints for this one run, and particles and bytes of each filter in the order of their
 * pfl_init. Exit status: that of tools/run. */
#include "cli.h"
#include "hash.h"

#include "pflight/pflight.h"
#include "pflight/port.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define WORDS_MAX 32
#define WORD_BYTES 1024

static char word[WORDS_MAX][WORD_BYTES];
static char *arguments[WORDS_MAX];

/* ---- The filters of the run: the linker's --wrap puts this in front of pfl_init ------------------------------------------ */

#define FILTERS_MAX 16u

static struct {
    uint32_t particles, bytes;
} filters[FILTERS_MAX];
static uint32_t filters_count;

pfl_status_t __real_pfl_init(void *arena, size_t bytes, const pfl_config_t *config, uint64_t t_us, pfl_t **out);
pfl_status_t __wrap_pfl_init(void *arena, size_t bytes, const pfl_config_t *config, uint64_t t_us, pfl_t **out);

pfl_status_t __wrap_pfl_init(void *arena, size_t bytes, const pfl_config_t *config, uint64_t t_us, pfl_t **out)
{
    if (filters_count < FILTERS_MAX) {
        filters[filters_count].particles = config->particles;
        filters[filters_count].bytes = (uint32_t)pfl_arena_bytes(config);
        filters_count++;
    }
    return __real_pfl_init(arena, bytes, config, t_us, out);
}

/* ---- The port: no counter, for instructions are counted from outside ------------------------------------------------------- */

uint32_t pfl_port_cycles(void)
{
    return 0u;
}

uint32_t pfl_port_cycles_mask(void)
{
    return 0u;
}

uint32_t pfl_port_cycles_hz(void)
{
    return 1u; /* scenarios divide by it */
}

void pfl_port_fault(int32_t status)
{
    (void)status;
}

bool pfl_port_self_test(void)
{
    return true;
}

/* ---- The run --------------------------------------------------------------------------------------------------------------- */

static int read_arguments(void)
{
    FILE *file = fopen("arguments", "r");
    int count = 1;

    arguments[0] = word[0];
    while (file != NULL && count < WORDS_MAX && fgets(word[count], WORD_BYTES, file) != NULL) {
        word[count][strcspn(word[count], "\n")] = '\0';
        arguments[count] = word[count];
        count++;
    }
    return count;
}

static bool make_output(const plan_t *plan, run_output_t *out, failure_t *failure)
{
    /* One element more than needed: calloc may answer null to a request for nothing. */
    *out = (run_output_t){
        .value = calloc(plan->values + 1u, sizeof *out->value),
        .series = calloc(plan->steps * plan->columns + 1u, sizeof *out->series),
        .cycles_ns = calloc(plan->cycles + 1u, sizeof *out->cycles_ns),
        .cycle = calloc(plan->cycles + 1u, sizeof *out->cycle),
        .hash = HASH_START,
    };
    return (out->value != NULL && out->series != NULL && out->cycles_ns != NULL && out->cycle != NULL) ||
           fail(failure, EXIT_HARNESS, "no memory for a run");
}

/* The first run of the study. */
static bool run_study(const study_t *study, failure_t *failure)
{
    plan_t plan = {0};
    run_output_t out;

    if (!study->scenario->open(study, &plan, failure) || !make_output(&plan, &out, failure) ||
        !study->scenario->run(&plan, 0u, &out, failure)) {
        return false;
    }
    const uint64_t hash = hash_u64(HASH_START, out.hash);
    (void)printf("hash=%08lx%08lx cycles=%lu", (unsigned long)(hash >> 32), (unsigned long)(hash & 0xFFFFFFFFu),
                 (unsigned long)plan.cycles);
    for (uint32_t k = 0u; k < filters_count; k++) {
        (void)printf(" filter=%lu:%lu", (unsigned long)filters[k].particles, (unsigned long)filters[k].bytes);
    }
    (void)printf("\n");
    return true;
}

int main(void)
{
    static cli_t cli;
    static study_t study;
    failure_t failure = {.exit_code = EXIT_HARNESS};

    if (cli_parse(read_arguments(), arguments, &cli, &failure) && cli.command == COMMAND_ONE &&
        cli_study(&cli, cli.scenario, &study, &failure) && run_study(&study, &failure)) {
        return EXIT_PASS;
    }
    (void)printf("run: %s\n", failure.text);
    return failure.exit_code;
}
