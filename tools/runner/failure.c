/* One line that says what went wrong: control characters that came in from outside are made visible. */
#include "failure.h"

#include <stdarg.h>
#include <stdio.h>

bool fail(failure_t *failure, int exit_code, const char *format, ...)
{
    va_list arguments;

    failure->exit_code = exit_code;
    failure->recording_missing = false;
    va_start(arguments, format);
    (void)vsnprintf(failure->text, sizeof failure->text, format, arguments);
    va_end(arguments);
    for (char *c = failure->text; *c != '\0'; c++) {
        if ((unsigned char)*c < 0x20u || *c == 0x7F) {
            *c = '?';
        }
    }
    return false;
}
