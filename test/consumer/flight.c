/* A consumer in C99: a short flight on a model and a sensor of the library, and the hash of all its estimates, which is the
 * same however the library came into the build. */
#ifdef TWO_FILES
#include "pflight.h"
#else
#include "pflight/pflight.h"
#endif

#include <stdio.h>
#include <string.h>

static uint64_t mix(uint64_t hash, const float *values, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        uint32_t bits;
        memcpy(&bits, &values[i], sizeof bits);
        hash = (hash ^ bits) * 0x100000001B3u;
    }
    return hash;
}

int main(void)
{
    static pfl_constant_velocity_t model = {.sigma_accel = 0.5f};
    static pfl_position_t position = {.count = 2u, .state = {PFL_CV_X, PFL_CV_Y}, .inv_sigma = {2.0f, 2.0f}};
    static const pfl_sensor_t sensors[] = {{.loglik = pfl_position_loglik, .user = &position}};
    static const pfl_config_t config = {.abi = PFL_ABI,
                                        .particles = 300u,
                                        .states = PFL_CV_STATES,
                                        .noises = 2u,
                                        .sensor_count = 1u,
                                        .ess_ratio = 0.5f,
                                        .seed = 8u,
                                        .sensors = sensors,
                                        .predict = pfl_constant_velocity_predict,
                                        .user = &model};
    PFL_ARENA(arena, 300, PFL_CV_STATES, 2);
    uint64_t hash = 0xCBF29CE484222325u;
    pfl_t *filter;

    pfl_status_t status = pfl_self_test(&arena, sizeof arena);
    if (status == PFL_OK) {
        status = pfl_init(&arena, sizeof arena, &config, 0u, &filter);
    }
    for (uint32_t k = 1u; (status == PFL_OK) && (k <= 100u); k++) {
        const uint64_t t_us = (uint64_t)k * 125000u;
        const float z_m[2] = {(float)k * 0.25f, (float)k * -0.125f};
        float mean[PFL_CV_STATES];
        float cov[PFL_CV_STATES * PFL_CV_STATES];

        status = pfl_predict(filter, t_us, NULL);
        status = (status == PFL_OK) ? pfl_update(filter, 0u, t_us, z_m) : status;
        status = (status == PFL_OK) ? pfl_estimate(filter, mean, cov) : status;
        if (status == PFL_OK) {
            hash = mix(mix(hash, mean, PFL_CV_STATES), cov, sizeof cov / sizeof cov[0]);
        }
    }
    if (status != PFL_OK) {
        fprintf(stderr, "%s\n", pfl_status_string(status));
        return 1;
    }
    printf("pflight %s: %08lx%08lx\n", PFL_VERSION, (unsigned long)(hash >> 32), (unsigned long)(hash & 0xFFFFFFFFu));
    return 0;
}
