/* A first filter: height and climb rate from a barometer. The README shows this program. */
#include "pflight/pflight.h"

#include <stdio.h>

static void climb(void *user, const void *u, float dt_s, const pfl_batch_t *p) /* x_k = f(x_k-1, w_k) */
{
    (void)user, (void)u;
    for (uint32_t i = 0; i < p->n; i++) {
        PFL_STATE(p, 0)[i] += dt_s * PFL_STATE(p, 1)[i];
        PFL_STATE(p, 1)[i] += dt_s * PFL_NOISE(p, 0)[i];
    }
}

static void barometer(void *user, const void *z, const pfl_view_t *p, float *ll) /* log p(z_k | x_k) */
{
    (void)user;
    for (uint32_t i = 0; i < p->n; i++) {
        const float error = (p->x[i] - *(const float *)z) / 0.5f;
        ll[i] = -0.5f * error * error;
    }
}

int main(void)
{
    static const pfl_sensor_t sensors[] = {{.loglik = barometer}};
    static const pfl_config_t config = {.abi = PFL_ABI,
                                        .particles = 300,
                                        .states = 2,
                                        .noises = 1,
                                        .sensor_count = 1,
                                        .ess_ratio = 0.5f,
                                        .seed = 1,
                                        .sensors = sensors,
                                        .predict = climb};
    PFL_ARENA(arena, 300, 2, 1);
    pfl_t *filter;
    float mean[2] = {0.0f, 0.0f};
    float cov[4] = {0.0f, 0.0f, 0.0f, 0.0f};
    pfl_status_t status = pfl_init(&arena, sizeof arena, &config, 0, &filter);
    for (uint64_t t_us = 100000; status == PFL_OK && t_us <= 10000000; t_us += 100000) {
        const float height_m = 2.0f * 1e-6f * (float)t_us; /* climbing at 2 m/s */
        status = pfl_predict(filter, t_us, NULL);
        status = status == PFL_OK ? pfl_update(filter, 0, t_us, &height_m) : status;
        status = status == PFL_OK ? pfl_estimate(filter, mean, cov) : status;
    }
    printf("%s: height %.1f m, climb rate %.1f m/s\n", pfl_status_string(status), (double)mean[0], (double)mean[1]);
    return status == PFL_OK ? 0 : 1;
}
