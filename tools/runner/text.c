/* Growing text, and its way into a file: see text.h. */
#include "text.h"

#include <errno.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static bool make_room(text_t *text, size_t more)
{
    const size_t needed = text->length + more + 1u;

    if (needed > text->room) {
        const size_t room = needed + needed / 2u + 256u;
        char *bytes = realloc(text->bytes, room);
        if (bytes == NULL) {
            text->spoilt = true;
            return false;
        }
        text->bytes = bytes;
        text->room = room;
    }
    return true;
}

void text_add(text_t *text, const char *format, ...)
{
    va_list arguments;

    va_start(arguments, format);
    const int length = vsnprintf(NULL, 0, format, arguments);
    va_end(arguments);
    if (length < 0 || text->spoilt || !make_room(text, (size_t)length)) {
        text->spoilt = true;
        return;
    }
    va_start(arguments, format);
    (void)vsnprintf(text->bytes + text->length, (size_t)length + 1u, format, arguments);
    va_end(arguments);
    text->length += (size_t)length;
}

void text_free(text_t *text)
{
    free(text->bytes);
    memset(text, 0, sizeof *text);
}

static bool write_stream(const text_t *text, FILE *stream)
{
    return fwrite(text->bytes, 1u, text->length, stream) == text->length;
}

static bool write_to(const text_t *text, const char *path)
{
    FILE *stream = fopen(path, "wb");

    if (stream == NULL) {
        return false;
    }
    const bool written = write_stream(text, stream);
    const int error = errno;
    const bool closed = fclose(stream) == 0;
    errno = written ? errno : error;
    return written && closed;
}

static bool write_by_rename(const text_t *text, const char *path)
{
    const size_t room = strlen(path) + 32u;
    char *temporary = malloc(room);

    if (temporary == NULL) {
        return false;
    }
    (void)snprintf(temporary, room, "%s.tmp.%ld", path, (long)getpid());
    const bool done = write_to(text, temporary) && rename(temporary, path) == 0;
    if (!done) {
        const int error = errno;
        (void)unlink(temporary);
        errno = error;
    }
    free(temporary);
    return done;
}

bool text_write(const text_t *text, const char *path, failure_t *failure)
{
    struct stat status;

    if (text->spoilt || text->bytes == NULL) {
        return fail(failure, EXIT_HARNESS, "out of memory while writing '%s'", path);
    }
    if (strcmp(path, "-") == 0) {
        if (write_stream(text, stdout) && fflush(stdout) == 0) {
            return true;
        }
        return fail(failure, EXIT_HARNESS, "cannot write to standard output: %s", strerror(errno));
    }
    const bool special = stat(path, &status) == 0 && !S_ISREG(status.st_mode);
    if (special ? write_to(text, path) : write_by_rename(text, path)) {
        return true;
    }
    return fail(failure, EXIT_HARNESS, "cannot write '%s': %s", path, strerror(errno));
}
