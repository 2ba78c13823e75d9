/* What gates, watch and redraw are worth: troubles that sensors and vehicles make, flown with and without them. */
#include "gates.h"

#include "judge.h"

#include <math.h>
#include <string.h>

#define FLIGHT 600u /* cycles: a minute */
#define BEGIN 150u
#define END 350u

typedef enum { NOTHING, KIDNAPPED, OUTLIERS, DROPOUT, FROZEN, LATE, DUPLICATE, TROUBLES } trouble_t;

static const char *const trouble_names[TROUBLES] = {"no trouble",
                                                    "kidnapped: 500 m aside",
                                                    "20 % outliers of 100 sigma",
                                                    "10 s without both receivers",
                                                    "first receiver frozen, 20 s",
                                                    "first receiver 1 s late, 20 s",
                                                    "first receiver twice, 20 s"};

typedef struct {
    double square, square_after; /* over all, and over the last ten seconds */
    uint64_t cycles, cycles_after;
    uint32_t lies, lost; /* flights that lied; that ended more than 20 m off */
} score_t;

static void kidnap(instant_t *instant)
{
    for (uint32_t k = 0u; k < 2u; k++) {
        instant->sample.z[k][0] += 500.0f;
    }
    instant->truth[0] += 500.0f;
}

static void trouble_samples(trouble_t trouble, uint32_t k, instant_t now, const instant_t *past, host_random_t *random,
                            instant_t *out)
{
    const bool on = (k >= BEGIN) && (k < END);
    *out = now;
    if ((trouble == KIDNAPPED) && (k >= BEGIN)) {
        kidnap(out);
    }
    for (uint32_t s = 0u; (trouble == OUTLIERS) && on && (s < SENSORS); s++) {
        if (host_random_uniform(random) < 0.2) {
            const double angle = 6.283185307179586 * host_random_uniform(random);
            out->sample.z[s][0] += (float)(100.0 * (double)world_sigma[s] * cos(angle));
            out->sample.z[s][1] += (float)(100.0 * (double)world_sigma[s] * sin(angle));
        }
    }
    if ((trouble == FROZEN) && on) {
        memcpy(out->sample.z[0], past[BEGIN].sample.z[0], sizeof out->sample.z[0]);
    }
    if ((trouble == LATE) && on) {
        memcpy(out->sample.z[0], past[k - 10u].sample.z[0], sizeof out->sample.z[0]);
    }
}

static uint32_t trouble_mask(trouble_t trouble, uint32_t k)
{
    const bool out = (trouble == DROPOUT) && (k >= BEGIN) && (k < (BEGIN + 100u));
    return out ? 4u : 7u;
}

static void fly(world_kind_t kind, trouble_t trouble, bool gates, uint32_t flight, score_t *score)
{
    static instant_t past[FLIGHT];
    const plan_t plan = {.kind = kind, .rate_hz = RATE_HZ, .gates = gates, .resample_always = false};
    world_t world;
    host_random_t random;
    uint32_t lies = 0u;
    bool lied = false;
    double last = 0.0;
    world_start(&world, kind, 5000u + flight, RATE_HZ);
    host_random_start(&random, flight, (uint64_t)trouble, RANDOM_MEASUREMENT);
    fault = fault_none();
    (void)plane_start(&plan);
    for (uint32_t k = 0u; k < FLIGHT; k++) {
        cycle_t cycle;
        instant_t instant;
        world_step(&world, &past[k]);
        trouble_samples(trouble, k, past[k], past, &random, &instant);
        plane.sensors_live = trouble_mask(trouble, k);
        plane.first_twice = (trouble == DUPLICATE) && (k >= BEGIN) && (k < END);
        plane_cycle(k, &instant, &cycle);
        last = judge_square(&cycle, &instant);
        score->square += (k >= BEGIN) ? last : 0.0;
        score->cycles += (k >= BEGIN) ? 1u : 0u;
        score->square_after += (k >= (FLIGHT - 100u)) ? last : 0.0;
        score->cycles_after += (k >= (FLIGHT - 100u)) ? 1u : 0u;
        const bool far = gates ? judge_lies(&cycle, &instant) : judge_lies_plainly(&cycle, &instant);
        lies = far ? (lies + 1u) : 0u;
        lied = lied || (lies > LIE_CYCLES);
    }
    score->lies += lied ? 1u : 0u;
    score->lost += (last > 400.0) ? 1u : 0u;
}

int gates_fly(uint32_t runs)
{
    for (uint32_t kind = 0u; kind < WORLDS; kind++) {
        for (uint32_t trouble = 0u; trouble < (uint32_t)TROUBLES; trouble++) {
            for (uint32_t gates = 0u; gates < 2u; gates++) {
                score_t score;
                memset(&score, 0, sizeof score);
                for (uint32_t flight = 0u; flight < runs; flight++) {
                    fly((world_kind_t)kind, (trouble_t)trouble, gates != 0u, flight, &score);
                }
                printf("%s|%s|%u|%.4f|%.4f|%u|%u|%u\n", kind == 0u ? "land" : "gps", trouble_names[trouble],
                       (unsigned)gates, sqrt(score.square / (double)score.cycles),
                       sqrt(score.square_after / (double)score.cycles_after), (unsigned)score.lies,
                       (unsigned)score.lost, (unsigned)runs);
            }
        }
    }
    return 0;
}
