/* pflight itself on the land vehicle: configuration, prior, and the loop that a flight computer would run. */
#include "cloud.h"
#include "host_filter.h"
#include "host_random.h"
#include "land_vehicle.h"

#include <math.h>
#include <stdlib.h>

#define JITTER_SPEED_MPS 0.05f
#define JITTER_HEADING_RAD 0.02f
#define STATES_MAX (PFL_LAND_STATES + 1) /* the proposal's log-likelihood is one more */

/* The vehicle stands first: the ready models take a pointer to the whole for a pointer to it. */
typedef struct {
    pfl_land_vehicle_t vehicle;
    float start[PFL_LAND_STATES];
    float start_sigma[PFL_LAND_STATES]; /* zeros: known start */
    pfl_land_vehicle_t quiet;           /* without the noise that the proposal draws */
    pfl_proposal_t proposal;
    pfl_position_t position;
    pfl_sensor_t sensor;
} model_t;

static void draw_start(void *user, const pfl_batch_t *p)
{
    const model_t *model = (const model_t *)user;

    for (uint32_t d = 0u; d < PFL_LAND_STATES; d++) {
        float *x = PFL_STATE(p, d);
        const float *w = PFL_NOISE(p, d);
        for (uint32_t i = 0u; i < p->n; i++) {
            x[i] = model->start[d] + model->start_sigma[d] * w[i];
            if (d == PFL_LAND_SPEED) {
                x[i] = (float)land_clip_start_speed((double)x[i]);
            }
        }
    }
}

static void predict_optimal(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    pfl_proposal_predict(&((model_t *)user)->proposal, u, dt_s, p);
}

static void set_proposal(const land_study_t *study, model_t *model)
{
    const float moved = (float)(LAND_PERIOD_S * sqrt(study->w_variance));
    const float seen = (float)sqrt(study->z_variance);

    model->quiet = model->vehicle;
    model->quiet.sigma_position_mps = 0.0f;
    model->proposal = (pfl_proposal_t){
        .predict = study->jitter ? pfl_land_vehicle_jitter_predict : pfl_land_vehicle_predict,
        .user = &model->quiet,
        .loglik_state = PFL_LAND_STATES,
        .count = LAND_MEASURED,
        .state = {PFL_LAND_EAST, PFL_LAND_NORTH, PFL_LAND_SPEED, 0u},
        .noise = {0u, 1u, 0u, 0u},
        .sigma_noise = {moved, moved, 0.0f, 0.0f},
        .sigma_measured = {seen, seen, seen, 0.0f},
    };
}

static void set_model(const land_study_t *study, model_t *model)
{
    const float inv_sigma = (float)(1.0 / sqrt(study->z_variance));

    *model = (model_t){.vehicle = land_vehicle_constants};
    model->vehicle.sigma_position_mps = (float)sqrt(study->w_variance);
    model->vehicle.sigma_speed_mps = JITTER_SPEED_MPS;
    model->vehicle.sigma_heading_rad = JITTER_HEADING_RAD;
    for (int d = 0; d < PFL_LAND_STATES; d++) {
        model->start[d] = (float)land_start[d];
        model->start_sigma[d] = study->uncertain ? (float)land_start_sigma[d] : 0.0f;
    }
    model->position = (pfl_position_t){
        LAND_MEASURED,
        {PFL_LAND_EAST, PFL_LAND_NORTH, PFL_LAND_SPEED, 0u},
        {inv_sigma, inv_sigma, inv_sigma, 0.0f},
    };
    model->sensor = (pfl_sensor_t){.loglik = pfl_position_loglik, .user = &model->position};
    if (study->optimal) {
        set_proposal(study, model);
        model->sensor = (pfl_sensor_t){.loglik = pfl_proposal_loglik, .user = &model->proposal};
    }
}

static pfl_config_t make_config(const land_study_t *study, uint32_t run, model_t *model)
{
    const pfl_predict_fn plain = study->jitter ? pfl_land_vehicle_jitter_predict : pfl_land_vehicle_predict;
    host_random_t random;

    host_random_start(&random, study->seed, run, RANDOM_FILTER_SEED);
    return (pfl_config_t){
        .abi = PFL_ABI,
        .particles = study->particles,
        .states = study->optimal ? STATES_MAX : PFL_LAND_STATES,
        .noises = study->jitter ? 4u : 2u,
        .sensor_count = 1u,
        .resampling = study->resampling,
        .moments = PFL_MOMENTS_MEAN,
        .ess_ratio = study->theta,
        .seed = host_random_u64(&random),
        .sensors = &model->sensor,
        .predict = study->optimal ? predict_optimal : plain,
        .draw = draw_start,
        .user = model,
    };
}

/* A status below zero is an error; gate and budget are off, so there are no refusals. */
static bool check(pfl_status_t status, const char *call, unsigned k, failure_t *failure)
{
    return status >= 0 || fail(failure, EXIT_HARNESS, "step %u: %s: %s", k, call, pfl_status_string(status));
}

static void show(const land_track_t *track, unsigned k, const double *x, const pfl_t *filter, look_t *look)
{
    const look_at_t at = {
        .t_s = LAND_PERIOD_S * (double)k,
        .state = {PFL_LAND_EAST, PFL_LAND_NORTH},
        .axis = {"east [m]", "north [m]"},
        .truth = {track->truth[k][PFL_LAND_EAST], track->truth[k][PFL_LAND_NORTH]},
        .estimate = {x[PFL_LAND_EAST], x[PFL_LAND_NORTH]},
    };

    look_take(look, filter, &at);
}

static bool fly(const land_study_t *study, pfl_t *filter, const land_track_t *track, land_estimate_t *estimate,
                look_t *look, failure_t *failure)
{
    pfl_health_t health;

    for (unsigned k = 1u; k <= LAND_STEPS; k++) {
        const uint64_t t_us = (uint64_t)k * LAND_PERIOD_US;
        const pfl_land_input_t input = land_input(k - 1u);
        const pfl_proposal_input_t with_measurement = {&input, track->z[k]};
        const void *u = study->optimal ? (const void *)&with_measurement : (const void *)&input;
        float mean[STATES_MAX];

        if (!check(pfl_predict(filter, t_us, u), "pfl_predict", k, failure) ||
            !check(pfl_update(filter, 0u, t_us, track->z[k]), "pfl_update", k, failure) ||
            !check(pfl_estimate(filter, mean, NULL), "pfl_estimate", k, failure) ||
            !check(pfl_health(filter, &health), "pfl_health", k, failure)) {
            return false;
        }
        for (int d = 0; d < PFL_LAND_STATES; d++) {
            estimate->x[k][d] = (double)mean[d];
        }
        estimate->cycles_ns[k - 1u] = cycle_ns(health.cycles_last);
        estimate->cycle[k - 1u] = cycle_of(&health);
        show(track, k, estimate->x[k], filter, look);
    }
    return true;
}

bool land_particle_filter(const land_study_t *study, uint32_t run, const land_track_t *track, land_estimate_t *estimate,
                          look_t *look, failure_t *failure)
{
    model_t model;
    set_model(study, &model);
    const pfl_config_t config = make_config(study, run, &model);
    void *arena;
    pfl_t *filter = host_filter(&config, &arena, failure);
    const bool flown = filter != NULL && fly(study, filter, track, estimate, look, failure);
    free(arena);
    return flown;
}
