/* The flight of flight.c from C++98, which has neither designated initialisers nor stdint of its own. */
#include "pflight/pflight.h"

#include <cstdio>
#include <cstring>

namespace {

class Flight {
  public:
    Flight() : status_(PFL_OK), filter_(NULL)
    {
        std::memset(&model_, 0, sizeof model_);
        model_.sigma_accel = 0.5f;
        std::memset(&position_, 0, sizeof position_);
        position_.count = 2;
        position_.state[0] = PFL_CV_X;
        position_.state[1] = PFL_CV_Y;
        position_.inv_sigma[0] = position_.inv_sigma[1] = 2.0f;
        std::memset(&sensor_, 0, sizeof sensor_);
        sensor_.loglik = pfl_position_loglik;
        sensor_.user = &position_;
        std::memset(&config_, 0, sizeof config_);
        config_.abi = PFL_ABI;
        config_.particles = 300;
        config_.states = PFL_CV_STATES;
        config_.noises = 2;
        config_.sensor_count = 1;
        config_.ess_ratio = 0.5f;
        config_.seed = 8;
        config_.sensors = &sensor_;
        config_.predict = pfl_constant_velocity_predict;
        config_.user = &model_;

        PFL_ARENA(arena, 300, PFL_CV_STATES, 2);
        status_ = pfl_self_test(&arena, sizeof arena);
        if (status_ == PFL_OK) {
            status_ = pfl_init(&arena, sizeof arena, &config_, 0, &filter_);
        }
    }

    bool step(unsigned k, float *mean, float *cov)
    {
        const uint64_t t_us = static_cast<uint64_t>(k) * 125000u;
        const float z_m[2] = {static_cast<float>(k) * 0.25f, static_cast<float>(k) * -0.125f};

        if (status_ == PFL_OK) {
            status_ = pfl_predict(filter_, t_us, NULL);
        }
        if (status_ == PFL_OK) {
            status_ = pfl_update(filter_, 0, t_us, z_m);
        }
        if (status_ == PFL_OK) {
            status_ = pfl_estimate(filter_, mean, cov);
        }
        return status_ == PFL_OK;
    }

  private:
    pfl_status_t status_;
    pfl_t *filter_;
    pfl_constant_velocity_t model_;
    pfl_position_t position_;
    pfl_sensor_t sensor_;
    pfl_config_t config_;
};

void mix(uint64_t &hash, const float *values, int count)
{
    for (int i = 0; i < count; i++) {
        uint32_t bits;
        std::memcpy(&bits, &values[i], sizeof bits);
        hash = (hash ^ bits) * ((static_cast<uint64_t>(1) << 40) + 0x1B3u);
    }
}

} // namespace

int main()
{
    uint64_t hash = (static_cast<uint64_t>(0xCBF29CE4u) << 32) | 0x84222325u;
    Flight flight;
    for (unsigned k = 1; k <= 100; k++) {
        float mean[PFL_CV_STATES];
        float cov[PFL_CV_STATES * PFL_CV_STATES];
        if (!flight.step(k, mean, cov)) {
            return 1;
        }
        mix(hash, mean, PFL_CV_STATES);
        mix(hash, cov, PFL_CV_STATES * PFL_CV_STATES);
    }
    std::printf("pflight %s: %08lx%08lx\n", PFL_VERSION, static_cast<unsigned long>(hash >> 32),
                static_cast<unsigned long>(hash & 0xFFFFFFFFu));
    return 0;
}
