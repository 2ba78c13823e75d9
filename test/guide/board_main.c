/* Flies a filter with a budget on an emulated STM32F405 behind the port of docs/guide/porting.md: does its counter count,
 * and is the budget kept? QEMU's timer counts whether it is switched on or not, so that this line of the port is compiled
 * only. The exit status is the number of the step that failed. Run by test/guide/check.py. */
#include "../../port/qemu/semihosting.h"
#include "pflight/pflight.h"

#define PARTICLES 100u

static pfl_constant_velocity_t motion = {.sigma_accel = 1.0f};
static pfl_position_t fix = {.count = 2, .state = {PFL_CV_X, PFL_CV_Y}, .inv_sigma = {1.0f, 1.0f}};
static const pfl_sensor_t sensor = {.loglik = pfl_position_loglik, .user = &fix};
static pfl_config_t config = {.abi = PFL_ABI,
                              .particles = PARTICLES,
                              .states = PFL_CV_STATES,
                              .noises = 2,
                              .sensor_count = 1,
                              .ess_ratio = 0.5f,
                              .sensors = &sensor,
                              .predict = pfl_constant_velocity_predict,
                              .user = &motion};
PFL_ARENA(arena, PARTICLES, PFL_CV_STATES, 2);

/* What the second update answers under a budget; the first is for the measure. */
static int second_update(uint32_t budget_cycles, pfl_health_t *health)
{
    static const float z[2] = {1.0f, 2.0f};
    pfl_t *f;
    pfl_status_t status = PFL_ERR_ARG;
    config.budget_cycles = budget_cycles;
    if (pfl_init(&arena, sizeof arena, &config, 0, &f) != PFL_OK) {
        return -100;
    }
    for (uint32_t k = 1u; k <= 2u; k++) {
        (void)pfl_predict(f, k * 100000u, 0);
        status = pfl_update(f, 0, k * 100000u, z);
    }
    (void)pfl_health(f, health);
    return (int)status;
}

int main(void)
{
    pfl_health_t health;
    if (pfl_self_test(&arena, sizeof arena) != PFL_OK) {
        return 1;
    }
    if ((second_update(0u, &health) != PFL_OK) || !health.counter_usable || (health.cycles_max < 10000u)) {
        return 2;
    }
    if ((second_update(2u * health.cycles_max, &health) != PFL_OK) || (health.overruns != 0u)) {
        return 3;
    }
    if ((second_update(health.cycles_max / 4u, &health) != PFL_ERR_BUDGET) || (health.overruns == 0u)) {
        return 4;
    }
    sh_print("the port counts, and a budget is kept\n");
    return 0;
}
