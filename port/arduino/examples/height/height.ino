/* Height and climb rate from a noisy height on pin A0: 100 particles at 20 Hz, over the serial line. */
#include <pflight.h>

static void climb(void *, const void *, float dt_s, const pfl_batch_t *p)
{
    for (uint32_t i = 0; i < p->n; i++) {
        PFL_STATE(p, 0)[i] += dt_s * PFL_STATE(p, 1)[i];
        PFL_STATE(p, 1)[i] += dt_s * PFL_NOISE(p, 0)[i];
    }
}

static void gauge(void *, const void *z, const pfl_view_t *p, float *ll)
{
    for (uint32_t i = 0; i < p->n; i++) {
        const float error = (p->x[i] - *static_cast<const float *>(z)) / 0.5f; /* sigma 0.5 m */
        ll[i] = -0.5f * error * error;
    }
}

static pfl_sensor_t sensor;
static pfl_config_t config;
static pfl_t *filter;

void setup()
{
    Serial.begin(115200);
    sensor.loglik = gauge;
    config.abi = PFL_ABI;
    config.particles = 100;
    config.states = 2;
    config.noises = 1;
    config.sensor_count = 1;
    config.ess_ratio = 0.5f;
    config.sensors = &sensor;
    config.predict = climb;

    PFL_ARENA(arena, 100, 2, 1);
    pfl_status_t status = pfl_self_test(&arena, sizeof arena); /* do this board's flags and FPU keep the bits? */
    if (status == PFL_OK) {
        status = pfl_init(&arena, sizeof arena, &config, 0, &filter);
    }
    Serial.println(pfl_status_string(status));
}

void loop()
{
    static uint64_t t_us = 0;
    const float z_m = 0.01f * analogRead(A0);
    float mean[2];

    t_us += 50000;
    if (filter != NULL && pfl_predict(filter, t_us, NULL) == PFL_OK && pfl_update(filter, 0, t_us, &z_m) >= PFL_OK &&
        pfl_estimate(filter, mean, NULL) == PFL_OK) {
        Serial.println(mean[0]);
    }
    delay(50);
}
