/* The scenario `wind`: recorded flights of two fixed-wing aircraft; wind and airspeed scale out of GPS, airspeed and
 * yaw, and what they are good for when GPS is out. */
#include "wind.h"

#include "cloud.h"
#include "hash.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define OUTAGE_S 60.0
#define OUTAGE_EVERY_S 20.0
#define AHEAD_S 10.0
#define AHEAD_EVERY_S 2.0

static const setting_t settings[] = {
    {"flight", "px4|x8", 0.0, 0.0, "px4", "the recording: light wind and a loiter, or strong wind and aerobatics"},
};

static const char *const columns[] = {"measured_t_s", "x_m",        "y_m",       "wind_x_mps", "wind_y_mps",
                                      "scale",        "offset_rad", "truth_x_m", "truth_y_m"};
enum { COLUMNS = sizeof columns / sizeof columns[0] };

static bool open_study(const study_t *study, plan_t *plan, failure_t *failure)
{
    wind_study_t *s = calloc(1u, sizeof *s);

    if (s == NULL) {
        return fail(failure, EXIT_HARNESS, "out of memory");
    }
    s->px4 = study_is(study, "flight", "px4");
    s->bootstrap = strcmp(study->filter, "bootstrap") == 0;
    s->particles = study->particles;
    s->seed = study->seed;
    if (!wind_load(s, study->data, failure)) {
        free(s);
        return false;
    }
    *plan = (plan_t){
        .own = s,
        .values = WIND_VALUES,
        .cycles = s->epochs,
        .steps = s->epochs,
        .columns = COLUMNS,
        .column = columns,
        .budget_us = 2000.0,
        .budget_reason = "5 fixes a second, 1 % of the time between them",
    };
    return true;
}

static void close_study(plan_t *plan)
{
    wind_study_t *s = plan->own;

    free(s->epoch);
    free(s);
}

/* The estimate after fix i, into the series. */
static void note(const wind_filter_t *f, size_t i, run_output_t *out)
{
    const wind_epoch_t *epoch = &f->study->epoch[i];
    const float *mean = f->mean;
    const double row[COLUMNS] = {
        epoch->t_s,
        (double)mean[PFL_WIND_X],
        (double)mean[PFL_WIND_Y],
        (double)mean[PFL_WIND_X_WIND],
        (double)mean[PFL_WIND_Y_WIND],
        (double)mean[PFL_WIND_SCALE],
        (double)mean[PFL_WIND_OFFSET],
        (double)epoch->fix.x_m,
        (double)epoch->fix.y_m,
    };

    if (out->series != NULL) {
        memcpy(&out->series[i * COLUMNS], row, sizeof row);
    }
    out->hash = hash_floats(out->hash, mean, PFL_WIND_STATES);
}

/* The wind: the covariance that all particles share is no part of their spread. A recording has no true wind. */
static void show(const wind_filter_t *f, size_t i, look_t *look)
{
    const double variance = (double)f->wind.cov[PFL_WIND_WW];
    const look_at_t at = {
        .t_s = f->study->epoch[i].t_s,
        .state = {PFL_WIND_Y_WIND, PFL_WIND_X_WIND},
        .axis = {"wind to east [m/s]", "wind to north [m/s]"},
        .truth = {MISSING, MISSING},
        .estimate = {(double)f->mean[PFL_WIND_Y_WIND], (double)f->mean[PFL_WIND_X_WIND]},
        .variance = {variance, variance},
    };

    look_take(look, f->filter, &at);
}

typedef struct {
    double squares, scale, settled;
    double next_outage_s, next_ahead_s;
} score_t;

static bool score_fix(wind_filter_t *f, size_t i, score_t *score, wind_ahead_t *ahead, failure_t *failure)
{
    const wind_study_t *s = f->study;
    const double t_s = s->epoch[i].t_s;
    const double end_s = s->epoch[s->epochs - 1u].t_s;

    if (t_s < s->epoch[0].t_s + WIND_SETTLING_S) {
        return true;
    }
    const double x = (double)f->mean[PFL_WIND_X_WIND] - s->batch_wind_mps[0];
    const double y = (double)f->mean[PFL_WIND_Y_WIND] - s->batch_wind_mps[1];
    score->squares += x * x + y * y;
    score->scale += (double)f->mean[PFL_WIND_SCALE];
    score->settled += 1.0;
    if (t_s >= score->next_outage_s && t_s + OUTAGE_S <= end_s) {
        score->next_outage_s += OUTAGE_EVERY_S;
        if (!wind_outage(f, i, ahead, failure)) {
            return false;
        }
    }
    if (t_s >= score->next_ahead_s && t_s + AHEAD_S <= end_s) {
        score->next_ahead_s += AHEAD_EVERY_S;
        return wind_ahead(f, i, ahead, failure);
    }
    return true;
}

static void conclude(const score_t *score, const wind_ahead_t *ahead, double *value)
{
    value[WIND_RMS] = sqrt(score->squares / score->settled);
    value[WIND_SCALE] = score->scale / score->settled;
    value[WIND_END_30] = ahead->sum[0] / ahead->starts;
    value[WIND_END_60] = ahead->sum[1] / ahead->starts;
    value[WIND_COVERED] = ahead->sum[2] / ahead->fixes;
    for (size_t h = 0u; h < 2u; h++) {
        value[WIND_AHEAD + 2u * h] = ahead->ahead[h][0] / ahead->aheads;
        value[WIND_AHEAD + 2u * h + 1u] = ahead->ahead[h][1] / ahead->aheads;
        value[WIND_ORBIT + 3u * h] = ahead->orbit[h][0] / fmax(ahead->orbits, 1.0);
        value[WIND_ORBIT + 3u * h + 1u] = ahead->orbit[h][1] / fmax(ahead->orbits, 1.0);
        value[WIND_ORBIT + 3u * h + 2u] = ahead->ahead[h][2] / fmax(ahead->orbits, 1.0);
    }
}

static bool run_once(const plan_t *plan, uint32_t run, run_output_t *out, failure_t *failure)
{
    const wind_study_t *s = plan->own;
    const double first_s = s->epoch[0].t_s + WIND_SETTLING_S;
    score_t score = {.next_outage_s = first_s, .next_ahead_s = first_s};
    wind_ahead_t ahead = {.starts = 0.0};
    wind_filter_t f;
    bool done = wind_filter_open(&f, s, run, failure);

    if (!done) {
        return false;
    }
    for (size_t i = 0u; done && i < s->epochs; i++) {
        pfl_health_t health = {0};
        done = wind_filter_cycle(&f, i, failure) && pfl_health(f.filter, &health) == PFL_OK;
        if (done) {
            out->cycles_ns[i] = cycle_ns(health.cycles_last);
            out->cycle[i] = cycle_of(&health);
            note(&f, i, out);
            show(&f, i, out->look);
            done = score_fix(&f, i, &score, &ahead, failure);
        }
    }
    wind_filter_close(&f);
    if (done) {
        conclude(&score, &ahead, out->value);
    }
    return done;
}

static const campaign_t campaign[] = {
    {"marginalised", 20u, {"flight=px4"}, 0u},
    {"marginalised", 20u, {"flight=x8"}, 0u},
    {"bootstrap", 20u, {"flight=px4"}, 0u},
    {"bootstrap", 20u, {"flight=x8"}, 0u},
};

const scenario_t wind_scenario = {
    .name = "wind",
    .summary =
        "recorded fixed-wing flights: wind and airspeed scale from GPS, airspeed and yaw; GPS outages; looking ahead",
    .filters = "marginalised|bootstrap",
    .particles = 300u,
    .runs = 20u,
    .settings = settings,
    .settings_count = sizeof settings / sizeof settings[0],
    .campaign = campaign,
    .campaign_count = sizeof campaign / sizeof campaign[0],
    .recordings = "px4: github.com/NorthStarUAS/insgnss_tools; x8: TestLog2 of github.com/priseborough/InertialNav",
    .open = open_study,
    .close = close_study,
    .run = run_once,
    .judge = wind_judge,
};
