/* A folder of CSV files as one list of measurements in the order of time; what lacks is explained. */
#include "recording.h"
#include "replay.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define ROWS_MAX 100000000u

/* Where a sensor's numbers stand. A cell may be empty: then there was no measurement. */
typedef struct {
    const char *name, *file;
    const char *column[1u + REPLAY_NUMBERS];
    size_t numbers;
} source_t;

static const source_t sources[REPLAY_SENSORS] = {
    [REPLAY_GPS] = {"gps", "gps.csv", {"t_s", "?north_m", "?east_m"}, 2u},
    [REPLAY_FIX] = {"fix", "gnss_fix.csv", {"t_s", "?north_m", "?east_m"}, 2u},
    [REPLAY_VELOCITY] = {"velocity", "gps.csv", {"t_s", "?vn_mps", "?ve_mps"}, 2u},
    [REPLAY_HEIGHT] = {"height", "gps.csv", {"t_s", "?alt_msl_m", NULL}, 1u},
    [REPLAY_BARO] = {"baro", "baro.csv", {"t_s", "?baro_alt_m", NULL}, 1u},
    [REPLAY_RANGE] = {"range", "ranges.csv", {"t_s", "?anchor_id", "?range_m"}, 2u},
};

static const char *bare(const char *column)
{
    return column[0] == '?' ? column + 1 : column;
}

/* Says what the file is needed for, and where it comes from. */
static bool explain(failure_t *failure, const char *what, const char *file, const char *const *column, size_t columns)
{
    char why[sizeof failure->text];
    char list[200] = "";
    const bool missing = failure->recording_missing;

    memcpy(why, failure->text, sizeof why);
    for (size_t c = 0u; c < columns; c++) {
        strncat(list, c == 0u ? "" : ", ", sizeof list - strlen(list) - 1u);
        strncat(list, bare(column[c]), sizeof list - strlen(list) - 1u);
    }
    (void)fail(failure, EXIT_HARNESS,
               "%.600s; %s needs %s with the columns %s: tools/log writes them where the log has "
               "them (docs/logs.md), or choose without it",
               why, what, file, list);
    failure->recording_missing = missing;
    return false;
}

bool replay_is_position(replay_sensor_t sensor)
{
    return sensor == REPLAY_GPS || sensor == REPLAY_FIX;
}

size_t replay_first(const replay_study_t *s, replay_sensor_t sensor, size_t from)
{
    size_t i = from;

    while (i < s->events && s->event[i].sensor != sensor) {
        i++;
    }
    return i;
}

/* At one time in the order of the sensors, and of the rows. */
static int by_time(const void *a, const void *b)
{
    const replay_event_t *x = a;
    const replay_event_t *y = b;

    if (x->t_s < y->t_s || x->t_s > y->t_s) {
        return x->t_s < y->t_s ? -1 : 1;
    }
    if (x->sensor != y->sensor) {
        return (int)x->sensor - (int)y->sensor;
    }
    return x->row < y->row ? -1 : 1;
}

static void take_row(replay_study_t *s, unsigned sensor, const double *row)
{
    replay_event_t *e = &s->event[s->events];
    const bool swapped = s->model == REPLAY_ODOMETRY && sensor != REPLAY_RANGE;

    *e = (replay_event_t){
        .t_s = row[0], .sensor = (replay_sensor_t)sensor, .row = (uint32_t)s->events, .truth = {MISSING, MISSING}};
    for (size_t k = 0u; k < sources[sensor].numbers; k++) {
        if (isnan(row[1u + k])) {
            return;
        }
        e->z[swapped ? 1u - k : k] = (float)row[1u + k];
    }
    s->events++;
}

static bool take_sensor(replay_study_t *s, unsigned sensor, const char *data, failure_t *failure)
{
    const source_t *source = &sources[sensor];
    recording_t rows = {0};
    char what[32] = "the sensor ";

    if (!recording_read(&rows, data, source->file, source->column, 1u + source->numbers, failure)) {
        strncat(what, source->name, sizeof what - strlen(what) - 1u);
        return explain(failure, what, source->file, source->column, 1u + source->numbers);
    }
    replay_event_t *grown = rows.rows < ROWS_MAX ? realloc(s->event, (s->events + rows.rows) * sizeof *grown) : NULL;
    if (grown == NULL) {
        recording_free(&rows);
        return fail(failure, EXIT_HARNESS, "out of memory");
    }
    s->event = grown;
    const size_t before = s->events;
    for (size_t i = 0u; i < rows.rows; i++) {
        take_row(s, sensor, &rows.value[i * rows.columns]);
    }
    recording_free(&rows);
    return s->events > before || fail(failure, EXIT_HARNESS, "%s/%s: no row has all numbers that the sensor %s needs",
                                      data, source->file, source->name);
}

/* Row of the anchor with this number; anchors->rows without one. */
static size_t find_anchor(const recording_t *anchors, double number)
{
    size_t k = 0u;

    while (k < anchors->rows && fabs(anchors->value[k * 3u] - number) > 0.5) {
        k++;
    }
    return k;
}

static bool take_anchors(replay_study_t *s, const char *data, failure_t *failure)
{
    static const char *const column[] = {"anchor_id", "x_m", "y_m"};
    recording_t rows = {0};
    bool found = true;

    if (!recording_read(&rows, data, "anchors.csv", column, 3u, failure)) {
        return explain(failure, "the sensor range", "anchors.csv", column, 3u);
    }
    for (size_t i = 0u; i < s->events && found; i++) {
        replay_event_t *e = &s->event[i];
        const size_t k = e->sensor == REPLAY_RANGE ? find_anchor(&rows, (double)e->z[0]) : 0u;
        found = k < rows.rows ||
                fail(failure, EXIT_HARNESS, "%s/ranges.csv: anchor %g is not in anchors.csv", data, (double)e->z[0]);
        if (found) {
            e->range = (pfl_range_z_t){(float)rows.value[k * 3u + 1u], (float)rows.value[k * 3u + 2u],
                                       s->anchors_over_m, e->z[1], 1.0f};
        }
    }
    recording_free(&rows);
    return found;
}

/* Each measurement gets the last speed and turn rate before it. */
static bool take_odometry(replay_study_t *s, const char *data, failure_t *failure)
{
    static const char *const column[] = {"t_s", "v_forward_mps", "yaw_rate_radps"};
    recording_t rows = {0};
    size_t at = 0u;

    if (!recording_read(&rows, data, "odometry.csv", column, 3u, failure)) {
        return explain(failure, "the model odometry", "odometry.csv", column, 3u);
    }
    for (size_t i = 0u; i < s->events; i++) {
        while (at + 1u < rows.rows && rows.value[(at + 1u) * 3u] <= s->event[i].t_s) {
            at++;
        }
        s->event[i].odometry = (pfl_odometry_input_t){(float)rows.value[at * 3u + 1u], (float)rows.value[at * 3u + 2u]};
    }
    recording_free(&rows);
    return true;
}

/* Truth where there is some, or else what the autopilot made of the flight; null: neither. */
static const char *read_truth(const replay_study_t *s, const char *data, recording_t *rows)
{
    static const char *const earth[] = {"t_s", "north_m", "east_m"};
    static const char *const room[] = {"t_s", "x_m", "y_m"}; /* the frame of the anchors */
    static const char *const files[] = {"truth.csv", "nav.csv"};
    failure_t unused = {0};

    for (size_t k = 0u; k < 2u; k++) {
        if (recording_read(rows, data, files[k], s->wanted[REPLAY_RANGE] ? room : earth, 3u, &unused)) {
            return files[k];
        }
    }
    return NULL;
}

static void take_truth(replay_study_t *s, const char *data)
{
    recording_t rows = {0};
    const size_t x = s->model == REPLAY_ODOMETRY && !s->wanted[REPLAY_RANGE] ? 2u : 1u;

    s->compared = read_truth(s, data, &rows);
    for (size_t i = 0u; s->compared != NULL && i < s->events; i++) {
        replay_event_t *e = &s->event[i];
        if (e->t_s >= rows.value[0] && e->t_s <= rows.value[(rows.rows - 1u) * 3u]) {
            e->truth[0] = recording_at(&rows, x, e->t_s);
            e->truth[1] = recording_at(&rows, 3u - x, e->t_s);
        }
    }
    recording_free(&rows);
}

bool replay_load(replay_study_t *s, const char *data, failure_t *failure)
{
    for (unsigned sensor = 0u; sensor < REPLAY_SENSORS; sensor++) {
        if (s->wanted[sensor] && !take_sensor(s, sensor, data, failure)) {
            return false;
        }
    }
    qsort(s->event, s->events, sizeof *s->event, by_time);
    for (size_t i = 0u; i < s->events; i++) {
        s->event[i].t_us = (uint64_t)llround((s->event[i].t_s - s->event[0].t_s) * 1e6);
    }
    if (s->event[s->events - 1u].t_us == 0u) {
        return fail(failure, EXIT_HARNESS, "%s: all measurements are of one time: nothing to fly", data);
    }
    take_truth(s, data);
    return (!s->wanted[REPLAY_RANGE] || take_anchors(s, data, failure)) &&
           (s->model != REPLAY_ODOMETRY || take_odometry(s, data, failure));
}
