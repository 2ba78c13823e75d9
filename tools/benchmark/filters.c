/* Flies each kind of filter once (test/bits/flights.h) and prints a line for it: hash of all estimates, particle-steps,
 * cycles of the port's counter over all and of the worst cycle, overruns, bytes of the arena and of what the module wants
 * beside it, root mean square error of the position in um, particles cycle by cycle. Then the adaptive filter by time: with
 * all the time it wants, and with 60 % of what its worst cycle took. Without an operating system too; tools/filters runs it
 * and explains the figures. */
#include "../../test/bits/flights.h"

#include "io.h"
#include "pflight/math.h"
#include "pflight/port.h"

#include <string.h>

#define BY_TIME 7u /* of the flights: the adaptive one */

static uint32_t hash;

void mix(float x)
{
    uint32_t word;
    memcpy(&word, &x, sizeof word);
    hash = (hash ^ word) * 0x01000193u;
    hash ^= hash >> 15;
}

static void say(const char *label, uint32_t value)
{
    char digits[11];
    uint32_t at = 10u;
    digits[10] = '\0';
    do {
        at--;
        digits[at] = (char)('0' + (char)(value % 10u));
        value /= 10u;
    } while (value != 0u);
    io_text(label);
    io_text(&digits[at]);
}

static bool fly(const char *name, uint32_t number, uint32_t budget_cycles, flown_t *flown)
{
    hash = 0x811C9DC5u;
    const bool flew = flight_fly(number, budget_cycles, flown);
    io_text("filter=");
    io_text(name);
    say(" hash=", flew ? hash : 0u);
    say(" particle_steps=", flown->particle_steps);
    say(" cycles=", flown->cycles);
    say(" worst=", flown->cycles_max);
    say(" budget=", budget_cycles);
    say(" overruns=", flown->overruns);
    say(" arena=", flown->arena_bytes);
    say(" beside=", flown->beside_bytes);
    say(" rms_um=", (uint32_t)(int32_t)(1.0e6f * pfl_sqrtf(flown->square / (float)FLIGHT_STEPS)));
    say(" particles=", flown->particles[0]);
    for (uint32_t k = 1u; k < FLIGHT_STEPS; k++) {
        say(",", flown->particles[k]);
    }
    io_text("\n");
    return flew;
}

int main(void)
{
    flown_t flown;
    bool good = true;
    (void)pfl_port_self_test();
    for (uint32_t k = 0u; k < FLIGHTS; k++) {
        good = fly(flight_names[k], k, 0u, &flown) && good;
    }
    if (pfl_port_cycles_mask() != 0u) {
        good = fly("all-the-time", BY_TIME, 0x7FFFFFFFu, &flown) && good;
        good = fly("in-time", BY_TIME, (flown.cycles_max / 10u) * 6u, &flown) && good;
    }
    return good ? 0 : 1;
}
