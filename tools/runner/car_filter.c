/* pflight in the street canyon: odometry with its errors as states, two clocks that the particles carry along, and ranges
 * whose long side forgives; a Gaussian instead of that, or odometry alone, for comparison. */
#include "car.h"
#include "cloud.h"
#include "host_filter.h"
#include "host_random.h"

#include <math.h>
#include <stdlib.h>

enum { CLOCK = PFL_WHEELS_STATES, STATES = CLOCK + PFL_CLOCK_STATES };

#define START_SIGMA_M 40.0f /* of a plain fix in such a street */
#define START_HEADING_RAD 0.2f
#define START_SCALE 0.02f
#define START_BIAS_RADPS 0.01f

typedef struct {
    const pfl_pseudoranges_t *fused;
    const pfl_odometry_input_t *odometry;
} input_t;

typedef struct {
    pfl_wheels_t wheels;
    pfl_pseudorange_t ranges;
    const car_study_t *study;
} model_t;

static void predict(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    model_t *model = user;
    const input_t *input = u;

    pfl_clocks_predict(&model->ranges, input->fused, dt_s, p);
    pfl_wheels_predict(&model->wheels, input->odometry, dt_s, p);
}

static void draw(void *user, const pfl_batch_t *p)
{
    const car_study_t *s = ((const model_t *)user)->study;
    const float start[STATES] = {(float)s->fix_x_m,
                                 (float)s->fix_y_m,
                                 (float)CAR_HEADING_RAD,
                                 1.0f,
                                 0.0f,
                                 (float)s->clock_m[0],
                                 (float)s->clock_m[1],
                                 0.0f};
    static const float spread[STATES] = {
        START_SIGMA_M, START_SIGMA_M, START_HEADING_RAD, START_SCALE, START_BIAS_RADPS, 0.0f, 0.0f, 0.0f};

    for (uint32_t d = 0u; d < STATES; d++) {
        for (uint32_t i = 0u; i < p->n; i++) {
            PFL_STATE(p, d)[i] = start[d] + spread[d] * PFL_NOISE(p, d)[i];
        }
    }
}

/* Reflections in a street last for about two seconds, ten epochs: hence the power. A direct range is good to 8 m, a
 * reflected one long by 40 m in the mean, roughly what the recording's description tells of its errors. */
static model_t make_model(const car_study_t *s)
{
    return (model_t){
        .wheels = {.speed_share = 0.05f,
                   .turn_share = 0.02f,
                   .sigma_turn = 0.01f,
                   .sigma_position = 0.3f,
                   .scale_walk = 0.001f,
                   .bias_walk = 0.0005f},
        .ranges = {.x_state = PFL_WHEELS_X,
                   .y_state = PFL_WHEELS_Y,
                   .clock_state = CLOCK,
                   .sigma_m = s->filter == CAR_GAUSSIAN ? 15.0f : 8.0f, /* the spread of all, or of the direct ones */
                   .tail_m = s->filter == CAR_GAUSSIAN ? 0.0f : 40.0f,
                   .power = 0.1f,
                   .clip_m = s->filter == CAR_GAUSSIAN ? INFINITY : 30.0f,
                   .leak = 0.03f,
                   .gain = 0.05f,
                   .interval_s = 0.2f},
        .study = s,
    };
}

static bool check(pfl_status_t status, const char *call, size_t i, failure_t *failure)
{
    return status >= 0 || fail(failure, EXIT_HARNESS, "epoch %zu: %s: %s", i, call, pfl_status_string(status));
}

static void show(const car_epoch_t *epoch, const float *mean, const pfl_t *f, look_t *look)
{
    const look_at_t at = {
        .t_s = epoch->t_s,
        .state = {PFL_WHEELS_X, PFL_WHEELS_Y},
        .axis = {"east [m]", "north [m]"},
        .truth = {epoch->truth_x_m, epoch->truth_y_m},
        .estimate = {(double)mean[PFL_WHEELS_X], (double)mean[PFL_WHEELS_Y]},
    };

    look_take(look, f, &at);
}

static bool drive(const car_study_t *s, model_t *model, pfl_t *f, float *estimate, run_output_t *out,
                  failure_t *failure)
{
    const pfl_pseudoranges_t *fused = NULL;

    for (size_t i = 0u; i < s->epochs; i++) {
        const car_epoch_t *epoch = &s->epoch[i];
        const input_t input = {fused, &epoch->odometry};
        float mean[STATES];
        pfl_health_t health;
        if (!check(pfl_predict(f, epoch->t_us, &input), "pfl_predict", i, failure) ||
            !check(pfl_update(f, 0u, epoch->t_us, &epoch->ranges), "pfl_update", i, failure) ||
            !check(pfl_estimate(f, mean, NULL), "pfl_estimate", i, failure) ||
            !check(pfl_health(f, &health), "pfl_health", i, failure)) {
            return false;
        }
        pfl_clocks_fused(&model->ranges);
        fused = &epoch->ranges;
        estimate[2u * i] = mean[PFL_WHEELS_X];
        estimate[2u * i + 1u] = mean[PFL_WHEELS_Y];
        out->cycles_ns[i] = cycle_ns(health.cycles_last);
        out->cycle[i] = cycle_of(&health);
        show(epoch, mean, f, out->look);
    }
    return true;
}

/* From the true start, where the other filters begin at a fix that is 40 m off. */
static void reckon(const car_study_t *s, float *estimate)
{
    double x = s->epoch[0].truth_x_m;
    double y = s->epoch[0].truth_y_m;
    double heading = CAR_HEADING_RAD;

    for (size_t i = 0u; i < s->epochs; i++) {
        const double dt = i > 0u ? s->epoch[i].t_s - s->epoch[i - 1u].t_s : 0.0;
        const double turn = dt * (double)s->epoch[i].odometry.turn_radps;
        x += dt * (double)s->epoch[i].odometry.speed_mps * cos(heading + 0.5 * turn);
        y += dt * (double)s->epoch[i].odometry.speed_mps * sin(heading + 0.5 * turn);
        heading += turn;
        estimate[2u * i] = (float)x;
        estimate[2u * i + 1u] = (float)y;
    }
}

bool car_filter(const car_study_t *s, uint32_t run, float *estimate, run_output_t *out, failure_t *failure)
{
    model_t model = make_model(s);
    const pfl_sensor_t sensor = {.loglik = pfl_pseudorange_loglik, .user = &model.ranges};
    host_random_t random;

    if (s->filter == CAR_ODOMETRY) {
        reckon(s, estimate);
        return true;
    }
    host_random_start(&random, s->seed, run, RANDOM_FILTER_SEED);
    const pfl_config_t config = {
        .abi = PFL_ABI,
        .particles = s->particles,
        .states = STATES,
        .noises = 6u,
        .sensor_count = 1u,
        .moments = PFL_MOMENTS_MEAN,
        .ess_ratio = 0.5f,
        .seed = host_random_u64(&random),
        .sensors = &sensor,
        .predict = predict,
        .draw = draw,
        .user = &model,
    };
    void *arena;
    pfl_t *f = host_filter(&config, &arena, failure);
    const bool driven = f != NULL && drive(s, &model, f, estimate, out, failure);
    free(arena);
    return driven;
}
