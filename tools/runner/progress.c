/* The progress bar: see progress.h. Drawn at most ten times a second, so that it costs nothing. */
#include "progress.h"

#include <stdio.h>
#include <time.h>
#include <unistd.h>

#define WIDTH 40u
#define PERIOD_MS 100u

static uint64_t now_ms(void)
{
    struct timespec now = {0, 0};

    (void)clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * 1000u + (uint64_t)now.tv_nsec / 1000000u;
}

void progress_begin(progress_t *progress, const char *label)
{
    progress->on = isatty(STDERR_FILENO) == 1;
    progress->label = label;
    progress->shown_ms = now_ms();
}

void progress_show(progress_t *progress, uint32_t done, uint32_t total)
{
    static const char full[] = "########################################";

    if (!progress->on || now_ms() - progress->shown_ms < PERIOD_MS) {
        return;
    }
    const int length = (int)((uint64_t)WIDTH * done / total);
    progress->shown_ms = now_ms();
    (void)fprintf(stderr, "\r%s [%-*.*s] %lu/%lu runs", progress->label, (int)WIDTH, length, full, (unsigned long)done,
                  (unsigned long)total);
    (void)fflush(stderr);
}

void progress_end(progress_t *progress)
{
    if (progress->on) {
        (void)fputs("\r\033[K", stderr);
        (void)fflush(stderr);
    }
}
