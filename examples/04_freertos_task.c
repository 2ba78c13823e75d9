/* A FreeRTOS task that runs a filter at 100 Hz under a cycle budget, and what it does when the budget is spent:
 *
 *     PFL_DEFERRED     the measurement is in; moments and resampling follow with the next cycle: go on
 *     PFL_ERR_BUDGET   it is not in, the posterior is the one before: the next measurement makes up for it
 *     a late wake-up   the time went elsewhere: predict to now, as time stamps and not a count of cycles rule
 *
 * It builds here with a stand-in for FreeRTOS (test/target/standin), whose counter leaps now and then as if a task of
 * higher priority had come between. On your board: your FreeRTOS, and in place of main() an xTaskCreate. */
#include "pflight/pflight.h"

#include <stdio.h>
#include <task.h>

#define PARTICLES 300
#define PERIOD_MS 10u
#define COUNTS_PER_S 168000000u
#define BUDGET (COUNTS_PER_S / 1000u) /* 1 ms of the period's 10 */

typedef struct {
    uint32_t cycles, fused, deferred, refused, late, faults;
    float mean[2];
} report_t;

static void climb(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    (void)user;
    (void)u;
    for (uint32_t i = 0; i < p->n; i++) {
        PFL_STATE(p, 0)[i] += dt_s * PFL_STATE(p, 1)[i];
        PFL_STATE(p, 1)[i] += dt_s * PFL_NOISE(p, 0)[i];
    }
}

static pfl_position_t barometer = {1, {0, 0, 0, 0}, {2.0f, 0.0f, 0.0f, 0.0f}}; /* sigma 0.5 m */
static const pfl_sensor_t sensors[] = {{.loglik = pfl_position_loglik, .user = &barometer}};
static const pfl_config_t config = {.abi = PFL_ABI,
                                    .particles = PARTICLES,
                                    .states = 2,
                                    .noises = 1,
                                    .sensor_count = 1,
                                    .ess_ratio = 0.5f,
                                    .seed = 1,
                                    .budget_cycles = BUDGET,
                                    .sensors = sensors,
                                    .predict = climb};
PFL_ARENA(arena, PARTICLES, 2, 1);

static float read_barometer(uint64_t t_us) /* a climb of 2 m/s */
{
    return 2.0e-6f * (float)t_us;
}

static void count(report_t *report, pfl_status_t status)
{
    report->cycles++;
    report->fused += (status == PFL_OK) ? 1u : 0u;
    report->deferred += (status == PFL_DEFERRED) ? 1u : 0u;
    report->refused += (status == PFL_ERR_BUDGET) ? 1u : 0u;
    report->faults += (status < 0 && status != PFL_ERR_BUDGET) ? 1u : 0u;
}

/* The task: `periods` of it here, for ever on a board. */
static void filter_task(pfl_t *filter, uint32_t periods, report_t *report)
{
    TickType_t wake = xTaskGetTickCount();

    for (uint32_t k = 0u; k < periods; k++) {
        report->late += (xTaskDelayUntil(&wake, pdMS_TO_TICKS(PERIOD_MS)) == pdFALSE) ? 1u : 0u;
        const uint64_t t_us = (uint64_t)xTaskGetTickCount() * (1000000u / configTICK_RATE_HZ);
        const float z_m = read_barometer(t_us);
        const pfl_status_t moved = pfl_predict(filter, t_us, NULL); /* always runs to its end */
        const pfl_status_t fused = (moved >= 0) ? pfl_update(filter, 0, t_us, &z_m) : moved;
        count(report, fused);
        if (fused == PFL_OK) {
            (void)pfl_estimate(filter, report->mean, NULL); /* O(1); after PFL_DEFERRED it would do the work put off */
        }
    }
}

int main(void)
{
    report_t report = {0};
    pfl_health_t health;
    pfl_t *filter;

    if (pfl_init(&arena, sizeof arena, &config, 0, &filter) != PFL_OK) {
        return 1;
    }
    filter_task(filter, 1000u, &report);
    if (pfl_health(filter, &health) != PFL_OK || !pfl_invariants_hold(filter)) {
        return 1;
    }
    printf("%lu cycles at 100 Hz: %lu fused, %lu deferred, %lu without their measurement, %lu late, %lu faults\n",
           (unsigned long)report.cycles, (unsigned long)report.fused, (unsigned long)report.deferred,
           (unsigned long)report.refused, (unsigned long)report.late, (unsigned long)report.faults);
    printf("overruns that the filter counted: %lu; longest cycle %lu counts of a budget of %lu\n",
           (unsigned long)health.overruns, (unsigned long)health.cycles_max, (unsigned long)BUDGET);
    printf("%.2f m, %.2f m/s at the end\n", (double)report.mean[0], (double)report.mean[1]);
    return (report.faults == 0u && report.deferred > 0u && report.refused > 0u && report.late > 0u) ? 0 : 1;
}
