/* The UAV's figures beside those of the paper and of its scenario page, and what is accepted: Table 1 and the clouds.
 * The page states figures for certain settings only: elsewhere there is neither a deviation nor a verdict. */
#include "uav_judge.h"

#include <math.h>

/* ---- Small things ------------------------------------------------------------------------------------------------ */

bool uav_is_value(double x, double value)
{
    return fabs(x - value) < 1e-9;
}

/* ---- Table 1 and the clouds: line, circle, winds ------------------------------------------------------------------- */

/* The paper's Table 1, in the order of uav_table_wind. */
static const double paper_mean[UAV_WINDS] = {1.3121, 1.2153, 1.3475, 1.3737};
static const double paper_max[UAV_WINDS] = {13.3903, 11.0736, 10.3345, 9.5199};
static const double paper_std[UAV_WINDS] = {0.8614, 0.8732, 0.9082, 0.8502};
static const double paper_average[UAV_OF_WIND] = {1.312, 11.08, 0.873};

/* The page's mean, maximum and std for what may be varied; known wind, and no kernel. */
typedef struct {
    char set;
    uint32_t particles;
    pfl_scheme_fn scheme;
    double resample_below; /* 0: never */
    bool distance;
    double figure[UAV_OF_WIND];
} reference_t;

static const reference_t references[] = {
    {'S', 1000u, pfl_multinomial, 0.25, false, {1.326, 10.80, 0.871}},
    {'G', 1000u, pfl_multinomial, 0.25, false, {1.296, 11.90, 0.862}},
    {'S', 1000u, pfl_multinomial, 0.0, false, {4.5, 14.2, 2.66}},
    {'S', 100u, pfl_multinomial, 0.25, false, {1.33, 9.2, 0.86}},
    {'S', 200u, pfl_multinomial, 0.25, false, {1.33, 9.7, 0.87}},
    {'S', 500u, pfl_multinomial, 0.25, false, {1.33, 10.4, 0.87}},
    {'S', 2000u, pfl_multinomial, 0.25, false, {1.33, 11.0, 0.87}},
    {'S', 1000u, pfl_multinomial, 0.5, false, {1.22, 10.4, 0.79}},
    {'S', 1000u, pfl_multinomial, 1.0, false, {1.15, 10.9, 0.73}},
    {'S', 1000u, pfl_systematic, 0.25, false, {1.33, 10.9, 0.87}},
    {'S', 1000u, pfl_multinomial, 0.25, true, {1.87, 11.6, 1.31}},
};

static const double *table_reference(const uav_study_t *s)
{
    for (size_t i = 0u; i < sizeof references / sizeof references[0]; i++) {
        const reference_t *r = &references[i];
        if (r->set == s->set.name && r->particles == s->particles && r->scheme == s->scheme &&
            uav_is_value(r->resample_below, s->resampling ? s->resample_below : 0.0) && r->distance == s->distance &&
            s->wind_model == UAV_WIND_KNOWN && !s->kernel && s->fixes) {
            return r->figure;
        }
    }
    return NULL;
}

/* F of a one-way analysis of variance between the four winds. */
static figure_t variance_ratio(table_t runs, size_t of)
{
    const double n = (double)runs.n;
    double mean[UAV_WINDS];
    double all = 0.0, within = 0.0, between = 0.0;

    for (size_t w = 0u; w < UAV_WINDS; w++) {
        mean[w] = stats_mean(runs, UAV_BY_WIND + w * UAV_OF_WIND + of).mean;
        all += mean[w] / (double)UAV_WINDS;
    }
    for (size_t w = 0u; w < UAV_WINDS; w++) {
        between += n * (mean[w] - all) * (mean[w] - all) / (double)(UAV_WINDS - 1);
        for (size_t r = 0u; r < runs.n; r++) {
            const double off = runs.table[r * runs.width + UAV_BY_WIND + w * UAV_OF_WIND + of] - mean[w];
            within += off * off / ((double)UAV_WINDS * (n - 1.0));
        }
    }
    return (figure_t){between / within, MISSING};
}

/* Enough flights to judge the averages by: the maximum scatters by 1.7 m. */
static bool has_enough_flights(const uav_study_t *s, table_t runs)
{
    return s->as_page && s->particles == 1000u && runs.n * (s->sim == UAV_WINDS_TABLE ? UAV_WINDS : 1u) >= 200u;
}

static void judge_clouds(const uav_study_t *s, table_t runs, verdict_t *verdict)
{
    static const char *const name[UAV_OF_WIND] = {"mean_m", "max_m", "std_m"};
    static const size_t column[UAV_OF_WIND] = {UAV_MEAN, UAV_MAX, UAV_STD};
    static const double lo[UAV_OF_WIND] = {1.28, 10.3, 0.855};
    static const double hi[UAV_OF_WIND] = {1.37, 11.3, 0.890};
    const double *reference = table_reference(s);

    for (size_t i = 0u; i < UAV_OF_WIND; i++) {
        metric_t *metric = verdict_add(verdict, name[i], stats_mean(runs, column[i]));
        if (s->resampling) {
            metric->paper = paper_average[i];
        }
        metric->reference = reference != NULL ? reference[i] : MISSING;
        if (has_enough_flights(s, runs)) {
            metric_accept(metric, lo[i], hi[i]);
        }
    }
}

static void judge_by_wind(const uav_study_t *s, table_t runs, verdict_t *verdict)
{
    /* The page's figures for 200 runs a wind. */
    static const double page[UAV_WINDS][UAV_OF_WIND] = {
        {1.327, 10.87, 0.871}, {1.320, 10.74, 0.868}, {1.332, 10.86, 0.872}, {1.326, 10.73, 0.873}};
    static const char *const name[UAV_WINDS][UAV_OF_WIND] = {{"mean_north_m", "max_north_m", "std_north_m"},
                                                             {"mean_east_m", "max_east_m", "std_east_m"},
                                                             {"mean_west_m", "max_west_m", "std_west_m"},
                                                             {"mean_south_m", "max_south_m", "std_south_m"}};
    static const char *const f_name[UAV_OF_WIND] = {"f_mean", "f_max", "f_std"};
    const double *paper[UAV_OF_WIND] = {paper_mean, paper_max, paper_std};

    for (size_t i = 0u; i < UAV_OF_WIND; i++) {
        for (size_t w = 0u; w < UAV_WINDS; w++) {
            metric_t *metric = verdict_add(verdict, name[w][i], stats_mean(runs, UAV_BY_WIND + w * UAV_OF_WIND + i));
            metric->paper = paper[i][w];
            metric->reference = s->as_page && s->particles == 1000u ? page[w][i] : MISSING;
        }
    }
    for (size_t i = 0u; i < UAV_OF_WIND && runs.n > 1u; i++) {
        metric_t *f = verdict_add(verdict, f_name[i], variance_ratio(runs, i));
        if (has_enough_flights(s, runs)) {
            metric_accept(f, 0.0, 3.8);
        }
    }
    text_add(&verdict->notes,
             "The wind blows north [0,1], east [1,0], west [-1,0], south [0,-1]. Under a law of time alone the error "
             "does not depend on it:\nF between the winds is that of chance, and so is the spread of the paper's four "
             "columns.\n");
}

static void judge_estimate(const uav_study_t *s, table_t runs, verdict_t *verdict)
{
    metric_t *rms = verdict_add(verdict, "estimate_rms_m", stats_root(stats_mean(runs, UAV_SQUARE)));

    if (s->set.name == 'S' && s->fixes && s->wind_model == UAV_WIND_KNOWN && (s->as_page || s->ekf)) {
        rms->reference = s->ekf ? 0.60 : 0.58;
        if (has_enough_flights(s, runs) || (s->as_page && s->particles == 1000u && runs.n >= 50u)) {
            metric_accept(rms, 0.0, 0.65);
        }
    }
}

/* The spread at 60 s, and how much resampling takes off it. */
static void judge_spread(const uav_study_t *s, table_t runs, verdict_t *verdict)
{
    const bool sparse = s->set.name == 'S' && s->particles == 1000u && s->wind_model == UAV_WIND_KNOWN && !s->ekf;
    metric_t *cloud = verdict_add(verdict, "cloud_std_60s_m", stats_mean(runs, UAV_CLOUD_60S));

    if (sparse && !s->resampling) {
        cloud->reference = 3.02;
        text_add(&verdict->notes, "Closed form, line, no resampling, 60 s: 3.03 m along and across.\n");
    } else if (sparse && s->as_page) {
        cloud->reference = 0.69;
    }
    if (s->resampling && !s->ekf) {
        metric_t *without =
            verdict_add(verdict, "cloud_std_60s_unresampled_m", stats_mean(runs, UAV_CLOUD_60S_UNRESAMPLED));
        metric_t *ratio =
            verdict_add(verdict, "cloud_ratio_60s", stats_ratio(runs, UAV_CLOUD_60S_UNRESAMPLED, UAV_CLOUD_60S));
        without->reference = sparse ? 3.02 : MISSING;
        ratio->reference = sparse && s->as_page ? 3.02 / 0.69 : MISSING;
        if (sparse && s->as_page && runs.n >= 50u) {
            metric_accept(ratio, 3.5, (double)INFINITY);
        }
    }
}

static void judge_flight(const uav_study_t *s, table_t runs, verdict_t *verdict)
{
    if (!s->ekf) {
        judge_clouds(s, runs, verdict);
    }
    judge_estimate(s, runs, verdict);
    judge_spread(s, runs, verdict);
    if (!s->ekf) {
        metric_t *resampled = verdict_add(verdict, "resamplings", stats_mean(runs, UAV_RESAMPLED));
        if (s->as_page && s->particles == 1000u) {
            resampled->reference = 5.5;
        }
    }
    if (s->sim == UAV_WINDS_TABLE && !s->ekf) {
        judge_by_wind(s, runs, verdict);
    }
}

void uav_judge(const plan_t *plan, table_t runs, verdict_t *verdict)
{
    const uav_study_t *s = plan->own;

    if (s->forecasts > 0u) {
        uav_judge_forecasts(s, runs, verdict);
    } else {
        judge_flight(s, runs, verdict);
    }
}
