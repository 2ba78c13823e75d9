/* Implementation of fuzz.h, and how the sanitizers are to behave. */
#include "fuzz.h"

#include "pflight/filter.h"
#include "pflight/port.h"
#include "pflight/rng.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A small quarantine: thousands of short lives a second would otherwise walk through all of the cache. */
const char *__asan_default_options(void);
const char *__asan_default_options(void)
{
    return "quarantine_size_mb=1:malloc_context_size=4:detect_leaks=1";
}

static const char *noted = "nothing";
static int noted_result;

void fuzz_note(const char *what, int result)
{
    noted = what;
    noted_result = result;
}

void fuzz_fail(const char *check, const char *file, int line)
{
    (void)fprintf(stderr, "FINDING: %s:%d: does not hold: %s (last: %s -> %d)\n", file, line, check, noted,
                  noted_result);
    abort();
}

/* ---- Values out of the input ------------------------------------------------------------------------------------- */

stream_t stream_of(const uint8_t *data, size_t size)
{
    return (stream_t){data, data + size, 0x9E3779B9u};
}

bool stream_ended(const stream_t *s)
{
    return s->at == s->end;
}

uint8_t take_u8(stream_t *s)
{
    if (s->at < s->end) {
        return *s->at++;
    }
    s->beyond = (s->beyond * 1664525u) + 1013904223u;
    return (uint8_t)(s->beyond >> 24);
}

uint16_t take_u16(stream_t *s)
{
    const uint16_t low = take_u8(s);
    return (uint16_t)(low | (take_u8(s) << 8));
}

uint32_t take_u32(stream_t *s)
{
    const uint32_t low = take_u16(s);
    return low | ((uint32_t)take_u16(s) << 16);
}

uint64_t take_u64(stream_t *s)
{
    const uint64_t low = take_u32(s);
    return low | ((uint64_t)take_u32(s) << 32);
}

uint32_t take_below(stream_t *s, uint32_t n)
{
    return take_u8(s) % n;
}

float take_sane(stream_t *s)
{
    return ((float)take_u8(s) - 127.5f) / 16.0f;
}

float take_float(stream_t *s)
{
    static const float special[] = {
        0.0f,           -0.0f,          1.0f,     -1.0f,       INFINITY,     -INFINITY,  NAN,         -NAN,
        FLT_MAX,        -FLT_MAX,       FLT_MIN,  -FLT_MIN,    1.0e-45f,     -1.0e-45f,  1.0e20f,     -1.0e20f,
        1.0e38f,        -1.0e38f,       1.0e-20f, 3.14159265f, -3.14159265f, 6.2831853f, 1.0e10f,     -1.0e10f,
        PFL_LOGLIK_MAX, 0.00097656262f, -43.57f,  -1.0e5f,     1.0e5f,       1600.0f,    FLT_EPSILON, 0.99999994f,
    };
    const uint8_t kind = take_u8(s);
    if (kind < 128u) {
        return ((float)kind - 63.5f) / 8.0f;
    }
    if (kind < 192u) {
        return special[kind % (sizeof special / sizeof special[0])];
    }
    const uint32_t bits = take_u32(s);
    float x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

float take_finite(stream_t *s)
{
    const float x = take_float(s);
    return isfinite(x) ? x : 1.5f;
}

bool all_finite(const float *x, size_t n)
{
    bool finite = true;
    for (size_t i = 0u; i < n; i++) {
        finite = finite && isfinite(x[i]);
    }
    return finite;
}

/* ---- Seeds --------------------------------------------------------------------------------------------------------- */

/* Starting the streams takes ten times as long as all else in a run; the few seeds of a target are started once. */
#define SEEDS 4u
void __real_pfl_rng_seed(pfl_rng_t *rng, uint64_t seed);
void __wrap_pfl_rng_seed(pfl_rng_t *rng, uint64_t seed);
void __wrap_pfl_rng_seed(pfl_rng_t *rng, uint64_t seed)
{
    static pfl_rng_t started[SEEDS];
    static bool known[SEEDS];
    if (seed >= SEEDS) {
        __real_pfl_rng_seed(rng, seed);
        return;
    }
    if (!known[seed]) {
        __real_pfl_rng_seed(&started[seed], seed);
        known[seed] = true;
    }
    *rng = started[seed];
}

/* ---- The port ------------------------------------------------------------------------------------------------------ */

fuzz_port_t fuzz_port;

uint32_t pfl_port_cycles(void)
{
    fuzz_port.now += fuzz_port.step;
    return fuzz_port.now & fuzz_port.mask;
}

uint32_t pfl_port_cycles_mask(void)
{
    return fuzz_port.mask;
}

uint32_t pfl_port_cycles_hz(void)
{
    return 0u;
}

void pfl_port_fault(int32_t status)
{
    REQUIRE(status != (int32_t)PFL_OK);
    fuzz_port.fault++;
}

bool pfl_port_self_test(void)
{
    return !fuzz_port.broken;
}
