/* Text that grows in memory: all output is complete before the first byte of it is written. */
#ifndef RUNNER_TEXT_H
#define RUNNER_TEXT_H

#include "failure.h"

#include <stdbool.h>
#include <stddef.h>

/* Zero it before use. Once memory runs out the text is spoilt, and text_write refuses it. */
typedef struct {
    char *bytes; /* terminated by a zero; null while empty */
    size_t length;
    size_t room;
    bool spoilt;
} text_t;

void text_add(text_t *text, const char *format, ...) PRINTF_LIKE(2, 3);
void text_free(text_t *text);

/* Writes the text to a file by way of a temporary one beside it, so that nobody ever sees half of it. "-" is
 * standard output; what is not a regular file (a pipe, /dev/null) is written directly. */
bool text_write(const text_t *text, const char *path, failure_t *failure);

#endif
