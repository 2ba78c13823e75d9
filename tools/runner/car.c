/* The scenario `car`: a recorded drive between tall buildings, by pseudoranges of which a third are reflections. */
#include "car.h"

#include "hash.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define ACCEPTED_PARTICLES 1000u

enum { RMSE, P95, MAX, AT_END, VALUES };

static const char *const columns[] = {"measured_t_s", "x_m", "y_m", "truth_x_m", "truth_y_m", "error_m"};
enum { COLUMNS = sizeof columns / sizeof columns[0] };

static bool open_study(const study_t *study, plan_t *plan, failure_t *failure)
{
    car_study_t *s = calloc(1u, sizeof *s);

    if (s == NULL) {
        return fail(failure, EXIT_HARNESS, "out of memory");
    }
    s->filter = strcmp(study->filter, "mixture") == 0    ? CAR_MIXTURE
                : strcmp(study->filter, "gaussian") == 0 ? CAR_GAUSSIAN
                                                         : CAR_ODOMETRY;
    s->particles = study->particles;
    s->seed = study->seed;
    if (!car_load(s, study->data, failure)) {
        free(s);
        return false;
    }
    *plan = (plan_t){
        .own = s,
        .values = VALUES,
        .cycles = s->epochs,
        .steps = s->epochs,
        .columns = COLUMNS,
        .column = columns,
        .budget_us = 4000.0,
        .budget_reason = "5 epochs a second, 2 % of the time between them",
    };
    return true;
}

static void close_study(plan_t *plan)
{
    car_study_t *s = plan->own;

    free(s->epoch);
    free(s);
}

/* Horizontally, one error an epoch, from the first on. */
static void score(const car_study_t *s, const float *estimate, double *error, run_output_t *out)
{
    double squares = 0.0;

    for (size_t i = 0u; i < s->epochs; i++) {
        const car_epoch_t *epoch = &s->epoch[i];
        const double x = (double)estimate[2u * i];
        const double y = (double)estimate[2u * i + 1u];
        error[i] = hypot(x - epoch->truth_x_m, y - epoch->truth_y_m);
        squares += error[i] * error[i];
        if (out->series != NULL) {
            const double row[COLUMNS] = {epoch->t_s, x, y, epoch->truth_x_m, epoch->truth_y_m, error[i]};
            memcpy(&out->series[i * COLUMNS], row, sizeof row);
        }
    }
    out->value[AT_END] = error[s->epochs - 1u];
    stats_sort(error, s->epochs);
    out->value[RMSE] = sqrt(squares / (double)s->epochs);
    out->value[P95] = error[(size_t)(0.95 * (double)(s->epochs - 1u))];
    out->value[MAX] = error[s->epochs - 1u];
}

static bool run_once(const plan_t *plan, uint32_t run, run_output_t *out, failure_t *failure)
{
    const car_study_t *s = plan->own;
    float *estimate = malloc(2u * s->epochs * sizeof *estimate);
    double *error = malloc(s->epochs * sizeof *error);
    bool done = estimate != NULL && error != NULL;

    if (!done) {
        (void)fail(failure, EXIT_HARNESS, "out of memory");
    }
    done = done && car_filter(s, run, estimate, out, failure);
    if (done) {
        score(s, estimate, error, out);
        out->hash = hash_floats(out->hash, estimate, 2u * s->epochs);
    }
    free(error);
    free(estimate);
    return done;
}

static void judge(const plan_t *plan, table_t runs, verdict_t *verdict)
{
    const car_study_t *s = plan->own;
    metric_t *rmse = verdict_add_typical(verdict, "rmse_m", runs, RMSE);
    metric_t *p95 = verdict_add_typical(verdict, "p95_m", runs, P95);

    verdict_add_typical(verdict, "max_m", runs, MAX);
    verdict_add_typical(verdict, "end_m", runs, AT_END);
    verdict_add(verdict, "rmse_worst_m", stats_largest(runs, RMSE));
    if (s->filter == CAR_MIXTURE && s->particles >= ACCEPTED_PARTICLES) {
        metric_accept(rmse, 0.0, 12.0);
        metric_accept(p95, 0.0, 25.0);
    }
    text_add(&verdict->notes,
             "Medians over the runs; one error an epoch, from the first on. Plain least-squares fixes: "
             "%.1f m RMS. The filters begin at the first of them.\n",
             s->fix_rmse_m);
}

static const campaign_t campaign[] = {
    {"mixture", 20u, {NULL}, 0u},
    {"gaussian", 20u, {NULL}, 0u},
    {"odometry", 1u, {NULL}, 0u},
};

const scenario_t car_scenario = {
    .name = "car",
    .summary = "recorded drive in a street canyon: pseudoranges with reflections, two clocks, odometry",
    .filters = "mixture|gaussian|odometry",
    .particles = 1000u,
    .runs = 20u,
    .campaign = campaign,
    .campaign_count = sizeof campaign / sizeof campaign[0],
    .recordings = "Berlin_Potsdamer_Platz of the smartLoc set in github.com/TUC-ProAut/libRSF",
    .open = open_study,
    .close = close_study,
    .run = run_once,
    .judge = judge,
};
