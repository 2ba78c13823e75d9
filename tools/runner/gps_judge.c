/* The figures of the scenario `gps` beside those of its page, and what is accepted. Acceptance holds for the settings
 * it was stated for, and from a hundred runs on. The document itself has a plot and no figure. */
#include "gps.h"

#include <math.h>

#define RUNS_FOR_ACCEPTANCE 100u
#define RUNS_FOR_RATIO_RAW 400u /* 0.43 is three standard errors above the mean then, and one and a half at 100 */

/* ---- Figures ------------------------------------------------------------------------------------------------------ */

/* Root of the mean of squares. */
static figure_t root_mean(table_t runs, size_t column)
{
    const figure_t square = stats_mean(runs, column);
    const double root = sqrt(square.mean);

    return (figure_t){root, root > 0.0 ? square.error / (2.0 * root) : MISSING};
}

static figure_t total(table_t runs, size_t column)
{
    return (figure_t){stats_mean(runs, column).mean * (double)runs.n, MISSING};
}

static metric_t *add_reference(metric_t *metric, gps_reference_t reference)
{
    metric->reference = reference.value;
    return metric;
}

static bool is_particle_filter(const gps_study_t *s)
{
    return s->filter == GPS_PF || s->filter == GPS_PF_COLOURED;
}

/* ---- Without sampling ------------------------------------------------------------------------------------------------ */

/* An exact figure must have the page's digits. */
static void add_exact(verdict_t *verdict, const char *name, double value, gps_reference_t reference)
{
    metric_t *metric = add_reference(verdict_add(verdict, name, (figure_t){value, MISSING}), reference);

    if (!isnan(reference.value)) {
        const double slack = 1.1 * reference.rounding; /* a figure that was rounded twice may be just beyond */
        metric_accept(metric, reference.value - slack, reference.value + slack);
    }
}

static void judge_expected(const gps_study_t *s, verdict_t *verdict)
{
    gps_expected_t expected;
    double deviation;

    if (!gps_expect(s, &expected)) {
        return;
    }
    add_exact(verdict, "rmse_expected_m", expected.rmse_m, gps_reference_expected(s));
    if (s->filter != GPS_RAW) {
        add_exact(verdict, "nees_expected", expected.nees, gps_reference_nees(s));
    }
    if (s->filter == GPS_KF && gps_is_standard(s) && !s->longrun && gps_document_deviation(&deviation)) {
        metric_accept(verdict_add(verdict, "gain_deviation", (figure_t){deviation, MISSING}), 0.0, 1e-7);
        text_add(&verdict->notes,
                 "gain_deviation: the largest of gain and covariance from the page's, k = 1 .. 100.\n");
    }
}

/* ---- The straight line ----------------------------------------------------------------------------------------------- */

static void judge_line_particles(const gps_study_t *s, table_t runs, verdict_t *verdict, metric_t *over_raw)
{
    const bool coloured = s->filter == GPS_PF_COLOURED;
    const bool stated = runs.n >= RUNS_FOR_ACCEPTANCE && s->particles == 1000u && s->kernel && !s->longrun;
    metric_t *ratio = verdict_add(verdict, "rmse_ratio_kf", stats_ratio(runs, GPS_RMSE, GPS_RMSE_KF));
    metric_t *distance = verdict_add(verdict, "rms_to_kf_m", root_mean(runs, GPS_TO_KF_2));

    (void)add_reference(distance, gps_reference_to_kf(s));
    ratio->reference = gps_is_standard(s) && s->kernel ? 1.0 : MISSING;
    if (stated && gps_is_standard(s)) {
        metric_accept(ratio, 0.97, 1.03);
        metric_accept(distance, 0.0, coloured ? 0.06 : 0.15);
        if (runs.n >= RUNS_FOR_RATIO_RAW) {
            metric_accept(over_raw, 0.0, 0.43);
        }
    }
    if (stated && s->white && !coloured && s->axes == 1 && gps_is_value(s->accuracy_m, 1.5)) {
        metric_accept(ratio, 0.99, 1.01);
    }
    if (gps_is_standard(s)) {
        text_add(&verdict->notes,
                 "The page's particle filters had 100 runs (+-0.02 m), in which their Kalman filter had "
                 "0.686 m with the document's model,\n0.609 m with R = 9 and 0.615 m with colour: compare "
                 "rmse_ratio_kf, which is on the same data.\n");
    }
}

static void judge_line(const gps_study_t *s, table_t runs, verdict_t *verdict, metric_t *over_raw)
{
    const figure_t nees = stats_mean(runs, GPS_NEES);

    if (isfinite(nees.mean)) {
        metric_t *metric = verdict_add(verdict, "nees", nees);
        if (!is_particle_filter(s)) {
            (void)add_reference(metric, gps_reference_nees(s));
        }
    } else {
        text_add(&verdict->notes,
                 "No nees: particles without a kernel step end up at one point, and state no error.\n");
    }
    if (gps_has_kf_partner(s)) {
        judge_line_particles(s, runs, verdict, over_raw);
    }
    if (gps_has_document_partner(s)) {
        metric_t *ratio = verdict_add(verdict, "rmse_ratio_document", stats_ratio(runs, GPS_RMSE, GPS_RMSE_DOCUMENT));
        if (gps_is_standard(s) && !s->longrun) {
            ratio->reference = s->filter == GPS_PF_COLOURED ? 0.613 / 0.686 : 0.6288 / 0.7128;
            if (runs.n >= RUNS_FOR_ACCEPTANCE &&
                (s->filter == GPS_KF_COLOURED || (s->particles == 1000u && s->kernel))) {
                metric_accept(ratio, 0.0, 0.93);
            }
        }
        text_add(&verdict->notes,
                 "rmse_ratio_document: over the same filter with the document's noise model, same data.\n");
    }
}

/* ---- Turns ----------------------------------------------------------------------------------------------------------- */

static void accept_curve(const gps_study_t *s, metric_t *rmse, metric_t *over_tuned, metric_t *lost)
{
    if (!gps_is_standard(s)) {
        return;
    }
    if (s->filter == GPS_KF && !s->longrun) {
        metric_accept(rmse, 10.0, (double)INFINITY);
    }
    if (s->filter == GPS_PF_COLOURED && s->particles == 1000u && !s->kernel && over_tuned != NULL) {
        metric_accept(rmse, 0.0, 1.16);
        metric_accept(over_tuned, 0.0, 0.95);
        metric_accept(lost, 0.0, 0.0);
    }
}

static void accept_radar(const gps_study_t *s, metric_t *rmse, metric_t *lost)
{
    const bool coarse = s->variant == GPS_RADAR_COARSE;

    if (s->filter == GPS_PF && !s->kernel && s->particles == (coarse ? 2000u : 1000u)) {
        metric_accept(rmse, 0.0, coarse ? 1.85 : 0.54);
        metric_accept(lost, 0.0, 0.0);
    }
}

static void judge_turns(const gps_study_t *s, table_t runs, verdict_t *verdict, metric_t *rmse, metric_t *lost)
{
    metric_t *over_tuned = NULL;

    if (gps_has_tuned_partner(s)) {
        verdict_add(verdict, "rmse_tuned_m", stats_mean(runs, GPS_RMSE_TUNED));
        over_tuned = verdict_add(verdict, "rmse_ratio_tuned", stats_ratio(runs, GPS_RMSE, GPS_RMSE_TUNED));
        verdict_add(verdict, "q_tuned", (figure_t){s->q_tuned, MISSING});
        text_add(&verdict->notes,
                 "tuned: a Kalman filter on the same data, the acceleration it believes in the best of a few on "
                 "30 runs that are not scored.\n");
    }
    if (s->filter == GPS_KF_TUNED || s->filter == GPS_KF_COLOURED) {
        const bool coloured = s->filter == GPS_KF_COLOURED;
        verdict_add(verdict, "q", (figure_t){coloured ? s->q_coloured : s->q_tuned, MISSING});
    }
    if (runs.n < RUNS_FOR_ACCEPTANCE) {
        return;
    }
    if (s->variant == GPS_CURVE) {
        accept_curve(s, rmse, over_tuned, lost);
    } else {
        accept_radar(s, rmse, lost);
    }
}

/* ---- All ----------------------------------------------------------------------------------------------------------- */

static void add_final(const gps_study_t *s, table_t runs, verdict_t *verdict)
{
    verdict_add(verdict, "final_position_m", root_mean(runs, GPS_FINAL_POSITION_2));
    if (s->filter != GPS_RAW) {
        verdict_add(verdict, "final_velocity_mps", root_mean(runs, GPS_FINAL_VELOCITY_2));
    }
}

void gps_judge(const plan_t *plan, table_t runs, verdict_t *verdict)
{
    const gps_study_t *s = plan->own;
    metric_t *rmse = add_reference(verdict_add(verdict, "rmse_m", stats_mean(runs, GPS_RMSE)), gps_reference_rmse(s));
    metric_t *lost = verdict_add(verdict, "lost_runs", total(runs, GPS_LOST));

    if (s->filter != GPS_RAW) {
        verdict_add(verdict, "rmse_raw_m", stats_mean(runs, GPS_RMSE_RAW));
        metric_t *over_raw = verdict_add(verdict, "rmse_ratio_raw", stats_ratio(runs, GPS_RMSE, GPS_RMSE_RAW));
        verdict_add(verdict, "beats_raw_runs", total(runs, GPS_BEATS_RAW));
        if (s->variant == GPS_LINE) {
            judge_line(s, runs, verdict, over_raw);
        }
    }
    if (s->variant != GPS_LINE) {
        judge_turns(s, runs, verdict, rmse, lost);
    }
    add_final(s, runs, verdict);
    judge_expected(s, verdict);
    if (is_particle_filter(s)) {
        verdict_add(verdict, "resampled_share", stats_mean(runs, GPS_RESAMPLED));
    }
}
