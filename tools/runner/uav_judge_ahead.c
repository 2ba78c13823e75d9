/* The UAV's forecasts beside the figures of the scenario page, and what is accepted: known wind, unknown wind, replay. */
#include "uav_judge.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define NAME_ROOM 32

/* Names made of a quantity and an instant must outlive the verdict; there are few, so they are written out. */
static const char *name_at(const char *quantity, unsigned second, const char *unit)
{
    static const char *const names[] = {
        "error_0s_m",      "error_10s_m",     "error_15s_m",     "error_20s_m",     "error_30s_m",
        "error_45s_m",     "error_60s_m",     "cloud_std_0s_m",  "cloud_std_10s_m", "cloud_std_15s_m",
        "cloud_std_20s_m", "cloud_std_30s_m", "cloud_std_45s_m", "cloud_std_60s_m", "coverage_0s",
        "coverage_10s",    "coverage_15s",    "coverage_20s",    "coverage_30s",    "coverage_45s",
        "coverage_60s",    "gain_0s",         "gain_10s",        "gain_20s",        "gain_30s",
        "gain_45s",        "gain_60s",
    };
    char wanted[NAME_ROOM];

    (void)snprintf(wanted, sizeof wanted, "%s_%us%s", quantity, second, unit);
    for (size_t i = 0u; i < sizeof names / sizeof names[0]; i++) {
        if (strcmp(names[i], wanted) == 0) {
            return names[i];
        }
    }
    return quantity;
}

/* ---- What forecasts share ------------------------------------------------------------------------------------ */

/* The page's error, cloud std and coverage at a horizon. */
typedef struct {
    double error, cloud, coverage;
} ahead_t;

static size_t of_horizon(unsigned h, size_t of)
{
    return UAV_HORIZON + h * UAV_OF_HORIZON + of;
}

/* Metrics of one horizon, named after `second`. */
typedef struct {
    metric_t *error, *cloud, *coverage;
} horizon_metrics_t;

static horizon_metrics_t add_horizon(table_t runs, unsigned h, unsigned second, const char *coverage,
                                     const ahead_t *page, verdict_t *verdict)
{
    const horizon_metrics_t m = {
        verdict_add(verdict, name_at("error", second, "_m"),
                    stats_root(stats_mean(runs, of_horizon(h, UAV_OF_SQUARE)))),
        verdict_add(verdict, name_at("cloud_std", second, "_m"), stats_mean(runs, of_horizon(h, UAV_OF_CLOUD))),
        verdict_add(verdict, coverage, stats_mean(runs, of_horizon(h, UAV_OF_COVERED))),
    };

    if (page != NULL) {
        m.error->reference = page->error;
        m.cloud->reference = page->cloud;
        m.coverage->reference = page->coverage;
    }
    return m;
}

/* How many times smaller the error is than that of the twin that ignores the wind. */
static metric_t *add_gain(table_t runs, unsigned h, unsigned second, verdict_t *verdict)
{
    const figure_t square = stats_ratio(runs, of_horizon(h, UAV_OF_IGNORED_SQUARE), of_horizon(h, UAV_OF_SQUARE));

    return verdict_add(verdict, name_at("gain", second, ""), stats_root(square));
}

static void add_reach(const uav_study_t *s, table_t runs, verdict_t *verdict)
{
    if (!s->ekf) {
        verdict_add(verdict, "reach_m", stats_mean(runs, UAV_REACH));
    }
}

/* ---- Forecast and unknown wind -------------------------------------------------------------------------------------- */

static const ahead_t *forecast_page(const uav_study_t *s, unsigned second)
{
    static const ahead_t filter[] = {{0.72, 0.514, 0.948}, {1.52, 1.094, 0.948}, {2.05, 1.461, 0.968}};
    static const ahead_t kalman[] = {{0.728, 0.515, 0.95}, {1.551, 1.097, 0.95}, {2.069, 1.463, 0.95}};
    static const ahead_t simulation[] = {{3.90, 2.69, 0.943}, {4.14, 2.86, 0.938}, {4.35, 3.02, 0.935}};
    const unsigned i = second / 15u - 2u;

    if (s->set.name != 'S' || s->wind_model != UAV_WIND_KNOWN || s->particles != 1000u) {
        return NULL;
    }
    if (s->filter_seconds == 0u) {
        return &simulation[i];
    }
    if (s->ekf) {
        return s->filter_seconds == 30u && s->fixes ? &kalman[i] : NULL;
    }
    return s->as_page ? &filter[i] : NULL;
}

static void judge_forecast(const uav_study_t *s, table_t runs, verdict_t *verdict)
{
    for (unsigned h = 0u; h < s->horizons; h++) {
        const unsigned second = s->filter_seconds + s->horizon_s[h];
        const bool last = second == 60u;
        const horizon_metrics_t m = add_horizon(runs, h, second, last ? "coverage" : name_at("coverage", second, ""),
                                                forecast_page(s, second), verdict);
        if (last && s->as_page && !s->ekf && s->particles == 1000u && runs.n >= 200u) {
            metric_accept(m.error, 0.0, 2.25);
            metric_accept(m.cloud, 1.43, 1.49);
            metric_accept(m.coverage, 0.92, 0.98);
        }
    }
    add_reach(s, runs, verdict);
}

/* A row of the page's table for the unknown wind; figures that it does not give are negative. */
typedef struct {
    bool ekf, kernel, drawn;
    uav_wind_model_t model;
    uint32_t particles;
    double wind_error;
    ahead_t at_60s;
} unknown_wind_t;

static const unknown_wind_t unknown_winds[] = {
    {false, false, false, UAV_WIND_IGNORED, 1000u, -1.0, {32.3, 2.80, 0.00}},
    {false, false, false, UAV_WIND_KNOWN, 1000u, -1.0, {4.13, 2.81, 0.93}},
    {false, false, false, UAV_WIND_IN_STATE, 1000u, 0.455, {15.5, 4.44, 0.59}},
    {false, true, false, UAV_WIND_IN_STATE, 500u, 0.176, {6.42, 4.80, 0.95}},
    {false, true, false, UAV_WIND_IN_STATE, 1000u, 0.157, {6.11, 4.89, 0.97}},
    {false, true, false, UAV_WIND_IN_STATE, 2000u, 0.141, {6.01, 4.96, 0.99}},
    /* The page's 0.162 and 7.04 are what this filter believes; the truth's wind does not walk, so its errors are less. */
    {true, true, false, UAV_WIND_IN_STATE, 1000u, -1.0, {-1.0, 4.97, -1.0}},
    {false, false, true, UAV_WIND_IN_STATE, 1000u, -1.0, {24.4, -1.0, -1.0}},
    {false, true, true, UAV_WIND_IN_STATE, 1000u, -1.0, {9.6, -1.0, -1.0}},
    {false, true, true, UAV_WIND_IN_STATE, 2000u, -1.0, {6.0, -1.0, -1.0}},
    {false, false, true, UAV_WIND_IGNORED, 1000u, -1.0, {131.0, -1.0, -1.0}},
};

static const unknown_wind_t *unknown_wind_page(const uav_study_t *s)
{
    const bool page_scheme = s->kernel ? s->scheme == pfl_systematic && uav_is_value(s->resample_below, 0.5)
                                       : s->scheme == pfl_multinomial && uav_is_value(s->resample_below, 0.25);

    for (size_t i = 0u; i < sizeof unknown_winds / sizeof unknown_winds[0]; i++) {
        const unknown_wind_t *row = &unknown_winds[i];
        /* Nothing is inferred where the wind is no state: the kernel is then of no consequence. */
        const bool same_kernel = row->kernel == s->kernel || row->model != UAV_WIND_IN_STATE;
        if (row->ekf == s->ekf && same_kernel && row->drawn == s->wind_drawn && row->model == s->wind_model &&
            row->particles == s->particles && page_scheme && s->set.name == 'G' && s->fixes &&
            s->filter_seconds == 30u) {
            return row;
        }
    }
    return NULL;
}

static double known(double figure)
{
    return figure < 0.0 ? MISSING : figure;
}

static void accept_unknown_wind(const uav_study_t *s, table_t runs, metric_t *wind, const horizon_metrics_t *m)
{
    if (!s->as_page || s->ekf || runs.n < 100u) {
        return;
    }
    if (!s->wind_drawn && s->particles == 1000u) {
        metric_accept(wind, 0.0, 0.20);
        metric_accept(m->error, 0.0, 7.0);
        metric_accept(m->coverage, 0.92, 1.0);
    } else if (s->wind_drawn && s->particles == 2000u) {
        metric_accept(m->error, 0.0, 7.0);
    }
}

static void judge_unknown_wind(const uav_study_t *s, table_t runs, verdict_t *verdict)
{
    const unknown_wind_t *page = unknown_wind_page(s);
    metric_t *wind = verdict_add(verdict, s->filter_seconds == 30u ? "wind_error_30s_mps" : "wind_error_mps",
                                 stats_root(stats_mean(runs, UAV_WIND_SQUARE)));

    if (page != NULL) {
        wind->reference = known(page->wind_error);
    }
    for (unsigned h = 0u; h < s->horizons; h++) {
        const unsigned second = s->filter_seconds + s->horizon_s[h];
        const bool last = second == 60u;
        const horizon_metrics_t m =
            add_horizon(runs, h, second, last ? "coverage" : name_at("coverage", second, ""), NULL, verdict);
        if (last && page != NULL) {
            m.error->reference = known(page->at_60s.error);
            m.cloud->reference = known(page->at_60s.cloud);
            m.coverage->reference = known(page->at_60s.coverage);
        }
        if (last) {
            accept_unknown_wind(s, runs, wind, &m);
        }
        if (last && s->wind_model == UAV_WIND_IN_STATE && !s->ekf) {
            add_gain(runs, h, second, verdict);
        }
    }
    add_reach(s, runs, verdict);
    if (s->wind_model == UAV_WIND_IN_STATE && !s->ekf) {
        text_add(
            &verdict->notes,
            "gain: error of a filter that ignores the wind over that of this one, on the same data. A run in some "
            "hundreds starts\nwithout a particle near the truth and never finds the wind: it then carries the mean "
            "square alone.\n");
    }
}

/* ---- Replay --------------------------------------------------------------------------------------------------------- */

static void judge_replay_horizon(const uav_study_t *s, table_t runs, unsigned h, verdict_t *verdict)
{
    static const ahead_t inferred[] = {{1.00, 0.73, 0.96}, {6.9, 4.7, 0.93}, {12.5, 9.3, 0.96}, {17.7, 13.9, 0.98}};
    static const ahead_t ignored[] = {{27.8, 0.21, 0.17}, {43.7, 1.4, 0.02}, {54.2, 1.8, 0.01}, {57.7, 2.2, 0.00}};
    static const double bound[] = {0.0, 7.6, 13.8, 19.5};
    const bool of_page = s->set.name == 'G' && s->fixes && s->particles == 1000u && !s->wind_drawn &&
                         uav_is_value(s->wind[0], -2.0) && uav_is_value(s->wind[1], 3.0) && !s->ekf;
    const bool state = s->wind_model == UAV_WIND_IN_STATE;
    const ahead_t *page = state ? &inferred[h] : &ignored[h];
    const unsigned second = s->horizon_s[h];
    const horizon_metrics_t m = add_horizon(runs, h, second, name_at("coverage", second, ""),
                                            of_page && s->wind_model != UAV_WIND_KNOWN ? page : NULL, verdict);
    metric_t *gain = state && !s->ekf ? add_gain(runs, h, second, verdict) : NULL;

    if (gain != NULL && of_page) {
        gain->reference = ignored[h].error / inferred[h].error;
    }
    /* The kernel is an alternative that the page puts level with the plain filter. */
    if (h > 0u && of_page && state && runs.n >= 60u && s->resampling && !s->distance &&
        (s->as_page || (s->kernel && uav_is_value(s->resample_below, 0.5)))) {
        metric_accept(m.error, 0.0, bound[h]);
        metric_accept(m.coverage, 0.90, 0.99);
        metric_accept(gain, 3.0, (double)INFINITY);
    }
}

/* Coverage over the horizons of 10, 20 and 30 s together. */
static figure_t pooled_coverage(table_t runs)
{
    double sum = 0.0, squares = 0.0;
    const double n = (double)runs.n;

    for (size_t r = 0u; r < runs.n; r++) {
        double share = 0.0;
        for (unsigned h = 1u; h < UAV_HORIZONS_MAX; h++) {
            share += runs.table[r * runs.width + of_horizon(h, UAV_OF_COVERED)] / (double)(UAV_HORIZONS_MAX - 1);
        }
        sum += share;
        squares += share * share;
    }
    const double variance = fmax(0.0, (squares - sum * sum / n) / (n - 1.0));
    return (figure_t){sum / n, runs.n > 1u ? sqrt(variance / n) : MISSING};
}

static void judge_replay(const uav_study_t *s, table_t runs, verdict_t *verdict)
{
    for (unsigned h = 0u; h < s->horizons; h++) {
        judge_replay_horizon(s, runs, h, verdict);
    }
    verdict_add(verdict, "coverage", pooled_coverage(runs));
    verdict_add(verdict, "wind_error_mps", stats_root(stats_mean(runs, UAV_WIND_SQUARE)));
    add_reach(s, runs, verdict);
    text_add(&verdict->notes,
             "A stand-in for the paper's flight log, which is not public. The wind's error is against its mean; the "
             "gust itself is 0.99 m/s.\n");
    if (s->wind_model == UAV_WIND_IN_STATE && !s->ekf) {
        text_add(&verdict->notes, "gain: error of a filter that ignores the wind over that of this one, on the same "
                                  "data.\n");
    }
}

void uav_judge_forecasts(const uav_study_t *s, table_t runs, verdict_t *verdict)
{
    if (s->sim == UAV_FORECAST) {
        judge_forecast(s, runs, verdict);
    } else if (s->sim == UAV_WIND) {
        judge_unknown_wind(s, runs, verdict);
    } else {
        judge_replay(s, runs, verdict);
    }
}
