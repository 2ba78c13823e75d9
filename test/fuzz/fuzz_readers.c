/* The readers of files: recordings of ranges with their anchors, truth and odometry, and the tape of calls. Whatever the
 * bytes, they are refused with one line that names the file, or what comes out is finite and in order.
 *
 * byte 0: 't' a tape of words; 'i' indoors, all else outdoors, and then four files with a form feed between them. */
#include "fuzz.h"

#include "recording.h"
#include "uwb_range.h"

#include "words.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define FILES 4u

/* ---- Files out of the input, behind fopen -------------------------------------------------------------------------- */

static struct {
    const char *name;
    const uint8_t *at;
    size_t size;
} file[FILES] = {
    {"anchors.csv", NULL, 0u}, {"ranges.csv", NULL, 0u}, {"truth.csv", NULL, 0u}, {"odometry.csv", NULL, 0u}};

FILE *__real_fopen(const char *path, const char *mode);
FILE *__wrap_fopen(const char *path, const char *mode);
FILE *__wrap_fopen(const char *path, const char *mode)
{
    const char *name = strrchr(path, '/');
    for (uint32_t k = 0u; (name != NULL) && (k < FILES); k++) {
        if (strcmp(name + 1, file[k].name) == 0) {
            return (file[k].at == NULL) ? NULL : fmemopen((void *)(uintptr_t)file[k].at, file[k].size, mode);
        }
    }
    return __real_fopen(path, mode);
}

static void cut(const uint8_t *data, size_t size)
{
    for (uint32_t k = 0u; k < FILES; k++) {
        const uint8_t *end = (size > 0u) ? memchr(data, '\f', size) : NULL;
        const size_t length = (end != NULL) ? (size_t)(end - data) : size;
        file[k].at = (length > 0u) ? data : NULL;
        file[k].size = length;
        data += length + ((end != NULL) ? 1u : 0u);
        size -= length + ((end != NULL) ? 1u : 0u);
    }
}

/* ---- Ranges ---------------------------------------------------------------------------------------------------------- */

static void check_failure(const failure_t *failure)
{
    REQUIRE(failure->exit_code == EXIT_HARNESS);
    REQUIRE((strlen(failure->text) > 0u) && (strlen(failure->text) < sizeof failure->text));
    REQUIRE(strpbrk(failure->text, "\r\n\t") == NULL);
}

static void check_ranges(const uwb_study_t *s)
{
    REQUIRE((s->anchors >= 1u) && (s->anchors <= UWB_ANCHORS_MAX) && (s->ranges >= 1u));
    for (uint32_t k = 0u; k < s->anchors; k++) {
        REQUIRE(isfinite(s->anchor[k].x_m) && isfinite(s->anchor[k].y_m) && isfinite(s->anchor[k].height_m));
    }
    for (size_t i = 0u; i < s->ranges; i++) {
        const uwb_range_t *range = &s->range[i];
        REQUIRE((range->anchor < s->anchors) && isfinite(range->range_m));
        REQUIRE((i == 0u) ? (range->t_us == 0u) : (range->t_us >= s->range[i - 1u].t_us));
        REQUIRE(isfinite(range->truth_x_m) && isfinite(range->truth_y_m));
        REQUIRE(!s->indoor || (isfinite(range->odometry.speed_mps) && isfinite(range->odometry.turn_radps)));
    }
}

static void read_ranges(bool indoor)
{
    uwb_study_t s;
    failure_t failure = {.exit_code = EXIT_PASS};
    memset(&s, 0, sizeof s);
    if (uwb_load(&s, "data", indoor ? "indoor" : "los_a1", &failure)) {
        check_ranges(&s);
        free(s.range);
    } else {
        check_failure(&failure);
        REQUIRE(s.range == NULL);
    }
}

/* ---- Tape: structures of every type, one after the other -------------------------------------------------------------- */

static stream_t tape;

uint32_t io_read(io_file_t from, void *bytes, uint32_t count)
{
    const size_t left = (size_t)(tape.end - tape.at);
    const uint32_t n = (left < count) ? (uint32_t)left : count;
    REQUIRE(from == IO_TAPE);
    memcpy(bytes, tape.at, n);
    tape.at += n;
    return n;
}

uint32_t io_write(io_file_t to, const void *bytes, uint32_t count)
{
    (void)to;
    (void)bytes;
    return count;
}

static void check_route(const type_t *type, const unsigned char *structure)
{
    for (uint32_t k = 0u; k < type->fields; k++) {
        if (type->field[k].kind == (uint8_t)FIELD_ROUTE) {
            const pfl_route_t *route;
            memcpy(&route, structure + type->field[k].offset, sizeof route);
            REQUIRE((route == NULL) || ((route->count >= 1u) && (route->count <= TAPE_WAYPOINTS_MAX)));
            REQUIRE((route == NULL) || (pfl_route_switch(route, 3u, 0.0f, 0.0f) < route->count));
        }
    }
}

static void read_type(const type_t *type)
{
    if (type != NULL) {
        REQUIRE(type->size <= TAPE_TYPE_MAX);
        unsigned char *structure = malloc(type->size);
        words_next_type(type, structure, 1.0f);
        check_route(type, structure);
        free(structure);
    }
}

/* The reader keeps what it has read ahead: a tape is used up before the next one begins. */
static void read_tape(const uint8_t *data, size_t size)
{
    const uint8_t *end = data + (size & ~(size_t)3u);
    tape = (stream_t){data, end, 0u};
    for (uint32_t k = 0u; (k < 16u) && (tape.at < end); k++) {
        const uint32_t id = words_next();
        read_type(tape_models[id % tape_models_count].user);
        read_type(tape_models[id % tape_models_count].u);
        read_type(tape_sensors[(id >> 8) % tape_sensors_count].user);
        read_type(tape_sensors[(id >> 8) % tape_sensors_count].z);
    }
    uint32_t more = 0u;
    do { /* whatever is left in the buffer */
        more++;
        (void)words_next();
    } while ((more < 256u) || (tape.at < tape.end));
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (size < 2u) {
        return 0;
    }
    if (data[0] == 't') {
        read_tape(data + 1, size - 1u);
    } else {
        cut(data + 1, size - 1u);
        read_ranges(data[0] == 'i');
    }
    return 0;
}
