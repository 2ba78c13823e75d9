/* The recording of `car`: ranges less what doubles can say about them, in epochs with odometry and truth. */
#include "car.h"
#include "recording.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define HEIGHT_M 1.5 /* the antenna's over the frame's origin; the street is level to some metres */
/* How likely a range is a reflection's, by its strength: one in two at 35 dB Hz, a logistic curve of 4 dB Hz. */
#define EVEN_DBHZ 35.0
#define SLOPE_DBHZ 4.0
#define RANGES_AT_START_MAX 64u

enum { T, SYSTEM, RANGE, EAST, NORTH, UP, STRENGTH, RANGE_COLUMNS };

typedef struct {
    recording_t ranges, fixes, odometry, truth;
} files_t;

static void close_files(files_t *files)
{
    recording_free(&files->ranges);
    recording_free(&files->fixes);
    recording_free(&files->odometry);
    recording_free(&files->truth);
}

static bool read_files(files_t *files, const char *folder, failure_t *failure)
{
    static const char *const ranges[] = {"t_s", "sys", "range_m", "sat_east_m", "sat_north_m", "sat_up_m", "cn0_dbhz"};
    static const char *const place[] = {"t_s", "east_m", "north_m"};
    static const char *const odometry[] = {"t_s", "v_forward_mps", "yaw_rate_radps"};

    return recording_read(&files->ranges, folder, "pseudorange.csv", ranges, RANGE_COLUMNS, failure) &&
           recording_read(&files->fixes, folder, "gnss_fix.csv", place, 3u, failure) &&
           recording_read(&files->odometry, folder, "odometry.csv", odometry, 3u, failure) &&
           recording_read(&files->truth, folder, "truth.csv", place, 3u, failure);
}

/* The range less its distance from the origin at the antenna's height; the clock is still in it. */
static double reduced(const double *row, double *ux, double *uy)
{
    const double up = row[UP] - HEIGHT_M;
    const double distance = sqrt(row[EAST] * row[EAST] + row[NORTH] * row[NORTH] + up * up);

    *ux = row[EAST] / distance;
    *uy = row[NORTH] / distance;
    return row[RANGE] - distance;
}

/* The median clock of a constellation in the first epoch, seen from the first fix. */
static double start_clock(const car_study_t *s, const recording_t *file, bool second)
{
    double clock[RANGES_AT_START_MAX];
    size_t n = 0u;

    for (size_t i = 0u; i < file->rows && n < RANGES_AT_START_MAX; i++) {
        const double *row = &file->value[i * file->columns];
        double ux;
        double uy;
        if (row[T] > file->value[T]) {
            break;
        }
        if ((row[SYSTEM] > 1.5) == second) {
            clock[n] = reduced(row, &ux, &uy);
            clock[n++] += ux * s->fix_x_m + uy * s->fix_y_m;
        }
    }
    stats_sort(clock, n);
    return n > 0u ? clock[n / 2u] : 0.0;
}

static bool add_range(car_epoch_t *epoch, const double *row, double nominal_m, failure_t *failure)
{
    double ux;
    double uy;
    const double range = reduced(row, &ux, &uy) - nominal_m;

    if (epoch->ranges.count == PFL_SATELLITES_MAX) {
        return fail(failure, EXIT_HARNESS, "pseudorange.csv: more than %u ranges at t = %g s", PFL_SATELLITES_MAX,
                    row[T]);
    }
    epoch->ranges.satellite[epoch->ranges.count++] = (pfl_satellite_t){
        .ux = (float)ux,
        .uy = (float)uy,
        .range_m = (float)range,
        .reflected = (float)fmin(fmax(1.0 / (1.0 + exp((row[STRENGTH] - EVEN_DBHZ) / SLOPE_DBHZ)), 0.05), 0.95),
        .system = row[SYSTEM] > 1.5 ? 1u : 0u,
    };
    return true;
}

/* The odometry's row of that time: both files have the same times. */
static pfl_odometry_input_t odometry_at(const recording_t *file, double t_s)
{
    return (pfl_odometry_input_t){(float)recording_at(file, 1u, t_s), (float)recording_at(file, 2u, t_s)};
}

static bool take_epochs(car_study_t *s, const files_t *files, double nominal_m, failure_t *failure)
{
    s->epoch = calloc(files->ranges.rows, sizeof *s->epoch);
    if (s->epoch == NULL) {
        return fail(failure, EXIT_HARNESS, "out of memory");
    }
    for (size_t i = 0u; i < files->ranges.rows; i++) {
        const double *row = &files->ranges.value[i * files->ranges.columns];
        if (s->epochs == 0u || row[T] > s->epoch[s->epochs - 1u].t_s) {
            car_epoch_t *epoch = &s->epoch[s->epochs++];
            epoch->t_s = row[T];
            epoch->t_us = (uint64_t)llround((row[T] - s->epoch[0].t_s) * 1e6);
            epoch->odometry = odometry_at(&files->odometry, row[T]);
            epoch->truth_x_m = recording_at(&files->truth, 1u, row[T]);
            epoch->truth_y_m = recording_at(&files->truth, 2u, row[T]);
        }
        if (!add_range(&s->epoch[s->epochs - 1u], row, nominal_m, failure)) {
            return false;
        }
    }
    return true;
}

static double rmse_of_fixes(const files_t *files)
{
    double squares = 0.0;

    for (size_t i = 0u; i < files->fixes.rows; i++) {
        const double *row = &files->fixes.value[i * files->fixes.columns];
        const double x = row[1] - recording_at(&files->truth, 1u, row[0]);
        const double y = row[2] - recording_at(&files->truth, 2u, row[0]);
        squares += x * x + y * y;
    }
    return sqrt(squares / (double)files->fixes.rows);
}

bool car_load(car_study_t *s, const char *data, failure_t *failure)
{
    char folder[900];
    files_t files;

    memset(&files, 0, sizeof files);
    const int length = snprintf(folder, sizeof folder, "%s/gnss_car_berlin", data);
    if (length < 0 || (size_t)length >= sizeof folder) {
        return fail(failure, EXIT_HARNESS, "--data: path too long");
    }
    bool loaded = read_files(&files, folder, failure);
    if (loaded) {
        s->fix_x_m = files.fixes.value[1];
        s->fix_y_m = files.fixes.value[2];
        s->fix_rmse_m = rmse_of_fixes(&files);
        const double nominal_m = start_clock(s, &files.ranges, false);
        s->clock_m[0] = 0.0;
        s->clock_m[1] = start_clock(s, &files.ranges, true) - nominal_m;
        loaded = take_epochs(s, &files, nominal_m, failure);
    }
    close_files(&files);
    if (!loaded) {
        free(s->epoch);
        s->epoch = NULL;
    }
    return loaded;
}
