/* Two sensors of one target, a range and a range with bearing, and five seconds without either: fusion is one update a
 * sensor, an outage is predicting without updating, and a gate keeps a wild range out. */
#include "pflight/pflight.h"

#include <stdio.h>

#define PARTICLES 500

static pfl_constant_velocity_t motion = {.sigma_accel = 0.3f};
static pfl_range_t range = {.x_state = 0, .y_state = 1, .inv_sigma = 1.0f / 0.3f};
static pfl_range_bearing_t radar = {
    .x_state = 0, .y_state = 1, .inv_sigma_range = 1.0f / 2.0f, .inv_sigma_bearing = 1.0f / 0.05f};

static void prior(void *user, const pfl_batch_t *p)
{
    (void)user;
    for (uint32_t i = 0; i < p->n; i++) {
        PFL_STATE(p, PFL_CV_X)[i] = 100.0f + 10.0f * PFL_NOISE(p, 0)[i];
        PFL_STATE(p, PFL_CV_Y)[i] = 10.0f * PFL_NOISE(p, 1)[i];
        PFL_STATE(p, PFL_CV_VX)[i] = PFL_NOISE(p, 2)[i];
        PFL_STATE(p, PFL_CV_VY)[i] = 3.0f * PFL_NOISE(p, 3)[i];
    }
}

/* The target goes north along x = 100 m at 4 m/s, seen without noise, for the sake of a short example. */
static pfl_status_t fuse(pfl_t *f, uint64_t t_us, float y_m)
{
    const float x_m = 100.0f;
    const pfl_range_z_t r = {0.0f, 50.0f, 0.0f, pfl_sqrtf(x_m * x_m + (y_m - 50.0f) * (y_m - 50.0f)), 1.0f};
    const pfl_range_bearing_z_t b = {0.0f, 0.0f, pfl_sqrtf(x_m * x_m + y_m * y_m), pfl_atan2f(y_m, x_m)};
    const pfl_range_z_t wild = {0.0f, 50.0f, 0.0f, 700.0f, 1.0f};
    pfl_status_t status = pfl_update(f, 0, t_us, &r);
    status = status == PFL_OK ? pfl_update(f, 1, t_us, &b) : status;
    if (status == PFL_OK && pfl_update(f, 0, t_us, &wild) != PFL_REJECTED) {
        puts("a range of 700 m should have been rejected");
        return PFL_ERR_ARG;
    }
    return status;
}

int main(void)
{
    static const pfl_sensor_t sensors[] = {{.loglik = pfl_range_loglik, .user = &range, .gate = 10.8f},
                                           {.loglik = pfl_range_bearing_loglik, .user = &radar, .gate = 13.8f}};
    static const pfl_config_t config = {.abi = PFL_ABI,
                                        .particles = PARTICLES,
                                        .states = PFL_CV_STATES,
                                        .noises = 2,
                                        .sensor_count = 2,
                                        .ess_ratio = 0.5f,
                                        .seed = 3,
                                        .sensors = sensors,
                                        .predict = pfl_constant_velocity_predict,
                                        .draw = prior,
                                        .user = &motion};
    PFL_ARENA(arena, PARTICLES, PFL_CV_STATES, 2);
    pfl_t *f;
    pfl_status_t status = pfl_init(&arena, sizeof arena, &config, 0, &f);
    for (uint32_t k = 1; status == PFL_OK && k <= 40; k++) {
        const uint64_t t_us = (uint64_t)k * 500000;
        const int outage = k > 20 && k <= 30;
        float mean[4];
        float cov[16];
        status = pfl_predict(f, t_us, NULL);
        if (status == PFL_OK && !outage) {
            status = fuse(f, t_us, 2.0f * (float)k);
        }
        if (status == PFL_OK && k % 5 == 0) {
            status = pfl_estimate(f, mean, cov);
            printf("%4.1f s %-6s  x %6.1f m  y %6.1f m  sigma %4.1f m\n", 0.5 * k, outage ? "blind" : "fused",
                   (double)mean[0], (double)mean[1], (double)pfl_sqrtf(cov[0] + cov[5]));
        }
    }
    puts(pfl_status_string(status));
    return status == PFL_OK ? 0 : 1;
}
