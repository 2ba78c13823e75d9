/* The scenario `land-vehicle`: its settings, the studies that `tools/run` makes of it, and a run. */
#include "land_vehicle.h"

#include "hash.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const setting_t settings[] = {
    {"case", "1|2|3", 0.0, 0.0, "1", "the paper's scenario: noises 5 and 10, 10 and 15, 15 and 20"},
    {"reading", "variance|std", 0.0, 0.0, "variance", "what the paper's noise figures are"},
    {"start", "known|uncertain", 0.0, 0.0, "known", "uncertain: drawn with 5 m, 5 m, 1 m/s, 0.5 rad"},
    {"jitter", "off|on", 0.0, 0.0, "off", "pf: 0.05 m/s and 0.02 rad per step"},
    {"theta", NULL, 0.0, 1.0, "0.5", "pf: resample when the effective sample size < theta N"},
    {"resampling", "systematic|stratified|residual|multinomial", 0.0, 0.0, "systematic", "pf: the scheme"},
    {"proposal", "prior|optimal", 0.0, 0.0, "prior", "pf: optimal: particles move to where the measurement says"},
    {"ukf", "tuned|forgot-t|r-identity|q-zero-p-identity|q-all-small|q-all-large|q-zero-p-zero|raw", 0.0, 0.0, "tuned",
     "ukf: its tuning"},
};

static const char *const columns[] = {"eps_k", "eps_1_k", "eps_2_k", "eps_3_k", "eps_4_k"};
enum { COLUMNS = sizeof columns / sizeof columns[0] };

static const char *const trace_columns[] = {
    "truth_east_m",    "truth_north_m",    "truth_speed_mps",    "truth_heading_rad",
    "estimate_east_m", "estimate_north_m", "estimate_speed_mps", "estimate_heading_rad",
    "measured_east_m", "measured_north_m", "measured_speed_mps",
};
enum { TRACE_COLUMNS = sizeof trace_columns / sizeof trace_columns[0] };

static void read_settings(const study_t *study, land_study_t *s)
{
    static const double sigma_w[LAND_CASES] = {5.0, 10.0, 15.0};
    static const double sigma_z[LAND_CASES] = {10.0, 15.0, 20.0};
    static const pfl_scheme_fn schemes[] = {pfl_systematic, pfl_stratified, pfl_residual, pfl_multinomial};

    s->filter = strcmp(study->filter, "pf") == 0 ? LAND_PF : LAND_KF;
    s->filter = strcmp(study->filter, "ukf") == 0 ? LAND_UKF : s->filter;
    s->tuning = (land_tuning_t)study_choice(study, "ukf");
    s->case_index = study_choice(study, "case");
    s->std_reading = study_is(study, "reading", "std");
    s->uncertain = study_is(study, "start", "uncertain");
    s->jitter = study_is(study, "jitter", "on");
    s->optimal = study_is(study, "proposal", "optimal");
    s->theta = (float)study_number(study, "theta");
    s->resampling = schemes[study_choice(study, "resampling")];
    s->particles = study->particles;
    s->seed = study->seed;
    s->w_variance = sigma_w[s->case_index] * (s->std_reading ? sigma_w[s->case_index] : 1.0);
    s->z_variance = sigma_z[s->case_index] * (s->std_reading ? sigma_z[s->case_index] : 1.0);
}

static bool open_study(const study_t *study, plan_t *plan, failure_t *failure)
{
    land_study_t *s = malloc(sizeof *s);

    if (s == NULL) {
        return fail(failure, EXIT_HARNESS, "out of memory");
    }
    read_settings(study, s);
    *plan = (plan_t){
        .own = s,
        .values = LAND_VALUES,
        .cycles = LAND_STEPS,
        .steps = LAND_STEPS,
        .columns = COLUMNS,
        .column = columns,
        .trace_columns = TRACE_COLUMNS,
        .trace_column = trace_columns,
        .period_s = LAND_PERIOD_S,
        .budget_us = 5000.0,
        .budget_reason = "2 updates a second, 1 % of the time between them",
    };
    return true;
}

static void close_study(plan_t *plan)
{
    free(plan->own);
}

/* eta of a run; eps_k and the states' errors into the series, where there is one. */
static double score(const land_track_t *track, const land_estimate_t *estimate, double *series)
{
    double sum = 0.0;

    for (unsigned k = 1u; k <= LAND_STEPS; k++) {
        double squares = 0.0;
        for (int d = 0; d < PFL_LAND_STATES; d++) {
            const double error = estimate->x[k][d] - track->truth[k][d];
            squares += error * error;
            if (series != NULL) {
                series[(k - 1u) * COLUMNS + 1u + (unsigned)d] = fabs(error);
            }
        }
        const double eps = sqrt(squares / (double)PFL_LAND_STATES);
        sum += eps;
        if (series != NULL) {
            series[(k - 1u) * COLUMNS] = eps;
        }
    }
    return sum / (double)LAND_STEPS;
}

/* trace: null unless the run is traced. */
static void fill_trace(const land_track_t *track, const land_estimate_t *estimate, double *trace)
{
    for (unsigned k = 1u; k <= LAND_STEPS && trace != NULL; k++) {
        double *row = &trace[(k - 1u) * TRACE_COLUMNS];
        for (unsigned d = 0u; d < PFL_LAND_STATES; d++) {
            row[d] = track->truth[k][d];
            row[PFL_LAND_STATES + d] = estimate->x[k][d];
        }
        for (unsigned m = 0u; m < LAND_MEASURED; m++) {
            row[2u * PFL_LAND_STATES + m] = (double)track->z[k][m];
        }
    }
}

static bool filter_track(const land_study_t *s, uint32_t run, const land_track_t *track, land_estimate_t *estimate,
                         look_t *look, failure_t *failure)
{
    switch (s->filter) {
    case LAND_PF:
        return land_particle_filter(s, run, track, estimate, look, failure);
    case LAND_UKF:
        return land_unscented_filter(s, s->tuning, track, estimate, failure);
    case LAND_KF:
    default:
        return land_kalman_filter(s, track, estimate, failure);
    }
}

/* The baselines on the same data. */
static bool score_baselines(const land_study_t *s, const land_track_t *track, double *value, failure_t *failure)
{
    land_estimate_t estimate;

    if (!land_kalman_filter(s, track, &estimate, failure)) {
        return false;
    }
    value[LAND_ETA_KF] = score(track, &estimate, NULL);
    if (s->filter == LAND_PF && s->uncertain) {
        if (!land_unscented_filter(s, LAND_UKF_TUNED, track, &estimate, failure)) {
            return false;
        }
        value[LAND_ETA_UKF] = score(track, &estimate, NULL);
    }
    return true;
}

static bool run_once(const plan_t *plan, uint32_t run, run_output_t *out, failure_t *failure)
{
    const land_study_t *s = plan->own;
    land_track_t track;
    land_estimate_t estimate;

    memset(&estimate, 0, sizeof estimate);
    land_make_track(s, run, &track);
    if (!filter_track(s, run, &track, &estimate, out->look, failure) ||
        !score_baselines(s, &track, out->value, failure)) {
        return false;
    }
    out->value[LAND_ETA] = score(&track, &estimate, out->series);
    out->value[LAND_RESAMPLED] = (double)estimate.cycle[LAND_STEPS - 1].resampled / (double)LAND_STEPS;
    memcpy(out->cycles_ns, estimate.cycles_ns, sizeof estimate.cycles_ns);
    memcpy(out->cycle, estimate.cycle, sizeof estimate.cycle);
    fill_trace(&track, &estimate, out->trace);
    for (unsigned k = 1u; k <= LAND_STEPS; k++) {
        for (int d = 0; d < PFL_LAND_STATES; d++) {
            const float x = (float)estimate.x[k][d];
            out->hash = hash_floats(out->hash, &x, 1u);
        }
    }
    return true;
}

static const campaign_t campaign[] = {
    {"pf", 1000u, {"case=1"}, 0u},
    {"pf", 1000u, {"case=2"}, 0u},
    {"pf", 1000u, {"case=3"}, 0u},
    {"ukf", 1000u, {"case=1"}, 0u},
    {"ukf", 1000u, {"case=2"}, 0u},
    {"ukf", 1000u, {"case=3"}, 0u},
    {"ukf", 1000u, {"case=1", "ukf=q-zero-p-zero"}, 0u},
    {"pf", 1000u, {"case=1", "start=uncertain"}, 0u},
    {"pf", 1000u, {"case=1", "start=uncertain", "jitter=on"}, 0u},
};

const scenario_t land_vehicle_scenario = {
    .name = "land-vehicle",
    .summary = "a car tracked from position and speed (4 states), particle filter against Kalman filter and UKF",
    .filters = "pf|kf|ukf",
    .particles = 300u,
    .runs = 100u,
    .settings = settings,
    .settings_count = sizeof settings / sizeof settings[0],
    .campaign = campaign,
    .campaign_count = sizeof campaign / sizeof campaign[0],
    .recordings = NULL,
    .open = open_study,
    .close = close_study,
    .run = run_once,
    .judge = land_judge,
};
