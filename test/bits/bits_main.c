/* Prints a hash of everything the library computes, one line a part: test/checks/bits compares the lines of many
 * compilers with golden.txt. Inputs come from integers only, never from a C library's mathematics. */
#include "hashing.h"

#include "pflight/pflight.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define INPUTS 1000000u
#define N_MAX 1000u
#define D_MAX 6u
#define STEPS 6u

static uint64_t state;
static uint64_t hash;
static union {
    uint64_t align;
    unsigned char bytes[PFL_ARENA_BYTES(N_MAX, D_MAX, D_MAX) + PFL_RETRY_BYTES(D_MAX)];
} arena, second;
static unsigned char snapshot[8u * (size_t)N_MAX * (D_MAX + 2u)];
static float out_a[INPUTS], out_b[INPUTS], in_a[INPUTS], in_b[INPUTS];

/* ---- Hash and inputs ------------------------------------------------------------------------------------------ */

void begin(uint64_t seed)
{
    state = seed;
    hash = 0xCBF29CE484222325u;
}

void end(const char *part)
{
    printf("%-28s %08lx%08lx\n", part, (unsigned long)(hash >> 32), (unsigned long)(hash & 0xFFFFFFFFu));
}

static void mix_u32(uint32_t u)
{
    hash = (hash ^ u) * 0x9E3779B97F4A7C15u;
    hash ^= hash >> 29;
}

/* The bits of a NaN are the processor's own, so all NaN count as one. */
void mix(float x)
{
    uint32_t u;
    memcpy(&u, &x, sizeof u);
    mix_u32(((u & 0x7FFFFFFFu) > 0x7F800000u) ? 0x7FC00000u : u);
}

static void mix_all(const float *x, size_t n)
{
    for (size_t i = 0u; i < n; i++) {
        mix(x[i]);
    }
}

/* SplitMix64 */
static uint32_t next_u32(void)
{
    state += 0x9E3779B97F4A7C15u;
    uint64_t z = state;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return (uint32_t)(z >> 32);
}

/* low .. high, in steps of 2^-24 of it */
float between(float low, float high)
{
    const float share = (float)(int32_t)(next_u32() >> 8) * 5.9604644775390625e-8f;
    return low + ((high - low) * share);
}

/* Any bits, of every class of float. */
static float any_float(void)
{
    const uint32_t u = next_u32();
    float x;
    memcpy(&x, &u, sizeof x);
    return x;
}

/* ---- Mathematics ---------------------------------------------------------------------------------------------- */

typedef float (*unary_fn)(float);

static void fill(float low, float high)
{
    for (uint32_t i = 0u; i < INPUTS; i++) {
        in_a[i] = between(low, high);
        in_b[i] = between(low, high);
    }
}

static void unary(const char *part, unary_fn function, float low, float high)
{
    begin(1u);
    fill(low, high);
    for (uint32_t i = 0u; i < INPUTS; i++) {
        mix(function(in_a[i]));
    }
    end(part);
}

static void of_any_floats(void)
{
    begin(2u);
    for (uint32_t i = 0u; i < INPUTS; i++) {
        const float x = any_float();
        mix(pfl_expf(x));
        mix(pfl_logf(x));
        mix(pfl_sqrtf(x));
        const float y = any_float();
        mix(pfl_atan2f(y, x));
    }
    end("any-float");
}

static void of_arrays(void)
{
    fill(-80.0f, 80.0f);
    begin(0u);
    pfl_expf_n(in_a, out_a, INPUTS);
    mix_all(out_a, INPUTS);
    pfl_sincosf_n(in_a, out_a, out_b, INPUTS);
    mix_all(out_a, INPUTS);
    mix_all(out_b, INPUTS);
    pfl_atan2f_n(in_a, in_b, out_a, INPUTS);
    mix_all(out_a, INPUTS);
    pfl_logf_n(in_b, out_a, INPUTS);
    mix_all(out_a, INPUTS);
    end("arrays");
    begin(0u); /* the same, one by one: must be the same hash */
    for (uint32_t i = 0u; i < INPUTS; i++) {
        mix(pfl_expf(in_a[i]));
    }
    for (uint32_t i = 0u; i < INPUTS; i++) {
        mix(pfl_sinf(in_a[i]));
    }
    for (uint32_t i = 0u; i < INPUTS; i++) {
        mix(pfl_cosf(in_a[i]));
    }
    for (uint32_t i = 0u; i < INPUTS; i++) {
        mix(pfl_atan2f(in_a[i], in_b[i]));
    }
    for (uint32_t i = 0u; i < INPUTS; i++) {
        mix(pfl_logf(in_b[i]));
    }
    end("arrays-one-by-one");
}

static void of_math(void)
{
    unary("exp", pfl_expf, -90.0f, 90.0f);
    unary("log", pfl_logf, 0.0f, 1.0e6f);
    unary("log-near-1", pfl_logf, 0.5f, 2.0f);
    unary("sin", pfl_sinf, -1608.0f, 1608.0f);
    unary("cos", pfl_cosf, -1608.0f, 1608.0f);
    unary("tan", pfl_tanf, -3.0f, 3.0f);
    unary("sqrt", pfl_sqrtf, 0.0f, 1.0e9f);
    unary("wrap-pi", pfl_wrap_pi, -6400.0f, 6400.0f);
    of_any_floats();
    of_arrays();
}

/* ---- Random numbers ------------------------------------------------------------------------------------------- */

static void of_random(void)
{
    pfl_rng_t rng;
    begin(0u);
    for (uint64_t seed = 0u; seed < 50u; seed++) {
        pfl_rng_seed(&rng, seed * 0x123456789ABCDEFu);
        for (uint32_t k = 0u; k < 2000u; k++) {
            mix_u32(pfl_rng_u32(&rng));
        }
        pfl_rng_long_jump(&rng);
        mix_u32(pfl_rng_u32(&rng));
    }
    end("rng-u32");
    begin(0u);
    pfl_rng_seed(&rng, 4u);
    pfl_rng_normals(&rng, out_a, INPUTS / 16u);
    mix_all(out_a, INPUTS);
    pfl_rng_long_jump(&rng);
    pfl_rng_normals(&rng, out_a, 100u);
    mix_all(out_a, 1600u);
    end("rng-normals");
}

/* ---- Filter runs ---------------------------------------------------------------------------------------------- */

/* A filter run: its configuration, and what it flies on. */
typedef struct {
    pfl_config_t config;
    pfl_sensor_t sensors[2];
    const void *u;
    const void *z[2];
} run_t;

static void die_of(const char *what, pfl_status_t status)
{
    fprintf(stderr, "bits_main: %s answered %d: %s\n", what, (int)status, pfl_status_string(status));
    exit(3);
}

static void require(const char *what, pfl_status_t status)
{
    if (status < PFL_OK) {
        die_of(what, status);
    }
}

/* Every state drifts with its neighbour and its own noise, with a product in it for contraction to show. */
static void mill(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    const uint32_t states = ((const pfl_config_t *)user)->states;
    const float push = *(const float *)u;
    for (uint32_t d = 0u; d < states; d++) {
        float *x = PFL_STATE(p, d);
        const float *next = PFL_STATE(p, (d + 1u) % states);
        for (uint32_t i = 0u; i < p->n; i++) {
            x[i] = (x[i] * 0.97f) + ((dt_s * (next[i] + push)) + (0.3f * PFL_NOISE(p, d)[i]));
        }
    }
}

static void see_first_and_last(void *user, const void *z, const pfl_view_t *p, float *ll)
{
    const size_t last = (size_t)((const pfl_config_t *)user)->states - 1u;
    const float measured = *(const float *)z;
    for (uint32_t i = 0u; i < p->n; i++) {
        const float a = pfl_wrap_pi(p->x[i] - measured) * 1.7f;
        const float b = (p->x[(last * p->stride) + i] + (0.5f * measured)) * 0.9f;
        ll[i] = -0.5f * ((a * a) + (b * b));
    }
}

static void scatter(void *user, const pfl_batch_t *p)
{
    const uint32_t states = ((const pfl_config_t *)user)->states;
    for (uint32_t d = 0u; d < states; d++) {
        for (uint32_t i = 0u; i < p->n; i++) {
            PFL_STATE(p, d)[i] = (2.0f * PFL_NOISE(p, d)[i]) + (0.25f * (float)(int32_t)d);
        }
    }
}

static run_t *mill_run(run_t *run, uint32_t n, uint16_t d)
{
    memset(run, 0, sizeof *run);
    run->config.abi = PFL_ABI;
    run->config.particles = n;
    run->config.states = d;
    run->config.noises = d;
    run->config.sensor_count = 1u;
    run->config.ess_ratio = 0.6f;
    run->config.seed = ((uint64_t)n * 100u) + d;
    run->config.sensors = run->sensors;
    run->config.predict = mill;
    run->config.draw = scatter;
    run->config.user = &run->config;
    run->sensors[0].loglik = see_first_and_last;
    return run;
}

static void mix_answers(pfl_t *f, const pfl_config_t *c)
{
    float mean[D_MAX];
    float cov[D_MAX * D_MAX];
    const bool full = c->moments == (uint16_t)PFL_MOMENTS_FULL;
    require("pfl_estimate", pfl_estimate(f, mean, full ? cov : NULL));
    mix_all(mean, c->states);
    mix_all(cov, full ? ((size_t)c->states * c->states) : 0u);
    require("pfl_most_likely", pfl_most_likely(f, mean));
    mix_all(mean, c->states);
    mix(pfl_effective_sample_size(f));
}

static void mix_cloud(const pfl_t *f, const pfl_config_t *c)
{
    pfl_view_t view;
    require("pfl_particles", pfl_particles(f, &view, out_b));
    for (size_t d = 0u; d < c->states; d++) {
        mix_all(&view.x[d * view.stride], view.n);
    }
    mix_all(out_b, view.n);
}

/* Flies the run and leaves the filter for more. */
static pfl_t *fly(run_t *run)
{
    pfl_t *f = NULL;
    require("pfl_init", pfl_init(&arena, sizeof arena, &run->config, 0u, &f));
    for (uint64_t k = 1u; k <= STEPS; k++) {
        const float push = between(-1.0f, 1.0f);
        require("pfl_predict", pfl_predict(f, k * 100000u, (run->u != NULL) ? run->u : &push));
        if ((k % 3u) == 0u) {
            mix_answers(f, &run->config); /* moments of the prediction */
        }
        for (uint16_t s = 0u; s < run->config.sensor_count; s++) {
            const float z = between(-0.8f, 0.8f);
            const void *measured = (run->z[s] != NULL) ? run->z[s] : &z;
            mix_u32((uint32_t)(int32_t)pfl_update(f, s, k * 100000u, measured));
            mix_answers(f, &run->config);
        }
    }
    mix_cloud(f, &run->config);
    return f;
}

static const pfl_scheme_fn schemes[] = {pfl_systematic, pfl_stratified, pfl_residual, pfl_multinomial};

static void of_schemes(void)
{
    static const uint32_t sizes[] = {1u, 7u, 16u, 17u, 64u, 65u, 80u, 300u, 1000u};
    static const char *const names[] = {"systematic", "stratified", "residual", "multinomial"};
    run_t run;
    for (uint16_t scheme = 0u; scheme < 4u; scheme++) {
        for (uint16_t moments = 0u; moments < 2u; moments++) {
            char part[40];
            begin(scheme);
            for (size_t s = 0u; s < (sizeof sizes / sizeof sizes[0]); s++) {
                for (uint16_t d = 1u; d <= D_MAX; d++) {
                    mill_run(&run, sizes[s], d)->config.resampling = schemes[scheme];
                    run.config.moments = moments;
                    (void)fly(&run);
                }
            }
            (void)snprintf(part, sizeof part, "%s-%s", names[scheme], (moments == 0u) ? "full" : "mean");
            end(part);
        }
    }
}

static void of_options(void)
{
    static const float lo[D_MAX] = {-1.0f, -0.5f, -1.0e3f, -2.0f, -0.1f, -0.3f};
    static const float hi[D_MAX] = {0.75f, 0.5f, 1.0e3f, 1.5f, 0.2f, 0.4f};
    run_t run;
    begin(10u);
    for (uint32_t n = 1u; n <= 300u; n += 23u) {
        for (uint16_t d = 1u; d <= D_MAX; d++) {
            mill_run(&run, n, d)->config.circular_mask = 0x2Du & ((1u << d) - 1u);
            run.config.circular = pfl_circular_means;
            (void)fly(&run);
        }
    }
    end("circular");
    begin(11u);
    for (uint16_t d = 1u; d <= D_MAX; d++) {
        mill_run(&run, 300u, d)->config.lo = lo;
        run.config.hi = hi;
        (void)fly(&run);
    }
    end("box");
    begin(12u);
    mill_run(&run, 300u, 3u)->config.dt_max_us = 33333u;
    run.sensors[0].gate = 2.0f;
    (void)fly(&run);
    run.config.ess_ratio = 1.0f;
    (void)fly(&run);
    run.config.ess_ratio = 0.0f;
    (void)fly(&run);
    end("substeps-gate-ratio");
}

/* Particles belong into the ring 0.5 <= |x_0| <= 1.5. */
static void ring_inside(void *user, const pfl_view_t *p, uint32_t *inside)
{
    (void)user;
    for (uint32_t i = 0u; i < p->n; i++) {
        const float r = pfl_sqrtf(p->x[i] * p->x[i]);
        inside[i] = ((r >= 0.5f) && (r <= 1.5f)) ? 1u : 0u;
    }
}

static void ring_project(void *user, const pfl_batch_t *p)
{
    (void)user;
    for (uint32_t i = 0u; i < p->n; i++) {
        const float r = pfl_sqrtf(p->x[i] * p->x[i]);
        const float wanted = (r < 0.5f) ? 0.5f : ((r > 1.5f) ? 1.5f : r);
        p->x[i] = (p->x[i] < 0.0f) ? -wanted : wanted;
    }
}

static void of_constraint_and_kernel(void)
{
    static const uint32_t tries[] = {1u, 2u, 20u};
    static const pfl_kernel_t kernel[] = {{0.1f, 0u, pfl_kernel_move}, {0.4f, 5u, pfl_kernel_move}};
    run_t run;
    begin(13u);
    for (size_t k = 0u; k < (sizeof tries / sizeof tries[0]); k++) {
        const pfl_constraint_t ring = {ring_inside, ring_project, NULL, tries[k], 0u, pfl_constraint_keep};
        for (uint32_t n = 1u; n <= 300u; n += 99u) {
            mill_run(&run, n, 3u)->config.constraint = &ring;
            (void)fly(&run);
        }
    }
    end("constraint");
    begin(14u);
    for (size_t k = 0u; k < (sizeof kernel / sizeof kernel[0]); k++) {
        for (uint16_t scheme = 0u; scheme < 4u; scheme++) {
            mill_run(&run, 300u, 4u)->config.resampling = schemes[scheme];
            run.config.circular_mask = 1u;
            run.config.circular = pfl_circular_means;
            run.config.ess_ratio = 0.9f;
            run.config.kernel = &kernel[k];
            (void)fly(&run);
        }
    }
    end("kernel");
}

static void of_quantiles(void)
{
    static const float shares[] = {1.0e-6f, 0.01f, 0.25f, 0.5f, 0.9f, 0.999f, 1.0f};
    run_t run;
    begin(20u);
    for (uint32_t n = 1u; n <= 1000u; n += 111u) {
        mill_run(&run, n, 2u)->config.ess_ratio = 0.1f;
        pfl_t *f = fly(&run);
        for (size_t k = 0u; k < (sizeof shares / sizeof shares[0]); k++) {
            float value;
            require("pfl_quantile", pfl_quantile(f, (uint16_t)(k % 2u), shares[k], &value));
            mix(value);
        }
    }
    end("quantiles");
}

static const void *steady(void *user, uint32_t step, uint64_t t_us)
{
    (void)step;
    (void)t_us;
    return user;
}

static void of_forecast(void)
{
    float push = 0.125f;
    float mean[8u * 4u];
    float cov[8u * 16u];
    const pfl_horizon_t horizon = {50000u, 8u, steady, &push, NULL, NULL};
    run_t run;
    begin(21u);
    for (uint16_t scheme = 0u; scheme < 4u; scheme++) {
        mill_run(&run, 300u, 4u)->config.resampling = schemes[scheme];
        pfl_t *f = fly(&run);
        pfl_t *ahead = NULL;
        require("pfl_forecast", pfl_forecast(f, &second, sizeof second, &horizon, mean, cov, &ahead));
        mix_all(mean, sizeof mean / sizeof mean[0]);
        mix_all(cov, sizeof cov / sizeof cov[0]);
        mix_cloud(ahead, &run.config);
        mix_cloud(f, &run.config);
    }
    end("forecast");
}

static void mix_snapshot(const pfl_t *f)
{
    const size_t bytes = pfl_snapshot_bytes(f);
    require("pfl_snapshot", pfl_snapshot(f, snapshot, sizeof snapshot));
    for (size_t i = 0u; i < bytes; i++) {
        mix_u32(snapshot[i]);
    }
}

static void of_snapshots(void)
{
    float delta[D_MAX];
    const float push = 0.5f;
    run_t run;
    begin(22u);
    for (uint32_t n = 1u; n <= 500u; n += 83u) {
        pfl_t *f = fly(mill_run(&run, n, 5u));
        mix_snapshot(f);
        require("pfl_restore", pfl_restore(f, snapshot, sizeof snapshot));
        require("pfl_predict", pfl_predict(f, (STEPS + 1u) * 100000u, &push));
        require("pfl_resample", pfl_resample(f));
        mix_snapshot(f);
        require("pfl_reset", pfl_reset(f, 5u));
        require("pfl_last_reset", pfl_last_reset(f, NULL, NULL, delta));
        mix_all(delta, 5u);
        mix_snapshot(f);
    }
    end("snapshot-reset");
}

/* ---- Ready models and sensors --------------------------------------------------------------------------------- */

static void of_land_vehicle(void)
{
    static const pfl_land_vehicle_t car = {100000.0f, 0.3f, 1250.0f, 2.5f, 0.5f, 2.2360680f, 0.05f, 0.02f};
    static const pfl_land_input_t input = {0.03f, -0.05f};
    static const pfl_position_t seen[2] = {{3u, {0u, 1u, 2u, 0u}, {0.31622777f, 0.31622777f, 0.31622777f, 0.0f}},
                                           {4u, {0u, 1u, 2u, 3u}, {0.3f, 0.2f, 0.1f, 2.0f}}};
    static const float z[4] = {0.3f, -0.2f, 0.6f, 0.1f};
    run_t run;
    for (uint16_t jitter = 0u; jitter < 2u; jitter++) {
        begin(30u);
        mill_run(&run, 300u, 4u);
        run.config.noises = (jitter != 0u) ? 4u : 2u;
        run.config.predict = (jitter != 0u) ? pfl_land_vehicle_jitter_predict : pfl_land_vehicle_predict;
        run.config.draw = NULL;
        run.config.user = (void *)(uintptr_t)&car;
        run.sensors[0].loglik = pfl_position_loglik;
        run.sensors[0].user = (void *)(uintptr_t)&seen[jitter];
        run.u = &input;
        run.z[0] = z;
        (void)fly(&run);
        end((jitter != 0u) ? "land-vehicle-jitter" : "land-vehicle");
    }
}

static void of_constant_velocity(void)
{
    static const pfl_range_t range[2] = {{0u, 1u, 2.0f, 3.0f}, {0u, 1u, 2.0f, 0.0f}};
    static const pfl_range_z_t z[2] = {{3.0f, 4.0f, 1.5f, 5.25f, 1.0f}, {-3.0f, 1.0f, 0.0f, 3.0f, 1.7f}};
    pfl_constant_velocity_t model = {0.7f, 0.0f};
    run_t run;
    begin(31u);
    for (uint16_t k = 0u; k < 2u; k++) {
        mill_run(&run, 300u, 4u)->config.sensor_count = 2u;
        run.config.predict = pfl_constant_velocity_predict;
        run.config.draw = NULL;
        run.config.user = &model;
        for (uint16_t s = 0u; s < 2u; s++) {
            run.sensors[s].loglik = pfl_range_loglik;
            run.sensors[s].user = (void *)(uintptr_t)&range[s];
            run.z[s] = &z[s];
        }
        (void)fly(&run);
        model.sigma_position = 0.4f;
    }
    end("constant-velocity-range");
}

static void of_odometry(void)
{
    static const pfl_odometry_t model = {1.02f, 0.1f, 0.2f, 0.05f, 0.08f};
    static const pfl_odometry_input_t input = {-1.5f, 0.6f};
    static const pfl_range_bearing_t seen = {0u, 1u, 2.0f, 4.0f};
    static const pfl_range_bearing_z_t z = {-2.0f, 1.0f, 2.3f, 5.8f};
    static const pfl_position_t first[2] = {{1u, {0u, 0u, 0u, 0u}, {0.9f, 0.0f, 0.0f, 0.0f}},
                                            {2u, {1u, 0u, 0u, 0u}, {0.9f, 0.7f, 0.0f, 0.0f}}};
    static const float place[2] = {0.1f, -0.2f};
    run_t run;
    begin(32u);
    for (uint16_t k = 0u; k < 2u; k++) {
        mill_run(&run, 300u, 3u)->config.sensor_count = 2u;
        run.config.noises = 4u;
        run.config.circular_mask = 4u;
        run.config.circular = pfl_circular_means;
        run.config.predict = pfl_odometry_predict;
        run.config.draw = NULL;
        run.config.user = (void *)(uintptr_t)&model;
        run.sensors[0].loglik = pfl_range_bearing_loglik;
        run.sensors[0].user = (void *)(uintptr_t)&seen;
        run.sensors[1].loglik = pfl_position_loglik;
        run.sensors[1].user = (void *)(uintptr_t)&first[k];
        run.u = &input;
        run.z[0] = &z;
        run.z[1] = place;
        (void)fly(&run);
    }
    end("odometry-range-bearing");
}

int main(void)
{
    const pfl_status_t trusted = pfl_self_test(&arena, sizeof arena);
    printf("%-28s %s\n", "self-test", (trusted == PFL_OK) ? "ok" : "FAILED");
    of_math();
    of_random();
    of_schemes();
    of_options();
    of_constraint_and_kernel();
    of_quantiles();
    of_forecast();
    of_snapshots();
    of_land_vehicle();
    of_constant_velocity();
    of_odometry();
    of_modules();
    return 0;
}
