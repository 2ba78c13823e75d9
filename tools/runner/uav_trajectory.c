/* The scenario `uav-trajectory`: the studies that `tools/run` makes of it, and a run. */
#include "uav_trajectory.h"

#include "hash.h"
#include "uav_settings.h"

#include <stdlib.h>
#include <string.h>

#define STREAMS_OF_A_WIND 0x10000u /* more than there can be runs */

static bool open_study(const study_t *study, plan_t *plan, failure_t *failure)
{
    uav_study_t *s = malloc(sizeof *s);

    if (s == NULL) {
        return fail(failure, EXIT_HARNESS, "out of memory");
    }
    if (!uav_read_settings(study, s, failure)) {
        free(s);
        return false;
    }
    *plan = (plan_t){
        .own = s,
        .values = UAV_VALUES,
        .cycles = s->ekf ? 0u : s->filter_seconds, /* the baseline is not timed */
        .steps = s->seconds,
        .columns = UAV_COLUMNS,
        .column = uav_column,
        .trace_columns = UAV_TRACE_COLUMNS,
        .trace_column = uav_trace_column,
        .period_s = 1.0,
        .budget_us = 10000.0,
        .budget_reason = "1 update a second of ten model steps, 1 % of the time between them",
    };
    return true;
}

static void close_study(plan_t *plan)
{
    free(plan->own);
}

/* A flight of the filter and of its twins: on the same data and random numbers, without resampling, and one that knows
 * nothing of the wind. */
typedef struct {
    uav_track_t track;
    uav_flight_t flight;
    uav_flight_t unresampled;
    uav_flight_t ignored;
} flights_t;

static bool has_unresampled_twin(const uav_study_t *s)
{
    return s->forecasts == 0u && s->resampling && !s->ekf;
}

static bool has_ignorant_twin(const uav_study_t *s)
{
    return s->forecasts > 0u && s->wind_model == UAV_WIND_IN_STATE && !s->ekf;
}

/* The twins first: the flight's own clouds then lie over theirs. */
static bool fly_twins(const uav_study_t *s, uint32_t stream, text_t *cloud, flights_t *all, failure_t *failure)
{
    const uav_clouds_t of_unresampled = {cloud, NULL, "unresampled", "unresampled-ahead"};
    const uav_clouds_t of_ignored = {cloud, NULL, "ignored", "ignored-ahead"};
    uav_study_t twin = *s;

    if (has_unresampled_twin(s)) {
        twin.resampling = false;
        return uav_particle_filter(&twin, stream, &all->track, &of_unresampled, &all->unresampled, failure);
    }
    if (has_ignorant_twin(s)) {
        twin.wind_model = UAV_WIND_IGNORED;
        return uav_particle_filter(&twin, stream, &all->track, &of_ignored, &all->ignored, failure);
    }
    return true;
}

static bool fly_all(const uav_study_t *s, uint32_t stream, text_t *cloud, look_t *look, flights_t *all,
                    failure_t *failure)
{
    const uav_clouds_t clouds = {cloud, look, "filter", "ahead"};

    memset(all, 0, sizeof *all);
    uav_make_track(s, stream, &all->track);
    if (s->ekf) {
        return uav_kalman_filter(s, &all->track, &all->flight, failure);
    }
    return fly_twins(s, stream, cloud, all, failure) &&
           uav_particle_filter(s, stream, &all->track, &clouds, &all->flight, failure);
}

static void score(const uav_study_t *s, const flights_t *all, double *value)
{
    uav_score_clouds(s, &all->track, &all->flight, value);
    if (has_unresampled_twin(s)) {
        double twin[UAV_VALUES] = {0.0};
        uav_score_clouds(s, &all->track, &all->unresampled, twin);
        value[UAV_CLOUD_60S_UNRESAMPLED] = twin[UAV_CLOUD_60S];
    }
    if (s->forecasts > 0u) {
        uav_score_forecasts(s, &all->track, &all->flight, value);
    }
    if (has_ignorant_twin(s)) {
        uav_score_ignored(s, &all->track, &all->ignored, value);
    }
}

static uint64_t hash_belief(uint64_t hash, const uav_belief_t *belief)
{
    for (int d = 0; d < UAV_STATES; d++) {
        const float x = (float)belief->mean[d];
        hash = hash_floats(hash, &x, 1u);
    }
    for (int i = 0; i < 2; i++) {
        const float w = (float)belief->wind[i];
        hash = hash_floats(hash, &w, 1u);
    }
    return hash;
}

static uint64_t hash_flight(const uav_study_t *s, const uav_flight_t *flight, uint64_t hash)
{
    for (unsigned k = 1u; k <= s->filter_seconds; k++) {
        hash = hash_belief(hash, &flight->at[k]);
    }
    for (unsigned j = 0u; j < s->forecasts; j++) {
        for (unsigned i = 1u; i <= s->ahead_s; i++) {
            hash = hash_belief(hash, &flight->ahead[j][i]);
        }
    }
    return hash;
}

/* What the tables of cycles, series and trace show: the only flight of the run, or its first. */
static void show(const uav_study_t *s, const flights_t *all, run_output_t *out)
{
    const uav_flight_t *ignored = has_ignorant_twin(s) ? &all->ignored : NULL;

    if (!s->ekf) {
        memcpy(out->cycles_ns, all->flight.cycles_ns, s->filter_seconds * sizeof *out->cycles_ns);
        memcpy(out->cycle, all->flight.cycle, s->filter_seconds * sizeof *out->cycle);
    }
    uav_fill_series(s, &all->track, &all->flight, has_unresampled_twin(s) ? &all->unresampled : NULL, ignored,
                    out->series);
    uav_fill_trace(s, &all->track, &all->flight, ignored, out->trace);
}

static bool fly_one(const uav_study_t *s, uint32_t stream, bool first, double *value, run_output_t *out,
                    failure_t *failure)
{
    flights_t *all = malloc(sizeof *all);

    if (all == NULL) {
        return fail(failure, EXIT_HARNESS, "out of memory");
    }
    const bool flown = fly_all(s, stream, first ? out->cloud : NULL, first ? out->look : NULL, all, failure);
    if (flown) {
        score(s, all, value);
        out->hash = hash_flight(s, &all->flight, out->hash);
    }
    if (flown && first) {
        show(s, all, out);
    }
    free(all);
    return flown;
}

/* The four winds of Table 1, each with random numbers of its own: with common ones they would agree by construction.
 * The first wind's are those of sim=circle, so that one can be checked against the other. */
static bool fly_winds(const uav_study_t *s, uint32_t run, run_output_t *out, failure_t *failure)
{
    for (unsigned w = 0u; w < UAV_WINDS; w++) {
        uav_study_t one = *s;
        double value[UAV_VALUES] = {0.0};
        memcpy(one.wind, uav_table_wind[w], sizeof one.wind);
        if (!fly_one(&one, run + w * STREAMS_OF_A_WIND, w == 0u, value, out, failure)) {
            return false;
        }
        for (unsigned i = 0u; i < UAV_HORIZON; i++) {
            out->value[i] += value[i] / (double)UAV_WINDS;
        }
        double *of = &out->value[UAV_BY_WIND + w * UAV_OF_WIND];
        of[UAV_OF_MEAN] = value[UAV_MEAN];
        of[UAV_OF_MAX] = value[UAV_MAX];
        of[UAV_OF_STD] = value[UAV_STD];
    }
    return true;
}

static bool run_once(const plan_t *plan, uint32_t run, run_output_t *out, failure_t *failure)
{
    const uav_study_t *s = plan->own;

    return s->sim == UAV_WINDS_TABLE ? fly_winds(s, run, out, failure)
                                     : fly_one(s, run, true, out->value, out, failure);
}

static const campaign_t campaign[] = {
    {"pf", 200u, {"sim=line"}, 0u},
    {"pf", 200u, {"sim=circle"}, 0u},
    {"pf", 50u, {"sim=winds"}, 0u},
    {"pf", 200u, {"sim=forecast"}, 0u},
    {"pf", 200u, {"sim=forecast", "kc=0"}, 0u},
    {"ekf", 200u, {"sim=forecast"}, 0u},
    {"pf", 100u, {"sim=wind"}, 0u},
    {"pf", 100u, {"sim=wind", "kernel=off"}, 0u},
    {"ekf", 100u, {"sim=wind"}, 0u},
    {"pf", 100u, {"sim=wind", "wind=prior"}, 2000u},
    {"pf", 60u, {"sim=replay"}, 0u},
};

const scenario_t uav_trajectory_scenario = {
    .name = "uav-trajectory",
    .summary = "a UAV under its autopilot in uncertain wind: where it is, where it will be, and the wind inferred",
    .filters = "pf|ekf",
    .particles = 1000u,
    .runs = 50u,
    .settings = uav_settings,
    .settings_count = UAV_SETTINGS,
    .campaign = campaign,
    .campaign_count = sizeof campaign / sizeof campaign[0],
    .recordings = NULL,
    .open = open_study,
    .close = close_study,
    .run = run_once,
    .judge = uav_judge,
};
