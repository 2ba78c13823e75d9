/* The scenario `manoeuvre`: a target flies straight for a minute or so, turns for ten seconds, flies straight again; only
 * its position is measured. One model of constant velocity, calm, wild, or a compromise; and two models that each particle
 * jumps between, with and without a minimum of particles in each. All filters see the same data. */
#include "manoeuvre.h"
#include "host_filter.h"

#include "cloud.h"
#include "hash.h"
#include "host_random.h"

#include "pflight/pflight.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define STEPS 300u
#define SETTLED 10u
#define PERIOD_S 1.0
#define SEEN_M 10.0
#define SPEED_MPS 30.0
#define TURN_RADPS 0.15
#define STRAIGHT_S 40.0 /* mean time until it turns */
#define TURNING_S 10.0  /* and until it goes straight again */
#define CALM 0.5f       /* root of the acceleration's spectral density [m/s^2/sqrt(Hz)] */
#define WILD 6.0f
#define JUDGED_PARTICLES 500u
#define JUDGED_RUNS 20u

enum { REGIME = PFL_CV_STATES, STATES };
enum { ONE_CALM, ONE_WILD, ONE, TWO_BARE, TWO, FILTERS };
/* Values: squares of the errors of each filter on straights, in turns, in all; steps of either kind; how often TWO tells the
 * regime. */
enum { STRAIGHT = 0, TURNING = FILTERS, ALL = 2 * FILTERS, STEPS_STRAIGHT = 3 * FILTERS, STEPS_TURNING, TOLD, VALUES };

static const char *const names[FILTERS] = {"calm", "wild", "one", "two_bare", "two"};

typedef struct {
    uint32_t particles;
    uint64_t seed;
    double accel; /* of the single model */
} manoeuvre_study_t;

static const setting_t settings[] = {
    {"accel", NULL, 0.01, 100.0, "4.5",
     "of the single model that is to do for all, 4.5 the best of 0.6 .. 6 [m/s^2/sqrt(Hz)]"},
};

static const char *const columns[] = {"truth_x_m", "truth_y_m", "turns",   "one_x_m",
                                      "one_y_m",   "two_x_m",   "two_y_m", "probability"};
enum { COLUMNS = sizeof columns / sizeof columns[0] };

/* ---- Data --------------------------------------------------------------------------------------------------------------- */

typedef struct {
    double x[STEPS], y[STEPS];
    bool turns[STEPS];
    float z[STEPS][2];
    double start_heading;
} track_t;

static void make_track(const manoeuvre_study_t *s, uint32_t run, track_t *t)
{
    host_random_t truth, measured;
    double x = 0.0, y = 0.0, turn = 0.0;

    host_random_start(&truth, s->seed, run, RANDOM_TRUTH);
    host_random_start(&measured, s->seed, run, RANDOM_MEASUREMENT);
    double heading = 6.283185307179586 * host_random_uniform(&truth);
    t->start_heading = heading;
    for (uint32_t k = 0u; k < STEPS; k++) {
        const double u = host_random_uniform(&truth);
        const double side = host_random_uniform(&truth) < 0.5 ? -TURN_RADPS : TURN_RADPS;
        t->turns[k] = fabs(turn) > 0.0;
        if (u < PERIOD_S / (t->turns[k] ? TURNING_S : STRAIGHT_S)) {
            turn = t->turns[k] ? 0.0 : side;
            t->turns[k] = !t->turns[k];
        }
        heading += 0.5 * turn * PERIOD_S;
        x += SPEED_MPS * PERIOD_S * cos(heading);
        y += SPEED_MPS * PERIOD_S * sin(heading);
        heading += 0.5 * turn * PERIOD_S;
        t->x[k] = x;
        t->y[k] = y;
        t->z[k][0] = (float)(x + SEEN_M * host_random_normal(&measured));
        t->z[k][1] = (float)(y + SEEN_M * host_random_normal(&measured));
    }
}

/* ---- Filters ------------------------------------------------------------------------------------------------------------ */

typedef struct {
    pfl_jump_t
        jump; /* of a single regime where there is but one model: moves and random numbers are the same for all */
    pfl_constant_velocity_t model[2];
    pfl_position_t seen;
    pfl_sensor_t sensor;
    pfl_config_t config;
    float room[PFL_JUMP_FLOATS(STATES, 2)];
    float heading;
} model_t;

/* Position as first seen, speed and heading roughly known, the regimes by their shares of time. */
static void draw(void *user, const pfl_batch_t *p)
{
    const model_t *m = (const model_t *)user;
    const float vx = (float)SPEED_MPS * cosf(m->heading);
    const float vy = (float)SPEED_MPS * sinf(m->heading);

    for (uint32_t i = 0u; i < p->n; i++) {
        PFL_STATE(p, PFL_CV_X)[i] = 20.0f * PFL_NOISE(p, 0)[i];
        PFL_STATE(p, PFL_CV_Y)[i] = 20.0f * PFL_NOISE(p, 1)[i];
        PFL_STATE(p, PFL_CV_VX)[i] = vx + 5.0f * PFL_NOISE(p, 2)[i];
        PFL_STATE(p, PFL_CV_VY)[i] = vy + 5.0f * PFL_NOISE(p, 3)[i];
        PFL_STATE(p, REGIME)[i] = m->jump.regimes > 1u && PFL_NOISE(p, 4)[i] > 0.84f ? 1.0f : 0.0f;
    }
}

static void set_model(const manoeuvre_study_t *s, uint32_t run, int which, const track_t *t, model_t *m)
{
    const float single = which == ONE_CALM ? CALM : (which == ONE_WILD ? WILD : (float)s->accel);
    const bool two = which == TWO || which == TWO_BARE;
    host_random_t random;

    memset(m, 0, sizeof *m);
    m->model[0] = (pfl_constant_velocity_t){two ? CALM : single, 0.0f};
    m->model[1] = (pfl_constant_velocity_t){WILD, 0.0f};
    m->jump = (pfl_jump_t){
        .regimes = two ? 2u : 1u,
        .regime = {{pfl_constant_velocity_predict, &m->model[0]}, {pfl_constant_velocity_predict, &m->model[1]}},
        .rate_hz = {{0.0f, (float)(1.0 / STRAIGHT_S)}, {(float)(1.0 / TURNING_S), 0.0f}},
        .states = STATES,
        .noises = 2u,
        .state = REGIME,
        .least = which == TWO ? s->particles / 5u : 0u,
        .ess_ratio = 0.5f,
        .room = m->room,
    };
    m->seen =
        (pfl_position_t){2u, {PFL_CV_X, PFL_CV_Y, 0u, 0u}, {(float)(1.0 / SEEN_M), (float)(1.0 / SEEN_M), 0.0f, 0.0f}};
    m->sensor = (pfl_sensor_t){.loglik = pfl_position_loglik, .user = &m->seen};
    m->heading = (float)t->start_heading;
    host_random_start(&random, s->seed, run, RANDOM_FILTER_SEED);
    m->config = (pfl_config_t){
        .abi = PFL_ABI,
        .particles = s->particles,
        .states = STATES,
        .noises = 3u,
        .sensor_count = 1u,
        .moments = PFL_MOMENTS_MEAN,
        .seed = host_random_u64(&random),
        .sensors = &m->sensor,
        .predict = pfl_jump_predict,
        .draw = draw,
        .user = m, /* the jumps stand first */
    };
}

typedef struct {
    float x[STEPS][2];
    float probability[STEPS]; /* of turning */
} estimate_t;

/* Both models, to be looked at. */
static void show(const track_t *t, uint32_t k, const float *mean, const pfl_t *f, look_t *look)
{
    const look_at_t at = {
        .t_s = PERIOD_S * (double)(k + 1u),
        .state = {PFL_CV_X, PFL_CV_Y},
        .axis = {"x [m]", "y [m]"},
        .truth = {t->x[k], t->y[k]},
        .estimate = {(double)mean[PFL_CV_X], (double)mean[PFL_CV_Y]},
    };

    look_take(look, f, &at);
}

static bool fly(const manoeuvre_study_t *s, uint32_t run, int which, const track_t *t, estimate_t *e, run_output_t *out,
                failure_t *failure)
{
    static const uint64_t period_us = (uint64_t)(PERIOD_S * 1e6);
    model_t m;
    set_model(s, run, which, t, &m);
    void *arena;
    pfl_t *f = host_filter(&m.config, &arena, failure);
    if (f == NULL) {
        free(arena);
        return false;
    }
    pfl_status_t status = PFL_OK;
    for (uint32_t k = 0u; k < STEPS && status == PFL_OK; k++) {
        float mean[STATES];
        float probability[2] = {0.0f, 0.0f};
        pfl_health_t health;
        const uint64_t t_us = (k + 1u) * period_us;
        status = pfl_predict(f, t_us, NULL);
        status = status == PFL_OK ? pfl_update(f, 0u, t_us, t->z[k]) : status;
        status = status == PFL_OK ? pfl_estimate(f, mean, NULL) : status;
        status = status == PFL_OK ? pfl_jump_probabilities(f, &m.jump, probability) : status;
        status = status == PFL_OK ? pfl_jump_resample(f, &m.jump) : status;
        memcpy(e->x[k], mean, sizeof e->x[k]);
        e->probability[k] = probability[1];
        if (which == TWO && status == PFL_OK && pfl_health(f, &health) == PFL_OK) {
            out->cycles_ns[k] = cycle_ns(health.cycles_last);
            out->cycle[k] = cycle_of(&health);
            show(t, k, mean, f, out->look);
        }
    }
    free(arena);
    return status == PFL_OK || fail(failure, EXIT_HARNESS, "%s: %s", names[which], pfl_status_string(status));
}

/* ---- Runs --------------------------------------------------------------------------------------------------------------- */

static void score(const track_t *t, const estimate_t *e, int which, double *value)
{
    for (uint32_t k = SETTLED; k < STEPS; k++) {
        const double x = (double)e->x[k][0] - t->x[k];
        const double y = (double)e->x[k][1] - t->y[k];
        value[(t->turns[k] ? TURNING : STRAIGHT) + which] += x * x + y * y;
        value[ALL + which] += (x * x + y * y) / (double)(STEPS - SETTLED);
        if (which == TWO) {
            value[t->turns[k] ? STEPS_TURNING : STEPS_STRAIGHT] += 1.0;
            value[TOLD] += (e->probability[k] > 0.5f) == t->turns[k] ? 1.0 / (double)(STEPS - SETTLED) : 0.0;
        }
    }
}

static bool run_once(const plan_t *plan, uint32_t run, run_output_t *out, failure_t *failure)
{
    const manoeuvre_study_t *s = plan->own;
    track_t t;
    estimate_t e[FILTERS];

    make_track(s, run, &t);
    for (int which = 0; which < FILTERS; which++) {
        if (!fly(s, run, which, &t, &e[which], out, failure)) {
            return false;
        }
        score(&t, &e[which], which, out->value);
        out->hash = hash_floats(out->hash, &e[which].x[0][0], 2u * STEPS);
    }
    for (uint32_t k = 0u; k < STEPS && out->series != NULL; k++) {
        const double row[COLUMNS] = {t.x[k],
                                     t.y[k],
                                     t.turns[k] ? 1.0 : 0.0,
                                     (double)e[ONE].x[k][0],
                                     (double)e[ONE].x[k][1],
                                     (double)e[TWO].x[k][0],
                                     (double)e[TWO].x[k][1],
                                     (double)e[TWO].probability[k]};
        memcpy(&out->series[k * COLUMNS], row, sizeof row);
    }
    return true;
}

static void judge(const plan_t *plan, table_t runs, verdict_t *verdict)
{
    static const char *const wheres[] = {"rmse_m_straight", "rmse_m_turning", "rmse_m"};
    const manoeuvre_study_t *s = plan->own;
    const bool judged = s->particles == JUDGED_PARTICLES && runs.n >= JUDGED_RUNS && fabs(s->accel - 4.5) < 1e-6;
    const double bound = stats_root(stats_mean(runs, ALL + ONE)).mean;

    for (size_t where = 0u; where < 3u; where++) {
        for (size_t k = 0u; k < FILTERS; k++) {
            const size_t column = where * FILTERS + k;
            const figure_t square = where == 2u
                                        ? stats_mean(runs, column)
                                        : stats_ratio(runs, column, where == 0u ? STEPS_STRAIGHT : STEPS_TURNING);
            metric_t *metric = verdict_add_of(verdict, wheres[where], names[k], stats_root(square));
            if (judged && where == 2u && k == TWO) {
                metric_accept(metric, 0.0, 0.9 * bound);
            }
        }
    }
    metric_t *told = verdict_add(verdict, "regime_told", stats_mean(runs, TOLD));
    if (judged) {
        metric_accept(told, 0.75, 1.0);
    }
    text_add(&verdict->notes,
             "calm, wild: one model each; one: the best single compromise; two: both, each particle by its "
             "regime, two_bare without a minimum of particles in each. Over all runs and their steps after "
             "the tenth.\nAcceptance: two has at most nine tenths of the best single model's error.\n");
}

static bool open_study(const study_t *study, plan_t *plan, failure_t *failure)
{
    manoeuvre_study_t *s = calloc(1u, sizeof *s);

    if (s == NULL) {
        return fail(failure, EXIT_HARNESS, "out of memory");
    }
    *s = (manoeuvre_study_t){study->particles, study->seed, study_number(study, "accel")};
    *plan = (plan_t){
        .own = s,
        .values = VALUES,
        .cycles = STEPS,
        .steps = STEPS,
        .columns = COLUMNS,
        .column = columns,
        .period_s = PERIOD_S,
        .budget_us = 1000.0,
        .budget_reason = "a measurement a second, 0.1 % of the time between them",
    };
    return true;
}

static void close_study(plan_t *plan)
{
    free(plan->own);
}

static const campaign_t campaign[] = {{"pf", 50u, {NULL}, 0u}};

const scenario_t manoeuvre_scenario = {
    .name = "manoeuvre",
    .summary = "a target that flies straight and turns: two models, each particle by its regime, beside one",
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
