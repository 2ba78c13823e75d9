/* pflight on the ranges with nothing calibrated: biases are means that particles carry along, and indoors the wheels' scale
 * and turn bias are states. */
#include "cloud.h"
#include "host_filter.h"
#include "host_random.h"
#include "uwb_range.h"

#include <stdlib.h>

#define BIAS_M 0.10f /* radios of this kind read long by about that */
#define BIAS_SIGMA_M 0.03f
#define BLIND_SIGMA_M 0.10f
#define WIDE_SIGMA_M                                                                                                   \
    0.20f /* indoors while the start is sought: a tempered likelihood, or few particles settle wrongly */
#define INDOOR_SIGMA_M 0.15f
#define START_SCALE 0.03f
#define START_TURN_BIAS_RADPS 0.01f

typedef struct {
    pfl_constant_velocity_t walk;
    pfl_wheels_t wheels;
    pfl_range_bias_t biases;
    const uwb_study_t *study;
} model_t;

typedef struct {
    const pfl_range_bias_z_t *fused; /* and not moved in yet */
    const pfl_odometry_input_t *odometry;
} input_t;

static void predict(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    model_t *model = user;
    const input_t *input = u;

    pfl_range_bias_correct(&model->biases, input->fused, p);
    if (model->study->indoor) {
        pfl_wheels_predict(&model->wheels, input->odometry, dt_s, p);
    } else {
        pfl_constant_velocity_predict(&model->walk, NULL, dt_s, p);
    }
}

static float bias_of(const uwb_study_t *s)
{
    return s->blind ? 0.0f : BIAS_M;
}

static void draw(void *user, const pfl_batch_t *p)
{
    const model_t *model = user;
    const uwb_study_t *s = model->study;

    if (s->indoor) {
        uwb_draw_box(s, p);
        for (uint32_t i = 0u; i < p->n; i++) {
            PFL_STATE(p, PFL_WHEELS_SCALE)[i] = 1.0f + START_SCALE * PFL_NOISE(p, PFL_WHEELS_SCALE)[i];
            PFL_STATE(p, PFL_WHEELS_BIAS)[i] = START_TURN_BIAS_RADPS * PFL_NOISE(p, PFL_WHEELS_BIAS)[i];
        }
    } else {
        uwb_draw_ring(s, bias_of(s), p);
    }
    for (uint32_t k = 0u; k < s->anchors; k++) {
        for (uint32_t i = 0u; i < p->n; i++) {
            PFL_STATE(p, model->biases.bias_state + k)[i] = bias_of(s);
        }
    }
}

/* Outdoors the noises are those of the filter with calibrated biases (uwb_filter.c), and each radio has a bias; indoors
 * all share one, which the circles from four sides show well, and the wheels' noises are less than without their errors
 * as states. The biases walk a millimetre a second, for what is not a bias. The widths of the prior and these noises were
 * chosen among a few on these recordings. */
static model_t make_model(const uwb_study_t *s)
{
    const float sigma_m = s->blind || s->indoor ? BLIND_SIGMA_M : BIAS_SIGMA_M;
    model_t model = {
        .walk = {.sigma_accel = 0.8f, .sigma_position = 0.03f},
        .wheels = {.speed_share = 0.03f,
                   .turn_share = 0.05f,
                   .sigma_turn = 0.03f,
                   .sigma_position = 0.03f,
                   .scale_walk = 0.001f,
                   .bias_walk = 0.0005f},
        .biases = {.x_state = 0u,
                   .y_state = 1u,
                   .bias_state = s->indoor ? PFL_WHEELS_STATES : PFL_CV_STATES,
                   .anchors = (uint16_t)s->anchors,
                   .sigma_m = s->indoor ? WIDE_SIGMA_M : 0.10f,
                   .dof = 3.0f,
                   .walk = 0.001f},
        .study = s,
    };

    for (uint32_t k = 0u; k < s->anchors; k++) {
        model.biases.variance_m2[k] = sigma_m * sigma_m;
    }
    return model;
}

/* One range: predicted to, fused, and the estimate after it. */
static bool cycle(model_t *model, pfl_t *filter, const input_t *input, const pfl_range_bias_z_t *z, uint64_t t_us,
                  float *mean)
{
    bool done = pfl_predict(filter, t_us, input) >= 0 && pfl_update(filter, 0u, t_us, z) >= 0 &&
                pfl_estimate(filter, mean, NULL) >= 0;

    pfl_range_bias_fused(&model->biases, z);
    return done;
}

static bool fly(const uwb_study_t *s, model_t *model, pfl_t *filter, float *estimate, run_output_t *out,
                failure_t *failure)
{
    pfl_range_bias_z_t z[2];
    const pfl_range_bias_z_t *fused = NULL;
    uint64_t before_us = 0u;

    for (size_t i = 0u; i < s->ranges; i++) {
        const uwb_range_t *range = &s->range[i];
        const uwb_anchor_t *anchor = &s->anchor[range->anchor];
        const input_t input = {fused, &range->odometry};
        /* Ranges at one time: no predict would move the first one in, so the next one waits a microsecond. */
        const uint64_t t_us = i > 0u && range->t_us <= before_us ? before_us + 1u : range->t_us;
        float mean[PFL_STATES_MAX];
        pfl_health_t health;

        if (s->indoor && i == UWB_INDOOR_SETTLING) {
            model->biases.sigma_m = INDOOR_SIGMA_M;
        }
        z[i % 2u] = (pfl_range_bias_z_t){anchor->x_m, anchor->y_m, anchor->height_m, range->range_m,
                                         s->indoor ? 0u : range->anchor};
        pfl_range_bias_move(&model->biases, (float)(t_us - before_us) * 1e-6f);
        if (!cycle(model, filter, &input, &z[i % 2u], t_us, mean) || pfl_health(filter, &health) != PFL_OK) {
            return fail(failure, EXIT_HARNESS, "range %zu: the filter gave no estimate", i);
        }
        fused = &z[i % 2u];
        before_us = t_us;
        estimate[2u * i] = mean[0];
        estimate[2u * i + 1u] = mean[1];
        out->cycles_ns[i] = cycle_ns(health.cycles_last);
        out->cycle[i] = cycle_of(&health);
        uwb_show(range, mean, filter, out->look);
    }
    return true;
}

bool uwb_online(const uwb_study_t *s, uint32_t run, float *estimate, run_output_t *out, failure_t *failure)
{
    model_t model = make_model(s);
    const pfl_sensor_t sensor = {.loglik = pfl_range_bias_loglik, .user = &model.biases};
    host_random_t random;

    host_random_start(&random, s->seed, run, RANDOM_FILTER_SEED);
    const pfl_config_t config = {
        .abi = PFL_ABI,
        .particles = s->particles,
        .states = (uint16_t)(model.biases.bias_state + s->anchors),
        .noises = s->indoor ? 6u : 4u,
        .sensor_count = 1u,
        .moments = PFL_MOMENTS_MEAN,
        .circular_mask = s->indoor ? 1u << PFL_WHEELS_HEADING : 0u,
        .circular = pfl_circular_means,
        .ess_ratio = 0.5f,
        .seed = host_random_u64(&random),
        .sensors = &sensor,
        .predict = predict,
        .draw = draw,
        .user = &model,
    };
    void *arena;
    pfl_t *filter = host_filter(&config, &arena, failure);
    const bool flown = filter != NULL && fly(s, &model, filter, estimate, out, failure);
    free(arena);
    return flown;
}
