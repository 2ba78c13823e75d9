/* pflight over the hills: dead reckoning moves the particles, the radar altimeter weighs them. Four filters on the same
 * five states; the marginalised one leaves the velocity's biases to one Kalman filter for all particles. */
#include "cloud.h"
#include "host_random.h"
#include "terrain.h"

#include <math.h>
#include <stdlib.h>

/* How the flights were made, out of the data's description. */
#define START_SIGMA_M 800.0f
#define BARO_SIGMA_M 15.0f
#define BIAS_SIGMA_MPS 1.2f
#define BIAS_TAU_S 250.0f
#define VELOCITY_SIGMA_MPS 0.1f
#define BARO_WALK_M 0.1f /* a row; the description says "slow" */
#define BARO_WHITE_M 0.6f
#define RADAR_SIGMA_M 1.5f
#define RADAR_SHARE 0.004f
#define ROW_S 0.5f

#define RADAR 0u
#define ADAPTIVE_BITS 65536u
#define ADAPTIVE_LEAST 200u
#define ADAPTIVE_CELL_M 8.0f
#define CONVERGED_M 200.0 /* clouds narrower than this are drawn less often */

typedef struct {
    pfl_marginal_shared_t shared; /* first: the callbacks take a pointer to the whole for a pointer to their own */
    pfl_dead_reckoning_t motion;
    const terrain_study_t *study;
} model_t;

static model_t make_model(const terrain_study_t *s)
{
    const float decay = pfl_expf(-ROW_S / BIAS_TAU_S);
    const float walk = BIAS_SIGMA_MPS * pfl_sqrtf(1.0f - decay * decay);
    model_t model = {
        .motion = {VELOCITY_SIGMA_MPS, decay, walk, BARO_WALK_M},
        .study = s,
    };
    model.shared = (pfl_marginal_shared_t){
        .model = {.predict = pfl_dead_reckoning_rest_predict,
                  .linear = 2u,
                  .mean = PFL_DR_BIAS_NORTH,
                  .driven = 2u,
                  .state = {PFL_DR_NORTH, PFL_DR_EAST},
                  .noise = {0u, 1u},
                  .drive = {{-ROW_S, 0.0f}, {0.0f, -ROW_S}},
                  .drive_variance = {ROW_S * ROW_S * VELOCITY_SIGMA_MPS * VELOCITY_SIGMA_MPS,
                                     ROW_S * ROW_S * VELOCITY_SIGMA_MPS * VELOCITY_SIGMA_MPS},
                  .transition = {{decay, 0.0f}, {0.0f, decay}},
                  .process_cov = {walk * walk, 0.0f, walk * walk}},
        .cov = {BIAS_SIGMA_MPS * BIAS_SIGMA_MPS, 0.0f, BIAS_SIGMA_MPS * BIAS_SIGMA_MPS},
    };
    return model;
}

static void plain_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    pfl_dead_reckoning_predict(&((model_t *)user)->motion, u, dt_s, p);
}

/* Around the dead-reckoned start; the marginalised filter's biases are means, all alike. */
static void draw(void *user, const pfl_batch_t *p)
{
    const terrain_study_t *s = ((const model_t *)user)->study;
    const float mean[PFL_DR_STATES] = {s->start_north_m, s->start_east_m, 0.0f, 0.0f, 0.0f};
    const float bias = s->filter == TERRAIN_RB ? 0.0f : BIAS_SIGMA_MPS;
    const float sigma[PFL_DR_STATES] = {START_SIGMA_M, START_SIGMA_M, BARO_SIGMA_M, bias, bias};

    for (uint32_t d = 0u; d < PFL_DR_STATES; d++) {
        for (uint32_t i = 0u; i < p->n; i++) {
            PFL_STATE(p, d)[i] = mean[d] + sigma[d] * PFL_NOISE(p, d)[i];
        }
    }
}

static pfl_config_t make_config(const terrain_study_t *s, uint32_t run, model_t *model, const pfl_sensor_t *sensor,
                                const pfl_kernel_t *kernel)
{
    const bool marginal = s->filter == TERRAIN_RB;
    host_random_t random;

    host_random_start(&random, s->seed, run, RANDOM_FILTER_SEED);
    return (pfl_config_t){
        .abi = PFL_ABI,
        .particles = s->particles,
        .states = PFL_DR_STATES,
        .noises = marginal ? 3u : 5u,
        .sensor_count = 1u,
        .ess_ratio = s->adaptive ? 0.0f : 0.5f, /* pfl_adapt resamples */
        .seed = host_random_u64(&random),
        .sensors = sensor,
        .kernel = s->filter == TERRAIN_PLAIN ? NULL : kernel,
        .predict = marginal ? pfl_marginal_shared_predict : plain_predict,
        .draw = draw,
        .user = model,
    };
}

static pfl_terrain_z_t measured(const terrain_study_t *s, const terrain_row_t *row, float spread_m)
{
    const float share = RADAR_SHARE * row->agl_m;
    const float variance = BARO_WHITE_M * BARO_WHITE_M + RADAR_SIGMA_M * RADAR_SIGMA_M + share * share;
    pfl_terrain_z_t z = {row->altitude_m, row->agl_m, pfl_sqrtf(variance), 1.0f};

    if (s->power_scale_m > 0.0f) {
        const float age = (float)row->t_s / s->power_rise_s;
        const float least = s->power_least * (1.0f + age * age);
        z.power = pfl_terrain_power(spread_m, s->power_scale_m, least < 1.0f ? least : 1.0f);
    }
    return z;
}

static bool check(pfl_status_t status, const char *call, size_t i, failure_t *failure)
{
    return status >= 0 || fail(failure, EXIT_HARNESS, "row %zu: %s: %s", i, call, pfl_status_string(status));
}

/* One row: predict, update unless the echo is lost, estimate. */
static bool cycle(const terrain_study_t *s, pfl_t *filter, model_t *model, size_t k, float spread_m, float *mean,
                  float *cov, failure_t *failure)
{
    const terrain_row_t *row = &s->row[k];
    const pfl_marginal_input_t in = {&row->velocity, NULL};

    if (k > 0u) {
        if (s->filter == TERRAIN_RB) {
            pfl_marginal_shared_step(&model->shared, false);
        }
        if (!check(pfl_predict(filter, row->t_us, s->filter == TERRAIN_RB ? (const void *)&in : &row->velocity),
                   "pfl_predict", k, failure)) {
            return false;
        }
    }
    if (!isnan(row->agl_m)) {
        const pfl_terrain_z_t z = measured(s, row, spread_m);
        const pfl_status_t fused = s->filter == TERRAIN_TEMPERED ? pfl_tempered_update(filter, RADAR, row->t_us, &z)
                                                                 : pfl_update(filter, RADAR, row->t_us, &z);
        if (!check(fused, "pfl_update", k, failure)) {
            return false;
        }
    }
    return check(pfl_estimate(filter, mean, cov), "pfl_estimate", k, failure);
}

static void show(const terrain_row_t *row, const float *mean, const pfl_t *filter, look_t *look)
{
    const look_at_t at = {
        .t_s = row->t_s,
        .state = {PFL_DR_EAST, PFL_DR_NORTH},
        .axis = {"east [m]", "north [m]"},
        .truth = {row->truth_east_m, row->truth_north_m},
        .estimate = {(double)mean[PFL_DR_EAST], (double)mean[PFL_DR_NORTH]},
    };

    look_take(look, filter, &at);
}

static bool fly(const terrain_study_t *s, pfl_t *filter, model_t *model, pfl_adaptive_t *adaptive,
                terrain_estimate_t *estimate, run_output_t *out, failure_t *failure)
{
    float spread_m = START_SIGMA_M * 1.4142136f;

    for (size_t k = 0u; k < s->rows; k++) {
        float mean[PFL_DR_STATES];
        float cov[PFL_DR_STATES * PFL_DR_STATES];
        pfl_health_t health;
        const uint32_t used = adaptive->config.particles;

        if (!cycle(s, filter, model, k, spread_m, mean, cov, failure) ||
            !check(pfl_health(filter, &health), "pfl_health", k, failure)) {
            return false;
        }
        if (s->adaptive && !check(pfl_adapt(filter, adaptive), "pfl_adapt", k, failure)) {
            return false;
        }
        spread_m = pfl_sqrtf(cov[0] + cov[PFL_DR_STATES + 1u]);
        estimate[k] = (terrain_estimate_t){mean[PFL_DR_NORTH], mean[PFL_DR_EAST], mean[PFL_DR_BARO], spread_m, used};
        if (k % 20u == 0u && (k % 200u == 0u || (double)spread_m > CONVERGED_M)) {
            cloud_take(out->cloud, "pf", s->row[k].t_s, filter, PFL_DR_EAST, PFL_DR_NORTH);
        }
        show(&s->row[k], mean, filter, out->look);
        if (k > 0u) {
            out->cycles_ns[k - 1u] = cycle_ns(health.cycles_last);
            out->cycle[k - 1u] = cycle_of(&health);
        }
    }
    return true;
}

bool terrain_fly(const terrain_study_t *s, uint32_t run, terrain_estimate_t *estimate, run_output_t *out,
                 failure_t *failure)
{
    pfl_terrain_t radar = {
        .grid = &s->grid,
        .north_state = PFL_DR_NORTH,
        .east_state = PFL_DR_EAST,
        .bias_state = PFL_DR_BARO,
        .tree_share = 0.12f,
        .gross_share = 0.01f,
        .tree_mean_m = 15.0f,
        .tree_sigma_m = 6.5f,
        .gross_span_m = 1000.0f,
    };
    pfl_tempered_t tempered = {.loglik = pfl_terrain_loglik, .user = &radar, .ess_share = 0.5f, .steps = 8u};
    const bool steps = s->filter == TERRAIN_TEMPERED;
    const pfl_sensor_t sensor = {.loglik = steps ? pfl_tempered_loglik : pfl_terrain_loglik,
                                 .user = steps ? (void *)&tempered : (void *)&radar};
    static void (*const move[])(pfl_t *) = {pfl_kernel_move, pfl_kernel_gaussian, pfl_kernel_epanechnikov};
    const pfl_kernel_t kernel = {
        .width = s->kernel_width,
        .states_mask = 31u,
        .move = move[s->kernel_shape],
    };
    model_t model = make_model(s);
    model.shared.model.user = &model.motion;
    uint32_t *bins = calloc(ADAPTIVE_BITS / 32u, sizeof *bins);
    pfl_adaptive_t adaptive = {
        .config = make_config(s, run, &model, &sensor, &kernel),
        .most = s->particles,
        .least = s->particles < ADAPTIVE_LEAST ? s->particles : ADAPTIVE_LEAST,
        .ess_ratio = 0.5f,
        .error = 0.05f,
        .quantile = 2.33f,
        .bits = ADAPTIVE_BITS,
        .bins = bins,
        .dimensions = 2u,
        .state = {PFL_DR_NORTH, PFL_DR_EAST},
        .inv_width = {1.0f / ADAPTIVE_CELL_M, 1.0f / ADAPTIVE_CELL_M},
    };
    const size_t bytes = PFL_ARENA_BYTES(s->particles, PFL_DR_STATES, adaptive.config.noises);
    void *arena = malloc(bytes);
    pfl_t *filter;

    bool flown = (arena != NULL && bins != NULL) ||
                 fail(failure, EXIT_HARNESS, "no memory for %lu particles", (unsigned long)s->particles);
    flown = flown && check(s->adaptive ? pfl_adaptive_init(arena, bytes, &adaptive, 0u, &filter)
                                       : pfl_init(arena, bytes, &adaptive.config, 0u, &filter),
                           "pfl_init", 0u, failure);
    flown = flown && fly(s, filter, &model, &adaptive, estimate, out, failure);
    free(bins);
    free(arena);
    return flown;
}
