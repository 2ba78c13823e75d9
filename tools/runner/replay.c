/* The scenario `replay`: a log of one's own, in the columns that tools/log writes, through a filter of one's choice. */
#include "replay.h"

#include <stdlib.h>
#include <string.h>

static const setting_t settings[] = {
    {"model", "cv|hover|turn|odometry", 0.0, 0.0, "cv",
     "constant velocity; hovering, with height; a turning vehicle; "
     "wheel odometry"},
    {"sensors", "gps|fix|velocity|height|baro|range|...", 0.0, 0.0, "gps", "one or more, with commas: docs/logs.md"},
    {"motion", "auto|#", 0.0, 1000.0, "auto",
     "noise of the model: cv [m/s^2/sqrt(Hz)], hover [m/s], turn "
     "[m/s/sqrt(s)], odometry [share of the speed]"},
    {"turning", "auto|#", 0.0, 100.0, "auto",
     "turn: of the turn rate [rad/s/sqrt(s)]; odometry: of the heading "
     "[rad/sqrt(s)]"},
    {"sigma_gps", NULL, 0.001, 1000.0, "1.5", "standard deviation of a position, of gps and fix [m]"},
    {"sigma_velocity", NULL, 0.001, 1000.0, "0.3", "of a velocity [m/s]"},
    {"sigma_height", NULL, 0.001, 1000.0, "3", "of a GPS height [m]"},
    {"sigma_baro", NULL, 0.001, 1000.0, "0.5", "of a barometer's height [m]"},
    {"sigma_range", NULL, 0.001, 1000.0, "0.2", "of a range to an anchor [m]"},
    {"range_dof", NULL, 0.0, 100.0, "3", "degrees of freedom of its Student t; 0: Gaussian"},
    {"anchors_over", NULL, -1000.0, 1000.0, "0", "height of the anchors over the vehicle [m]"},
    {"start_speed", NULL, 0.0, 1000.0, "10", "how large the velocity may be at first, where none is measured [m/s]"},
    {"ess", NULL, 0.0, 1.0, "0.5", "resample below this share of the particles"},
    {"gate", NULL, 0.0, 1000.0, "0", "refuse a measurement whose -2 log-likelihood is above that; 0: none"},
    {"from", NULL, 0.0, 1e6, "10", "score from this time after the first measurement [s]"},
    {"gap", NULL, 0.0, 1e6, "60", "start anew after so long without a measurement [s]; 0: never"},
};

static const char *const columns[REPLAY_COLUMNS] = {
    "measured_t_s", "x_m", "y_m", "measured_x_m", "measured_y_m", "truth_x_m", "truth_y_m", "sigma_m", "nis", "nees",
};

/* Is the sensor's name one of those between the commas? */
static bool names(const char *list, const char *sensor)
{
    const size_t length = strlen(sensor);

    while (list != NULL) {
        if (strncmp(list, sensor, length) == 0 && (list[length] == ',' || list[length] == '\0')) {
            return true;
        }
        list = strchr(list, ',');
        list = list != NULL ? list + 1 : NULL;
    }
    return false;
}

static void choose_sensors(replay_study_t *s, const study_t *study)
{
    static const struct {
        const char *name, *sigma;
    } all[REPLAY_SENSORS] = {
        [REPLAY_GPS] = {"gps", "sigma_gps"},
        [REPLAY_FIX] = {"fix", "sigma_gps"},
        [REPLAY_VELOCITY] = {"velocity", "sigma_velocity"},
        [REPLAY_HEIGHT] = {"height", "sigma_height"},
        [REPLAY_BARO] = {"baro", "sigma_baro"},
        [REPLAY_RANGE] = {"range", "sigma_range"},
    };

    for (unsigned k = 0u; k < REPLAY_SENSORS; k++) {
        s->wanted[k] = names(study_value(study, "sensors"), all[k].name);
        s->sigma[k] = (float)study_number(study, all[k].sigma);
    }
}

static float or_auto(const study_t *study, const char *key, const float *automatic)
{
    return study_is(study, key, "auto") ? automatic[study_choice(study, "model")] : (float)study_number(study, key);
}

static bool can_see(const replay_study_t *s, failure_t *failure)
{
    if (!s->wanted[REPLAY_GPS] && !s->wanted[REPLAY_FIX] && !s->wanted[REPLAY_RANGE]) {
        return fail(failure, EXIT_USAGE, "--sensors: one of them must tell the position: gps, fix or range");
    }
    if ((s->wanted[REPLAY_HEIGHT] || s->wanted[REPLAY_BARO]) && s->model != REPLAY_HOVER) {
        return fail(failure, EXIT_USAGE, "--sensors: height and baro need a model with height: --model hover");
    }
    return !(s->wanted[REPLAY_VELOCITY] && s->model == REPLAY_ODOMETRY) ||
           fail(failure, EXIT_USAGE, "--sensors: with --model odometry the velocity comes from odometry.csv");
}

static bool open_study(const study_t *study, plan_t *plan, failure_t *failure)
{
    static const float motion[REPLAY_MODELS] = {2.0f, 3.0f, 2.0f, 0.1f};
    static const float turning[REPLAY_MODELS] = {0.0f, 0.0f, 0.2f, 0.05f};
    replay_study_t *s = calloc(1u, sizeof *s);

    if (s == NULL) {
        return fail(failure, EXIT_HARNESS, "out of memory");
    }
    s->model = (replay_model_t)study_choice(study, "model");
    choose_sensors(s, study);
    s->motion = or_auto(study, "motion", motion);
    s->turning = or_auto(study, "turning", turning);
    s->start_speed = (float)study_number(study, "start_speed");
    s->ess_ratio = (float)study_number(study, "ess");
    s->range_dof = (float)study_number(study, "range_dof");
    s->anchors_over_m = (float)study_number(study, "anchors_over");
    s->gate = (float)study_number(study, "gate");
    s->from_s = study_number(study, "from");
    s->gap_s = study_number(study, "gap");
    s->particles = study->particles;
    s->seed = study->seed;
    if (!can_see(s, failure) || !replay_load(s, study->data, failure)) {
        free(s->event);
        free(s);
        return false;
    }
    const double span_s = s->event[s->events - 1u].t_s - s->event[0].t_s;
    *plan = (plan_t){
        .own = s,
        .values = REPLAY_VALUES,
        .cycles = s->events,
        .steps = s->events,
        .columns = REPLAY_COLUMNS,
        .column = columns,
        .period_s = 0.0,
        .budget_us = 0.05 * 1e6 * span_s / (double)s->events,
        .budget_reason = "5 % of the mean time between two measurements",
    };
    return true;
}

static void close_study(plan_t *plan)
{
    replay_study_t *s = plan->own;

    free(s->event);
    free(s);
}

static bool run_once(const plan_t *plan, uint32_t run, run_output_t *out, failure_t *failure)
{
    return replay_fly(plan->own, run, out, failure);
}

const scenario_t replay_scenario = {
    .name = "replay",
    .summary = "a log of one's own: --data DIR names its folder, tools/log makes it",
    .filters = "pf",
    .particles = 500u,
    .runs = 5u,
    .settings = settings,
    .settings_count = sizeof settings / sizeof settings[0],
    .campaign = NULL,
    .campaign_count = 0u,
    .recordings = NULL, /* the log is the caller's, and tools/run alone has none to fly */
    .open = open_study,
    .close = close_study,
    .run = run_once,
    .judge = replay_judge,
};
