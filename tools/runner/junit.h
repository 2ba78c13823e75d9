/* Results as JUnit XML, which CI systems show: a test suite a scenario, a test case a judged metric of a study. */
#ifndef RUNNER_JUNIT_H
#define RUNNER_JUNIT_H

#include "render.h"

/* A suite being written; zero it before use. */
typedef struct {
    text_t cases;
    unsigned tests, failures, skipped;
    double elapsed_s;
} junit_suite_t;

/* The judged metrics of a study, and its time budget. */
void junit_add_study(junit_suite_t *suite, const outcome_t *outcome, const char *id);

/* A scenario that could not run. */
void junit_add_skipped(junit_suite_t *suite, const char *scenario, const char *reason);

/* Moves the suite into the document. */
void junit_add_suite(text_t *document, const char *scenario, junit_suite_t *suite);

/* Around all suites. */
void junit_begin(text_t *document);
void junit_end(text_t *document);

#endif
