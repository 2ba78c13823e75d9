/* What the fuzz targets share: values out of a stream of bytes, a check that stops the fuzzer, and a port whose counter
 * the target drives. */
#ifndef FUZZ_H
#define FUZZ_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/* Ends the run with a line that names the check; libFuzzer keeps the input. */
void fuzz_fail(const char *check, const char *file, int line);
/* What was done last, for that line. */
void fuzz_note(const char *what, int result);
#define REQUIRE(check) ((check) ? (void)0 : fuzz_fail(#check, __FILE__, __LINE__))

/* ---- Values out of the input ------------------------------------------------------------------------------------- */

/* Behind the end of the input come pseudorandom bytes, so that a short input still means a whole run. */
typedef struct {
    const uint8_t *at, *end;
    uint32_t beyond;
} stream_t;

stream_t stream_of(const uint8_t *data, size_t size);
bool stream_ended(const stream_t *s);
uint8_t take_u8(stream_t *s);
uint16_t take_u16(stream_t *s);
uint32_t take_u32(stream_t *s);
uint64_t take_u64(stream_t *s);
uint32_t take_below(stream_t *s, uint32_t n); /* 0 .. n-1, n <= 256 */
float take_float(stream_t *s);                /* any: half of them small, the others special or any bits */
float take_finite(stream_t *s);               /* as above, without NaN and infinities */
float take_sane(stream_t *s);                 /* |x| <= 8, in eighths */

bool all_finite(const float *x, size_t n);

/* ---- The port ------------------------------------------------------------------------------------------------------ */

typedef struct {
    uint32_t mask; /* of the counter; 0: none */
    uint32_t now;
    uint32_t step;  /* that each reading adds; may be "backwards" */
    bool broken;    /* the port's self-test fails */
    uint64_t fault; /* calls of the fault hook */
} fuzz_port_t;
extern fuzz_port_t fuzz_port;

#endif
