/* The elevation model and the flights of `terrain` from their CSV files. */
#include "recording.h"
#include "terrain.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define FOLDER "dem_jacksboro"
#define LINE_BYTES 16384
#define SIDE_MAX 4096u

/* ---- The map: a header of eastings, then rows of a northing and heights ------------------------------------------- */

typedef struct {
    char line[LINE_BYTES];
    double number[SIDE_MAX];
    size_t numbers;
} map_line_t;

/* The comma-separated numbers of the next line; false at the end. An empty first field counts as zero. */
static bool next_line(map_line_t *l, FILE *file)
{
    if (fgets(l->line, LINE_BYTES, file) == NULL) {
        return false;
    }
    l->numbers = 0u;
    for (char *at = l->line; at != NULL && l->numbers < SIDE_MAX; l->numbers++) {
        char *end = at;
        l->number[l->numbers] = strtod(at, &end);
        l->number[l->numbers] = end == at && l->numbers > 0u ? (double)NAN : l->number[l->numbers];
        at = strchr(at, ',');
        at = at == NULL ? NULL : at + 1;
    }
    return true;
}

static bool take_row(terrain_study_t *s, const map_line_t *l, const char *path, failure_t *failure)
{
    const size_t columns = s->grid.columns;
    int16_t *grown = realloc(s->height_m, (s->grid.rows + 1u) * columns * sizeof *grown);

    if (grown == NULL) {
        return fail(failure, EXIT_HARNESS, "out of memory");
    }
    s->height_m = grown;
    if (l->numbers != columns + 1u) {
        return fail(failure, EXIT_HARNESS, "%s, line %lu: %zu fields: expected %zu", path,
                    (unsigned long)s->grid.rows + 2u, l->numbers, columns + 1u);
    }
    for (size_t c = 0u; c < columns; c++) {
        const double height = l->number[c + 1u];
        if (!(fabs(height) <= 9000.0)) {
            return fail(failure, EXIT_HARNESS, "%s, line %lu: column %zu: expected a height of at most 9000 m", path,
                        (unsigned long)s->grid.rows + 2u, c + 2u);
        }
        grown[s->grid.rows * columns + c] = (int16_t)lround(height);
    }
    s->grid.rows++;
    return true;
}

static bool read_map(terrain_study_t *s, FILE *file, map_line_t *l, const char *path, failure_t *failure)
{
    double first = 0.0;
    double last = 0.0;

    if (!next_line(l, file) || l->numbers < 3u || !(l->number[l->numbers - 1u] > l->number[1])) {
        return fail(failure, EXIT_HARNESS, "%s, line 1: expected the eastings of at least two columns", path);
    }
    s->grid.columns = (uint32_t)l->numbers - 1u;
    s->grid.east_m = (float)l->number[1];
    s->grid.columns_per_m = (float)((double)(s->grid.columns - 1u) / (l->number[l->numbers - 1u] - l->number[1]));
    while (next_line(l, file)) {
        first = s->grid.rows == 0u ? l->number[0] : first;
        last = l->number[0];
        if (!take_row(s, l, path, failure)) {
            return false;
        }
    }
    if (s->grid.rows < 2u || !(last > first)) {
        return fail(failure, EXIT_HARNESS, "%s: expected rows from south to north", path);
    }
    s->grid.north_m = (float)first;
    s->grid.rows_per_m = (float)((double)(s->grid.rows - 1u) / (last - first));
    s->grid.height_m = s->height_m;
    return true;
}

static bool load_map(terrain_study_t *s, const char *folder, failure_t *failure)
{
    char path[1024];
    map_line_t *l = malloc(sizeof *l);

    (void)snprintf(path, sizeof path, "%s/dem.csv", folder);
    FILE *file = fopen(path, "r");
    bool done = l != NULL && file != NULL;
    if (l == NULL) {
        (void)fail(failure, EXIT_HARNESS, "out of memory");
    } else if (file == NULL) {
        (void)fail(failure, EXIT_HARNESS, "%s: %s: name the folder of the recordings with --data DIR", path,
                   strerror(errno));
        failure->recording_missing = true;
    }
    done = done && read_map(s, file, l, path, failure);
    if (file != NULL) {
        (void)fclose(file);
    }
    free(l);
    return done;
}

/* ---- The flight ---------------------------------------------------------------------------------------------------- */

static bool load_flight(terrain_study_t *s, const char *folder, failure_t *failure)
{
    static const char *const columns[] = {"t_s",        "dr_north_m",    "dr_east_m",    "dr_vn_mps",  "dr_ve_mps",
                                          "baro_alt_m", "?radalt_agl_m", "true_north_m", "true_east_m"};
    recording_t file;

    if (!recording_read(&file, folder, s->second ? "flight_sim_2.csv" : "flight_sim_1.csv", columns,
                        sizeof columns / sizeof columns[0], failure)) {
        return false;
    }
    s->row = calloc(file.rows, sizeof *s->row);
    for (size_t k = 0u; s->row != NULL && k < file.rows; k++) {
        const double *v = &file.value[k * file.columns];
        s->row[k] = (terrain_row_t){
            .t_s = v[0],
            .t_us = (uint64_t)llround((v[0] - file.value[0]) * 1e6),
            .velocity = {(float)v[3], (float)v[4]},
            .altitude_m = (float)v[5],
            .agl_m = (float)v[6],
            .truth_north_m = v[7],
            .truth_east_m = v[8],
        };
    }
    s->rows = file.rows;
    s->start_north_m = (float)file.value[1];
    s->start_east_m = (float)file.value[2];
    recording_free(&file);
    return s->row != NULL || fail(failure, EXIT_HARNESS, "out of memory");
}

bool terrain_load(terrain_study_t *s, const char *data, failure_t *failure)
{
    char folder[900];

    if ((size_t)snprintf(folder, sizeof folder, "%s/" FOLDER, data) >= sizeof folder) {
        return fail(failure, EXIT_HARNESS, "--data: path too long");
    }
    if (load_map(s, folder, failure) && load_flight(s, folder, failure)) {
        return true;
    }
    terrain_unload(s);
    return false;
}

void terrain_unload(terrain_study_t *s)
{
    free(s->height_m);
    free(s->row);
    s->height_m = NULL;
    s->row = NULL;
}
