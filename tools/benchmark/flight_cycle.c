/* Flights of a filter, to be counted or timed; tools/bench builds it, runs it and explains its figures.
 *
 *     flight_cycle count WORK N STEPS ESS      one flight; callgrind collects inside bench_cycle
 *     flight_cycle time WORK N STEPS ESS R     R flights of the same inputs; of each step the shortest time counts
 *
 * WORK: land-vehicle, or chain-D with D states. ESS: the ratio below which the filter resamples; 0 never, 1 always.
 * Prints "name value" lines. */
#include "work.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

/* One filter cycle, the measured region: never inlined, and not static, so that callgrind finds its name. */
pfl_status_t bench_cycle(pfl_t *f, uint64_t t_us, const void *u, const float *z, float *mean);
__attribute__((noinline)) pfl_status_t bench_cycle(pfl_t *f, uint64_t t_us, const void *u, const float *z, float *mean)
{
    const pfl_status_t moved = pfl_predict(f, t_us, u);
    const pfl_status_t fused = (moved == PFL_OK) ? pfl_update(f, 0u, t_us, z) : moved;
    return (fused == PFL_OK) ? pfl_estimate(f, mean, NULL) : fused;
}

typedef struct {
    const work_t *work;
    const pfl_config_t *config;
    void *arena;
    size_t bytes;
    uint32_t steps;
    uint32_t resampled;
    uint64_t best_ns[WORK_STEPS_MAX];
} flight_t;

static uint64_t mix(uint64_t hash, const float *x, uint32_t n)
{
    for (uint32_t i = 0u; i < n; i++) {
        uint32_t u;
        memcpy(&u, &x[i], sizeof u);
        for (uint32_t k = 0u; k < 4u; k++) {
            hash = (hash ^ ((u >> (8u * k)) & 0xFFu)) * 0x100000001B3u;
        }
    }
    return hash;
}

static uint64_t now_ns(void)
{
    struct timespec t;
    (void)clock_gettime(CLOCK_MONOTONIC, &t);
    return ((uint64_t)t.tv_sec * 1000000000u) + (uint64_t)t.tv_nsec;
}

static void stop(const char *what, pfl_status_t status)
{
    fprintf(stderr, "flight_cycle: %s: %s\n", what, pfl_status_string(status));
    exit(3);
}

/* Flies once; keeps the shortest time of each step; returns the hash of all estimates. */
static uint64_t fly(flight_t *flight)
{
    uint64_t hash = 0xCBF29CE484222325u;
    float mean[PFL_STATES_MAX];
    pfl_health_t health;
    pfl_t *f = NULL;
    const pfl_status_t built = pfl_init(flight->arena, flight->bytes, flight->config, 0u, &f);
    if (built != PFL_OK) {
        stop("pfl_init", built);
    }
    for (uint32_t k = 0u; k < flight->steps; k++) {
        const void *u = flight->work->input(k);
        const float *z = flight->work->measured(k);
        const uint64_t start = now_ns();
        const pfl_status_t status = bench_cycle(f, (k + 1u) * (uint64_t)WORK_STEP_US, u, z, mean);
        const uint64_t took = now_ns() - start;
        if (status != PFL_OK) {
            stop("the filter cycle", status);
        }
        flight->best_ns[k] = (took < flight->best_ns[k]) ? took : flight->best_ns[k];
        hash = mix(hash, mean, flight->work->states);
    }
    (void)pfl_health(f, &health);
    flight->resampled = health.resampled;
    return hash;
}

static pfl_config_t config_of(const work_t *work, uint32_t particles, float ess_ratio, pfl_sensor_t *sensor)
{
    pfl_config_t c;
    memset(&c, 0, sizeof c);
    sensor->loglik = work->loglik;
    sensor->user = work->sensor;
    sensor->gate = 0.0f;
    c.abi = PFL_ABI;
    c.particles = particles;
    c.states = work->states;
    c.noises = work->noises;
    c.sensor_count = 1u;
    c.moments = PFL_MOMENTS_MEAN;
    c.ess_ratio = ess_ratio;
    c.seed = 1u;
    c.sensors = sensor;
    c.predict = work->predict;
    c.draw = work->draw;
    c.user = work->model;
    return c;
}

static const work_t *find_work(const char *name)
{
    if (strcmp(name, "land-vehicle") == 0) {
        return work_land_vehicle();
    }
    if (strcmp(name, "land-vehicle-antithetic") == 0) {
        return work_land_vehicle_antithetic();
    }
    const unsigned long states = (strncmp(name, "chain-", 6u) == 0) ? strtoul(name + 6, NULL, 10) : 0u;
    return ((states >= 2u) && (states <= PFL_STATES_MAX) && ((states % 2u) == 0u)) ? work_chain((uint16_t)states)
                                                                                   : NULL;
}

static void measure(flight_t *flight, uint32_t repeats, bool timed)
{
    const uint32_t n = flight->config->particles;
    uint64_t hash = 0u;
    uint64_t sum = 0u;
    memset(flight->best_ns, 0xFF, sizeof flight->best_ns);
    for (uint32_t r = 0u; r < repeats; r++) {
        hash = fly(flight);
    }
    for (uint32_t k = 0u; k < flight->steps; k++) {
        sum += flight->best_ns[k];
    }
    printf("hash %016" PRIx64 "\n", hash);
    printf("steps %" PRIu32 "\n", flight->steps);
    printf("arena_bytes %zu\n", flight->bytes);
    printf("resampled %" PRIu32 "\n", flight->resampled);
    if (timed) {
        printf("ns %.3f\n", (double)sum / ((double)n * flight->steps));
        printf("repetitions %" PRIu32 "\n", repeats);
    }
}

int main(int argc, char **argv)
{
    static flight_t flight;
    const bool timed = (argc == 7) && (strcmp(argv[1], "time") == 0);
    const bool counted = (argc == 6) && (strcmp(argv[1], "count") == 0);
    const unsigned long n = (argc >= 6) ? strtoul(argv[3], NULL, 10) : 0u;
    const unsigned long steps = (argc >= 6) ? strtoul(argv[4], NULL, 10) : 0u;
    const unsigned long repeats = timed ? strtoul(argv[6], NULL, 10) : 1u;
    flight.work = (argc >= 6) ? find_work(argv[2]) : NULL;
    if ((!timed && !counted) || (flight.work == NULL) || (n < 1u) || (n > PFL_PARTICLES_MAX) || (steps < 1u) ||
        (steps > WORK_STEPS_MAX) || (repeats < 1u)) {
        fprintf(stderr, "flight_cycle: usage: count WORK N STEPS ESS, or time WORK N STEPS ESS REPETITIONS\n");
        return 2;
    }
    pfl_sensor_t sensor;
    const pfl_config_t config = config_of(flight.work, (uint32_t)n, strtof(argv[5], NULL), &sensor);
    flight.config = &config;
    flight.steps = (uint32_t)steps;
    flight.bytes = PFL_ARENA_BYTES(n, flight.work->states, flight.work->noises);
    flight.arena = malloc(flight.bytes); /* of the benchmark, not of the library */
    if (flight.arena == NULL) {
        fprintf(stderr, "flight_cycle: no memory for %lu particles\n", n);
        return 3;
    }
    measure(&flight, (uint32_t)repeats, timed);
    free(flight.arena);
    return 0;
}
