/* Flies, compares, judges. */
#include "judge.h"

#include <math.h>
#include <string.h>

typedef struct {
    instant_t at[CYCLES];
    plane_t warm;
    uint64_t hash_a, hash_b;
    double square[CYCLES];
} reference_t;

static reference_t references[WORLDS][FLIGHTS];
static double clean_rmse[WORLDS];

const char *class_name(class_t c)
{
    static const char *const names[CLASSES] = {"masked", "recovered", "flagged", "silent", "fatal"};
    return names[c];
}

double judge_clean_rmse(world_kind_t kind)
{
    return clean_rmse[kind];
}

double judge_square(const cycle_t *cycle, const instant_t *instant)
{
    if (cycle->status[1u + SENSORS] != PFL_OK || !cycle->healthy) {
        return (double)INFINITY;
    }
    const double dx = (double)cycle->mean[0] - (double)instant->truth[0];
    const double dy = (double)cycle->mean[1] - (double)instant->truth[1];
    return (dx * dx) + (dy * dy);
}

static bool is_far(const cycle_t *cycle, const instant_t *instant)
{
    bool far = false;
    for (uint32_t d = 0u; d < STATES; d++) {
        const double error = (double)cycle->mean[d] - (double)instant->truth[d];
        const bool angle = (plane.plan.kind == WORLD_LAND) && (d == 3u);
        const double near = angle ? remainder(error, 6.283185307179586) : error;
        far = far || (near * near > 25.0 * (double)cycle->cov[(STATES + 1u) * d]);
    }
    return far;
}

bool judge_lies(const cycle_t *cycle, const instant_t *instant)
{
    return !plane_complains(cycle) && is_far(cycle, instant);
}

bool judge_lies_plainly(const cycle_t *cycle, const instant_t *instant)
{
    return (cycle->status[1u + SENSORS] == PFL_OK) && is_far(cycle, instant);
}

/* ---- Without a fault ------------------------------------------------------------------------------------------------- */

static void trace_cycle(FILE *out, uint32_t k, const cycle_t *c, const instant_t *instant)
{
    static const char *const phases[6] = {"INIT", "CONVERGING", "TRACKING", "DEGRADED", "LOST", "SETTLING"};
    fprintf(out, "%4u %-10s error %8.2f sigma %6.2f %6.2f  status", (unsigned)k,
            c->healthy ? phases[(uint32_t)c->health.phase % 6u] : "?", sqrt(judge_square(c, instant)),
            sqrt((double)c->cov[0]), sqrt((double)c->cov[STATES + 1u]));
    for (uint32_t s = 0u; s < STATUSES; s++) {
        fprintf(out, " %d", (int)c->status[s]);
    }
    fprintf(out, "  fault %03x reject %x mode %02x event %03x mended %u%s%s%s\n", (unsigned)c->health.fault,
            (unsigned)c->health.reject, (unsigned)c->health.mode, (unsigned)c->health.event, (unsigned)c->health.mended,
            judge_lies(c, instant) ? " OFF" : "", c->nonfinite ? " NONFINITE" : "",
            (k == fault.first) ? " <- fault" : "");
}

static bool fly_clean(world_kind_t kind, uint32_t flight, bool dearest)
{
    reference_t *r = &references[kind][flight];
    const plan_t plan = {.kind = kind, .rate_hz = RATE_HZ, .gates = true, .resample_always = dearest};
    world_t world;
    world_start(&world, kind, flight, RATE_HZ);
    fault = fault_none();
    if (!plane_start(&plan)) {
        return false;
    }
    bool good = true;
    uint32_t lies = 0u;
    for (uint32_t k = 0u; k < CYCLES; k++) {
        cycle_t cycle;
        if (!dearest && (k == WARM)) {
            r->warm = plane;
        }
        world_step(&world, &r->at[k]);
        plane_cycle(k, &r->at[k], &cycle);
        if (!dearest) {
            r->square[k] = judge_square(&cycle, &r->at[k]);
            clean_rmse[kind] += (k >= WARM) ? (r->square[k] / (double)((CYCLES - WARM) * FLIGHTS)) : 0.0;
        }
        lies = ((k >= WARM) && judge_lies(&cycle, &r->at[k])) ? (lies + 1u) : 0u;
        good = good && !cycle.nonfinite && (lies <= LIE_CYCLES);
    }
    if (!dearest) {
        r->hash_a = plane.hash_a;
        r->hash_b = plane.hash_b;
    }
    return good && plane_fences_stand();
}

bool judge_prepare(void)
{
    bool good = true;
    for (uint32_t kind = 0u; kind < WORLDS; kind++) {
        clean_rmse[kind] = 0.0;
        for (uint32_t flight = 0u; flight < FLIGHTS; flight++) {
            good = fly_clean((world_kind_t)kind, flight, true) && good;
            good = fly_clean((world_kind_t)kind, flight, false) && good;
        }
        clean_rmse[kind] = sqrt(clean_rmse[kind]);
    }
    return good;
}

/* ---- With one --------------------------------------------------------------------------------------------------------- */

static uint32_t window_of(const fault_t *f)
{
    return (fault_lasts(f) ? (f->first + 1u) : (f->first + f->cycles)) + RECOVERY;
}

static double root_mean(const double *square, uint32_t from)
{
    double sum = 0.0;
    for (uint32_t k = from; k < (from + WINDOW); k++) {
        sum += square[k];
    }
    return sqrt(sum / (double)WINDOW);
}

static class_t verdict_of(const judgement_t *j, const reference_t *r, bool complained)
{
    if (j->nonfinite || j->fence || j->second) {
        return CLASS_FATAL;
    }
    if (j->lie || (j->late && !complained)) {
        return CLASS_SILENT;
    }
    if (j->late) {
        return CLASS_FLAGGED;
    }
    return (plane.hash_a == r->hash_a) ? CLASS_MASKED : CLASS_RECOVERED;
}

static uint64_t mixed_of(uint64_t run_seed)
{
    return (run_seed * 0x9E3779B97F4A7C15u) >> 40;
}

world_kind_t judge_draw(uint64_t run_seed)
{
    fault = fault_of_run(run_seed, FAULT_FIRST, FAULT_LAST, CYCLES);
    return (world_kind_t)(mixed_of(run_seed) % WORLDS);
}

judgement_t judge_run(uint64_t run_seed, FILE *trace)
{
    static double square[CYCLES];
    judgement_t j;
    memset(&j, 0, sizeof j);
    j.kind = judge_draw(run_seed);
    const reference_t *r = &references[j.kind][(mixed_of(run_seed) / WORLDS) % FLIGHTS];
    memset(&fault_state, 0, sizeof fault_state);
    plane = r->warm;
    const uint32_t window = window_of(&fault);
    bool complained = false;
    uint32_t lies = 0u;
    if (trace != NULL) {
        fault_print(trace, &fault);
    }
    for (uint32_t k = WARM; k < CYCLES; k++) {
        cycle_t cycle;
        plane_cycle(k, &r->at[k], &cycle);
        square[k] = judge_square(&cycle, &r->at[k]);
        lies = judge_lies(&cycle, &r->at[k]) ? (lies + 1u) : 0u;
        j.lie = j.lie || (lies > LIE_CYCLES);
        j.nonfinite = j.nonfinite || cycle.nonfinite;
        complained = complained || ((k >= window) && plane_complains(&cycle));
        j.usable = cycle.healthy && ((cycle.health.mode & PFL_MODE_USABLE) != 0u);
        if (trace != NULL) {
            trace_cycle(trace, k, &cycle, &r->at[k]);
        }
    }
    const double clean = fmax(root_mean(r->square, window), clean_rmse[j.kind]);
    j.ratio = root_mean(square, window) / clean;
    j.late = !(j.ratio <= 1.5);
    j.fence = !plane_fences_stand();
    j.second = plane.hash_b != r->hash_b;
    j.verdict = verdict_of(&j, r, complained);
    return j;
}
