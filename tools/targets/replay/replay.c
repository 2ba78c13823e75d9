/* Plays a tape (tape.h) to the library of this machine: reads tape.in, writes every status and output to tape.out and
 * what each call cost to tape.ticks, and prints one line. Exit status: 0 played, 2 no files, 3 the tape makes no
 * sense, 4 an output could not be written, 5 pfl_self_test failed. */
#include "play.h"

#define PAINT 0xA5A5A5A5u
#define SPARE_WORDS 24u /* below the painter's caller: the painter's own frame */

/* ---- Cost of a call ------------------------------------------------------------------------------------------------------ */

__attribute__((noinline)) void play_paint(const uint32_t *sp)
{
    uint32_t *word = io_stack_bottom();
    if (word == NULL) {
        return;
    }
    while (word < (sp - SPARE_WORDS)) {
        *(volatile uint32_t *)word = PAINT;
        word++;
    }
}

static uint32_t stack_used(const uint32_t *sp)
{
    const uint32_t *word = io_stack_bottom();
    if (word == NULL) {
        return 0u;
    }
    while ((word < sp) && (*word == PAINT)) {
        word++;
    }
    return (uint32_t)((const char *)sp - (const char *)word);
}

void play_count(const play_t *p, tape_op_t op, mark_t mark, uint32_t stop)
{
    pfl_health_t health = {0};
    const uint32_t stack = stack_used(mark.sp);
    const uint32_t begin = pfl_port_cycles();
    const uint32_t empty = pfl_port_cycles() - begin; /* what reading the counter costs */
    const uint32_t mask = pfl_port_cycles_mask();
    words_put(IO_TICKS, (uint32_t)op);
    words_put(IO_TICKS, ((stop - mark.start) - empty) & mask);
    words_put(IO_TICKS, stack);
    (void)pfl_health(p->filter, &health);
    words_put(IO_TICKS, health.resampled);
}

/* ---- The tape ---------------------------------------------------------------------------------------------------------------- */

typedef bool (*play_fn)(play_t *p);

static const play_fn play_of[TAPE_OPS] = {
    [TAPE_INIT] = play_init,         [TAPE_PREDICT] = play_predict,       [TAPE_UPDATE] = play_update,
    [TAPE_ESTIMATE] = play_estimate, [TAPE_RESAMPLE] = play_resample,     [TAPE_FARTHEST] = play_farthest,
    [TAPE_ESS] = play_ess,           [TAPE_FORECAST] = play_forecast,     [TAPE_STANDOFF] = play_standoff,
    [TAPE_LVFG] = play_lvfg,         [TAPE_NMPC_SOLVE] = play_nmpc_solve, [TAPE_RESET] = play_reset,
};

static bool read_head(play_t *p)
{
    const uint32_t magic = words_next();
    p->steps_max = words_next();
    p->ess_ratio = words_next_float();
    p->sharpen = words_next_float();
    p->mirror = words_next() != 0u;
    p->hash = WORDS_HASH_START;
    return magic == TAPE_MAGIC;
}

static bool play_all(play_t *p)
{
    for (;;) {
        const uint32_t op = words_next();
        const bool last = (op == (uint32_t)TAPE_PREDICT) && (p->steps_max != 0u) && (p->cycles == p->steps_max);
        if (words_ended() || (op >= (uint32_t)TAPE_OPS)) {
            return false;
        }
        if ((op == (uint32_t)TAPE_END) || last) {
            return true;
        }
        p->cycles += (op == (uint32_t)TAPE_PREDICT) ? 1u : 0u;
        p->calls++;
        if (((p->filter == NULL) && (op != (uint32_t)TAPE_INIT) && (op < (uint32_t)TAPE_STANDOFF)) || !play_of[op](p)) {
            return false;
        }
    }
}

/* ---- Report -------------------------------------------------------------------------------------------------------------------- */

static void say_u32(const char *key, uint32_t value)
{
    char digits[11];
    uint32_t k = 10u;
    digits[k] = '\0';
    do {
        k--;
        digits[k] = (char)('0' + (char)(value % 10u));
        value /= 10u;
    } while (value != 0u);
    io_text(key);
    io_text(&digits[k]);
}

static void say_u64(const char *key, uint64_t value)
{
    char digits[17];
    for (uint32_t k = 16u; k > 0u; k--) {
        digits[k - 1u] = "0123456789abcdef"[value & 15u];
        value >>= 4;
    }
    digits[16] = '\0';
    io_text(key);
    io_text(digits);
}

int main(void)
{
    static play_t play;
    static uint64_t arena[(PFL_SELF_TEST_BYTES + 7u) / 8u];
    if (pfl_self_test(arena, sizeof arena) != PFL_OK) {
        io_text("self_test=FAILED\n");
        return 5;
    }
    if (io_open() != 0) {
        io_text("replay: tape.in, tape.out or tape.ticks cannot be opened\n");
        return 2;
    }
    (void)pfl_port_self_test(); /* starts the counter */
    if (!read_head(&play) || !play_all(&play)) {
        say_u32("replay: the tape makes no sense at call ", play.calls);
        io_text("\n");
        return 3;
    }
    if (!words_flush()) {
        io_text("replay: an output could not be written\n");
        return 4;
    }
    io_close();
    say_u64("hash=", play.hash);
    say_u32(" calls=", play.calls);
    say_u32(" cycles=", play.cycles);
    say_u32(" arena=", play.arena_bytes);
    io_text("\n");
    return 0;
}
