/* CSV recordings: recording.h. */
#include "recording.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define LINE_MAX_BYTES 4096
#define FIELDS_MAX 64
#define NUMBER_MAX 1e12 /* more no measurement is, and a float or a count of microseconds could not hold it */

typedef struct {
    const char *path;
    size_t line_number;
    char line[LINE_MAX_BYTES];
    char *field[FIELDS_MAX];
    size_t fields;
} reader_t;

/* Next line into fields; false at the end of the file or with the failure filled in. */
static bool next_line(reader_t *r, FILE *file, failure_t *failure)
{
    if (fgets(r->line, LINE_MAX_BYTES, file) == NULL) {
        return false;
    }
    r->line_number++;
    const size_t length = strlen(r->line);
    if (length == LINE_MAX_BYTES - 1u && r->line[length - 1u] != '\n') {
        return fail(failure, EXIT_HARNESS, "%s, line %zu: longer than %d characters", r->path, r->line_number,
                    LINE_MAX_BYTES - 2);
    }
    r->line[strcspn(r->line, "\r\n")] = '\0';
    r->fields = 0u;
    for (char *at = r->line; at != NULL && r->fields < FIELDS_MAX; r->fields++) {
        r->field[r->fields] = at;
        at = strchr(at, ',');
        if (at != NULL) {
            *at++ = '\0';
        }
    }
    return true;
}

/* The name in the header; that of a column that may be empty is written after a '?'. */
static const char *name_of(const char *column)
{
    return column[0] == '?' ? column + 1 : column;
}

static bool find_columns(const reader_t *r, const char *const *column, size_t columns, size_t *where,
                         failure_t *failure)
{
    for (size_t c = 0u; c < columns; c++) {
        where[c] = FIELDS_MAX;
        for (size_t k = 0u; k < r->fields; k++) {
            where[c] = strcmp(r->field[k], name_of(column[c])) == 0 ? k : where[c];
        }
        if (where[c] == FIELDS_MAX) {
            return fail(failure, EXIT_HARNESS, "%s, line 1: no column '%s' in the header", r->path, name_of(column[c]));
        }
    }
    return true;
}

static bool read_number(const reader_t *r, size_t where, const char *name, double *number, failure_t *failure)
{
    if (where >= r->fields) {
        return fail(failure, EXIT_HARNESS, "%s, line %zu: column %zu (%s) is missing: expected a number", r->path,
                    r->line_number, where + 1u, name_of(name));
    }
    char *end = r->field[where];
    if (name[0] == '?' && *end == '\0') {
        *number = (double)NAN;
        return true;
    }
    errno = 0;
    *number = strtod(r->field[where], &end);
    if (end == r->field[where] || *end != '\0' || !(fabs(*number) <= NUMBER_MAX)) {
        return fail(failure, EXIT_HARNESS, "%s, line %zu: column %zu (%s) is '%s': expected a number of at most %g",
                    r->path, r->line_number, where + 1u, name_of(name), r->field[where], NUMBER_MAX);
    }
    return true;
}

static bool make_room(recording_t *recording, size_t *room, failure_t *failure)
{
    if (recording->rows < *room) {
        return true;
    }
    const size_t more = *room == 0u ? 1024u : *room * 2u;
    double *grown = realloc(recording->value, more * recording->columns * sizeof *grown);
    if (grown == NULL) {
        return fail(failure, EXIT_HARNESS, "out of memory");
    }
    recording->value = grown;
    *room = more;
    return true;
}

static bool read_rows(recording_t *recording, reader_t *r, FILE *file, const char *const *column, const size_t *where,
                      failure_t *failure)
{
    size_t room = 0u;
    const bool timed = strcmp(column[0], "t_s") == 0;

    while (next_line(r, file, failure)) {
        if (!make_room(recording, &room, failure)) {
            return false;
        }
        double *row = &recording->value[recording->rows * recording->columns];
        for (size_t c = 0u; c < recording->columns; c++) {
            if (!read_number(r, where[c], column[c], &row[c], failure)) {
                return false;
            }
        }
        const double *before = recording->rows > 0u ? row - recording->columns : row;
        if (timed && row[0] < before[0]) {
            return fail(failure, EXIT_HARNESS,
                        "%s, line %zu: column %zu (t_s) goes back in time: expected %.17g or more", r->path,
                        r->line_number, where[0] + 1u, before[0]);
        }
        recording->rows++;
    }
    if (failure->exit_code == EXIT_PASS && recording->rows == 0u) {
        return fail(failure, EXIT_HARNESS, "%s, line 2: no data: expected at least one row", r->path);
    }
    return failure->exit_code == EXIT_PASS;
}

static bool read_file(recording_t *recording, const char *path, FILE *file, const char *const *column,
                      failure_t *failure)
{
    size_t where[RECORDING_COLUMNS_MAX];
    reader_t *r = calloc(1u, sizeof *r);

    if (r == NULL) {
        return fail(failure, EXIT_HARNESS, "out of memory");
    }
    r->path = path;
    bool done = next_line(r, file, failure);
    if (!done && failure->exit_code == EXIT_PASS) {
        (void)fail(failure, EXIT_HARNESS, "%s, line 1: empty: expected a header", path);
    }
    done = done && find_columns(r, column, recording->columns, where, failure) &&
           read_rows(recording, r, file, column, where, failure);
    if (done && ferror(file) != 0) {
        done = fail(failure, EXIT_HARNESS, "%s: cannot be read", path);
    }
    free(r);
    return done;
}

bool recording_read(recording_t *recording, const char *folder, const char *name, const char *const *column,
                    size_t columns, failure_t *failure)
{
    char path[1024];

    *recording = (recording_t){.columns = columns};
    failure->exit_code = EXIT_PASS;
    if ((size_t)snprintf(path, sizeof path, "%s/%s", folder, name) >= sizeof path) {
        return fail(failure, EXIT_HARNESS, "%s: path too long", folder);
    }
    FILE *file = fopen(path, "r");
    if (file == NULL) {
        (void)fail(failure, EXIT_HARNESS, "%s: %s: name the folder of the recordings with --data DIR", path,
                   strerror(errno));
        failure->recording_missing = true;
        return false;
    }
    const bool done = read_file(recording, path, file, column, failure);
    (void)fclose(file);
    if (!done) {
        recording_free(recording);
    }
    return done;
}

void recording_free(recording_t *recording)
{
    free(recording->value);
    *recording = (recording_t){0};
}

double recording_at(const recording_t *recording, size_t c, double t_s)
{
    size_t low = 0u;
    size_t high = recording->rows - 1u;
    const double *value = recording->value;
    const size_t width = recording->columns;

    while (high - low > 1u) {
        const size_t middle = low + (high - low) / 2u;
        if (value[middle * width] <= t_s) {
            low = middle;
        } else {
            high = middle;
        }
    }
    const double span = value[high * width] - value[low * width];
    double share = span > 0.0 ? (t_s - value[low * width]) / span : 0.0;
    share = fmin(fmax(share, 0.0), 1.0);
    return value[low * width + c] + share * (value[high * width + c] - value[low * width + c]);
}
