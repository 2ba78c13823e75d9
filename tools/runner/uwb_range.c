/* The scenario `uwb-range`: real ranges to radio anchors, outdoors without odometry, indoors with it and from an
 * unknown start. */
#include "uwb_range.h"

#include "hash.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const setting_t settings[] = {
    {"set", "los_a1|nlos_a2|indoor", 0.0, 0.0, "los_a1", "the recording"},
    {"bias", "anchor|common|online|blind", 0.0, 0.0, "anchor",
     "one bias an anchor or 0.10 m for all, outdoors; learnt from 0.10 m or from nothing, as are the wheels' errors"},
    {"tails", "student|gauss", 0.0, 0.0, "student", "the range's likelihood; gauss does not survive gross errors"},
};

static const char *const columns[] = {"measured_t_s", "x_m", "y_m", "truth_x_m", "truth_y_m", "error_m"};
enum { COLUMNS = sizeof columns / sizeof columns[0] };

static bool open_study(const study_t *study, plan_t *plan, failure_t *failure)
{
    uwb_study_t *s = calloc(1u, sizeof *s);

    if (s == NULL) {
        return fail(failure, EXIT_HARNESS, "out of memory");
    }
    s->common_bias = study_is(study, "bias", "common");
    s->blind = study_is(study, "bias", "blind");
    s->online = s->blind || study_is(study, "bias", "online");
    s->gaussian = study_is(study, "tails", "gauss");
    s->particles = study->particles;
    s->seed = study->seed;
    if (!uwb_load(s, study->data, study_value(study, "set"), failure)) {
        free(s);
        return false;
    }
    *plan = (plan_t){
        .own = s,
        .values = UWB_VALUES,
        .cycles = s->ranges,
        .steps = s->ranges,
        .columns = COLUMNS,
        .column = columns,
        .period_s = 0.0,
        .budget_us = s->indoor ? 700.0 : 250.0,
        .budget_reason = s->indoor ? "8 ranges a second, about 0.5 % of the time between them"
                                   : "40 ranges a second, 1 % of the time between them",
    };
    return true;
}

static void close_study(plan_t *plan)
{
    uwb_study_t *s = plan->own;

    free(s->range);
    free(s);
}

/* Scores the estimates, horizontally, one error a range. */
static bool score(const uwb_study_t *s, const float *estimate, run_output_t *out, failure_t *failure)
{
    const size_t skipped = s->indoor ? UWB_INDOOR_SETTLING : 0u;
    double *error = malloc(s->ranges * sizeof *error);
    double squares = 0.0;
    size_t scored = 0u;

    if (error == NULL) {
        return fail(failure, EXIT_HARNESS, "out of memory");
    }
    for (size_t i = 0u; i < s->ranges; i++) {
        const uwb_range_t *range = &s->range[i];
        const double x = (double)estimate[2u * i];
        const double y = (double)estimate[2u * i + 1u];
        const double e = hypot(x - range->truth_x_m, y - range->truth_y_m);
        if (i >= skipped) {
            error[scored++] = e;
            squares += e * e;
        }
        if (out->series != NULL) {
            const double row[COLUMNS] = {range->t_s, x, y, range->truth_x_m, range->truth_y_m, e};
            memcpy(&out->series[i * COLUMNS], row, sizeof row);
        }
    }
    if (scored == 0u) {
        free(error);
        return fail(failure, EXIT_HARNESS, "only %zu ranges: expected more than %zu", s->ranges, skipped);
    }
    stats_sort(error, scored);
    out->value[UWB_RMSE] = sqrt(squares / (double)scored);
    out->value[UWB_P95] = error[(size_t)(0.95 * (double)(scored - 1u))];
    out->value[UWB_MAX] = error[scored - 1u];
    free(error);
    return true;
}

static bool run_once(const plan_t *plan, uint32_t run, run_output_t *out, failure_t *failure)
{
    const uwb_study_t *s = plan->own;
    float *estimate = malloc(2u * s->ranges * sizeof *estimate);

    if (estimate == NULL) {
        return fail(failure, EXIT_HARNESS, "out of memory");
    }
    const bool done =
        (s->online ? uwb_online : uwb_filter)(s, run, estimate, out, failure) && score(s, estimate, out, failure);
    if (done) {
        out->hash = hash_floats(out->hash, estimate, 2u * s->ranges);
        out->value[UWB_RESAMPLED] = (double)out->cycle[s->ranges - 1u].resampled / (double)s->ranges;
    }
    free(estimate);
    return done;
}

static const campaign_t campaign[] = {
    {"pf", 20u, {"set=los_a1"}, 0u},
    {"pf", 20u, {"set=nlos_a2"}, 0u},
    {"pf", 20u, {"set=indoor"}, 0u},
    {"pf", 20u, {"set=los_a1", "bias=online"}, 0u},
    {"pf", 20u, {"set=nlos_a2", "bias=online"}, 0u},
    {"pf", 20u, {"set=indoor", "bias=online"}, 0u},
};

const scenario_t uwb_range_scenario = {
    .name = "uwb-range",
    .summary = "recorded ultra-wideband ranges: a walker outdoors, a wheeled robot indoors from an unknown start",
    .filters = "pf",
    .particles = 500u,
    .runs = 20u,
    .settings = settings,
    .settings_count = sizeof settings / sizeof settings[0],
    .campaign = campaign,
    .campaign_count = sizeof campaign / sizeof campaign[0],
    .recordings =
        "outdoor: github.com/cucudasluv/UWB-dataset; indoor: the Labyrinth set of github.com/TUC-ProAut/libRSF",
    .open = open_study,
    .close = close_study,
    .run = run_once,
    .judge = uwb_judge,
};
