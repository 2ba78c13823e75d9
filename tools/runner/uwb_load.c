/* The recordings of `uwb-range` from their CSV files into one list of ranges. Constants that no file holds stand here
 * with where they come from. */
#include "recording.h"
#include "uwb_range.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Outdoors, from the recordings' description: height of the tag in the anchors' frame, and the truth's lag. */
#define TAG_HEIGHT_M 1.1
#define TRUTH_LAG_S 0.18
#define OUTDOOR_BIAS_M 0.10f
#define INDOOR_BIAS_M 0.13f
#define TRACK_M 0.157

/* Outdoors, ranges of each anchor read long by the median of its residuals to the truth, mean of both recordings,
 * to the centimetre: a calibration on the data that is scored, as the guide says. */
static const struct {
    int id;
    float bias_m;
} anchor_bias[] = {{3, 0.11f}, {5, 0.09f}, {9, 0.10f}, {12, 0.13f}};

typedef struct {
    recording_t anchors, ranges, truth, odometry;
} files_t;

static void close_files(files_t *files)
{
    recording_free(&files->anchors);
    recording_free(&files->ranges);
    recording_free(&files->truth);
    recording_free(&files->odometry);
}

static bool read_files(files_t *files, const char *folder, bool indoor, failure_t *failure)
{
    static const char *const anchors[] = {"anchor_id", "x_m", "y_m", "z_m"};
    static const char *const ranges[] = {"t_s", "anchor_id", "range_m"};
    static const char *const truth[] = {"t_s", "x_m", "y_m"};
    static const char *const odometry[] = {"t_s", "v_left_mps", "v_right_mps"};

    return recording_read(&files->anchors, folder, "anchors.csv", anchors, indoor ? 3u : 4u, failure) &&
           recording_read(&files->ranges, folder, "ranges.csv", ranges, 3u, failure) &&
           recording_read(&files->truth, folder, "truth.csv", truth, 3u, failure) &&
           (!indoor || recording_read(&files->odometry, folder, "odometry.csv", odometry, 3u, failure));
}

static float bias_of(const uwb_study_t *s, int id)
{
    float bias_m = s->indoor ? INDOOR_BIAS_M : OUTDOOR_BIAS_M;

    for (size_t k = 0u; !s->indoor && !s->common_bias && k < sizeof anchor_bias / sizeof anchor_bias[0]; k++) {
        bias_m = anchor_bias[k].id == id ? anchor_bias[k].bias_m : bias_m;
    }
    return bias_m;
}

static bool take_anchors(uwb_study_t *s, const recording_t *file, const char *folder, failure_t *failure)
{
    if (file->rows > UWB_ANCHORS_MAX) {
        return fail(failure, EXIT_HARNESS, "%s/anchors.csv, line %u: expected at most %u anchors", folder,
                    UWB_ANCHORS_MAX + 2u, UWB_ANCHORS_MAX);
    }
    s->anchors = (uint32_t)file->rows;
    for (uint32_t k = 0u; k < s->anchors; k++) {
        const double *row = &file->value[k * file->columns];
        s->anchor[k].x_m = (float)row[1];
        s->anchor[k].y_m = (float)row[2];
        s->anchor[k].height_m = s->indoor ? 0.0f : (float)(row[3] - TAG_HEIGHT_M);
        s->anchor[k].bias_m = bias_of(s, (int)lround(row[0]));
    }
    return true;
}

/* The wheel speeds of the interval that ends at the range. */
static pfl_odometry_input_t odometry_at(const recording_t *file, double t_s, size_t *row)
{
    while (*row + 1u < file->rows && file->value[*row * file->columns] < t_s - 1e-4) {
        (*row)++;
    }
    const double left = file->value[*row * file->columns + 1u];
    const double right = file->value[*row * file->columns + 2u];
    return (pfl_odometry_input_t){(float)((left + right) / 2.0), (float)((right - left) / TRACK_M)};
}

static bool take_ranges(uwb_study_t *s, const files_t *files, const char *folder, failure_t *failure)
{
    const recording_t *file = &files->ranges;
    size_t odometry_row = 0u;

    s->range = calloc(file->rows, sizeof *s->range);
    if (s->range == NULL) {
        return fail(failure, EXIT_HARNESS, "out of memory");
    }
    s->ranges = file->rows;
    for (size_t i = 0u; i < file->rows; i++) {
        const double *row = &file->value[i * file->columns];
        uwb_range_t *range = &s->range[i];
        const double truth_t_s = row[0] - (s->indoor ? 0.0 : TRUTH_LAG_S);
        range->t_s = row[0];
        range->t_us = (uint64_t)llround((row[0] - file->value[0]) * 1e6);
        range->range_m = (float)row[2];
        range->anchor = 0u;
        while (range->anchor < s->anchors &&
               lround(files->anchors.value[range->anchor * files->anchors.columns]) != lround(row[1])) {
            range->anchor++;
        }
        if (range->anchor == s->anchors) {
            return fail(failure, EXIT_HARNESS, "%s/ranges.csv, line %zu: anchor_id %g: expected one of anchors.csv",
                        folder, i + 2u, row[1]);
        }
        range->truth_x_m = recording_at(&files->truth, 1u, truth_t_s);
        range->truth_y_m = recording_at(&files->truth, 2u, truth_t_s);
        if (s->indoor) {
            range->odometry = odometry_at(&files->odometry, row[0], &odometry_row);
        }
    }
    return true;
}

bool uwb_load(uwb_study_t *s, const char *data, const char *set, failure_t *failure)
{
    char folder[900];
    files_t files;

    memset(&files, 0, sizeof files);
    s->indoor = strcmp(set, "indoor") == 0;
    s->los = strcmp(set, "los_a1") == 0;
    const int length = s->indoor ? snprintf(folder, sizeof folder, "%s/uwb_indoor", data)
                                 : snprintf(folder, sizeof folder, "%s/uwb_outdoor/%s", data, set);
    if (length < 0 || (size_t)length >= sizeof folder) {
        return fail(failure, EXIT_HARNESS, "--data: path too long");
    }
    const bool loaded = read_files(&files, folder, s->indoor, failure) &&
                        take_anchors(s, &files.anchors, folder, failure) && take_ranges(s, &files, folder, failure);
    close_files(&files);
    if (!loaded) {
        free(s->range);
        s->range = NULL;
    }
    return loaded;
}
