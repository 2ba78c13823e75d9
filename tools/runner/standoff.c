/* The scenario `standoff`: its settings, the studies that `tools/run` makes of it, and a run. */
#include "standoff.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const setting_t settings[] = {
    {"motion", "cv|road|lane", 0.0, 0.0, "cv",
     "the filter's model: constant velocity, aligned with the road, on its lane"},
    {"guidance", "lvfg|lvfg+|nmpc|nmpc+", 0.0, 0.0, "lvfg", "the paper's laws, and ours with a +"},
    {"visibility", "inout|in", 0.0, 0.0, "inout", "inout: the target is not seen for 10 s, twice"},
    {"plant", "zoh|euler", 0.0, 0.0, "zoh", "the UAVs' lags: exact, or by the paper's Euler step"},
    {"truth", "paper|calm", 0.0, 0.0, "paper", "how the target drives: restless as calibrated to the paper, or calm"},
    {"tries", NULL, 1.0, 256.0, "4", "cpf, cv: draws a particle has to stay on the road"},
    {"fallback", "slide|clamp|bounce|weight|keep", 0.0, 0.0, "slide", "cpf, cv: what then happens to it"},
    {"theta", NULL, 0.0, 1.0, "1", "pf: resample at a visible step when the effective sample size <= theta N"},
    {"qa", NULL, 0.0, 10.0, "0", "acceleration noise along the road (cv: on each axis) in m/s^2; 0: the page's"},
    {"ql", NULL, 0.0, 10.0, "0", "road: acceleration noise across in m/s^2; 0: the page's"},
};

/* Position of a value among the choices of a setting, which stand in the order of the enumeration they stand for. */
static unsigned choice_index(const study_t *study, const char *key)
{
    const char *value = study_value(study, key);
    const size_t length = strlen(value);
    const char *choice = NULL;
    unsigned index = 0u;

    for (size_t i = 0u; i < sizeof settings / sizeof settings[0]; i++) {
        choice = strcmp(settings[i].key, key) == 0 ? settings[i].choices : choice;
    }
    while (choice != NULL && (strncmp(choice, value, length) != 0 || strchr("|", choice[length]) == NULL)) {
        choice = strchr(choice, '|');
        choice = choice == NULL ? NULL : choice + 1;
        index++;
    }
    return index;
}

/* The page's noises where the command line has none. */
static void read_noises(const study_t *study, standoff_study_t *s)
{
    const double along = study_number(study, "qa");
    const double across = study_number(study, "ql");

    s->sigma_along = 1.0;
    s->sigma_across = s->calm ? 0.3 : 1.0;
    if (s->ekf || s->motion == MOTION_LANE) {
        s->sigma_along = s->calm ? 0.3 : 0.7;
    } else if (s->motion == MOTION_ROAD) {
        s->sigma_along = s->calm ? 0.5 : 0.7;
    }
    s->sigma_along = along > 0.0 ? along : s->sigma_along;
    s->sigma_across = across > 0.0 ? across : s->sigma_across;
}

static bool read_settings(const study_t *study, standoff_study_t *s, failure_t *failure)
{
    const double tries = study_number(study, "tries");

    if (tries > floor(tries)) {
        return fail(failure, EXIT_USAGE, "--set tries=%s: give a whole number", study_value(study, "tries"));
    }
    s->ekf = strncmp(study->filter, "ekf", 3u) == 0;
    s->constrained = strncmp(study->filter, "cpf", 3u) == 0;
    s->uavs = strstr(study->filter, "multi") != NULL ? 2u : 1u;
    s->motion = (standoff_motion_t)choice_index(study, "motion");
    s->guidance = (standoff_guidance_t)choice_index(study, "guidance");
    s->fallback = (standoff_fallback_t)choice_index(study, "fallback");
    s->outages = study_is(study, "visibility", "inout");
    s->euler_plant = study_is(study, "plant", "euler");
    s->calm = study_is(study, "truth", "calm");
    s->tries = (uint32_t)tries;
    s->ess_ratio = study_number(study, "theta");
    s->particles = study->particles;
    s->seed = study->seed;
    read_noises(study, s);
    return true;
}

static bool open_study(const study_t *study, plan_t *plan, failure_t *failure)
{
    standoff_study_t *s = malloc(sizeof *s);

    if (s == NULL) {
        return fail(failure, EXIT_HARNESS, "out of memory");
    }
    memset(s, 0, sizeof *s);
    if (!read_settings(study, s, failure)) {
        free(s);
        return false;
    }
    *plan = (plan_t){
        .own = s,
        .values = STANDOFF_VALUES,
        .cycles = STANDOFF_STEPS,
        .steps = STANDOFF_STEPS,
        .columns = SERIES_COLUMNS,
        .column = standoff_columns,
        .period_s = STANDOFF_PERIOD_S,
        .budget_us = 5000.0,
        .budget_reason = "2 updates a second, 1 % of the time between them",
    };
    return true;
}

static void close_study(plan_t *plan)
{
    free(plan->own);
}

/* The position error of another filter in the same world. */
static bool fly_baseline(const standoff_study_t *s, uint32_t run, double *position, failure_t *failure)
{
    double value[STANDOFF_FLIGHT_VALUES] = {0.0};

    if (!standoff_fly(s, run, value, NULL, failure)) {
        return false;
    }
    *position = value[STANDOFF_POSITION];
    return true;
}

static bool fly_baselines(const standoff_study_t *s, uint32_t run, double *value, failure_t *failure)
{
    standoff_study_t other = *s;

    if (standoff_has_pf(s)) {
        other.constrained = false;
        if (!fly_baseline(&other, run, &value[STANDOFF_POSITION_PF], failure)) {
            return false;
        }
    }
    other = *s;
    if (standoff_has_cpf(s)) {
        other.uavs = 1u;
        if (!fly_baseline(&other, run, &value[STANDOFF_POSITION_CPF], failure)) {
            return false;
        }
    }
    other = *s;
    if (standoff_has_ekf(s)) {
        other.ekf = true;
        other.sigma_along = s->calm ? 0.3 : 0.7;
        return fly_baseline(&other, run, &value[STANDOFF_POSITION_EKF], failure);
    }
    return true;
}

static bool run_once(const plan_t *plan, uint32_t run, run_output_t *out, failure_t *failure)
{
    const standoff_study_t *s = plan->own;

    return standoff_fly(s, run, out->value, out, failure) && fly_baselines(s, run, out->value, failure);
}

static const campaign_t campaign[] = {
    {"pf", 200u, {NULL}},
    {"cpf", 200u, {NULL}},
    {"cpf-multi", 200u, {NULL}},
    {"ekf-multi", 200u, {NULL}},
    {"cpf-multi", 200u, {"motion=lane"}},
    {"cpf-multi", 200u, {"motion=lane", "truth=calm"}},
    {"cpf-multi", 200u, {"visibility=in"}},
    {"cpf-multi", 200u, {"guidance=nmpc", "visibility=in"}},
    {"cpf-multi", 200u, {"guidance=nmpc"}},
    {"cpf-multi", 200u, {"guidance=lvfg+"}},
    {"cpf-multi", 200u, {"guidance=nmpc+"}},
};

const scenario_t standoff_scenario = {
    .name = "standoff",
    .summary = "UAVs keep a distance to a target on a road, seen with gaps: constrained particle filter, LVFG and NMPC",
    .filters = "cpf-multi|cpf|pf|pf-multi|ekf|ekf-multi",
    .particles = 200u,
    .runs = 200u,
    .settings = settings,
    .settings_count = sizeof settings / sizeof settings[0],
    .campaign = campaign,
    .campaign_count = sizeof campaign / sizeof campaign[0],
    .recordings = NULL,
    .open = open_study,
    .close = close_study,
    .run = run_once,
    .judge = standoff_judge,
};
