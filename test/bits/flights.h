/* One short flight of each kind of filter on the same sharp measurements, without an operating system or a C library: for
 * the golden hashes (bits_modules.c), and for the counts of instructions (tools/benchmark/filters.c). */
#ifndef BITS_FLIGHTS_H
#define BITS_FLIGHTS_H

#include <stdbool.h>
#include <stdint.h>

#define FLIGHT_STEPS 60u
#define FLIGHT_PARTICLES 200u

typedef struct {
    uint32_t particle_steps; /* particles of all cycles */
    uint32_t cycles;         /* of the port's counter, all cycles */
    uint32_t cycles_max;
    uint32_t overruns;
    uint32_t arena_bytes;
    uint32_t beside_bytes; /* of the module's structure and workspace, which the caller holds beside the arena */
    uint32_t particles[FLIGHT_STEPS];
    float square; /* sum of the squared errors of the position, against the truth */
} flown_t;

#define FLIGHTS 13u
extern const char *const flight_names[FLIGHTS];

/* False when a call of the library failed. Every estimate goes through mix(). budget_cycles: for the adaptive filter, which
 * then goes by time; 0 for all others. */
bool flight_fly(uint32_t number, uint32_t budget_cycles, flown_t *flown);

/* The includer's. */
void mix(float x);

#endif
