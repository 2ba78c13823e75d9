/* The scenario `gps`: its settings, the studies that `tools/run` makes of it, and a run. */
#include "gps.h"

#include "hash.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const setting_t settings[] = {
    {"variant", "line|curve|radar|radar-coarse", 0.0, 0.0, "line",
     "the document's straight line; a path with turns, seen by GPS, by a radar, by a radar of 20 degrees"},
    {"d", NULL, 0.0, 0.999, "0.5", "decay of the GPS error from one sample to the next"},
    {"noise", "coloured|white", 0.0, 0.0, "coloured",
     "white: independent errors of the stated accuracy, d of no account"},
    {"accuracy", NULL, 0.01, 1000.0, "1.5", "the receiver's stated accuracy [m]"},
    {"r", "document|longrun", 0.0, 0.0, "document",
     "noise variance in a filter without colour: accuracy^2, or 2/(1-d) of it"},
    {"axes", "1|3", 0.0, 0.0, "1", "line: north alone, or north, east and down"},
    {"velocity", "off|on", 0.0, 0.0, "off", "GPS velocity of 0.1 m/s used as well"},
    {"guess", "document|far|far-wide", 0.0, 0.0, "document",
     "line: x0 = [0; 0.5], or [5; 0] with P0 as it is or diag(25, 1)"},
    {"truth", "document|drawn", 0.0, 0.0, "document", "line: the document's start, or one drawn from N(x0, P0)"},
    {"kernel", "auto|on|off", 0.0, 0.0, "auto",
     "pf: kernel step of width 0.5 after resampling; auto: on the line, and with velocity"},
    {"linear", "off|on", 0.0, 0.0, "off", "radar, kf: on range and azimuth linearised once, instead of on positions"},
};

static const char *const columns[] = {"error_m", "error_measured_m", "error_kf_m", "speed_error_mps", "sigma_north_m"};
static const char *const trace_columns[] = {
    "truth_north_m", "truth_east_m", "truth_down_m", "measured_north_m", "measured_east_m", "measured_down_m",
    "north_m",       "east_m",       "down_m",       "kf_north_m",       "kf_east_m",       "kf_down_m",
};
enum { COLUMNS = sizeof columns / sizeof columns[0], TRACE_COLUMNS = sizeof trace_columns / sizeof trace_columns[0] };

/* ---- Settings ------------------------------------------------------------------------------------------------------ */

static const char *const filter_name[] = {
    [GPS_KF] = "kf",
    [GPS_KF_TUNED] = "kf-tuned",
    [GPS_KF_COLOURED] = "kf-coloured",
    [GPS_EKF] = "ekf",
    [GPS_PF] = "pf",
    [GPS_PF_COLOURED] = "pf-coloured",
    [GPS_RAW] = "raw",
};
static const char *const variant_name[] = {
    [GPS_LINE] = "line", [GPS_CURVE] = "curve", [GPS_RADAR] = "radar", [GPS_RADAR_COARSE] = "radar-coarse"};

static unsigned index_of(const char *const *names, unsigned count, const char *name)
{
    unsigned i = 0u;

    while (i + 1u < count && strcmp(names[i], name) != 0) {
        i++;
    }
    return i;
}

static void read_noise(const study_t *study, gps_study_t *s)
{
    const double variance = pow(study_number(study, "accuracy"), 2.0);

    s->white = study_is(study, "noise", "white");
    s->longrun = study_is(study, "r", "longrun");
    s->decay = s->white ? 0.0 : study_number(study, "d");
    s->accuracy_m = study_number(study, "accuracy");
    s->noise_m = sqrt(s->white ? variance : 2.0 * (1.0 - s->decay) * variance);
    s->r_m2 = s->longrun && !s->white ? 2.0 * variance / (1.0 - s->decay) : variance;
}

static void read_radar(gps_study_t *s)
{
    const double rad_per_deg = 0.017453292519943295769;
    const bool coarse = s->variant == GPS_RADAR_COARSE;

    s->sigma_range = coarse ? 0.5 : 1.0;
    s->sigma_azimuth = rad_per_deg * (coarse ? 20.0 : 3.0);
    s->sigma_heading = coarse ? 1.5 : 0.5;
}

static void read_settings(const study_t *study, gps_study_t *s)
{
    memset(s, 0, sizeof *s);
    s->filter = (gps_filter_t)index_of(filter_name, sizeof filter_name / sizeof filter_name[0], study->filter);
    s->variant = (gps_variant_t)index_of(variant_name, sizeof variant_name / sizeof variant_name[0],
                                         study_value(study, "variant"));
    s->guess = study_is(study, "guess", "far") ? GPS_GUESS_FAR : GPS_GUESS_DOCUMENT;
    s->guess = study_is(study, "guess", "far-wide") ? GPS_GUESS_FAR_WIDE : s->guess;
    s->steps = s->variant == GPS_LINE ? GPS_STEPS_LINE : GPS_STEPS_CURVE;
    s->axes = study_is(study, "axes", "3") ? 3 : 1;
    s->axes = s->variant == GPS_LINE ? s->axes : 2;
    s->velocity = study_is(study, "velocity", "on");
    s->drawn = study_is(study, "truth", "drawn");
    s->linear = study_is(study, "linear", "on");
    /* Without it a velocity of 0.1 m/s leaves too few distinct positions, also where the model has noise of its own. */
    s->kernel = study_is(study, "kernel", "on") ||
                (study_is(study, "kernel", "auto") && (s->variant == GPS_LINE || s->velocity));
    s->particles = study->particles;
    s->seed = study->seed;
    read_noise(study, s);
    read_radar(s);
}

/* Combinations without a meaning are refused, not ignored. */
static bool check_settings(const study_t *study, const gps_study_t *s, failure_t *failure)
{
    const bool line = s->variant == GPS_LINE;
    const bool coloured = s->filter == GPS_KF_COLOURED || s->filter == GPS_PF_COLOURED;
    const bool kalman = s->filter == GPS_KF || s->filter == GPS_KF_TUNED;

    if (line && s->filter == GPS_EKF) {
        return fail(failure, EXIT_USAGE,
                    "--filter ekf: the straight line is linear, its filter is kf; give "
                    "--set variant=curve, radar or radar-coarse");
    }
    if (!line && (study_is(study, "axes", "3") || s->guess != GPS_GUESS_DOCUMENT || s->drawn)) {
        return fail(failure, EXIT_USAGE, "--set axes, guess, truth: for variant=line only");
    }
    if (gps_is_radar(s) && (coloured || s->velocity || s->white || s->longrun)) {
        return fail(failure, EXIT_USAGE,
                    "--filter *-coloured, --set velocity, noise, r: for GPS, variant=line or curve; "
                    "the radar's noise is white");
    }
    if (s->linear && !(gps_is_radar(s) && kalman)) {
        return fail(failure, EXIT_USAGE, "--set linear=on: for a radar and --filter kf or kf-tuned");
    }
    return true;
}

bool gps_has_kf_partner(const gps_study_t *s)
{
    return s->variant == GPS_LINE && (s->filter == GPS_PF || s->filter == GPS_PF_COLOURED);
}

bool gps_has_tuned_partner(const gps_study_t *s)
{
    return s->variant != GPS_LINE && s->filter != GPS_KF_TUNED && s->filter != GPS_RAW;
}

bool gps_has_document_partner(const gps_study_t *s)
{
    return s->filter == GPS_KF_COLOURED || s->filter == GPS_PF_COLOURED;
}

/* What the page gives the linear filter, which nothing rescues. */
#define LINEAR_ACCELERATION 0.3

/* On a path with turns the Kalman filter with colour is tuned too; on a line there is no acceleration to believe in. */
static bool tune(gps_study_t *s, failure_t *failure)
{
    if (s->linear) {
        s->q_tuned = LINEAR_ACCELERATION;
        return true;
    }
    if (s->filter != GPS_KF_TUNED && !gps_has_tuned_partner(s)) {
        return true;
    }
    return gps_tune(s, false, &s->q_tuned, failure) &&
           (s->filter != GPS_KF_COLOURED || gps_tune(s, true, &s->q_coloured, failure));
}

static bool open_study(const study_t *study, plan_t *plan, failure_t *failure)
{
    gps_study_t *s = malloc(sizeof *s);

    if (s == NULL) {
        return fail(failure, EXIT_HARNESS, "out of memory");
    }
    read_settings(study, s);
    if (!check_settings(study, s, failure) || !tune(s, failure)) {
        free(s);
        return false;
    }
    *plan = (plan_t){
        .own = s,
        .values = GPS_VALUES,
        .cycles = s->steps,
        .steps = s->steps,
        .columns = COLUMNS,
        .column = columns,
        .trace_columns = TRACE_COLUMNS,
        .trace_column = trace_columns,
        .period_s = GPS_PERIOD_S,
        .budget_us = 1000.0,
        .budget_reason = "10 updates a second, 1 % of the time between them",
    };
    return true;
}

static void close_study(plan_t *plan)
{
    free(plan->own);
}

/* ---- A run --------------------------------------------------------------------------------------------------------- */

/* All that a run needs; too large for a thread's stack on small systems. */
typedef struct {
    gps_track_t track;
    gps_estimate_t own;
    gps_estimate_t partner;
    gps_estimate_t raw;
    bool has_partner;
    look_t *look;
} workspace_t;

static double square_error(int axes, const double *a, const double *b)
{
    double squares = 0.0;

    for (int i = 0; i < axes; i++) {
        squares += (a[i] - b[i]) * (a[i] - b[i]);
    }
    return squares;
}

/* Mean square distance of the positions over k = 1 .. steps. */
static double mean_square(const gps_study_t *s, double a[][GPS_AXES_MAX], double b[][GPS_AXES_MAX])
{
    double sum = 0.0;

    for (unsigned k = 1u; k <= s->steps; k++) {
        sum += square_error(s->axes, a[k], b[k]);
    }
    return sum / (double)s->steps;
}

static bool kalman(const gps_study_t *s, bool coloured, double q, workspace_t *w, gps_estimate_t *e, failure_t *failure)
{
    return s->linear ? gps_radar_kalman(s, q, &w->track, e, failure)
                     : gps_kalman(s, coloured, q, &w->track, e, failure);
}

static bool filter_track(const gps_study_t *s, uint32_t run, workspace_t *w, failure_t *failure)
{
    switch (s->filter) {
    case GPS_KF_TUNED:
        return kalman(s, false, s->q_tuned, w, &w->own, failure);
    case GPS_KF_COLOURED:
        return kalman(s, true, s->q_coloured, w, &w->own, failure);
    case GPS_EKF:
        return gps_turn_kalman(s, &w->track, &w->own, failure);
    case GPS_PF:
    case GPS_PF_COLOURED:
        return gps_particle_filter(s, s->filter == GPS_PF_COLOURED, run, &w->track, &w->own, w->look, failure);
    case GPS_RAW:
        w->own = w->raw;
        return true;
    case GPS_KF:
    default:
        return kalman(s, false, 0.0, w, &w->own, failure);
    }
}

static double rmse_of(const gps_study_t *s, workspace_t *w, gps_estimate_t *estimate)
{
    return sqrt(mean_square(s, estimate->position, w->track.position));
}

/* The partner that stays in the workspace is the one that goes into the time series. */
static bool score_partners(const gps_study_t *s, uint32_t run, workspace_t *w, double *value, failure_t *failure)
{
    const bool particles = s->filter == GPS_PF_COLOURED;

    w->has_partner = gps_has_document_partner(s) || gps_has_tuned_partner(s) || gps_has_kf_partner(s);
    if (gps_has_document_partner(s)) {
        if (particles ? !gps_particle_filter(s, false, run, &w->track, &w->partner, NULL, failure)
                      : !kalman(s, false, 0.0, w, &w->partner, failure)) {
            return false;
        }
        value[GPS_RMSE_DOCUMENT] = rmse_of(s, w, &w->partner);
    }
    if (gps_has_tuned_partner(s)) {
        if (!kalman(s, false, s->q_tuned, w, &w->partner, failure)) {
            return false;
        }
        value[GPS_RMSE_TUNED] = rmse_of(s, w, &w->partner);
    }
    if (gps_has_kf_partner(s)) {
        if (!kalman(s, particles, 0.0, w, &w->partner, failure)) {
            return false;
        }
        value[GPS_RMSE_KF] = rmse_of(s, w, &w->partner);
        value[GPS_TO_KF_2] = mean_square(s, w->own.position, w->partner.position);
    }
    return true;
}

static void score(const gps_study_t *s, workspace_t *w, double *value)
{
    const unsigned last = s->steps;

    value[GPS_RMSE] = rmse_of(s, w, &w->own);
    value[GPS_RMSE_RAW] = rmse_of(s, w, &w->raw);
    value[GPS_FINAL_POSITION_2] = square_error(s->axes, w->own.position[last], w->track.position[last]);
    value[GPS_FINAL_VELOCITY_2] = square_error(s->axes, w->own.velocity[last], w->track.velocity[last]);
    for (unsigned k = 1u; k <= last; k++) {
        value[GPS_NEES] += w->own.nees[k] / (double)last;
    }
    value[GPS_RESAMPLED] = (double)w->own.cycle[last - 1u].resampled / (double)last;
    value[GPS_LOST] = value[GPS_RMSE] > GPS_LOST_M ? 1.0 : 0.0;
    value[GPS_BEATS_RAW] = value[GPS_RMSE] < value[GPS_RMSE_RAW] ? 1.0 : 0.0;
}

/* The Kalman filter beside it: the partner on the same data. */
static void fill_series(const gps_study_t *s, const workspace_t *w, double *series)
{
    for (unsigned k = 1u; k <= s->steps; k++) {
        double *row = series + (size_t)(k - 1u) * COLUMNS;
        row[0] = sqrt(square_error(s->axes, w->own.position[k], w->track.position[k]));
        row[1] = sqrt(square_error(s->axes, w->raw.position[k], w->track.position[k]));
        row[2] = w->has_partner ? sqrt(square_error(s->axes, w->partner.position[k], w->track.position[k])) : MISSING;
        row[3] = s->filter == GPS_RAW ? MISSING : sqrt(square_error(s->axes, w->own.velocity[k], w->track.velocity[k]));
        row[4] = w->own.sigma[k] > 0.0 ? w->own.sigma[k] : MISSING;
    }
}

static void fill_trace(const gps_study_t *s, const workspace_t *w, double *trace)
{
    for (unsigned k = 1u; k <= s->steps && trace != NULL; k++) {
        double *row = trace + (size_t)(k - 1u) * TRACE_COLUMNS;
        for (int a = 0; a < GPS_AXES_MAX; a++) {
            row[a] = w->track.position[k][a];
            row[3 + a] = s->variant == GPS_LINE || a < s->axes ? w->track.gps[k][a] : MISSING;
            row[6 + a] = a < s->axes ? w->own.position[k][a] : MISSING;
            row[9 + a] = w->has_partner && a < s->axes ? w->partner.position[k][a] : MISSING;
        }
    }
}

static bool work(const gps_study_t *s, uint32_t run, workspace_t *w, run_output_t *out, failure_t *failure)
{
    w->look = out->look;
    gps_make_track(s, run, &w->track);
    memcpy(w->raw.position, w->track.gps, sizeof w->track.gps);
    memcpy(w->raw.velocity, w->track.gps_velocity, sizeof w->track.gps_velocity);
    if (!filter_track(s, run, w, failure) || !score_partners(s, run, w, out->value, failure)) {
        return false;
    }
    score(s, w, out->value);
    fill_series(s, w, out->series);
    fill_trace(s, w, out->trace);
    memcpy(out->cycles_ns, w->own.cycles_ns, s->steps * sizeof w->own.cycles_ns[0]);
    memcpy(out->cycle, w->own.cycle, s->steps * sizeof w->own.cycle[0]);
    for (unsigned k = 1u; k <= s->steps; k++) {
        for (int a = 0; a < s->axes; a++) {
            const float x[2] = {(float)w->own.position[k][a], (float)w->own.velocity[k][a]};
            out->hash = hash_floats(out->hash, x, 2u);
        }
    }
    return true;
}

static bool run_once(const plan_t *plan, uint32_t run, run_output_t *out, failure_t *failure)
{
    workspace_t *w = calloc(1u, sizeof *w);
    const bool done = w != NULL ? work(plan->own, run, w, out, failure) : fail(failure, EXIT_HARNESS, "out of memory");

    free(w);
    return done;
}

/* clang-format off */
static const campaign_t campaign[] = {
    {"kf",          1000u, {"variant=line"},                  0u},
    {"pf",           400u, {"variant=line"},                  0u},
    {"pf-coloured",  400u, {"variant=line"},                  0u},
    {"pf",           400u, {"variant=line", "noise=white"},   0u},
    {"kf",           100u, {"variant=curve"},                 0u},
    {"pf",           100u, {"variant=curve"},                 0u},
    {"pf-coloured",  100u, {"variant=curve"},                 0u},
    {"ekf",          100u, {"variant=radar"},                 0u},
    {"pf",           100u, {"variant=radar"},                 0u},
    {"ekf",          100u, {"variant=radar-coarse"},          0u},
    {"pf",           100u, {"variant=radar-coarse"},          2000u},
};
/* clang-format on */

const scenario_t gps_scenario = {
    .name = "gps",
    .summary = "a position from GPS with coloured noise, or from a radar: Kalman filters and particle filters",
    .filters = "kf|kf-tuned|kf-coloured|ekf|pf|pf-coloured|raw",
    .particles = 1000u,
    .runs = 400u,
    .settings = settings,
    .settings_count = sizeof settings / sizeof settings[0],
    .campaign = campaign,
    .campaign_count = sizeof campaign / sizeof campaign[0],
    .recordings = NULL,
    .open = open_study,
    .close = close_study,
    .run = run_once,
    .judge = gps_judge,
};
