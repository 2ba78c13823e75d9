/* A particle filter as an ArduPilot library: height and climb rate from a height measurement, to start your own from. */
#pragma once

#include "pflight.h"

class AP_PFlight {
  public:
    /* False where this build does not keep the bits, or the configuration is refused: status() tells. */
    bool init(uint64_t now_us);

    /* A height and its time, at the rate of the barometer. False: not fused. */
    bool update(uint64_t now_us, float height_m);

    float height_m() const
    {
        return mean[0];
    }
    float climb_mps() const
    {
        return mean[1];
    }
    pfl_status_t status() const
    {
        return last;
    }

  private:
    static const uint16_t particles = 200;

    static void climb(void *user, const void *u, float dt_s, const pfl_batch_t *p);
    static void barometer(void *user, const void *z, const pfl_view_t *p, float *ll);

    union {
        uint64_t align;
        uint8_t bytes[PFL_ARENA_BYTES(particles, 2, 1)];
    } arena;
    pfl_config_t config{};
    pfl_sensor_t sensor{};
    pfl_t *filter = nullptr;
    pfl_status_t last = PFL_ERR_ARG;
    float mean[2]{};
};
