/* A bar on standard error, where that is a terminal; nothing at all elsewhere. */
#ifndef RUNNER_PROGRESS_H
#define RUNNER_PROGRESS_H

#include <stdbool.h>
#include <stdint.h>

typedef struct {
    bool on;
    const char *label;
    uint64_t shown_ms; /* when it was drawn last */
} progress_t;

void progress_begin(progress_t *progress, const char *label);
void progress_show(progress_t *progress, uint32_t done, uint32_t total);
void progress_end(progress_t *progress); /* wipes the bar */

#endif
