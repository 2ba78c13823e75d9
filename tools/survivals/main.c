/* pflight_survival: runs with one fault each, one line a run; one run cycle by cycle; flights with and without gates; a
 * long flight. tools/survival calls it. */
#include "gates.h"
#include "judge.h"
#include "soak.h"

#include <inttypes.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/types.h>
#include <sys/wait.h>
#include <unistd.h>

#define SECONDS_A_RUN 20u /* a run takes milliseconds: longer is a hang, and SIGALRM ends the process */

static bool number_of(const char *text, uint64_t *number)
{
    char *end = NULL;
    *number = strtoull(text, &end, 10);
    return (*text >= '0') && (*text <= '9') && (*end == '\0');
}

static void print_run(uint64_t run_seed, const judgement_t *j)
{
    printf("%" PRIu64 "|%s|%s|%s|%s|%d%d%d%d%d%d%d|%d|%.4g\n", run_seed, fault_region_name(&fault),
           fault_kind_name(&fault), j->kind == WORLD_LAND ? "land" : "gps", class_name(j->verdict),
           j->nonfinite ? 1 : 0, j->fence ? 1 : 0, j->second ? 1 : 0, j->lie ? 1 : 0, j->late ? 1 : 0,
           j->usable ? 1 : 0, fault_state.struck ? 1 : 0, fault_lasts(&fault) ? 1 : 0, j->ratio);
    (void)fflush(stdout);
}

/* Each run in a process of its own, so that what a fault leaves behind in memory is of no other run. The first that does
 * not end as it should ends this process in the same way. */
static int fly_runs(uint64_t first, uint64_t count)
{
    for (uint64_t k = 0u; k < count; k++) {
        const pid_t child = fork();
        if (child == 0) {
            (void)alarm(SECONDS_A_RUN);
            const judgement_t j = judge_run(first + k, NULL);
            print_run(first + k, &j);
            _exit(0);
        }
        int status = 0;
        if ((child < 0) || (waitpid(child, &status, 0) != child)) {
            fprintf(stderr, "pflight_survival: no process for a run\n");
            return 1;
        }
        if (WIFSIGNALED(status)) {
            (void)signal(WTERMSIG(status), SIG_DFL);
            (void)raise(WTERMSIG(status));
        }
        if (WEXITSTATUS(status) != 0) {
            return WEXITSTATUS(status);
        }
    }
    return 0;
}

static int replay(uint64_t run_seed)
{
    (void)alarm(SECONDS_A_RUN);
    const judgement_t j = judge_run(run_seed, stdout);
    printf("clean rmse %.3f m, after recovery %.3f times that\n", judge_clean_rmse(j.kind), j.ratio);
    print_run(run_seed, &j);
    return 0;
}

/* What a run would be, for one that did not live to say it. */
static int name(uint64_t run_seed)
{
    const world_kind_t kind = judge_draw(run_seed);
    printf("%s|%s|%s|%d\n", fault_region_name(&fault), fault_kind_name(&fault), kind == WORLD_LAND ? "land" : "gps",
           fault_lasts(&fault) ? 1 : 0);
    return 0;
}

static int show_clean(void)
{
    for (uint32_t kind = 0u; kind < WORLDS; kind++) {
        printf("%s|%.4f\n", kind == 0u ? "land" : "gps", judge_clean_rmse((world_kind_t)kind));
    }
    return 0;
}

static int usage(void)
{
    fprintf(stderr, "pflight_survival: clean | runs FIRST COUNT | replay SEED | name SEED | gates RUNS | soak HOURS\n");
    return 2;
}

int main(int argc, char **argv)
{
    uint64_t a = 0u;
    uint64_t b = 0u;
    if ((argc < 2) || ((argc > 2) && !number_of(argv[2], &a)) || ((argc > 3) && !number_of(argv[3], &b))) {
        return usage();
    }
    if ((strcmp(argv[1], "soak") == 0) && (argc == 3)) {
        return soak_fly((double)a);
    }
    if ((strcmp(argv[1], "gates") == 0) && (argc == 3)) {
        return gates_fly((uint32_t)a);
    }
    if ((strcmp(argv[1], "name") == 0) && (argc == 3)) {
        return name(a);
    }
    const bool known = ((strcmp(argv[1], "clean") == 0) && (argc == 2)) ||
                       ((strcmp(argv[1], "runs") == 0) && (argc == 4)) ||
                       ((strcmp(argv[1], "replay") == 0) && (argc == 3));
    if (!known) {
        return usage();
    }
    if (!judge_prepare()) {
        fprintf(stderr, "pflight_survival: a flight without a fault lies, or answers what is not a number\n");
        return 1;
    }
    return (argc == 4) ? fly_runs(a, b) : ((argc == 3) ? replay(a) : show_clean());
}
