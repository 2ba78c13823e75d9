/* Why something could not be done, and with which exit code the runner then ends: one line for a person. */
#ifndef RUNNER_FAILURE_H
#define RUNNER_FAILURE_H

#include <stdbool.h>

enum {
    EXIT_PASS = 0,    /* done, and within the stated acceptance */
    EXIT_OUTSIDE = 1, /* done, and outside it */
    EXIT_USAGE = 2,   /* the command line is wrong */
    EXIT_HARNESS = 3  /* the runner could not do its work: a file, memory, a filter that answered an error */
};

typedef struct {
    int exit_code;
    bool recording_missing; /* a recording is not there: `tools/run` alone then skips the scenario */
    char text[1024];        /* one line, without the newline */
} failure_t;

#if defined(__GNUC__)
#define PRINTF_LIKE(format_index, first) __attribute__((format(printf, format_index, first)))
#else
#define PRINTF_LIKE(format_index, first)
#endif

/* Fills in the failure and returns false, for `return fail(...)`. Whatever the arguments hold, it stays one line. */
bool fail(failure_t *failure, int exit_code, const char *format, ...) PRINTF_LIKE(3, 4);

#endif
