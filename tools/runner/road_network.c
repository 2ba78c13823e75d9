/* The scenario `road-network`: each filter in its own closed loop with the guidance, on the same target and the same errors
 * of measurement; and what is measured on them. */
#include "road_network.h"

#include "hash.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define JUDGED_PARTICLES 200u
#define JUDGED_RUNS 100u
#define SETTLED 10u  /* steps that no error is counted in */
#define FOUND_M 10.0 /* an error below this is a target found again */
#define OUTAGES 2
#define VIEW_HALF_RAD (40.0 * 3.14159265358979323846 / 180.0) /* as in `standoff` */

/* Values of a run, for each filter: squared errors of the position, over all settled steps, in the outages and at their
 * last steps; error of the standoff distance; seconds until the target is found again; was it out of the camera's view when
 * an outage ended. Then whether the vehicle was told. */
enum { SQUARE, SQUARE_OUT, SQUARE_END, DISTANCE, AGAIN, LOST, FIGURES };
enum { TOLD = FIGURES * ROAD_FILTERS, VALUES };

static const char *const names[ROAD_FILTERS] = {"free", "annulus", "one", "two"};
static const char *const wheres[FIGURES] = {"rmse_m", "rmse_out_m", "rmse_end_m", "standoff_m", "again_s", "lost"};

typedef struct {
    road_study_t study; /* stands first */
    road_map_t map;
} road_plan_t;

static const setting_t settings[] = {
    {"accel", NULL, 0.01, 100.0, "1.5",
     "of the filters without streets, 1.5 the best of 0.7 .. 3 for the annulus [m/s^2/sqrt(Hz)]"},
};

static const char *const columns[] = {"truth_x_m", "truth_y_m",       "annulus_x_m", "annulus_y_m",
                                      "two_x_m",   "two_y_m",         "uav_x_m",     "uav_y_m",
                                      "lorry",     "error_annulus_m", "error_two_m"};
enum { COLUMNS = sizeof columns / sizeof columns[0] };
enum { COLUMN_ANNULUS = 2, COLUMN_TWO = 4, COLUMN_UAV = 6, COLUMN_LORRY = 8, COLUMN_ERRORS = 9 };

/* ---- A flight --------------------------------------------------------------------------------------------------------- */

static const standoff_study_t guided = {.uavs = 1u, .guidance = GUIDANCE_LVFG};

static bool out_of_view(const standoff_belief_t *b, const double *target, const standoff_uav_t *uav)
{
    const double axis = atan2(b->target[TARGET_Y] - uav->y_m, b->target[TARGET_X] - uav->x_m);
    const double truth = atan2(target[TARGET_Y] - uav->y_m, target[TARGET_X] - uav->x_m);

    return fabs(remainder(truth - axis, 6.283185307179586)) > VIEW_HALF_RAD;
}

static void record_outage(double error, bool last, bool lost, double *value)
{
    value[SQUARE_OUT] += error * error / (double)STANDOFF_OUT_STEPS;
    if (last) {
        value[SQUARE_END] += error * error / (double)OUTAGES;
        value[LOST] += lost ? 1.0 / (double)OUTAGES : 0.0;
    }
}

/* value: FIGURES of one filter. looking: for the target after an outage. */
static void record(const standoff_belief_t *b, const double *target, const standoff_uav_t *uav, double wanted_m,
                   unsigned k, bool *looking, double *value)
{
    const double error = hypot(b->target[TARGET_X] - target[TARGET_X], b->target[TARGET_Y] - target[TARGET_Y]);
    const double distance = hypot(uav->x_m - target[TARGET_X], uav->y_m - target[TARGET_Y]);

    if (k > SETTLED) {
        value[SQUARE] += error * error / (double)(STANDOFF_STEPS - SETTLED);
        value[DISTANCE] += fabs(distance - wanted_m) / (double)(STANDOFF_STEPS - SETTLED);
    }
    if (standoff_is_out(k)) {
        record_outage(error, !standoff_is_out(k + 1u), out_of_view(b, target, uav), value);
        *looking = true;
    } else {
        *looking = *looking && error > FOUND_M;
        value[AGAIN] += *looking ? STANDOFF_PERIOD_S / (double)OUTAGES : 0.0;
    }
}

static void note(const standoff_belief_t *b, const double *target, const standoff_uav_t *uav, road_filter_kind_t kind,
                 double lorry, double *row)
{
    const size_t at = kind == ROAD_TWO ? COLUMN_TWO : COLUMN_ANNULUS;

    memcpy(row, target, 2u * sizeof *row);
    memcpy(&row[at], b->target, 2u * sizeof *row);
    row[COLUMN_ERRORS + (kind == ROAD_TWO ? 1 : 0)] =
        hypot(b->target[TARGET_X] - target[TARGET_X], b->target[TARGET_Y] - target[TARGET_Y]);
    if (kind == ROAD_TWO) {
        row[COLUMN_UAV] = uav->x_m;
        row[COLUMN_UAV + 1] = uav->y_m;
        row[COLUMN_LORRY] = lorry;
    }
}

static bool fly(road_filter_t *filter, road_filter_kind_t kind, const standoff_track_t *track, double *lorry,
                run_output_t *out, failure_t *failure)
{
    standoff_uav_t uav;
    standoff_pilot_t pilot;
    standoff_belief_t belief;
    bool looking = false;

    standoff_start_uav(track, 0u, &uav);
    standoff_pilot_start(&pilot);
    for (unsigned k = 1u; k <= STANDOFF_STEPS; k++) {
        pfl_planar_uav_input_t command;
        uint32_t cycles_ns;
        cycle_t cycle;
        const standoff_sight_t sight = standoff_see(track, k, 0u, &uav);
        if (!road_filter_step(filter, k, standoff_is_out(k) ? NULL : &sight, &belief, lorry, &cycles_ns, &cycle,
                              failure) ||
            !standoff_pilot_step(&guided, &uav, &belief, &pilot, &command, failure)) {
            return false;
        }
        record(&belief, track->target[k], &uav, (double)pilot.standoff.distance_m, k, &looking,
               &out->value[FIGURES * kind]);
        for (int d = 0; d < TARGET_STATES; d++) {
            const float x = (float)belief.target[d];
            out->hash = hash_floats(out->hash, &x, 1u);
        }
        if (kind == ROAD_TWO) {
            out->cycles_ns[k - 1u] = cycles_ns;
            out->cycle[k - 1u] = cycle;
            road_filter_show(filter, k, track->target[k], &belief, out->look);
        }
        if (out->series != NULL && (kind == ROAD_TWO || kind == ROAD_ANNULUS)) {
            note(&belief, track->target[k], &uav, kind, *lorry, &out->series[(k - 1u) * COLUMNS]);
        }
        standoff_move_uav(false, (double)command.speed_mps, (double)command.turn_radps, &uav);
    }
    return true;
}

static bool run_once(const plan_t *plan, uint32_t run, run_output_t *out, failure_t *failure)
{
    const road_plan_t *own = plan->own;
    standoff_track_t track;
    const unsigned vehicle = road_make_track(&own->study, &own->map, run, &track);

    for (int k = 0; k < ROAD_FILTERS; k++) {
        const road_filter_kind_t kind = (road_filter_kind_t)k;
        double lorry = 0.0;
        road_filter_t *filter = road_filter_open(&own->study, &own->map, kind, run, track.prior, failure);
        const bool flown = filter != NULL && fly(filter, kind, &track, &lorry, out, failure);
        road_filter_close(filter);
        if (!flown) {
            return false;
        }
        out->value[TOLD] = (lorry > 0.5) == (vehicle == ROAD_LORRY) ? 1.0 : 0.0;
    }
    return true;
}

/* ---- The study ---------------------------------------------------------------------------------------------------------- */

/* The better of the two filters without streets times this. Over 16 seeds of 100 runs the ratios are 0.67, 0.68 and 0.72
 * with standard deviations of 0.03, so that a series fails by chance once in 40 000 or less often. */
static const double shares[SQUARE_END + 1] = {0.8, 0.85, 0.85};

static void judge(const plan_t *plan, table_t runs, verdict_t *verdict)
{
    const road_plan_t *own = plan->own;
    const bool judged =
        own->study.particles == JUDGED_PARTICLES && runs.n >= JUDGED_RUNS && fabs(own->study.accel - 1.5) < 1e-6;

    for (int where = 0; where < FIGURES; where++) {
        figure_t figure[ROAD_FILTERS];
        metric_t *metric = NULL;
        for (int k = 0; k < ROAD_FILTERS; k++) {
            const figure_t mean = stats_mean(runs, (size_t)(FIGURES * k + where));
            figure[k] = where <= SQUARE_END ? stats_root(mean) : mean;
            metric = verdict_add_of(verdict, wheres[where], names[k], figure[k]);
        }
        if (judged && where <= SQUARE_END) { /* the last of the filters, against the better of those without streets */
            metric_accept(metric, 0.0, shares[where] * fmin(figure[ROAD_FREE].mean, figure[ROAD_ANNULUS].mean));
        }
    }
    metric_t *told = verdict_add(verdict, "vehicle_told", stats_mean(runs, TOLD));
    if (judged) {
        metric_accept(told, 0.8, 1.0); /* 0.93 with a deviation of 0.03 in 100 runs */
    }
    text_add(
        &verdict->notes,
        "free: constant velocity; annulus: kept to the annulus that holds all streets, as in standoff; one, two: on "
        "the streets, by one model of a vehicle and by two. out, end: in the two outages of 10 s, and at their last "
        "steps; again: until the error is below 10 m after them; lost: out of the camera's view at their ends.\n"
        "Acceptance: two has at most 0.8 of the better error of free and annulus, 0.85 in the outages and at "
        "their ends, and tells car from lorry in 0.8 of the runs.\n");
}

static bool open_study(const study_t *study, plan_t *plan, failure_t *failure)
{
    road_plan_t *own = calloc(1u, sizeof *own);

    if (own == NULL) {
        return fail(failure, EXIT_HARNESS, "out of memory");
    }
    own->study = (road_study_t){study->particles, study->seed, study_number(study, "accel")};
    if (!road_make_map(&own->map, failure)) {
        free(own);
        return false;
    }
    *plan = (plan_t){
        .own = own,
        .values = VALUES,
        .cycles = STANDOFF_STEPS,
        .steps = STANDOFF_STEPS,
        .columns = COLUMNS,
        .column = columns,
        .period_s = STANDOFF_PERIOD_S,
        .budget_us = 500.0,
        .budget_reason = "2 measurements a second, 0.1 % of the time between them",
    };
    return true;
}

static void close_study(plan_t *plan)
{
    free(plan->own);
}

static const campaign_t campaign[] = {{"pf", 200u, {NULL}, 0u}};

const scenario_t road_network_scenario = {
    .name = "road-network",
    .summary =
        "standoff of a car or lorry on a network of streets, lost twice: particles on the streets beside filters "
        "that know an annulus, or nothing",
    .filters = "pf",
    .particles = JUDGED_PARTICLES,
    .runs = 200u,
    .settings = settings,
    .settings_count = sizeof settings / sizeof settings[0],
    .campaign = campaign,
    .campaign_count = sizeof campaign / sizeof campaign[0],
    .open = open_study,
    .close = close_study,
    .run = run_once,
    .judge = judge,
};
