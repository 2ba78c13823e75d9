/* Settings of the scenario `uav-trajectory`: "auto" is what its page states for the chosen simulation. */
#include "uav_settings.h"

#include <stdlib.h>
#include <string.h>

const setting_t uav_settings[UAV_SETTINGS] = {
    {"sim", "line|circle|winds|forecast|wind|replay", 0.0, 0.0, "winds",
     "simulation 1, 2, the four winds of Table 1, forecast, unknown wind, waypoint replay"},
    {"resampling", "on|off", 0.0, 0.0, "on", "pf: off: never resamples"},
    {"wind", "auto|prior|#,#", -30.0, 30.0, "auto", "the truth's mean wind in m/s; prior: drawn for each run"},
    {"set", "auto|S|G", 0.0, 0.0, "auto", "noise: S sparse fixes, G a fix a second"},
    {"filter_wind", "auto|known|ignored|state", 0.0, 0.0, "auto", "what the filter makes of the wind"},
    {"kernel", "auto|on|off", 0.0, 0.0, "auto", "pf: kernel step of width 0.5 after resampling"},
    {"scheme", "auto|systematic|stratified|residual|multinomial", 0.0, 0.0, "auto", "pf: the resampling scheme"},
    {"nlim", "auto|#", 0.0, 1.0, "auto", "pf: resample when the effective sample size < nlim N"},
    {"proposal", "prior|optimal", 0.0, 0.0, "prior", "pf: optimal: particles move to where the fix says"},
    {"weighting", "gauss|distance", 0.0, 0.0, "gauss", "pf: distance: by the inverse squared distance"},
    {"fixes", "on|off", 0.0, 0.0, "on", "off: the filter gets none"},
    {"kc", "auto|#", 0.0, 59.0, "auto", "forecast, wind: the whole second at which the forecast begins"},
};

static const uav_set_t set_s = {'S', 0.25, 0.7, 5u, {1.2, 1.2, 1.0, 1.0, 0.1, 0.2}};
static const uav_set_t set_g = {'G', 0.5, 1.0, 1u, {2.5, 2.5, 1.0, 1.0, 0.1, 0.2}};

static bool near(double a, double b)
{
    return a - b < 1e-9 && b - a < 1e-9;
}

/* ---- What the page states ---------------------------------------------------------------------------------------- */

static void set_horizons(uav_study_t *s, const unsigned *horizon_s, unsigned count)
{
    s->horizons = count;
    memcpy(s->horizon_s, horizon_s, count * sizeof *horizon_s);
    s->ahead_s = horizon_s[count - 1u];
}

static void set_page_times(uav_study_t *s)
{
    static const unsigned after_30[] = {0u, 15u, 30u};
    static const unsigned by_tens[] = {0u, 10u, 20u, 30u};

    s->seconds = s->sim == UAV_CIRCLE || s->sim == UAV_WINDS_TABLE ? 63u : 60u;
    s->filter_seconds = s->seconds;
    if (s->sim == UAV_FORECAST || s->sim == UAV_WIND) {
        s->filter_seconds = 30u;
        s->forecasts = 1u;
        s->forecast_at[0] = 30u;
        set_horizons(s, after_30, 3u);
    } else if (s->sim == UAV_REPLAY) {
        s->seconds = 120u;
        s->filter_seconds = 90u;
        s->forecasts = 8u;
        for (unsigned j = 0u; j < s->forecasts; j++) {
            s->forecast_at[j] = 20u + 10u * j;
        }
        set_horizons(s, by_tens, 4u);
    }
}

static void set_page(uav_study_t *s)
{
    static const double wind[][2] = {{1.0, 1.0}, {0.0, 1.0}, {0.0, 1.0}, {0.0, 1.0}, {0.0, 1.0}, {-2.0, 3.0}};
    const bool unknown_wind = s->sim == UAV_WIND || s->sim == UAV_REPLAY;

    set_page_times(s);
    memcpy(s->wind, wind[s->sim], sizeof s->wind);
    s->set = unknown_wind ? set_g : set_s;
    s->wind_model = unknown_wind ? UAV_WIND_IN_STATE : UAV_WIND_KNOWN;
    s->wind_sigma_mps = s->sim == UAV_REPLAY ? 3.0 : 2.0;
    s->wind_walk = s->sim == UAV_REPLAY ? 0.2 : 0.02;
    s->kernel = s->sim == UAV_WIND;
    s->resampling = true;
    s->fixes = true;
}

/* The kernel comes with a scheme and a threshold of its own. */
static void set_page_resampling(uav_study_t *s)
{
    s->scheme = s->kernel ? pfl_systematic : pfl_multinomial;
    s->resample_below = s->kernel ? 0.5 : 0.25;
}

/* ---- What the command line changes -------------------------------------------------------------------------------- */

static void read_wind(const study_t *study, uav_study_t *s)
{
    const char *value = study_value(study, "wind");
    char *rest;

    s->wind_drawn = strcmp(value, "prior") == 0;
    if (!s->wind_drawn && strcmp(value, "auto") != 0) {
        s->wind[0] = strtod(value, &rest);
        s->wind[1] = strtod(rest + 1, NULL);
    }
}

static void read_filter(const study_t *study, uav_study_t *s)
{
    static const pfl_scheme_fn schemes[] = {pfl_systematic, pfl_stratified, pfl_residual, pfl_multinomial};

    s->ekf = strcmp(study->filter, "ekf") == 0;
    if (!study_is(study, "filter_wind", "auto")) {
        s->wind_model = (uav_wind_model_t)(study_choice(study, "filter_wind") - 1u);
    }
    if (!study_is(study, "kernel", "auto")) {
        s->kernel = study_is(study, "kernel", "on");
    }
    set_page_resampling(s);
    if (!study_is(study, "scheme", "auto")) {
        s->scheme = schemes[study_choice(study, "scheme") - 1u];
    }
    if (!study_is(study, "nlim", "auto")) {
        s->resample_below = study_number(study, "nlim");
    }
    s->resampling = study_is(study, "resampling", "on");
    s->optimal = study_is(study, "proposal", "optimal");
    s->distance = study_is(study, "weighting", "distance");
    s->fixes = study_is(study, "fixes", "on");
}

static bool read_kc(const study_t *study, uav_study_t *s, failure_t *failure)
{
    const double kc = study_number(study, "kc");

    if (study_is(study, "kc", "auto")) {
        return true;
    }
    if (s->sim != UAV_FORECAST && s->sim != UAV_WIND) {
        return fail(failure, EXIT_USAGE, "--set kc: only with sim=forecast or sim=wind");
    }
    s->forecast_at[0] = (unsigned)kc;
    if (!near((double)s->forecast_at[0], kc)) {
        return fail(failure, EXIT_USAGE, "--set kc='%s': give a whole number of seconds", study_value(study, "kc"));
    }
    s->filter_seconds = s->forecast_at[0];
    s->ahead_s = s->seconds - s->filter_seconds;
    /* Scored at 30, 45 and 60 s of the flight as long as they lie ahead. */
    s->horizons = 0u;
    for (unsigned at = 30u; at <= 60u; at += 15u) {
        if (at >= s->filter_seconds) {
            s->horizon_s[s->horizons++] = at - s->filter_seconds;
        }
    }
    return true;
}

static bool is_as_page(const uav_study_t *s)
{
    uav_study_t page = {.sim = s->sim};

    set_page(&page);
    set_page_resampling(&page);
    return s->set.name == page.set.name && s->wind_model == page.wind_model && s->resampling &&
           s->scheme == page.scheme && near(s->resample_below, page.resample_below) && s->kernel == page.kernel &&
           !s->optimal && !s->distance && s->fixes && s->filter_seconds == page.filter_seconds;
}

bool uav_read_settings(const study_t *study, uav_study_t *s, failure_t *failure)
{
    memset(s, 0, sizeof *s);
    s->sim = (uav_sim_t)study_choice(study, "sim");
    s->particles = study->particles;
    s->seed = study->seed;
    set_page(s);
    if (s->sim == UAV_WINDS_TABLE && !study_is(study, "wind", "auto")) {
        return fail(failure, EXIT_USAGE, "--set wind: sim=winds flies the four winds of Table 1; try sim=circle");
    }
    if (!study_is(study, "set", "auto")) {
        s->set = study_is(study, "set", "S") ? set_s : set_g;
    }
    read_wind(study, s);
    read_filter(study, s);
    if (!read_kc(study, s, failure)) {
        return false;
    }
    if (s->optimal && (s->distance || s->sim == UAV_REPLAY)) {
        return fail(failure, EXIT_USAGE,
                    "--set proposal=optimal: for weighting=gauss, and not for sim=replay, where "
                    "the gusts act on the heading too");
    }
    s->as_page = is_as_page(s);
    return true;
}
