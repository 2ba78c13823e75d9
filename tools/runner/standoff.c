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
    {"gating", "off|on", 0.0, 0.0, "off",
     "on: a UAV measures only while its camera, on the last estimate, has the target"},
    {"plant", "zoh|euler", 0.0, 0.0, "zoh", "the UAVs' lags: exact, or by the paper's Euler step"},
    {"truth", "paper|calm", 0.0, 0.0, "paper", "how the target drives: restless as calibrated to the paper, or calm"},
    {"tries", NULL, 1.0, 256.0, "4", "cpf, cv: draws a particle has to stay on the road"},
    {"fallback", "slide|clamp|bounce|weight|keep", 0.0, 0.0, "slide", "cpf, cv: what then happens to it"},
    {"theta", NULL, 0.0, 1.0, "0",
     "pf: resample at a visible step when the effective sample size <= theta N; 0: 1, lane 0.5"},
    {"kernel", NULL, 0.0, 0.99, "0.9", "lane: width of the kernel step after resampling; 0: none"},
    {"parts", NULL, 1.0, 64.0, "8", "lane: parts in which the first measurement after a gap is fused"},
    {"reach", "sigma|farthest", 0.0, 0.0, "sigma", "lane: 3 standard deviations, as the EKF has; cv, road: farthest"},
    {"qa", NULL, 0.0, 10.0, "0", "acceleration noise along the road (cv: on each axis) in m/s^2; 0: the page's"},
    {"ql", NULL, 0.0, 10.0, "0", "road: acceleration noise across in m/s^2; 0: the page's"},
};

/* Settings that the page does not change: at their defaults? */
static bool is_as_page(const study_t *study)
{
    static const char *const keys[] = {"gating", "theta", "kernel", "parts", "reach", "qa", "ql"};
    bool same = true;

    for (size_t k = 0u; k < sizeof keys / sizeof keys[0]; k++) {
        for (size_t i = 0u; i < sizeof settings / sizeof settings[0]; i++) {
            same = same && (strcmp(settings[i].key, keys[k]) != 0 || study_is(study, keys[k], settings[i].fallback));
        }
    }
    return same;
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

static bool read_whole(const study_t *study, const char *key, uint32_t *value, failure_t *failure)
{
    const double number = study_number(study, key);

    *value = (uint32_t)number;
    return !(number > floor(number)) ||
           fail(failure, EXIT_USAGE, "--set %s=%s: give a whole number", key, study_value(study, key));
}

static bool read_settings(const study_t *study, standoff_study_t *s, failure_t *failure)
{
    if (!read_whole(study, "tries", &s->tries, failure) || !read_whole(study, "parts", &s->parts, failure)) {
        return false;
    }
    s->ekf = strncmp(study->filter, "ekf", 3u) == 0;
    s->constrained = strncmp(study->filter, "cpf", 3u) == 0;
    s->uavs = strstr(study->filter, "multi") != NULL ? 2u : 1u;
    s->motion = (standoff_motion_t)study_choice(study, "motion");
    s->guidance = (standoff_guidance_t)study_choice(study, "guidance");
    s->fallback = (standoff_fallback_t)study_choice(study, "fallback");
    s->outages = study_is(study, "visibility", "inout");
    s->gated = study_is(study, "gating", "on");
    s->euler_plant = study_is(study, "plant", "euler");
    s->calm = study_is(study, "truth", "calm");
    s->kernel_width = study_number(study, "kernel");
    s->farthest = study_is(study, "reach", "farthest");
    s->particles = study->particles;
    s->seed = study->seed;
    const double theta = study_number(study, "theta");
    s->ess_ratio = theta > 0.0 ? theta : (s->motion == MOTION_LANE ? 0.5 : 1.0);
    s->as_page = is_as_page(study);
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
    /* Table II, and the yardstick */
    {"pf", 200u, {NULL}, 0u},
    {"cpf", 200u, {NULL}, 0u},
    {"cpf-multi", 200u, {NULL}, 0u},
    {"ekf", 200u, {NULL}, 0u},
    {"ekf-multi", 200u, {NULL}, 0u},
    {"pf", 200u, {"truth=calm"}, 0u},
    {"cpf", 200u, {"truth=calm"}, 0u},
    {"cpf-multi", 200u, {"truth=calm"}, 0u},
    {"ekf-multi", 200u, {"truth=calm"}, 0u},
    /* Table III */
    {"cpf-multi", 200u, {"visibility=in"}, 0u},
    {"cpf-multi", 200u, {"visibility=in", "guidance=nmpc"}, 0u},
    {"cpf-multi", 200u, {"visibility=in", "guidance=lvfg+"}, 0u},
    {"cpf-multi", 200u, {"visibility=in", "guidance=nmpc+"}, 0u},
    {"cpf-multi", 200u, {"guidance=nmpc"}, 0u},
    {"cpf-multi", 200u, {"guidance=lvfg+"}, 0u},
    {"cpf-multi", 200u, {"guidance=nmpc+"}, 0u},
    /* models, and tries */
    {"cpf-multi", 200u, {"motion=road"}, 0u},
    {"cpf-multi", 200u, {"motion=road", "truth=calm"}, 0u},
    {"cpf-multi", 200u, {"motion=lane"}, 0u},
    {"cpf-multi", 200u, {"motion=lane", "truth=calm"}, 0u},
    {"cpf", 200u, {"tries=1"}, 0u},
    {"cpf", 200u, {"tries=64"}, 0u},
    {"cpf-multi", 200u, {"tries=1"}, 100u},
    /* Figure 5 */
    {"cpf", 200u, {NULL}, 25u},
    {"cpf", 200u, {NULL}, 50u},
    {"cpf", 200u, {NULL}, 100u},
    {"cpf", 200u, {NULL}, 800u},
    {"cpf-multi", 200u, {NULL}, 25u},
    {"cpf-multi", 200u, {NULL}, 50u},
    {"cpf-multi", 200u, {NULL}, 100u},
    {"cpf-multi", 200u, {NULL}, 800u},
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
