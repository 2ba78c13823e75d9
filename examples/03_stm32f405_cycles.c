/* Cycles of a filter cycle, by stage, on an STM32F405 without an operating system: the DWT cycle counter, read through
 * port/cortex_m. The figures go out as text through ITM port 0 (SWO) and stand in `cycles` for a debugger. On real
 * hardware only: emulators do not model the DWT. examples/README.md tells how to build, flash and read it. */
#include "pflight/pflight.h"

#include <string.h>

#define PARTICLES 300u
#define ITM_PORTS_ENABLED (*(volatile uint32_t *)0xE0000E00u)
#define ITM_PORT0 (*(volatile uint32_t *)0xE0000000u)

enum { PREDICT, UPDATE, ESTIMATE, RESAMPLE, STAGES };
typedef struct {
    uint32_t max, sum, count;
} cost_t;
cost_t cycles[STAGES];   /* for the debugger: print cycles */
volatile int32_t status; /* 1: done; else the pfl_status_t that went wrong */

extern char board_data_load[], board_data_start[], board_data_end[], board_bss_start[], board_bss_end[],
    board_stack_top[];

static pfl_land_vehicle_t vehicle = {100000.0f, 0.3f, 1250.0f, 2.5f, 0.5f, 2.236f, 0.0f, 0.0f};
static pfl_position_t seen = {3u, {0u, 1u, 2u, 0u}, {0.316f, 0.316f, 0.316f, 0.0f}};
static const pfl_sensor_t sensor = {.loglik = pfl_position_loglik, .user = &seen};
static pfl_config_t config = {.abi = PFL_ABI, .particles = PARTICLES, .states = 4, .noises = 2, .sensor_count = 1};
PFL_ARENA(arena, PARTICLES, 4, 2);

static void say(const char *text)
{
    for (; (ITM_PORTS_ENABLED & 1u) != 0u && *text != '\0'; text++) { /* bit 0: a debugger listens */
        while (ITM_PORT0 == 0u) {                                     /* busy */
        }
        *(volatile uint8_t *)&ITM_PORT0 = (uint8_t)*text;
    }
}

static void say_number(const char *name, uint32_t value)
{
    char digits[12] = "           ";
    for (uint32_t k = 10u; k > 0u && (value > 0u || k == 10u); k--) {
        digits[k] = (char)('0' + (char)(value % 10u));
        value /= 10u;
    }
    say(name);
    say(digits);
}

static void note(int stage, uint32_t count)
{
    cost_t *c = &cycles[stage];
    c->max = (count > c->max) ? count : c->max;
    c->sum += count;
    c->count++;
}

static pfl_status_t cycle(pfl_t *f, uint32_t k)
{
    const pfl_land_input_t input = {0.03f, (k < 45u) ? -0.05f : 0.01f};
    const uint64_t t_us = (uint64_t)k * 500000u;
    const float z[3] = {-1.7f * (float)k, 1.2f * (float)k, 4.0f}; /* straight on, at 4 m/s */
    float mean[4];
    pfl_health_t health;
    const uint32_t start = pfl_port_cycles();
    const pfl_status_t moved = pfl_predict(f, t_us, &input);
    const uint32_t predicted = pfl_port_cycles();
    const pfl_status_t fused = (moved == PFL_OK) ? pfl_update(f, 0, t_us, z) : moved;
    const uint32_t updated = pfl_port_cycles();
    const pfl_status_t done = (fused == PFL_OK) ? pfl_estimate(f, mean, NULL) : fused;
    const uint32_t estimated = pfl_port_cycles();
    (void)pfl_health(f, &health);
    note(PREDICT, predicted - start);
    note(UPDATE, updated - predicted - health.cycles_resample); /* weighing and moments */
    note(ESTIMATE, estimated - updated);
    if (health.cycles_resample > 0u) {
        note(RESAMPLE, health.cycles_resample);
    }
    return done;
}

static void run(void)
{
    static const char *const name[STAGES] = {"predict  mean", "update   mean", "estimate mean", "resample mean"};
    pfl_t *f;
    config.moments = PFL_MOMENTS_MEAN;
    config.ess_ratio = 0.5f;
    config.sensors = &sensor;
    config.predict = pfl_land_vehicle_predict;
    config.user = &vehicle;
    pfl_status_t done = pfl_self_test(&arena, sizeof arena);
    done = (done == PFL_OK) ? pfl_init(&arena, sizeof arena, &config, 0, &f) : done;
    for (uint32_t k = 1u; k <= 100u && done == PFL_OK; k++) {
        done = cycle(f, k);
    }
    for (int s = 0; s < STAGES; s++) {
        say_number(name[s], (cycles[s].count > 0u) ? (cycles[s].sum / cycles[s].count) : 0u);
        say_number(" max", cycles[s].max);
        say(" cycles\n");
    }
    status = (done == PFL_OK) ? 1 : (int32_t)done;
}

__attribute__((noreturn, used)) void board_start(void)
{
    memcpy(board_data_start, board_data_load, (size_t)(board_data_end - board_data_start));
    memset(board_bss_start, 0, (size_t)(board_bss_end - board_bss_start));
    run();
    for (;;) {
    }
}

__attribute__((naked, used)) void board_reset(void) /* floating point on, before any compiled code */
{
    __asm__("ldr r0, =0xE000ED88\n ldr r1, [r0]\n orr r1, #0xF00000\n str r1, [r0]\n dsb\n isb\n b board_start\n");
}

__attribute__((section(".vectors"), used)) static const struct {
    char *stack;
    void (*handler[15])(void);
} vectors = {board_stack_top, {board_reset}};
