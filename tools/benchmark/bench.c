/* One flight of the land-vehicle filter, to be counted or timed: position and speed seen, case 1 read as variances,
 * T = 0.5 s, theta = 0.5, 100 steps, known start. tools/bench builds it, runs it and explains its figures.
 *
 *     bench count N     one flight under callgrind, which collects inside bench_cycle
 *     bench time N R    R flights of the same inputs; per step the shortest time of all of them counts
 *
 * Prints "name value" lines. */
#include "pflight/pflight.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define STEPS 100u
#define STEP_US 500000u
#define VAR_W 5.0f
#define VAR_NOISE 10.0f

typedef struct {
    pfl_land_input_t input[STEPS];
    float z[STEPS][3];
} inputs_t;

static pfl_land_vehicle_t vehicle = {100000.0f, 0.3f, 1250.0f, 2.5f, 0.5f, 0.0f, 0.0f, 0.0f};
static pfl_position_t seen = {3u, {0u, 1u, 2u, 0u}, {0.0f, 0.0f, 0.0f, 0.0f}};

/* The start, known exactly. */
static void draw(void *user, const pfl_batch_t *p)
{
    static const float start[PFL_LAND_STATES] = {0.0f, 0.0f, 4.0f, 2.5f};
    (void)user;
    for (uint32_t d = 0u; d < PFL_LAND_STATES; d++) {
        for (uint32_t i = 0u; i < p->n; i++) {
            PFL_STATE(p, d)[i] = start[d];
        }
    }
}

static float steer_of(uint32_t k)
{
    if (k < 45u) {
        return -0.05f;
    }
    return (k < 65u) ? -0.005f : ((k < 80u) ? 0.01f : -0.01f);
}

/* Truth and measurements, by the library's own model on a batch of one. */
static void generate(inputs_t *in)
{
    float noise[PFL_BATCH * 3u];
    float x[PFL_LAND_STATES];
    const pfl_batch_t truth = {x, 1u, noise, 0u, 1u};
    pfl_rng_t rng;
    vehicle.sigma_position_mps = pfl_sqrtf(VAR_W);
    for (uint32_t k = 0u; k < 3u; k++) {
        seen.inv_sigma[k] = 1.0f / pfl_sqrtf(VAR_NOISE);
    }
    pfl_rng_seed(&rng, 2026u);
    draw(NULL, &truth);
    for (uint32_t k = 0u; k < STEPS; k++) {
        in->input[k].throttle = 0.03f;
        in->input[k].steer_rad = steer_of(k);
        pfl_rng_normals(&rng, noise, (sizeof noise / sizeof noise[0]) / 16u);
        pfl_land_vehicle_predict(&vehicle, &in->input[k], (float)STEP_US * 1.0e-6f, &truth);
        pfl_rng_normals(&rng, noise, 1u);
        for (uint32_t s = 0u; s < 3u; s++) {
            in->z[k][s] = x[s] + (pfl_sqrtf(VAR_NOISE) * noise[s]);
        }
    }
}

/* One filter cycle, the measured region: never inlined, and not static, so that callgrind finds its name. */
pfl_status_t bench_cycle(pfl_t *f, uint64_t t_us, const pfl_land_input_t *u, const float *z, float *mean);
__attribute__((noinline)) pfl_status_t bench_cycle(pfl_t *f, uint64_t t_us, const pfl_land_input_t *u, const float *z,
                                                   float *mean)
{
    const pfl_status_t moved = pfl_predict(f, t_us, u);
    const pfl_status_t fused = (moved == PFL_OK) ? pfl_update(f, 0u, t_us, z) : moved;
    return (fused == PFL_OK) ? pfl_estimate(f, mean, NULL) : fused;
}

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
    fprintf(stderr, "bench: %s: %s\n", what, pfl_status_string(status));
    exit(3);
}

/* Flies once; `best` (may be null) keeps the shortest time of each step. */
static uint64_t fly(void *arena, size_t bytes, const pfl_config_t *config, const inputs_t *in, uint64_t *best,
                    uint32_t *resampled)
{
    uint64_t hash = 0xCBF29CE484222325u;
    float mean[PFL_LAND_STATES];
    pfl_health_t health;
    pfl_t *f = NULL;
    const pfl_status_t built = pfl_init(arena, bytes, config, 0u, &f);
    if (built != PFL_OK) {
        stop("pfl_init", built);
    }
    for (uint32_t k = 0u; k < STEPS; k++) {
        const uint64_t start = (best != NULL) ? now_ns() : 0u;
        const pfl_status_t status = bench_cycle(f, (k + 1u) * (uint64_t)STEP_US, &in->input[k], in->z[k], mean);
        const uint64_t took = (best != NULL) ? (now_ns() - start) : 0u;
        if (status != PFL_OK) {
            stop("the filter cycle", status);
        }
        if ((best != NULL) && (took < best[k])) {
            best[k] = took;
        }
        hash = mix(hash, mean, PFL_LAND_STATES);
    }
    (void)pfl_health(f, &health);
    *resampled = health.resampled;
    return hash;
}

static pfl_config_t config_of(uint32_t particles, const pfl_sensor_t *sensor)
{
    pfl_config_t c;
    memset(&c, 0, sizeof c);
    c.abi = PFL_ABI;
    c.particles = particles;
    c.states = PFL_LAND_STATES;
    c.noises = 2u;
    c.sensor_count = 1u;
    c.moments = PFL_MOMENTS_MEAN;
    c.ess_ratio = 0.5f;
    c.seed = 1u;
    c.sensors = sensor;
    c.predict = pfl_land_vehicle_predict;
    c.draw = draw;
    c.user = &vehicle;
    return c;
}

static void report_time(void *arena, size_t bytes, const pfl_config_t *config, const inputs_t *in, uint32_t repeats)
{
    uint64_t best[STEPS];
    uint64_t sum = 0u;
    uint32_t resampled;
    memset(best, 0xFF, sizeof best);
    for (uint32_t r = 0u; r < repeats; r++) {
        (void)fly(arena, bytes, config, in, best, &resampled);
    }
    for (uint32_t k = 0u; k < STEPS; k++) {
        sum += best[k];
    }
    printf("ns %.3f\n", (double)sum / ((double)config->particles * STEPS));
    printf("repetitions %" PRIu32 "\n", repeats);
}

int main(int argc, char **argv)
{
    static inputs_t inputs;
    const bool timed = (argc == 4) && (strcmp(argv[1], "time") == 0);
    const bool counted = (argc == 3) && (strcmp(argv[1], "count") == 0);
    const unsigned long n = (argc >= 3) ? strtoul(argv[2], NULL, 10) : 0u;
    const unsigned long repeats = timed ? strtoul(argv[3], NULL, 10) : 1u;
    if ((!timed && !counted) || (n < 1u) || (n > PFL_PARTICLES_MAX) || (repeats < 1u)) {
        fprintf(stderr, "bench: usage: bench count N, or bench time N REPETITIONS\n");
        return 2;
    }
    generate(&inputs);
    const pfl_sensor_t sensor = {.loglik = pfl_position_loglik, .user = &seen};
    const pfl_config_t config = config_of((uint32_t)n, &sensor);
    const size_t bytes = PFL_ARENA_BYTES(n, PFL_LAND_STATES, 2u);
    void *arena = malloc(bytes); /* of the benchmark, not of the library */
    if (arena == NULL) {
        fprintf(stderr, "bench: no memory for %lu particles\n", n);
        return 3;
    }
    if (timed) {
        report_time(arena, bytes, &config, &inputs, (uint32_t)repeats);
    } else {
        uint32_t resampled = 0u;
        const uint64_t hash = fly(arena, bytes, &config, &inputs, NULL, &resampled);
        printf("hash %016" PRIx64 "\n", hash);
        printf("steps %u\n", STEPS);
        printf("arena_bytes %zu\n", bytes);
        printf("resampled %" PRIu32 "\n", resampled);
    }
    free(arena);
    return 0;
}
