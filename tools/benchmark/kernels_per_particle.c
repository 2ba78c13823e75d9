/* Models and sensors of the library once more, as functions of one particle (per_particle.h): what that convenience
 * costs, beside the batches of kernels_models.c. */
#include "kernels.h"

/* As pfl_constant_velocity_predict: the same arithmetic, so the same bits. */
static void drift(void *user, const void *u, float dt_s, float *x, const float *w)
{
    const float *kick_and_shift = (const float *)user;
    const float kick = kick_and_shift[0];
    const float shift = kick_and_shift[1];
    (void)u;
    x[0] += (dt_s * x[2]) + (shift * w[0]);
    x[1] += (dt_s * x[3]) + (shift * w[1]);
    x[2] += kick * w[0];
    x[3] += kick * w[1];
}
PFL_PER_PARTICLE_PREDICT(drift_predict, 4, 2, drift)

/* As pfl_land_vehicle_predict, with a call for sine and cosine. */
static void steer(void *user, const void *u, float dt_s, float *x, const float *w)
{
    const float *number = (const float *)user; /* push, drag, turn, spread, slowest */
    float s;
    float c;
    const float v = x[2];
    const float way = dt_s * v;
    (void)u;
    pfl_sincosf(x[3], &s, &c);
    x[0] += (way * c) + (number[3] * w[0]);
    x[1] += (way * s) + (number[3] * w[1]);
    x[3] += number[2] * v;
    x[2] = v + ((number[0] / ((v > number[4]) ? v : number[4])) - (number[1] * (v * v)));
}
PFL_PER_PARTICLE_PREDICT(steer_predict, 4, 2, steer)

/* As pfl_position_loglik on three states. */
static float seen(void *user, const void *z, const float *x)
{
    const float inverse = *(const float *)user;
    const float *at = (const float *)z;
    const float a = (x[0] - at[0]) * inverse;
    const float b = (x[1] - at[1]) * inverse;
    const float c = (x[2] - at[2]) * inverse;
    return -0.5f * (((a * a) + (b * b)) + (c * c));
}
PFL_PER_PARTICLE_LOGLIK(seen_loglik, 3, seen)

/* As the filter calls them: through a pointer, so that the length of the batch is not known. */
static void move(pfl_predict_fn callback, float *numbers)
{
    pfl_predict_fn volatile predict = callback;
    for (uint32_t first = 0u; first < KERNEL_N; first += PFL_BATCH) {
        const pfl_batch_t batch = {&kernel_data.x[0][first], KERNEL_N, kernel_data.noise, first, PFL_BATCH};
        predict(numbers, NULL, KERNEL_DT_S, &batch);
    }
}

KERNEL(one_constant_velocity)
{
    float numbers[2];
    numbers[0] = 1.0f * pfl_sqrtf(KERNEL_DT_S);
    numbers[1] = 0.5f * KERNEL_DT_S * numbers[0];
    move(drift_predict, numbers);
}

KERNEL(one_land_vehicle)
{
    const float of_mass = KERNEL_DT_S / 1250.0f;
    float numbers[5] = {100000.0f * 0.03f * of_mass, 0.3f * of_mass, 0.0f, KERNEL_DT_S * 2.0f, 0.5f};
    numbers[2] = KERNEL_DT_S * (pfl_tanf(-0.05f) / 2.5f);
    move(steer_predict, numbers);
}

KERNEL(one_position)
{
    static const float at[3] = {10.5f, 9.5f, 10.2f};
    pfl_loglik_fn volatile loglik = seen_loglik;
    float inverse = 0.5f;
    for (uint32_t first = 0u; first < KERNEL_N; first += PFL_BATCH) {
        const pfl_view_t view = {&kernel_data.x[0][first], KERNEL_N, first, PFL_BATCH};
        loglik(&inverse, at, &view, &kernel_data.out[0][first]);
    }
}

const kernel_t kernels_per_particle[] = {
    {"one_constant_velocity", kernel_one_constant_velocity, NULL},
    {"one_land_vehicle", kernel_one_land_vehicle, NULL},
    {"one_position", kernel_one_position, NULL},
};
const uint32_t kernels_per_particle_count = sizeof kernels_per_particle / sizeof kernels_per_particle[0];
