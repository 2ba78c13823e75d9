/* What the filter does with particles and weights, through the public calls: 4 states, 2 noises, two of them seen. */
#include "kernels.h"

static const pfl_constant_velocity_t model = {1.0f, 0.0f};
static const pfl_position_t broad = {2u, {0u, 1u, 0u, 0u}, {1.0f, 1.0f, 0.0f, 0.0f}};
static const pfl_position_t sharp = {2u, {0u, 1u, 0u, 0u}, {100.0f, 100.0f, 0.0f, 0.0f}};
static const pfl_position_t blind = {2u, {0u, 1u, 0u, 0u}, {0.0f, 0.0f, 0.0f, 0.0f}};
static const float seen[2] = {0.1f, -0.2f};
static pfl_sensor_t sensor = {.loglik = pfl_position_loglik};
static pfl_config_t config;
PFL_ARENA(arena, KERNEL_N, 4u, 2u);

static void draw(void *user, const pfl_batch_t *p)
{
    (void)user;
    for (uint32_t d = 0u; d < 4u; d++) {
        for (uint32_t i = 0u; i < p->n; i++) {
            PFL_STATE(p, d)[i] = PFL_NOISE(p, d)[i];
        }
    }
}

static void *constant(const void *in)
{
    union {
        const void *in;
        void *user;
    } pointer = {in};
    return pointer.user;
}

/* A filter that has drawn and moved its particles. */
static void start(const pfl_position_t *sees, pfl_moments_t moments, uint32_t circular, pfl_scheme_fn scheme)
{
    static const pfl_config_t none;
    config = none;
    sensor.user = constant(sees);
    config.abi = PFL_ABI;
    config.particles = KERNEL_N;
    config.states = 4u;
    config.noises = 2u;
    config.sensor_count = 1u;
    config.resampling = scheme;
    config.moments = (uint16_t)moments;
    config.circular_mask = circular;
    config.circular = pfl_circular_means;
    config.sensors = &sensor;
    config.predict = pfl_constant_velocity_predict;
    config.draw = draw;
    config.user = constant(&model);
    (void)pfl_init(&arena, sizeof arena, &config, 0u, &kernel_data.filter);
    (void)pfl_predict(kernel_data.filter, 100000u, NULL);
}

/* The same with weights; the prediction after them makes the moments stale. */
static void weighed(pfl_moments_t moments, uint32_t circular)
{
    start(&broad, moments, circular, pfl_systematic);
    (void)pfl_update(kernel_data.filter, 0u, 100000u, seen);
    (void)pfl_predict(kernel_data.filter, 200000u, NULL);
}

static void with_weights(const pfl_position_t *sees, pfl_scheme_fn scheme)
{
    start(sees, PFL_MOMENTS_MEAN, 0u, scheme);
    (void)pfl_update(kernel_data.filter, 0u, 100000u, seen);
}

/* ---- Preparations ---------------------------------------------------------------------------------------------------- */

static void before_cycle(void)
{
    start(&broad, PFL_MOMENTS_MEAN, 0u, pfl_systematic);
}
static void before_mean(void)
{
    weighed(PFL_MOMENTS_MEAN, 0u);
}
static void before_covariance(void)
{
    weighed(PFL_MOMENTS_FULL, 0u);
}
static void before_circle(void)
{
    weighed(PFL_MOMENTS_MEAN, 4u);
}
static void before_equal(void)
{
    with_weights(&blind, pfl_systematic);
}
static void before_systematic(void)
{
    with_weights(&broad, pfl_systematic);
}
static void before_degenerate(void)
{
    with_weights(&sharp, pfl_systematic);
}
static void before_stratified(void)
{
    with_weights(&broad, pfl_stratified);
}
static void before_residual(void)
{
    with_weights(&broad, pfl_residual);
}
static void before_multinomial(void)
{
    with_weights(&broad, pfl_multinomial);
}

/* ---- Kernels --------------------------------------------------------------------------------------------------------- */

KERNEL(predict)
{
    (void)pfl_predict(kernel_data.filter, 200000u, NULL);
}
KERNEL(update)
{
    (void)pfl_update(kernel_data.filter, 0u, 100000u, seen);
}
KERNEL(mean)
{
    (void)pfl_estimate(kernel_data.filter, kernel_data.mean, NULL);
}
KERNEL(mean_covariance)
{
    (void)pfl_estimate(kernel_data.filter, kernel_data.mean, NULL);
}
KERNEL(mean_circular)
{
    (void)pfl_estimate(kernel_data.filter, kernel_data.mean, NULL);
}
KERNEL(resample_equal)
{
    (void)pfl_resample(kernel_data.filter);
}
KERNEL(resample_systematic)
{
    (void)pfl_resample(kernel_data.filter);
}
KERNEL(resample_degenerate)
{
    (void)pfl_resample(kernel_data.filter);
}
KERNEL(resample_stratified)
{
    (void)pfl_resample(kernel_data.filter);
}
KERNEL(resample_residual)
{
    (void)pfl_resample(kernel_data.filter);
}
KERNEL(resample_multinomial)
{
    (void)pfl_resample(kernel_data.filter);
}

const kernel_t kernels_filter[] = {
    {"predict", kernel_predict, before_cycle},
    {"update", kernel_update, before_cycle},
    {"mean", kernel_mean, before_mean},
    {"mean_covariance", kernel_mean_covariance, before_covariance},
    {"mean_circular", kernel_mean_circular, before_circle},
    {"resample_equal", kernel_resample_equal, before_equal},
    {"resample_systematic", kernel_resample_systematic, before_systematic},
    {"resample_degenerate", kernel_resample_degenerate, before_degenerate},
    {"resample_stratified", kernel_resample_stratified, before_stratified},
    {"resample_residual", kernel_resample_residual, before_residual},
    {"resample_multinomial", kernel_resample_multinomial, before_multinomial},
};
const uint32_t kernels_filter_count = sizeof kernels_filter / sizeof kernels_filter[0];
