/* One test of a battery of TestU01 (L'Ecuyer and Simard 2007) on one generator:
 *     testu01 uniform|normal smallcrush|crush|bigcrush TEST SEED
 * prints a line "p NAME VALUE" for each p-value and last "numbers COUNT". Each test has a stream of its own. */
#include "source.h"

#include <bbattery.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <swrite.h>
#include <unif01.h>
#include <unistd.h>

#define TESTS_MAX 200

static source_t source;

static unsigned int next_word(void)
{
    return source_word(&source);
}

static void run(const char *battery, int test)
{
    int repeat[TESTS_MAX + 1] = {0};
    char name[] = "pflight";
    unif01_Gen *generator = unif01_CreateExternGenBits(name, next_word);

    repeat[test] = 1;
    swrite_Basic = FALSE;
    if (strcmp(battery, "smallcrush") == 0) {
        bbattery_RepeatSmallCrush(generator, repeat);
    } else if (strcmp(battery, "crush") == 0) {
        bbattery_RepeatCrush(generator, repeat);
    } else {
        bbattery_RepeatBigCrush(generator, repeat);
    }
    unif01_DeleteExternGenBits(generator);
}

int main(int argc, char **argv)
{
    if (argc != 5) {
        (void)fprintf(stderr, "usage: testu01 uniform|normal smallcrush|crush|bigcrush TEST SEED\n");
        return 2;
    }
    const int test = atoi(argv[3]);
    if (test < 1 || test > TESTS_MAX) {
        return 2;
    }
    source_start(&source, strcmp(argv[1], "normal") == 0 ? SOURCE_NORMAL : SOURCE_UNIFORM, strtoull(argv[4], NULL, 10),
                 (unsigned)test);
    (void)fflush(stdout);
    const int out = dup(1); /* the library reports on standard output, at length */
    if (out < 0 || freopen("/dev/null", "w", stdout) == NULL) {
        return 3;
    }
    run(argv[2], test);
    FILE *answer = fdopen(out, "w");
    if (answer == NULL) {
        return 3;
    }
    for (int i = 0; i < bbattery_NTests; i++) {
        (void)fprintf(answer, "p %.17g %s\n", bbattery_pVal[i], bbattery_TestNames[i]);
    }
    (void)fprintf(answer, "numbers %llu\n", (unsigned long long)source.numbers);
    return fclose(answer) == 0 ? 0 : 3;
}
