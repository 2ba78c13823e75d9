/* The closed loop of `standoff`, and what is measured on it. */
#include "cloud.h"
#include "hash.h"
#include "standoff.h"

#include <math.h>
#include <string.h>

#define PI 3.14159265358979323846
#define VIEW_HALF_RAD (40.0 * PI / 180.0)

const char *const standoff_columns[SERIES_COLUMNS] = {
    [SERIES_TARGET_X] = "target_x_m",
    [SERIES_TARGET_Y] = "target_y_m",
    [SERIES_ESTIMATE_X] = "estimate_x_m",
    [SERIES_ESTIMATE_Y] = "estimate_y_m",
    [SERIES_UAV1_X] = "uav1_x_m",
    [SERIES_UAV1_Y] = "uav1_y_m",
    [SERIES_UAV2_X] = "uav2_x_m",
    [SERIES_UAV2_Y] = "uav2_y_m",
    [SERIES_DISTANCE] = "distance_wanted_m",
    [SERIES_REACH] = "reach_m",
    [SERIES_POSITION] = "position_error_m",
    [SERIES_VELOCITY] = "velocity_error_mps",
    [SERIES_STANDOFF_ERROR] = "standoff_error_m",
    [SERIES_PHASE_ERROR] = "phase_error_deg",
};

/* One flight under way. */
typedef struct {
    const standoff_study_t *s;
    const standoff_track_t *track;
    standoff_pf_t *pf; /* or */
    standoff_ekf_t ekf;
    standoff_pilot_t pilot;
    standoff_uav_t uav[STANDOFF_UAVS];
    standoff_belief_t belief;
    pfl_planar_uav_input_t command[STANDOFF_UAVS];
    double *value;
    double *series; /* null: not wanted */
} flight_t;

/* ---- What is measured --------------------------------------------------------------------------------------------- */

/* Angle at the UAV between the camera's axis, which points at the estimate, and the target. */
static bool has_lost(const flight_t *f, const double *target, const standoff_uav_t *uav)
{
    const double axis = atan2(f->belief.target[TARGET_Y] - uav->y_m, f->belief.target[TARGET_X] - uav->x_m);
    const double truth = atan2(target[TARGET_Y] - uav->y_m, target[TARGET_X] - uav->x_m);

    return fabs(remainder(truth - axis, 2.0 * PI)) > VIEW_HALF_RAD;
}

static double phase_error_deg(const double *target, const standoff_uav_t *uav)
{
    const double first = atan2(uav[0].y_m - target[TARGET_Y], uav[0].x_m - target[TARGET_X]);
    const double second = atan2(uav[1].y_m - target[TARGET_Y], uav[1].x_m - target[TARGET_X]);

    return fabs(remainder(second - first - PI, 2.0 * PI)) * 180.0 / PI;
}

/* Of the UAVs: distance, field of view, effort; returns the mean error of the distance. */
static double record_uavs(flight_t *f, const double *target)
{
    const double share = 1.0 / (double)f->s->uavs;
    double error = 0.0;
    unsigned lost = 0u;

    for (unsigned i = 0u; i < f->s->uavs; i++) {
        const standoff_uav_t *uav = &f->uav[i];
        const double distance = hypot(uav->x_m - target[TARGET_X], uav->y_m - target[TARGET_Y]);
        const double speed = (double)f->command[i].speed_mps - UAV_CRUISE_MPS;
        error += share * fabs(distance - (double)f->pilot.standoff.distance_m);
        lost += has_lost(f, target, uav) ? 1u : 0u;
        f->value[STANDOFF_EFFORT_SPEED] += share * fabs(speed) * STANDOFF_PERIOD_S;
        f->value[STANDOFF_EFFORT_TURN] += share * fabs((double)f->command[i].turn_radps) * STANDOFF_PERIOD_S;
    }
    f->value[STANDOFF_LOSS] = lost == f->s->uavs ? 1.0 : f->value[STANDOFF_LOSS];
    f->value[STANDOFF_LOSS_ANY] = lost > 0u ? 1.0 : f->value[STANDOFF_LOSS_ANY];
    f->value[STANDOFF_DISTANCE] += error / (double)STANDOFF_STEPS;
    return error;
}

static double record_pair(flight_t *f, const double *target)
{
    if (f->s->uavs < 2u) {
        return 0.0;
    }
    const double gap = hypot(f->uav[0].x_m - f->uav[1].x_m, f->uav[0].y_m - f->uav[1].y_m);
    const double error = phase_error_deg(target, f->uav);
    f->value[STANDOFF_CLOSEST] = fmin(f->value[STANDOFF_CLOSEST], gap);
    f->value[STANDOFF_PHASE] += error / (double)STANDOFF_STEPS;
    return error;
}

static void record(flight_t *f, unsigned k)
{
    const double *target = f->track->target[k];
    const double *seen = f->belief.target;
    const double position = hypot(seen[TARGET_X] - target[TARGET_X], seen[TARGET_Y] - target[TARGET_Y]);
    const double velocity = hypot(seen[TARGET_VX] - target[TARGET_VX], seen[TARGET_VY] - target[TARGET_VY]);
    const double out_share = standoff_is_out(k) ? 1.0 / (double)STANDOFF_OUT_STEPS : 0.0;

    f->value[STANDOFF_POSITION] += position / (double)STANDOFF_STEPS;
    f->value[STANDOFF_VELOCITY] += velocity / (double)STANDOFF_STEPS;
    f->value[STANDOFF_POSITION_OUT] += position * out_share;
    f->value[STANDOFF_VELOCITY_OUT] += velocity * out_share;
    f->value[STANDOFF_WANTED_OUT] += (double)f->pilot.standoff.wanted_m * out_share;
    const double distance_error = record_uavs(f, target);
    const double phase_error = record_pair(f, target);
    if (f->series != NULL) {
        const double row[SERIES_COLUMNS] = {
            target[TARGET_X],  target[TARGET_Y], seen[TARGET_X],
            seen[TARGET_Y],    f->uav[0].x_m,    f->uav[0].y_m,
            f->uav[1].x_m,     f->uav[1].y_m,    (double)f->pilot.standoff.distance_m,
            f->belief.reach_m, position,         velocity,
            distance_error,    phase_error,
        };
        memcpy(&f->series[(k - 1u) * SERIES_COLUMNS], row, sizeof row);
    }
}

static void record_end(flight_t *f)
{
    if (f->pf != NULL) {
        standoff_pf_counts(f->pf, &f->value[STANDOFF_DRAWS], &f->value[STANDOFF_FALLBACK],
                           &f->value[STANDOFF_OFF_ROAD]);
    }
    if (f->pilot.calls > 0u) {
        f->value[STANDOFF_EVALUATIONS] = (double)f->pilot.evaluations / (double)f->pilot.calls;
        f->value[STANDOFF_EVALUATIONS_MAX] = (double)f->pilot.evaluations_max;
    }
}

/* ---- The loop ----------------------------------------------------------------------------------------------------- */

static bool filter_step(flight_t *f, unsigned k, uint32_t *cycles_ns, cycle_t *cycle, failure_t *failure)
{
    const bool possible = !f->s->outages || !standoff_is_out(k);
    bool visible = false;
    standoff_sight_t sight[STANDOFF_UAVS];

    for (unsigned i = 0u; i < f->s->uavs; i++) {
        sight[i] = standoff_see(f->track, k, i, &f->uav[i]);
        /* Before the first estimate the cameras are pointed by hand. */
        sight[i].seen = possible && (!f->s->gated || k == 1u || !has_lost(f, f->track->target[k], &f->uav[i]));
        visible = visible || sight[i].seen;
    }
    if (f->pf != NULL) {
        return standoff_pf_step(f->pf, k, visible ? sight : NULL, &f->belief, cycles_ns, cycle, failure);
    }
    const uint32_t begin = pfl_port_cycles();
    const bool done = standoff_ekf_step(f->s, visible ? sight : NULL, &f->ekf, &f->belief);
    const uint32_t passed = (pfl_port_cycles() - begin) & pfl_port_cycles_mask();
    *cycles_ns = cycle_ns(passed);
    return done || fail(failure, EXIT_HARNESS, "step %u: the innovation covariance is singular", k);
}

static bool fly(flight_t *f, run_output_t *out, failure_t *failure)
{
    for (unsigned k = 1u; k <= STANDOFF_STEPS; k++) {
        uint32_t cycles_ns = 0u;
        cycle_t cycle = {0};
        if (!filter_step(f, k, &cycles_ns, &cycle, failure) ||
            !standoff_pilot_step(f->s, f->uav, &f->belief, &f->pilot, f->command, failure)) {
            return false;
        }
        record(f, k);
        if (out != NULL) {
            out->cycles_ns[k - 1u] = cycles_ns;
            out->cycle[k - 1u] = cycle;
            standoff_pf_show(f->pf, k, f->track->target[k], &f->belief, out->look);
            for (int d = 0; d < TARGET_STATES; d++) {
                const float x = (float)f->belief.target[d];
                out->hash = hash_floats(out->hash, &x, 1u);
            }
        }
        for (unsigned i = 0u; i < f->s->uavs; i++) {
            standoff_move_uav(f->s->euler_plant, (double)f->command[i].speed_mps, (double)f->command[i].turn_radps,
                              &f->uav[i]);
        }
    }
    record_end(f);
    return true;
}

bool standoff_fly(const standoff_study_t *s, uint32_t run, double *value, run_output_t *out, failure_t *failure)
{
    standoff_track_t track;
    flight_t f;

    memset(&f, 0, sizeof f);
    standoff_make_track(s, run, &track);
    f.s = s;
    f.track = &track;
    f.value = value;
    f.series = out != NULL ? out->series : NULL;
    f.value[STANDOFF_CLOSEST] = s->uavs < 2u ? 0.0 : (double)INFINITY;
    for (unsigned i = 0u; i < STANDOFF_UAVS; i++) {
        standoff_start_uav(&track, i, &f.uav[i]);
    }
    standoff_pilot_start(&f.pilot);
    if (s->ekf) {
        standoff_ekf_start(s, track.prior, &f.ekf);
    } else {
        f.pf = standoff_pf_open(s, run, track.prior, failure);
        if (f.pf == NULL) {
            return false;
        }
    }
    const bool flown = fly(&f, out, failure);
    standoff_pf_close(f.pf);
    return flown;
}
