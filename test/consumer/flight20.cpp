/* The flight of flight.c from C++20: designated initialisers, spans, and callbacks that are lambdas. */
#include "pflight/pflight.h"

#include <array>
#include <bit>
#include <cstdio>
#include <span>

namespace {

void mix(uint64_t &hash, std::span<const float> values)
{
    for (const float value : values) {
        hash = (hash ^ std::bit_cast<uint32_t>(value)) * 0x100000001B3u;
    }
}

} // namespace

int main()
{
    static pfl_constant_velocity_t model{.sigma_accel = 0.5f, .sigma_position = 0.0f};
    static pfl_position_t position{.count = 2, .state = {PFL_CV_X, PFL_CV_Y}, .inv_sigma = {2.0f, 2.0f}};
    static const pfl_sensor_t sensor{.loglik = [](void *user, const void *z, const pfl_view_t *p,
                                                  float *ll) { pfl_position_loglik(user, z, p, ll); },
                                     .user = &position};
    static const pfl_config_t config{
        .abi = PFL_ABI,
        .particles = 300,
        .states = PFL_CV_STATES,
        .noises = 2,
        .sensor_count = 1,
        .ess_ratio = 0.5f,
        .seed = 8,
        .sensors = &sensor,
        .predict = [](void *user, const void *u, float dt_s,
                      const pfl_batch_t *p) { pfl_constant_velocity_predict(user, u, dt_s, p); },
        .user = &model};
    PFL_ARENA(arena, 300, PFL_CV_STATES, 2);
    pfl_t *filter = nullptr;
    uint64_t hash = 0xCBF29CE484222325u;

    if (pfl_self_test(&arena, sizeof arena) != PFL_OK ||
        pfl_init(&arena, sizeof arena, &config, 0, &filter) != PFL_OK) {
        return 1;
    }
    for (unsigned k = 1; k <= 100; k++) {
        const uint64_t t_us = k * uint64_t{125000};
        const std::array<float, 2> z_m{static_cast<float>(k) * 0.25f, static_cast<float>(k) * -0.125f};
        std::array<float, PFL_CV_STATES> mean;
        std::array<float, PFL_CV_STATES * PFL_CV_STATES> cov;
        if (pfl_predict(filter, t_us, nullptr) != PFL_OK || pfl_update(filter, 0, t_us, z_m.data()) != PFL_OK ||
            pfl_estimate(filter, mean.data(), cov.data()) != PFL_OK) {
            return 1;
        }
        mix(hash, mean);
        mix(hash, cov);
    }
    std::printf("pflight %s: %016llx\n", PFL_VERSION, static_cast<unsigned long long>(hash));
    return 0;
}
