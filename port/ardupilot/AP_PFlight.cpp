/* See AP_PFlight.h. A scheduler task of the vehicle calls update(); nothing here allocates or waits. */
#include "AP_PFlight.h"

void AP_PFlight::climb(void *, const void *, float dt_s, const pfl_batch_t *p)
{
    for (uint32_t i = 0; i < p->n; i++) {
        PFL_STATE(p, 0)[i] += dt_s * PFL_STATE(p, 1)[i];
        PFL_STATE(p, 1)[i] += dt_s * PFL_NOISE(p, 0)[i];
    }
}

void AP_PFlight::barometer(void *, const void *z, const pfl_view_t *p, float *ll)
{
    const float height_m = *static_cast<const float *>(z);

    for (uint32_t i = 0; i < p->n; i++) {
        const float error = (p->x[i] - height_m) * 2.0f; /* sigma 0.5 m */
        ll[i] = -0.5f * error * error;
    }
}

bool AP_PFlight::init(uint64_t now_us)
{
    sensor.loglik = barometer;
    config.abi = PFL_ABI;
    config.particles = particles;
    config.states = 2;
    config.noises = 1;
    config.sensor_count = 1;
    config.ess_ratio = 0.5f;
    config.sensors = &sensor;
    config.predict = climb;

    last = pfl_self_test(&arena, sizeof(arena));
    if (last == PFL_OK) {
        last = pfl_init(&arena, sizeof(arena), &config, now_us, &filter);
    }
    return last == PFL_OK;
}

bool AP_PFlight::update(uint64_t now_us, float height_m)
{
    if (filter == nullptr) {
        return false;
    }
    last = pfl_predict(filter, now_us, nullptr);
    if (last >= PFL_OK) {
        last = pfl_update(filter, 0, now_us, &height_m);
    }
    const bool fused = last >= PFL_OK;
    (void)pfl_estimate(filter, mean, nullptr); /* also after a refusal: the prediction */
    return fused;
}
