/* Hours of flight at 100 Hz: how many alarms, are the counters sane, and a hash that a second flight must repeat. */
#include "soak.h"

#include "judge.h"

#include <inttypes.h>
#include <math.h>

typedef struct {
    uint64_t cycles, refused, critical, degraded, lies, nonfinite;
    double square;
} tally_t;

/* Critical: not usable though it once was, a fault, or a status that is one. A refused measurement is the gate's work. */
static void count(tally_t *tally, const cycle_t *cycle, const instant_t *instant, bool *alarmed)
{
    bool critical = !cycle->healthy || (cycle->health.fault != 0u) || ((cycle->health.mode & PFL_MODE_USABLE) == 0u);
    for (uint32_t k = 0u; k < STATUSES; k++) {
        tally->refused += (cycle->status[k] == PFL_REJECTED) ? 1u : 0u;
        critical = critical || ((cycle->status[k] < PFL_OK) && (cycle->status[k] != PFL_REJECTED));
    }
    tally->cycles++;
    tally->critical += (critical && !*alarmed) ? 1u : 0u;
    tally->degraded += (cycle->health.phase == PFL_PHASE_DEGRADED) ? 1u : 0u;
    tally->lies += judge_lies(cycle, instant) ? 1u : 0u;
    tally->nonfinite += cycle->nonfinite ? 1u : 0u;
    tally->square += judge_square(cycle, instant);
    *alarmed = critical;
}

static int fly(world_kind_t kind, double hours)
{
    const plan_t plan = {.kind = kind, .rate_hz = 100.0, .gates = true, .resample_always = false};
    const uint64_t cycles = (uint64_t)(hours * 360000.0);
    world_t world;
    tally_t tally = {0};
    cycle_t cycle;
    instant_t instant;
    bool alarmed = false;
    world_start(&world, kind, 1000u, plan.rate_hz);
    fault = fault_none();
    if (!plane_start(&plan)) {
        return 1;
    }
    for (uint64_t k = 0u; k < cycles; k++) {
        world_step(&world, &instant);
        plane_cycle((uint32_t)(k % 1000000000u), &instant, &cycle);
        if (k >= 1000u) { /* ten seconds to converge */
            count(&tally, &cycle, &instant, &alarmed);
        }
    }
    const pfl_health_t *h = &cycle.health;
    const bool sane = (h->fused + h->rejected == 3u * cycles) && (h->faulted == 0u) && (h->mended == 0u) &&
                      (h->quarantined == 0u) && (h->overruns == 0u) && pfl_invariants_hold(plane.f) &&
                      plane_fences_stand();
    printf("%s|%" PRIu64 "|%" PRIu64 "|%.6f|%.6f|%" PRIu64 "|%" PRIu64 "|%u|%.4f|%d|%016" PRIx64 "\n",
           kind == WORLD_LAND ? "land" : "gps", cycles, tally.critical,
           (double)tally.refused / (3.0 * (double)tally.cycles), (double)tally.degraded / (double)tally.cycles,
           tally.lies, tally.nonfinite, (unsigned)h->resets, sqrt(tally.square / (double)tally.cycles), sane ? 1 : 0,
           plane.hash_a);
    return 0;
}

int soak_fly(double hours)
{
    const int land = fly(WORLD_LAND, hours);
    return (land == 0) ? fly(WORLD_GPS, hours) : land;
}
