/* pflight on the ranges: constant velocity outdoors, odometry and a global start indoors, one Student-t range sensor
 * for both. */
#include "cloud.h"
#include "host_filter.h"
#include "host_random.h"
#include "uwb_range.h"

#include <math.h>
#include <stdlib.h>

#define TAIL_DOF 3.0f
#define SIGMA_OUTDOOR_M 0.10f
#define SIGMA_INDOOR_M 0.20f
#define START_SPREAD_M 0.5f
#define START_SPEED_MPS 1.0f

/* The motion stands first: the ready models take a pointer to the whole for a pointer to it. */
typedef struct {
    union {
        pfl_constant_velocity_t outdoor;
        pfl_odometry_t indoor;
    } motion;
    const uwb_study_t *study;
} model_t;

/* Two independent uniforms in (0, 1] and [-pi, pi] out of two normals: Box and Muller backwards. */
static float uniform_of(float a, float b, float *angle)
{
    *angle = pfl_atan2f(b, a);
    return pfl_expf(-0.5f * (a * a + b * b));
}

/* Outdoors: the ring of the first range, give or take, in every direction. */
void uwb_draw_ring(const uwb_study_t *s, float bias_m, const pfl_batch_t *p)
{
    const uwb_anchor_t *anchor = &s->anchor[s->range[0].anchor];
    const float slant_m = s->range[0].range_m - bias_m;
    const float square = slant_m * slant_m - anchor->height_m * anchor->height_m;
    const float radius_m = pfl_sqrtf(square > 0.0f ? square : 0.0f);

    for (uint32_t i = 0u; i < p->n; i++) {
        float direction;
        float sine;
        float cosine;
        const float share = uniform_of(PFL_NOISE(p, 0)[i], PFL_NOISE(p, 1)[i], &direction);
        const float rho_m = radius_m + START_SPREAD_M * (2.0f * share - 1.0f);
        pfl_sincosf(direction, &sine, &cosine);
        PFL_STATE(p, PFL_CV_X)[i] = anchor->x_m + rho_m * cosine;
        PFL_STATE(p, PFL_CV_Y)[i] = anchor->y_m + rho_m * sine;
        PFL_STATE(p, PFL_CV_VX)[i] = START_SPEED_MPS * PFL_NOISE(p, 2)[i];
        PFL_STATE(p, PFL_CV_VY)[i] = START_SPEED_MPS * PFL_NOISE(p, 3)[i];
    }
}

static void draw_ring(void *user, const pfl_batch_t *p)
{
    const uwb_study_t *s = ((const model_t *)user)->study;

    uwb_draw_ring(s, s->anchor[s->range[0].anchor].bias_m, p);
}

/* Indoors: anywhere in the box of the anchors, any heading. */
void uwb_draw_box(const uwb_study_t *s, const pfl_batch_t *p)
{
    float lo_x = s->anchor[0].x_m;
    float hi_x = lo_x;
    float lo_y = s->anchor[0].y_m;
    float hi_y = lo_y;

    for (uint32_t k = 1u; k < s->anchors; k++) {
        lo_x = fminf(lo_x, s->anchor[k].x_m);
        hi_x = fmaxf(hi_x, s->anchor[k].x_m);
        lo_y = fminf(lo_y, s->anchor[k].y_m);
        hi_y = fmaxf(hi_y, s->anchor[k].y_m);
    }
    for (uint32_t i = 0u; i < p->n; i++) {
        float angle;
        const float share = uniform_of(PFL_NOISE(p, 0)[i], PFL_NOISE(p, 1)[i], &angle);
        PFL_STATE(p, PFL_ODO_X)[i] = lo_x + (hi_x - lo_x) * share;
        PFL_STATE(p, PFL_ODO_Y)[i] = lo_y + (hi_y - lo_y) * (0.5f + 0.5f * angle / PFL_PI);
        PFL_STATE(p, PFL_ODO_HEADING)[i] = pfl_wrap_pi(10.0f * PFL_NOISE(p, 2)[i]); /* uniform to e^-50 */
    }
}

static void draw_box(void *user, const pfl_batch_t *p)
{
    uwb_draw_box(((const model_t *)user)->study, p);
}

static model_t make_model(const uwb_study_t *s)
{
    model_t model = {.study = s};

    if (s->indoor) {
        model.motion.indoor = (pfl_odometry_t){.speed_scale = 0.974f,
                                               .speed_share = 0.03f,
                                               .turn_share = 0.1f,
                                               .sigma_turn = 0.05f,
                                               .sigma_position = 0.05f};
    } else {
        model.motion.outdoor = (pfl_constant_velocity_t){.sigma_accel = 0.8f, .sigma_position = 0.03f};
    }
    return model;
}

static pfl_config_t make_config(const uwb_study_t *s, uint32_t run, model_t *model, const pfl_sensor_t *sensor)
{
    host_random_t random;

    host_random_start(&random, s->seed, run, RANDOM_FILTER_SEED);
    return (pfl_config_t){
        .abi = PFL_ABI,
        .particles = s->particles,
        .states = s->indoor ? PFL_ODO_STATES : PFL_CV_STATES,
        .noises = 4u,
        .sensor_count = 1u,
        .moments = PFL_MOMENTS_MEAN,
        .circular_mask = s->indoor ? 1u << PFL_ODO_HEADING : 0u,
        .circular = pfl_circular_means,
        .ess_ratio = 0.5f,
        .seed = host_random_u64(&random),
        .sensors = sensor,
        .predict = s->indoor ? pfl_odometry_predict : pfl_constant_velocity_predict,
        .draw = s->indoor ? draw_box : draw_ring,
        .user = model,
    };
}

static bool check(pfl_status_t status, const char *call, size_t i, failure_t *failure)
{
    return status >= 0 || fail(failure, EXIT_HARNESS, "range %zu: %s: %s", i, call, pfl_status_string(status));
}

void uwb_show(const uwb_range_t *range, const float *mean, const pfl_t *filter, look_t *look)
{
    const look_at_t at = {
        .t_s = range->t_s,
        .state = {0u, 1u},
        .axis = {"x [m]", "y [m]"},
        .truth = {range->truth_x_m, range->truth_y_m},
        .estimate = {(double)mean[0], (double)mean[1]},
    };

    look_take(look, filter, &at);
}

static bool fly(const uwb_study_t *s, pfl_t *filter, float *estimate, run_output_t *out, failure_t *failure)
{
    pfl_health_t health;

    for (size_t i = 0u; i < s->ranges; i++) {
        const uwb_range_t *range = &s->range[i];
        const uwb_anchor_t *anchor = &s->anchor[range->anchor];
        const pfl_range_z_t z = {anchor->x_m, anchor->y_m, anchor->height_m, range->range_m - anchor->bias_m, 1.0f};
        float mean[PFL_STATES_MAX];

        if (!check(pfl_predict(filter, range->t_us, &range->odometry), "pfl_predict", i, failure) ||
            !check(pfl_update(filter, 0u, range->t_us, &z), "pfl_update", i, failure) ||
            !check(pfl_estimate(filter, mean, NULL), "pfl_estimate", i, failure) ||
            !check(pfl_health(filter, &health), "pfl_health", i, failure)) {
            return false;
        }
        estimate[2u * i] = mean[0];
        estimate[2u * i + 1u] = mean[1];
        out->cycles_ns[i] = cycle_ns(health.cycles_last);
        out->cycle[i] = cycle_of(&health);
        uwb_show(range, mean, filter, out->look);
    }
    return true;
}

bool uwb_filter(const uwb_study_t *s, uint32_t run, float *estimate, run_output_t *out, failure_t *failure)
{
    pfl_range_t sensed = {
        .x_state = 0u,
        .y_state = 1u,
        .inv_sigma = 1.0f / (s->indoor ? SIGMA_INDOOR_M : SIGMA_OUTDOOR_M),
        .dof = s->gaussian ? 0.0f : TAIL_DOF,
    };
    const pfl_sensor_t sensor = {.loglik = pfl_range_loglik, .user = &sensed};
    model_t model = make_model(s);
    const pfl_config_t config = make_config(s, run, &model, &sensor);
    void *arena;
    pfl_t *filter = host_filter(&config, &arena, failure);
    const bool flown = filter != NULL && fly(s, filter, estimate, out, failure);
    free(arena);
    return flown;
}
