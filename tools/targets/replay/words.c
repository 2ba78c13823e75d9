/* Implementation of words.h. The buffers are small: an image's RAM belongs to the filter. */
#include "words.h"

#include <string.h>

#define BUFFER 512u

typedef struct {
    unsigned char bytes[BUFFER];
    uint32_t at, filled;
} buffer_t;

static buffer_t in;
static buffer_t out[IO_FILES];
static bool ended, broken;

static pfl_waypoint_t waypoints[TAPE_WAYPOINTS_MAX];
static pfl_route_t route;

/* ---- In ------------------------------------------------------------------------------------------------------------ */

uint32_t words_next(void)
{
    if (in.at == in.filled) {
        in.filled = io_read(IO_TAPE, in.bytes, BUFFER) & ~3u;
        in.at = 0u;
    }
    if (in.at == in.filled) {
        ended = true;
        return 0u;
    }
    const unsigned char *b = &in.bytes[in.at];
    in.at += 4u;
    return (uint32_t)b[0] | ((uint32_t)b[1] << 8) | ((uint32_t)b[2] << 16) | ((uint32_t)b[3] << 24);
}

float words_next_float(void)
{
    const uint32_t word = words_next();
    float x;
    memcpy(&x, &word, sizeof x);
    return x;
}

uint64_t words_next_u64(void)
{
    const uint32_t low = words_next();
    return ((uint64_t)words_next() << 32) | low;
}

bool words_ended(void)
{
    return ended;
}

/* A pointer to a route: 0, or 1 and the route. */
static const pfl_route_t *next_route(void)
{
    if (words_next() == 0u) {
        return NULL;
    }
    const uint32_t count = words_next();
    route.waypoint = waypoints;
    route.count = (count < TAPE_WAYPOINTS_MAX) ? count : TAPE_WAYPOINTS_MAX;
    route.count = (route.count > 0u) ? route.count : 1u; /* the library takes no route without a waypoint */
    route.closed = words_next() != 0u;
    route.switching = (pfl_switching_t)words_next();
    route.reach_m = words_next_float();
    route.approach_rad = words_next_float();
    route.follow_per_m = words_next_float();
    for (uint32_t k = 0u; k < route.count; k++) {
        waypoints[k].x_m = words_next_float();
        waypoints[k].y_m = words_next_float();
    }
    return &route;
}

static void next_field(const field_t *field, unsigned char *at, float sharpen)
{
    for (uint32_t k = 0u; k < field->count; k++) {
        if (field->kind == (uint8_t)FIELD_ROUTE) {
            const pfl_route_t *pointer = next_route();
            memcpy(at, &pointer, sizeof(const pfl_route_t *));
        } else if (field->kind == (uint8_t)FIELD_HALF) {
            const uint16_t half = (uint16_t)words_next();
            memcpy(at + (2u * k), &half, sizeof half);
        } else if (field->kind == (uint8_t)FIELD_BOOL) {
            const bool flag = words_next() != 0u;
            memcpy(at + (sizeof flag * k), &flag, sizeof flag);
        } else if (field->kind == (uint8_t)FIELD_INV_SIGMA) {
            const float x = words_next_float() * sharpen;
            memcpy(at + (4u * k), &x, sizeof x);
        } else {
            const uint32_t word = words_next();
            memcpy(at + (4u * k), &word, sizeof word);
        }
    }
}

void words_next_type(const type_t *type, void *structure, float sharpen)
{
    memset(structure, 0, type->size);
    for (uint32_t k = 0u; k < type->fields; k++) {
        next_field(&type->field[k], (unsigned char *)structure + type->field[k].offset, sharpen);
    }
}

/* ---- Out ------------------------------------------------------------------------------------------------------------- */

static void flush(io_file_t file)
{
    if ((out[file].at > 0u) && (io_write(file, out[file].bytes, out[file].at) != out[file].at)) {
        broken = true;
    }
    out[file].at = 0u;
}

void words_put(io_file_t file, uint32_t word)
{
    if (out[file].at == BUFFER) {
        flush(file);
    }
    for (uint32_t k = 0u; k < 4u; k++) {
        out[file].bytes[out[file].at] = (unsigned char)(word >> (8u * k));
        out[file].at++;
    }
}

static uint32_t bits_of(float x)
{
    uint32_t word;
    memcpy(&word, &x, sizeof word);
    return ((word & 0x7FFFFFFFu) > 0x7F800000u) ? 0x7FC00000u : word;
}

void words_put_float(float x)
{
    words_put(IO_OUT, bits_of(x));
}

/* Only types of plain words come out of the library. */
void words_put_type(const type_t *type, const void *structure)
{
    for (uint32_t k = 0u; k < type->size; k += 4u) {
        uint32_t word;
        memcpy(&word, (const unsigned char *)structure + k, sizeof word);
        words_put(IO_OUT, word);
    }
}

bool words_flush(void)
{
    flush(IO_OUT);
    flush(IO_TICKS);
    return !broken;
}

uint64_t words_hash(uint64_t hash, const float *x, uint32_t n)
{
    for (uint32_t i = 0u; i < n; i++) {
        uint32_t word;
        memcpy(&word, &x[i], sizeof word);
        for (uint32_t k = 0u; k < 4u; k++) {
            hash = (hash ^ ((word >> (8u * k)) & 0xFFu)) * UINT64_C(0x00000100000001B3);
        }
    }
    return hash;
}
