/* Recordings as CSV files: columns found by the names of their header, every number checked, and a complaint that
 * names file, line and column. */
#ifndef RUNNER_RECORDING_H
#define RUNNER_RECORDING_H

#include "failure.h"

#include <stddef.h>

#define RECORDING_COLUMNS_MAX 12

/* Row i, requested column c is value[i * columns + c]. Zero it before use. */
typedef struct {
    double *value;
    size_t rows;
    size_t columns;
} recording_t;

/* Reads the named columns of folder/name. The first of them must not decrease where it is called "t_s". At least one
 * row. False with the failure filled in, and nothing to free, otherwise; a file that is not there is marked as a
 * missing recording. A name after a '?' is one of a column that may be empty: NaN there. */
bool recording_read(recording_t *recording, const char *folder, const char *name, const char *const *column,
                    size_t columns, failure_t *failure);
void recording_free(recording_t *recording);

/* Column c at time t by linear interpolation over column 0; held beyond both ends. */
double recording_at(const recording_t *recording, size_t c, double t_s);

#endif
