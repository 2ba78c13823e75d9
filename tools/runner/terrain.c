/* The scenario `terrain`: where is the aircraft, without satellites, from a start error of a kilometre, by what a radar
 * altimeter sees of real hills? The flights are simulated; the map is not. */
#include "terrain.h"

#include "hash.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const setting_t settings[] = {
    {"flight", "1|2", 0.0, 0.0, "1", "2 starts further off, over smoother ground"},
    {"power", "spread|full", 0.0, 0.0, "spread",
     "of the likelihood: less while the cloud is wide; plain always takes it whole"},
    {"scale", NULL, 1.0, 10000.0, "30", "power=spread: deviation of the cloud at which half of it is used [m]"},
    {"least", NULL, 0.0, 1.0, "0.02", "power=spread: never less, at first"},
    {"rise", NULL, 1.0, 100000.0, "110",
     "power=spread: that floor is twice as high after this time, and grows by its square [s]"},
    {"kernel", NULL, 0.01, 0.99, "0.35", "width of the kernel step after resampling; plain has none"},
    {"adapt", "off|kld", 0.0, 0.0, "off", "number of particles: as said, or as many as the cloud needs, up to that"},
    {"shape", "shrinking|gaussian|epanechnikov", 0.0, 0.0, "shrinking", "of that step"},
};

static const char *const columns[] = {"measured_t_s", "error_m", "sigma_m", "baro_m"};
enum { COLUMNS = sizeof columns / sizeof columns[0] };
static const char *const trace_columns[] = {"x_m", "y_m", "truth_x_m", "truth_y_m", "agl_m"};
enum { TRACE_COLUMNS = sizeof trace_columns / sizeof trace_columns[0] };

static terrain_filter_t filter_of(const char *name)
{
    static const char *const names[] = {"rb", "plain", "regularised", "tempered"};
    unsigned filter = 0u;

    while (strcmp(names[filter], name) != 0) {
        filter++;
    }
    return (terrain_filter_t)filter;
}

static bool open_study(const study_t *study, plan_t *plan, failure_t *failure)
{
    terrain_study_t *s = calloc(1u, sizeof *s);

    if (s == NULL) {
        return fail(failure, EXIT_HARNESS, "out of memory");
    }
    s->filter = filter_of(study->filter);
    s->second = study_is(study, "flight", "2");
    s->kernel_width = (float)study_number(study, "kernel");
    s->kernel_shape = (terrain_shape_t)study_choice(study, "shape");
    s->adaptive = study_is(study, "adapt", "kld");
    s->power_least = (float)study_number(study, "least");
    s->power_rise_s = (float)study_number(study, "rise");
    if (s->filter != TERRAIN_PLAIN && study_is(study, "power", "spread")) {
        s->power_scale_m = (float)study_number(study, "scale");
    }
    s->as_they_come = true;
    for (size_t k = 1u; k < sizeof settings / sizeof settings[0]; k++) {
        s->as_they_come = s->as_they_come &&
                          (strcmp(study->value[k], settings[k].fallback) == 0 || strcmp(settings[k].key, "adapt") == 0);
    }
    s->particles = study->particles;
    s->seed = study->seed;
    if (!terrain_load(s, study->data, failure)) {
        free(s);
        return false;
    }
    *plan = (plan_t){
        .own = s,
        .values = TERRAIN_VALUES,
        .cycles = s->rows - 1u,
        .steps = s->rows - 1u,
        .columns = COLUMNS,
        .column = columns,
        .trace_columns = TRACE_COLUMNS,
        .trace_column = trace_columns,
        .period_s = 0.5,
        .budget_us = 5000.0,
        .budget_reason = "2 heights a second, 1 % of the time between them",
    };
    return true;
}

static void close_study(plan_t *plan)
{
    terrain_study_t *s = plan->own;

    terrain_unload(s);
    free(s);
}

static double error_of(const terrain_study_t *s, const terrain_estimate_t *e, size_t k)
{
    return hypot((double)e[k].north_m - s->row[k].truth_north_m, (double)e[k].east_m - s->row[k].truth_east_m);
}

/* Scores the estimates, horizontally. */
static void score(const terrain_study_t *s, const terrain_estimate_t *e, run_output_t *out)
{
    double squares = 0.0;
    double worst = 0.0;
    double particles = 0.0;
    size_t scored = 0u;
    size_t settled = 0u; /* first row from which all are near */

    for (size_t k = 0u; k < s->rows; k++) {
        const double error = error_of(s, e, k);
        settled = error > TERRAIN_NEAR_M ? k + 1u : settled;
        if (s->row[k].t_s >= TERRAIN_SCORED_FROM_S) {
            squares += error * error;
            worst = fmax(worst, error);
            particles += (double)e[k].particles;
            scored++;
        }
    }
    out->value[TERRAIN_RMSE] = sqrt(squares / (double)scored);
    out->value[TERRAIN_WORST] = worst;
    out->value[TERRAIN_CONVERGED] = worst <= TERRAIN_NEAR_M ? 1.0 : 0.0;
    out->value[TERRAIN_SETTLED_S] = s->row[settled < s->rows ? settled : s->rows - 1u].t_s;
    out->value[TERRAIN_PARTICLES] = particles / (double)scored;
    out->value[TERRAIN_RESAMPLED] = (double)out->cycle[s->rows - 2u].resampled / (double)(s->rows - 1u);
}

/* Row k of the flight is row k - 1 of the series: the first has no cycle before it. */
static void tell(const terrain_study_t *s, const terrain_estimate_t *e, run_output_t *out)
{
    for (size_t k = 1u; k < s->rows; k++) {
        const terrain_row_t *row = &s->row[k];
        const double series[COLUMNS] = {row->t_s, error_of(s, e, k), (double)e[k].sigma_m, (double)e[k].baro_m};
        const double trace[TRACE_COLUMNS] = {(double)e[k].east_m, (double)e[k].north_m, row->truth_east_m,
                                             row->truth_north_m, isnan(row->agl_m) ? MISSING : (double)row->agl_m};
        if (out->series != NULL) {
            memcpy(&out->series[(k - 1u) * COLUMNS], series, sizeof series);
        }
        if (out->trace != NULL) {
            memcpy(&out->trace[(k - 1u) * TRACE_COLUMNS], trace, sizeof trace);
        }
    }
}

static bool run_once(const plan_t *plan, uint32_t run, run_output_t *out, failure_t *failure)
{
    const terrain_study_t *s = plan->own;
    terrain_estimate_t *estimate = malloc(s->rows * sizeof *estimate);

    if (estimate == NULL) {
        return fail(failure, EXIT_HARNESS, "out of memory");
    }
    const bool done = terrain_fly(s, run, estimate, out, failure);
    if (done) {
        for (size_t k = 0u; k < s->rows; k++) {
            out->hash = hash_floats(out->hash, &estimate[k].north_m, 2u);
        }
        score(s, estimate, out);
        tell(s, estimate, out);
    }
    free(estimate);
    return done;
}

static const campaign_t campaign[] = {
    {"rb", 20u, {"flight=1"}, 500u},
    {"rb", 20u, {"flight=2"}, 500u},
    {"regularised", 20u, {"flight=1"}, 2000u},
    {"regularised", 20u, {"flight=2"}, 2000u},
    {"regularised", 20u, {"flight=1", "adapt=kld"}, 2000u},
    {"regularised", 20u, {"flight=2", "adapt=kld"}, 2000u},
    {"regularised", 20u, {"flight=1"}, 500u},
    {"regularised", 20u, {"flight=2"}, 500u},
    {"tempered", 20u, {"flight=1"}, 2000u},
    {"tempered", 20u, {"flight=2"}, 2000u},
    {"plain", 20u, {"flight=1"}, 5000u},
    {"plain", 20u, {"flight=2"}, 5000u},
};

const scenario_t terrain_scenario = {
    .name = "terrain",
    .summary = "navigation by the ground below: a radar altimeter over real hills, from a start error of a kilometre",
    .filters = "rb|regularised|tempered|plain",
    .particles = 500u,
    .runs = 20u,
    .settings = settings,
    .settings_count = sizeof settings / sizeof settings[0],
    .campaign = campaign,
    .campaign_count = sizeof campaign / sizeof campaign[0],
    .recordings = "heights: jacksboro_fault_dem of matplotlib's sample data; the flights were simulated over them",
    .open = open_study,
    .close = close_study,
    .run = run_once,
    .judge = terrain_judge,
};
