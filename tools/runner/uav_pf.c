/* pflight itself on the UAV: configuration, prior, the loop that a ground station would run, and its forecasts. */
#include "uav_trajectory.h"

#include "host_random.h"

#include <math.h>
#include <stdlib.h>

#define KERNEL_WIDTH 0.5f
#define STATES_MAX (UAV_STATES + 4)
#define NOISES_MAX 4u
#define CLOUD_EVERY_S 5u /* in a trace: the cloud at these seconds, and at the second before, where a fix is due next */

/* Everything that a filter's configuration points to. The vehicle stands first: the ready model takes a pointer to the
 * whole for a pointer to it. */
typedef struct {
    pfl_autopilot_t vehicle;
    uint32_t states;
    float start[STATES_MAX];
    float start_sigma[STATES_MAX];
    const uav_study_t *study;
    const uav_clouds_t *clouds;
    pfl_autopilot_t quiet; /* without the gusts that the proposal draws */
    pfl_proposal_t proposal;
    pfl_position_t position;
    pfl_sensor_t sensor;
    pfl_kernel_t kernel;
    pfl_config_t config;
} model_t;

static void draw_start(void *user, const pfl_batch_t *p)
{
    const model_t *model = (const model_t *)user;

    for (uint32_t d = 0u; d < model->states; d++) {
        float *x = PFL_STATE(p, d);
        const float *w = PFL_NOISE(p, d);
        for (uint32_t i = 0u; i < p->n; i++) {
            x[i] = model->start[d] + model->start_sigma[d] * w[i];
        }
    }
}

/* States beyond the vehicle's six: wind, waypoint. Both start at zero. */
static void add_states(const uav_study_t *s, model_t *model)
{
    model->states = UAV_STATES;
    if (s->wind_model == UAV_WIND_IN_STATE) {
        model->vehicle.wind_state = (uint16_t)model->states;
        model->vehicle.wind_walk = (float)s->wind_walk;
        model->start_sigma[model->states] = (float)s->wind_sigma_mps;
        model->start_sigma[model->states + 1u] = (float)s->wind_sigma_mps;
        model->kernel.states_mask |= 3u << model->states;
        model->states += 2u;
    }
    if (s->sim == UAV_REPLAY) {
        model->vehicle.waypoint_state = (uint16_t)model->states;
        model->states += 1u;
    }
}

static void predict_optimal(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    pfl_proposal_predict(&((model_t *)user)->proposal, u, dt_s, p);
}

/* A gust is held over the second between two steps, and moves the position only: linear, whatever the pilot does. */
static void set_proposal(const uav_study_t *s, model_t *model)
{
    const float moved = (float)(s->set.sigma_gust_mps * 1e-6 * (double)UAV_PERIOD_US);
    const float seen = (float)s->set.sigma_fix_m;

    model->quiet = model->vehicle;
    model->quiet.sigma_gust_mps = 0.0f;
    model->proposal = (pfl_proposal_t){
        .predict = pfl_autopilot_predict,
        .user = &model->quiet,
        .loglik_state = (uint16_t)model->states,
        .count = UAV_FIX,
        .state = {PFL_AUTOPILOT_X, PFL_AUTOPILOT_Y, PFL_AUTOPILOT_HEIGHT, 0u},
        .noise = {0u, 1u, 0u, 0u},
        .sigma_noise = {moved, moved, 0.0f, 0.0f},
        .sigma_measured = {seen, seen, seen, 0.0f},
    };
    model->states += 1u;
    model->sensor = (pfl_sensor_t){.loglik = pfl_proposal_loglik, .user = &model->proposal};
}

static void make_model(const uav_study_t *s, const uav_track_t *track, const uav_clouds_t *clouds, model_t *model)
{
    const float inv_sigma = (float)(1.0 / s->set.sigma_fix_m);

    *model = (model_t){.vehicle = uav_vehicle, .study = s, .clouds = clouds};
    model->vehicle.sigma_gust_mps = (float)s->set.sigma_gust_mps;
    model->kernel.move = pfl_kernel_move;
    model->kernel.width = KERNEL_WIDTH;
    model->kernel.states_mask =
        (1u << PFL_AUTOPILOT_X) | (1u << PFL_AUTOPILOT_Y) | (1u << PFL_AUTOPILOT_SPEED) | (1u << PFL_AUTOPILOT_HEADING);
    for (int d = 0; d < UAV_STATES; d++) {
        model->start[d] = (float)track->measured_start[d];
        model->start_sigma[d] = (float)s->set.start_sigma[d];
    }
    if (s->wind_model == UAV_WIND_KNOWN) {
        model->vehicle.wind_x_mps = (float)track->wind[0];
        model->vehicle.wind_y_mps = (float)track->wind[1];
    }
    add_states(s, model);
    model->position = (pfl_position_t){
        UAV_FIX,
        {PFL_AUTOPILOT_X, PFL_AUTOPILOT_Y, PFL_AUTOPILOT_HEIGHT, 0u},
        {inv_sigma, inv_sigma, inv_sigma, 0.0f},
    };
    model->sensor.loglik = s->distance ? pfl_position_distance_loglik : pfl_position_loglik;
    model->sensor.user = &model->position;
    if (s->optimal) {
        set_proposal(s, model);
    }
}

static void make_config(const uav_study_t *s, uint32_t stream, model_t *model)
{
    host_random_t random;

    host_random_start(&random, s->seed, stream, RANDOM_FILTER_SEED);
    model->config = (pfl_config_t){
        .abi = PFL_ABI,
        .particles = s->particles,
        .states = (uint16_t)model->states,
        .noises = s->wind_model == UAV_WIND_IN_STATE ? NOISES_MAX : 2u,
        .sensor_count = 1u,
        .resampling = s->scheme,
        .moments = PFL_MOMENTS_FULL,
        .circular_mask = 1u << PFL_AUTOPILOT_HEADING,
        .circular = pfl_circular_means,
        .ess_ratio = s->resampling ? (float)s->resample_below : 0.0f,
        .seed = host_random_u64(&random),
        .sensors = &model->sensor,
        .kernel = s->kernel ? &model->kernel : NULL,
        .predict = s->optimal ? predict_optimal : pfl_autopilot_predict,
        .draw = draw_start,
        .user = model,
    };
}

/* A status below zero is an error; gate and budget are off, so there are no refusals. */
static bool check(pfl_status_t status, const char *call, unsigned k, failure_t *failure)
{
    return status >= 0 || fail(failure, EXIT_HARNESS, "second %u: %s: %s", k, call, pfl_status_string(status));
}

/* ---- What the filter answers ------------------------------------------------------------------------------------- */

static void to_belief(const model_t *model, const float *mean, const float *cov, uav_belief_t *belief)
{
    const uint32_t wind = model->vehicle.wind_state;
    const size_t row = model->states;

    for (int d = 0; d < UAV_STATES; d++) {
        belief->mean[d] = (double)mean[d];
    }
    belief->wind[0] = (double)(wind != 0u ? mean[wind] : model->vehicle.wind_x_mps);
    belief->wind[1] = (double)(wind != 0u ? mean[wind + 1u] : model->vehicle.wind_y_mps);
    belief->xx = (double)cov[PFL_AUTOPILOT_X * row + PFL_AUTOPILOT_X];
    belief->xy = (double)cov[PFL_AUTOPILOT_X * row + PFL_AUTOPILOT_Y];
    belief->yy = (double)cov[PFL_AUTOPILOT_Y * row + PFL_AUTOPILOT_Y];
}

static uav_cloud_t look_at_cloud(const pfl_view_t *view, const double *truth)
{
    const float *x = PFL_STATE(view, PFL_AUTOPILOT_X);
    const float *y = PFL_STATE(view, PFL_AUTOPILOT_Y);
    const double n = (double)view->n;
    double sum_x = 0.0, sum_y = 0.0, squares = 0.0;
    uav_cloud_t cloud = {0.0, 0.0, 0.0};

    for (uint32_t i = 0u; i < view->n; i++) {
        const double dx = (double)x[i] - truth[PFL_AUTOPILOT_X];
        const double dy = (double)y[i] - truth[PFL_AUTOPILOT_Y];
        const double d = sqrt(dx * dx + dy * dy);
        sum_x += dx;
        sum_y += dy;
        squares += d * d;
        cloud.mean_m += d / n;
        cloud.max_m = fmax(cloud.max_m, d);
    }
    cloud.std_m = sqrt((squares / n - (sum_x * sum_x + sum_y * sum_y) / (n * n)) / 2.0);
    return cloud;
}

static void show(const model_t *model, const pfl_t *filter, const uav_track_t *track, unsigned k, const float *mean)
{
    const look_at_t at = {
        .t_s = (double)k,
        .state = {PFL_AUTOPILOT_X, PFL_AUTOPILOT_Y},
        .axis = {"x [m]", "y [m]"},
        .truth = {track->truth[k][PFL_AUTOPILOT_X], track->truth[k][PFL_AUTOPILOT_Y]},
        .estimate = {(double)mean[PFL_AUTOPILOT_X], (double)mean[PFL_AUTOPILOT_Y]},
    };

    look_take(model->clouds->look, filter, &at);
}

static bool look(const model_t *model, pfl_t *filter, const uav_track_t *track, unsigned k, uav_flight_t *flight,
                 failure_t *failure)
{
    float mean[STATES_MAX];
    float cov[STATES_MAX * STATES_MAX];
    pfl_view_t view;

    if (!check(pfl_estimate(filter, mean, cov), "pfl_estimate", k, failure) ||
        !check(pfl_particles(filter, &view, NULL), "pfl_particles", k, failure)) {
        return false;
    }
    to_belief(model, mean, cov, &flight->at[k]);
    flight->cloud[k] = look_at_cloud(&view, track->truth[k]);
    show(model, filter, track, k, mean);
    if (k % CLOUD_EVERY_S == 0u || k % CLOUD_EVERY_S == CLOUD_EVERY_S - 1u) {
        cloud_take(model->clouds->text, model->clouds->filtered, (double)k, filter, PFL_AUTOPILOT_X, PFL_AUTOPILOT_Y);
    }
    return true;
}

/* ---- Forecasts --------------------------------------------------------------------------------------------------- */

/* What the pilot will ask for, in a pfl_control_fn's form. */
typedef struct {
    const uav_study_t *study;
    pfl_autopilot_input_t wanted;
    pfl_proposal_input_t without_fix;
} pilot_t;

static const void *pilot_input(void *user, uint32_t step, uint64_t t_us)
{
    pilot_t *pilot = (pilot_t *)user;

    (void)step;
    pilot->wanted = uav_reference(pilot->study, (unsigned)(t_us / UAV_PERIOD_US));
    pilot->without_fix = (pfl_proposal_input_t){&pilot->wanted, NULL};
    return pilot->study->optimal ? (const void *)&pilot->without_fix : (const void *)&pilot->wanted;
}

static bool reach_of(const pfl_t *ahead, const uav_belief_t *last, unsigned k, double *reach_m, failure_t *failure)
{
    float reach = 0.0f;

    if (!check(pfl_farthest(ahead, PFL_AUTOPILOT_X, PFL_AUTOPILOT_Y, (float)last->mean[PFL_AUTOPILOT_X],
                            (float)last->mean[PFL_AUTOPILOT_Y], &reach),
               "pfl_farthest", k, failure)) {
        return false;
    }
    *reach_m = (double)reach;
    return true;
}

/* The clouds on the way of a forecast: shorter ones, which take the same course to the bit. */
static bool take_clouds_ahead(const model_t *model, const pfl_t *filter, void *spare, size_t bytes, unsigned k,
                              const pfl_horizon_t *whole, failure_t *failure)
{
    pfl_horizon_t horizon = *whole;
    float mean[UAV_AHEAD_MAX * STATES_MAX];
    pfl_t *ahead = NULL;

    for (horizon.steps = CLOUD_EVERY_S; horizon.steps <= whole->steps; horizon.steps += CLOUD_EVERY_S) {
        if (!check(pfl_forecast(filter, spare, bytes, &horizon, mean, NULL, &ahead), "pfl_forecast", k, failure)) {
            return false;
        }
        cloud_take(model->clouds->text, model->clouds->forecast, (double)(k + horizon.steps), ahead, PFL_AUTOPILOT_X,
                   PFL_AUTOPILOT_Y);
    }
    return true;
}

/* Forecast j, from second k on. */
static bool look_ahead(const model_t *model, const pfl_t *filter, void *spare, size_t bytes, unsigned j,
                       uav_flight_t *flight, failure_t *failure)
{
    const uav_study_t *s = model->study;
    const unsigned k = s->forecast_at[j];
    const size_t states = model->states;
    pilot_t pilot = {.study = s};
    const pfl_horizon_t horizon = {
        .step_us = UAV_PERIOD_US, .steps = s->ahead_s, .control = pilot_input, .control_user = &pilot};
    float mean[UAV_AHEAD_MAX * STATES_MAX];
    float cov[UAV_AHEAD_MAX * STATES_MAX * STATES_MAX];
    pfl_t *ahead = NULL;

    flight->ahead[j][0] = flight->at[k];
    if (model->clouds->text != NULL && uav_is_shown(s, j) &&
        !take_clouds_ahead(model, filter, spare, bytes, k, &horizon, failure)) {
        return false;
    }
    if (!check(pfl_forecast(filter, spare, bytes, &horizon, mean, cov, &ahead), "pfl_forecast", k, failure)) {
        return false;
    }
    for (unsigned i = 0u; i < s->ahead_s; i++) {
        to_belief(model, &mean[i * states], &cov[i * states * states], &flight->ahead[j][i + 1u]);
    }
    return reach_of(ahead, &flight->ahead[j][s->ahead_s], k, &flight->reach_m[j], failure);
}

static bool look_ahead_where_due(const model_t *model, const pfl_t *filter, void *spare, size_t bytes, unsigned k,
                                 uav_flight_t *flight, failure_t *failure)
{
    for (unsigned j = 0u; j < model->study->forecasts; j++) {
        if (model->study->forecast_at[j] == k && !look_ahead(model, filter, spare, bytes, j, flight, failure)) {
            return false;
        }
    }
    return true;
}

/* ---- The loop ---------------------------------------------------------------------------------------------------- */

/* The cycle that ends at second k. */
static bool cycle(const uav_study_t *s, pfl_t *filter, const uav_track_t *track, unsigned k, uav_flight_t *flight,
                  failure_t *failure)
{
    const uint64_t t_us = (uint64_t)k * UAV_PERIOD_US;
    const pfl_autopilot_input_t wanted = uav_reference(s, k - 1u);
    const pfl_proposal_input_t with_fix = {&wanted, uav_has_fix(s, k) ? track->z[k] : NULL};
    const void *u = s->optimal ? (const void *)&with_fix : (const void *)&wanted;
    pfl_health_t health;

    if (!check(pfl_predict(filter, t_us, u), "pfl_predict", k, failure) ||
        (uav_has_fix(s, k) && !check(pfl_update(filter, 0u, t_us, track->z[k]), "pfl_update", k, failure)) ||
        !check(pfl_health(filter, &health), "pfl_health", k, failure)) {
        return false;
    }
    flight->cycles_ns[k - 1u] = cycle_ns(health.cycles_last);
    flight->cycle[k - 1u] = cycle_of(&health);
    flight->resampled = health.resampled;
    return true;
}

static bool fly(const model_t *model, void *arena, void *spare, size_t bytes, const uav_track_t *track,
                uav_flight_t *flight, failure_t *failure)
{
    const uav_study_t *s = model->study;
    pfl_t *filter;

    if (!check(pfl_init(arena, bytes, &model->config, 0u, &filter), "pfl_init", 0u, failure)) {
        return false;
    }
    for (unsigned k = 0u; k <= s->filter_seconds; k++) {
        if ((k > 0u && !cycle(s, filter, track, k, flight, failure)) ||
            !look(model, filter, track, k, flight, failure) ||
            !look_ahead_where_due(model, filter, spare, bytes, k, flight, failure)) {
            return false;
        }
    }
    return true;
}

bool uav_particle_filter(const uav_study_t *s, uint32_t stream, const uav_track_t *track, const uav_clouds_t *clouds,
                         uav_flight_t *flight, failure_t *failure)
{
    model_t model;

    make_model(s, track, clouds, &model);
    make_config(s, stream, &model);
    const size_t bytes = PFL_ARENA_BYTES(model.config.particles, model.config.states, model.config.noises);
    void *arena = malloc(bytes);
    void *spare = malloc(bytes); /* for the forecasts */
    const bool flown = arena != NULL && spare != NULL
                           ? fly(&model, arena, spare, bytes, track, flight, failure)
                           : fail(failure, EXIT_HARNESS, "no memory for %lu particles", (unsigned long)s->particles);
    free(spare);
    free(arena);
    return flown;
}
