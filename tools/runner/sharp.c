/* The scenario `sharp`: a target with random accelerations, its position measured far more sharply than one step of the
 * model spreads a particle. The model is linear, so that the Kalman filter gives the exact answer; the figure of each
 * particle filter is its distance from that. Every filter sees the same data; the bootstrap filter also flies with ten
 * times the particles. */
#include "sharp.h"
#include "host_filter.h"

#include "cloud.h"
#include "hash.h"
#include "host_random.h"
#include "kalman.h"

#include "pflight/pflight.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define STEPS 100u
#define SETTLED 20u /* steps that no error is counted in */
#define PERIOD_S 0.5
#define PERIOD_US 500000u
#define TIMES 10u /* particles of the large bootstrap filter, in those of the others */
#define STATES_MAX 6
#define JUDGED_PARTICLES 200u
#define JUDGED_RUNS 20u

enum { EXTRA = PFL_CV_STATES, FAVOUR };
enum { BOOTSTRAP, LARGE, TEMPERED, AUXILIARY, OPTIMAL, ADAPTED, FILTERS };
enum { KALMAN = 2 * FILTERS, VALUES };
/* Values of a run: distance of each filter, then the errors against the truth, the Kalman filter's last. */

static const char *const names[FILTERS + 1] = {"bootstrap", "bootstrap_10n", "tempered", "auxiliary",
                                               "optimal",   "adapted",       "kalman"};

static const setting_t settings[] = {
    {"sigma", NULL, 1e-3, 10.0, "0.02", "standard deviation of the measured position [m]"},
    {"accel", NULL, 1e-3, 100.0, "1", "root of the acceleration's spectral density [m/s^2/sqrt(Hz)]"},
};

typedef struct {
    uint32_t particles;
    uint64_t seed;
    double sigma, accel;
} sharp_study_t;

static const char *const columns[] = {"truth_x_m",     "truth_y_m",     "kalman_x_m",  "kalman_y_m",
                                      "bootstrap_x_m", "bootstrap_y_m", "optimal_x_m", "optimal_y_m"};
enum { COLUMNS = sizeof columns / sizeof columns[0] };

/* ---- Data and the exact answer --------------------------------------------------------------------------------------- */

typedef struct {
    double truth[STEPS][4];
    float z[STEPS][2];
    double kalman[STEPS][2];
    double variance[STEPS]; /* of a position by the Kalman filter */
} track_t;

static void axis_matrices(double accel, double *f, double *q)
{
    memset(f, 0, 16u * sizeof *f);
    memset(q, 0, 16u * sizeof *q);
    const double shift = 0.5 * PERIOD_S * accel * sqrt(PERIOD_S);
    const double kick = accel * sqrt(PERIOD_S);
    for (int d = 0; d < 2; d++) {
        f[5 * d] = 1.0;
        f[5 * (d + 2)] = 1.0;
        f[4 * d + d + 2] = PERIOD_S;
        q[5 * d] = shift * shift;
        q[5 * (d + 2)] = kick * kick;
        q[4 * d + d + 2] = shift * kick;
        q[4 * (d + 2) + d] = shift * kick;
    }
}

/* x <- f x */
static void advance(const double *f, const double *x, double *next)
{
    matrix_multiply(f, x, next, 4, 4, 1);
}

static bool make_track(const sharp_study_t *s, uint32_t run, track_t *t, failure_t *failure)
{
    static const double h[8] = {1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0};
    const double r[4] = {s->sigma * s->sigma, 0.0, 0.0, s->sigma * s->sigma};
    const double kick = s->accel * sqrt(PERIOD_S);
    gaussian_t belief = {.n = 4};
    host_random_t truth, measured;
    double f[16], q[16], x[4], next[4];

    host_random_start(&truth, s->seed, run, RANDOM_TRUTH);
    host_random_start(&measured, s->seed, run, RANDOM_MEASUREMENT);
    axis_matrices(s->accel, f, q);
    for (int d = 0; d < 4; d++) {
        x[d] = host_random_normal(&truth);
        belief.p[5 * d] = 1.0;
    }
    for (uint32_t k = 0u; k < STEPS; k++) {
        double z[2];
        advance(f, x, next);
        for (int d = 0; d < 2; d++) {
            const double w = kick * host_random_normal(&truth);
            x[d] = next[d] + 0.5 * PERIOD_S * w;
            x[d + 2] = next[d + 2] + w;
            z[d] = x[d] + s->sigma * host_random_normal(&measured);
            t->z[k][d] = (float)z[d];
        }
        memcpy(t->truth[k], x, sizeof x);
        advance(f, belief.x, next);
        kalman_predict(&belief, next, f, q);
        if (!kalman_update(&belief, z, h, r, 2)) {
            return fail(failure, EXIT_HARNESS, "the Kalman filter's innovation has no variance");
        }
        memcpy(t->kalman[k], belief.x, sizeof t->kalman[k]);
        t->variance[k] = belief.p[0];
    }
    return true;
}

/* ---- Filters ------------------------------------------------------------------------------------------------------------ */

typedef struct {
    int which;
    uint32_t states;
    pfl_constant_velocity_t moving, still;
    pfl_position_t seen, looked;
    pfl_tempered_t tempered;
    pfl_proposal_t proposal;
    pfl_auxiliary_t auxiliary;
    pfl_kernel_t kernel;
    pfl_sensor_t sensor;
    pfl_config_t config;
} model_t;

static bool is_given(int which)
{
    return which == OPTIMAL || which == ADAPTED;
}

static bool is_looking(int which)
{
    return which == AUXILIARY || which == ADAPTED;
}

static void move(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    model_t *m = (model_t *)user;

    if (is_given(m->which)) {
        pfl_proposal_predict(&m->proposal, u, dt_s, p);
    } else {
        pfl_constant_velocity_predict(&m->moving, u, dt_s, p);
    }
}

static void draw(void *user, const pfl_batch_t *p)
{
    const model_t *m = (const model_t *)user;

    for (uint32_t d = 0u; d < m->states; d++) {
        for (uint32_t i = 0u; i < p->n; i++) {
            PFL_STATE(p, d)[i] = d < PFL_CV_STATES ? PFL_NOISE(p, d)[i] : 0.0f;
        }
    }
}

static void set_sensors(const sharp_study_t *s, model_t *m)
{
    const double kick = s->accel * sqrt(PERIOD_S);
    const double shift = 0.5 * PERIOD_S * kick;
    const float seen = (float)(1.0 / s->sigma);
    const float looked = (float)(1.0 / sqrt(s->sigma * s->sigma + shift * shift));

    m->moving = (pfl_constant_velocity_t){(float)s->accel, 0.0f};
    m->seen = (pfl_position_t){2u, {PFL_CV_X, PFL_CV_Y, 0u, 0u}, {seen, seen, 0.0f, 0.0f}};
    m->looked = (pfl_position_t){2u, {PFL_CV_X, PFL_CV_Y, 0u, 0u}, {looked, looked, 0.0f, 0.0f}};
    m->tempered = (pfl_tempered_t){.loglik = pfl_position_loglik, .user = &m->seen, .ess_share = 0.5f, .steps = 8u};
    m->auxiliary = (pfl_auxiliary_t){pfl_position_loglik, &m->looked, 0.0f, 0.7f, FAVOUR};
    m->proposal = (pfl_proposal_t){
        .predict = pfl_constant_velocity_predict,
        .user = &m->still,
        .loglik_state = EXTRA,
        .count = 2u,
        .state = {PFL_CV_X, PFL_CV_Y, 0u, 0u},
        .noise = {0u, 1u, 0u, 0u},
        .other = {PFL_CV_VX, PFL_CV_VY, 0u, 0u},
        .sigma_noise = {(float)shift, (float)shift, 0.0f, 0.0f},
        .sigma_other = {(float)kick, (float)kick, 0.0f, 0.0f},
        .sigma_measured = {(float)s->sigma, (float)s->sigma, 0.0f, 0.0f},
    };
    m->sensor = (pfl_sensor_t){.loglik = pfl_position_loglik, .user = &m->seen};
    if (is_given(m->which)) {
        m->sensor = (pfl_sensor_t){.loglik = pfl_proposal_loglik, .user = &m->proposal};
    } else if (m->which == TEMPERED) {
        m->sensor = (pfl_sensor_t){.loglik = pfl_tempered_loglik, .user = &m->tempered};
    }
}

static void set_model(const sharp_study_t *s, uint32_t run, int which, model_t *m)
{
    host_random_t random;

    memset(m, 0, sizeof *m);
    m->which = which;
    m->states = is_looking(which) ? STATES_MAX : (is_given(which) ? EXTRA + 1u : EXTRA);
    set_sensors(s, m);
    m->kernel = (pfl_kernel_t){0.3f, 0u, pfl_kernel_move};
    host_random_start(&random, s->seed, run, RANDOM_FILTER_SEED);
    m->config = (pfl_config_t){
        .abi = PFL_ABI,
        .particles = s->particles * (which == LARGE ? TIMES : 1u),
        .states = (uint16_t)m->states,
        .noises = 2u,
        .sensor_count = 1u,
        .ess_ratio = 0.5f,
        .seed = host_random_u64(&random),
        .sensors = &m->sensor,
        .kernel = which == TEMPERED ? &m->kernel : NULL,
        .predict = move,
        .draw = draw,
        .user = m,
    };
}

static pfl_status_t cycle(pfl_t *f, const model_t *m, uint64_t t_us, const float *z, float *mean)
{
    const pfl_proposal_input_t blind = {NULL, NULL};
    const pfl_proposal_input_t given = {NULL, z};
    pfl_status_t s = PFL_OK;

    if (is_looking(m->which)) {
        s = pfl_auxiliary_look(f, &m->auxiliary, t_us, &blind, z);
    }
    s = s == PFL_OK ? pfl_predict(f, t_us, &given) : s;
    if (s == PFL_OK) {
        s = m->which == TEMPERED ? pfl_tempered_update(f, 0u, t_us, z) : pfl_update(f, 0u, t_us, z);
    }
    return s == PFL_OK ? pfl_estimate(f, mean, NULL) : s;
}

/* The optimal one, to be looked at. */
static void show(const track_t *t, uint32_t k, const float *mean, const pfl_t *f, look_t *look)
{
    const look_at_t at = {
        .t_s = PERIOD_S * (double)(k + 1u),
        .state = {PFL_CV_X, PFL_CV_Y},
        .axis = {"x [m]", "y [m]"},
        .truth = {t->truth[k][0], t->truth[k][1]},
        .estimate = {(double)mean[PFL_CV_X], (double)mean[PFL_CV_Y]},
    };

    look_take(look, f, &at);
}

/* One filter over the track: its estimates, and the times of the optimal one. */
static bool fly(const sharp_study_t *s, uint32_t run, int which, const track_t *t, float (*estimate)[2],
                run_output_t *out, failure_t *failure)
{
    model_t m;
    set_model(s, run, which, &m);
    void *arena;
    pfl_t *f = host_filter(&m.config, &arena, failure);
    if (f == NULL) {
        free(arena);
        return false;
    }
    pfl_status_t status = PFL_OK;
    for (uint32_t k = 0u; k < STEPS && status == PFL_OK; k++) {
        float mean[STATES_MAX];
        pfl_health_t health;
        status = cycle(f, &m, (uint64_t)(k + 1u) * PERIOD_US, t->z[k], mean);
        memcpy(estimate[k], mean, sizeof estimate[k]);
        if (which == OPTIMAL && pfl_health(f, &health) == PFL_OK) {
            out->cycles_ns[k] = cycle_ns(health.cycles_last);
            out->cycle[k] = cycle_of(&health);
            show(t, k, mean, f, out->look);
        }
    }
    free(arena);
    return status == PFL_OK || fail(failure, EXIT_HARNESS, "%s: %s", names[which], pfl_status_string(status));
}

/* ---- Runs --------------------------------------------------------------------------------------------------------------- */

/* Root mean squares over the settled steps: of the distance from the Kalman filter, in its deviations, and of the error. */
static void score(const track_t *t, float (*estimate)[2], int which, double *value)
{
    double distance = 0.0;
    double error = 0.0;
    const double n = (double)(STEPS - SETTLED);

    for (uint32_t k = SETTLED; k < STEPS; k++) {
        for (int d = 0; d < 2; d++) {
            const double off = (double)estimate[k][d] - t->kalman[k][d];
            const double wrong = (double)estimate[k][d] - t->truth[k][d];
            distance += 0.5 * off * off / (t->variance[k] * n);
            error += wrong * wrong / n;
        }
    }
    value[which] = sqrt(distance);
    value[FILTERS + which] = sqrt(error);
}

static bool run_once(const plan_t *plan, uint32_t run, run_output_t *out, failure_t *failure)
{
    const sharp_study_t *s = plan->own;
    track_t t;
    float estimate[FILTERS][STEPS][2];
    double squares = 0.0;

    if (!make_track(s, run, &t, failure)) {
        return false;
    }
    for (int which = 0; which < FILTERS; which++) {
        if (!fly(s, run, which, &t, estimate[which], out, failure)) {
            return false;
        }
        score(&t, estimate[which], which, out->value);
        out->hash = hash_floats(out->hash, &estimate[which][0][0], 2u * STEPS);
    }
    for (uint32_t k = 0u; k < STEPS; k++) {
        const double x = t.kalman[k][0] - t.truth[k][0];
        const double y = t.kalman[k][1] - t.truth[k][1];
        squares += k < SETTLED ? 0.0 : (x * x + y * y) / (double)(STEPS - SETTLED);
        if (out->series != NULL) {
            const double row[COLUMNS] = {t.truth[k][0],
                                         t.truth[k][1],
                                         t.kalman[k][0],
                                         t.kalman[k][1],
                                         (double)estimate[BOOTSTRAP][k][0],
                                         (double)estimate[BOOTSTRAP][k][1],
                                         (double)estimate[OPTIMAL][k][0],
                                         (double)estimate[OPTIMAL][k][1]};
            memcpy(&out->series[k * COLUMNS], row, sizeof row);
        }
    }
    out->value[KALMAN] = sqrt(squares);
    return true;
}

/* With a tenth of the particles those that draw from the optimal proposal are at least as near to the exact answer, in the
 * median over the runs; the auxiliary filter alone, whose particles still move blindly, is nearer than the bootstrap filter
 * of as many. */
static void judge(const plan_t *plan, table_t runs, verdict_t *verdict)
{
    const sharp_study_t *s = plan->own;
    const double large = stats_median(runs, LARGE).mean;
    const double same = stats_median(runs, BOOTSTRAP).mean;
    const bool judged = s->particles == JUDGED_PARTICLES && runs.n >= JUDGED_RUNS && s->sigma < 0.021 &&
                        s->sigma > 0.019 && s->accel < 1.01 && s->accel > 0.99;

    for (size_t k = 0u; k < FILTERS; k++) {
        metric_t *metric = verdict_add_of(verdict, "distance", names[k], stats_median(runs, k));
        if (judged && (k == AUXILIARY || k == OPTIMAL || k == ADAPTED)) {
            metric_accept(metric, 0.0, k == AUXILIARY ? same : large);
        }
    }
    for (size_t k = 0u; k <= FILTERS; k++) {
        verdict_add_of(verdict, "rmse_m", names[k], stats_median(runs, FILTERS + k));
    }
    text_add(&verdict->notes,
             "Distances are those of the estimated position from the Kalman filter's, which is exact here, "
             "in its standard deviations; root mean square after 20 steps, median over the runs.\n"
             "Acceptance: auxiliary, optimal and adapted are no further from it than the bootstrap filter "
             "with ten times their particles. Times are those of the optimal proposal.\n");
}

static bool open_study(const study_t *study, plan_t *plan, failure_t *failure)
{
    sharp_study_t *s = calloc(1u, sizeof *s);

    if (s == NULL) {
        return fail(failure, EXIT_HARNESS, "out of memory");
    }
    *s = (sharp_study_t){study->particles, study->seed, study_number(study, "sigma"), study_number(study, "accel")};
    *plan = (plan_t){
        .own = s,
        .values = VALUES,
        .cycles = STEPS,
        .steps = STEPS,
        .columns = COLUMNS,
        .column = columns,
        .period_s = PERIOD_S,
        .budget_us = 500.0,
        .budget_reason = "2 measurements a second, 0.1 % of the time between them",
    };
    return true;
}

static void close_study(plan_t *plan)
{
    free(plan->own);
}

static const campaign_t campaign[] = {{"pf", 50u, {NULL}, 0u}};

const scenario_t sharp_scenario = {
    .name = "sharp",
    .summary =
        "a sharp measurement: auxiliary, optimal and tempered filters beside the bootstrap filter with ten times as "
        "many particles",
    .filters = "pf",
    .particles = JUDGED_PARTICLES,
    .runs = 50u,
    .settings = settings,
    .settings_count = sizeof settings / sizeof settings[0],
    .campaign = campaign,
    .campaign_count = sizeof campaign / sizeof campaign[0],
    .open = open_study,
    .close = close_study,
    .run = run_once,
    .judge = judge,
};
