/* The runner with other choices in its filters than the scenarios make: linked into it with the linker's --wrap, so that
 * every scenario takes part as it is. For tools/study; what it asks for comes in the environment:
 *
 * PFLIGHT_STUDY_SCHEME=0..3      the resampling scheme: systematic, stratified, residual, multinomial
 * PFLIGHT_STUDY_ESS=R            ess_ratio, of filters whose configuration has one
 * PFLIGHT_STUDY_NOISE=KIND       plain, antithetic, quasi, array (noise.h)
 * PFLIGHT_STUDY_VALUES=FILE      the runs' values go there, one line a run
 * PFLIGHT_STUDY_FILTER=I/M       of M filters that a run makes, one after the other, the I-th is looked at, from 1: its calls
 *                                go through count_*, where a profiler collects; at the end their cycles are printed to
 *                                standard error. One thread
 * PFLIGHT_STUDY_CYCLES=K         all ends after K of them: enough to know what one costs
 * PFLIGHT_STUDY_ESTIMATES=FILE   and its estimates go there: the first two states, two floats a call of pfl_estimate */
#include "monte_carlo.h"
#include "noise.h"

#include "pflight/pflight.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define WRAP(type, name, arguments)                                                                                    \
    type __real_##name arguments;                                                                                      \
    type __wrap_##name arguments;                                                                                      \
    type __wrap_##name arguments

/* Of a thread's latest filter; no scenario flies two at once. */
typedef struct {
    pfl_config_t config;
    pfl_predict_fn predict;
    noise_t noise;
    uint32_t noises;
} override_t;

__extension__ static __thread override_t *latest;
static unsigned long looked_at, of_filters, filters, cycles, cycles_max;
static FILE *estimates;

static const char *wish(const char *name, const char *otherwise)
{
    const char *value = getenv(name);
    return value != NULL && value[0] != '\0' ? value : otherwise;
}

/* ---- The filter --------------------------------------------------------------------------------------------------- */

static void predict_with_noise(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    float noise[PFL_NOISES_MAX * PFL_BATCH];
    pfl_batch_t batch = *p;

    noise_fill(&latest->noise, p, noise);
    batch.noise = noise;
    latest->predict(user, u, dt_s, &batch);
}

static void predict_antithetic(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    pfl_antithetic_t antithetic = {latest->predict, user, latest->noises};
    pfl_antithetic_predict(&antithetic, u, dt_s, p);
}

/* What ours cost is all that there is to count: the library makes no noise that nobody wants. */
static bool take_noise(const pfl_config_t *config)
{
    const noise_kind_t kind = noise_kind(wish("PFLIGHT_STUDY_NOISE", "plain"));

    latest->predict = config->predict;
    latest->noises = config->noises;
    if (kind == NOISE_PLAIN || config->noises == 0u) {
        return true;
    }
    if (kind == NOISE_ANTITHETIC) {
        latest->config.noises = (uint16_t)PFL_ANTITHETIC_NOISES(config->noises);
        latest->config.predict = predict_antithetic;
        return config->noises <= PFL_ANTITHETIC_MAX;
    }
    latest->config.noises = 0u;
    latest->config.predict = predict_with_noise;
    return noise_start(&latest->noise, kind, config);
}

WRAP(pfl_status_t, pfl_init, (void *arena, size_t arena_bytes, const pfl_config_t *config, uint64_t t_us, pfl_t **out))
{
    static const pfl_scheme_fn schemes[] = {pfl_systematic, pfl_stratified, pfl_residual, pfl_multinomial};
    const char *scheme = wish("PFLIGHT_STUDY_SCHEME", NULL);
    const char *ess = wish("PFLIGHT_STUDY_ESS", NULL);

    if (looked_at > 0u) {
        filters++;
    }
    if (latest != NULL) {
        noise_free(&latest->noise);
        free(latest);
    }
    latest = calloc(1u, sizeof *latest);
    if (latest == NULL) {
        return PFL_ERR_MEMORY;
    }
    latest->config = *config;
    if (scheme != NULL) {
        latest->config.resampling = schemes[strtoul(scheme, NULL, 10) & 3u];
    }
    if (ess != NULL && config->ess_ratio > 0.0f) {
        latest->config.ess_ratio = strtof(ess, NULL);
    }
    if (!take_noise(config)) {
        return PFL_ERR_MEMORY;
    }
    return __real_pfl_init(arena, arena_bytes, &latest->config, t_us, out);
}

/* ---- Counting: the calls of a cycle, of one filter -------------------------------------------------------------------- */

pfl_status_t __real_pfl_predict(pfl_t *f, uint64_t t_us, const void *u);
pfl_status_t __real_pfl_update(pfl_t *f, uint16_t sensor, uint64_t t_us, const void *z);
pfl_status_t __real_pfl_resample(pfl_t *f);
pfl_status_t __real_pfl_estimate(pfl_t *f, float *mean, float *cov);

__attribute__((noinline)) static pfl_status_t count_predict(pfl_t *f, uint64_t t_us, const void *u)
{
    const pfl_status_t status = __real_pfl_predict(f, t_us, u);
    cycles++;
    return status;
}

__attribute__((noinline)) static pfl_status_t count_update(pfl_t *f, uint16_t sensor, uint64_t t_us, const void *z)
{
    const pfl_status_t status = __real_pfl_update(f, sensor, t_us, z);
    __asm__ volatile(""); /* no tail call: a profiler is to see the function return */
    return status;
}

__attribute__((noinline)) static pfl_status_t count_resample(pfl_t *f)
{
    const pfl_status_t status = __real_pfl_resample(f);
    __asm__ volatile("");
    return status;
}

__attribute__((noinline)) static pfl_status_t count_estimate(pfl_t *f, float *mean, float *cov)
{
    const pfl_status_t status = __real_pfl_estimate(f, mean, cov);
    __asm__ volatile("");
    return status;
}

static bool is_counted(void)
{
    return looked_at > 0u && (filters - 1u) % of_filters == looked_at - 1u;
}

static void write_estimate(const float *mean)
{
    if (estimates != NULL && fwrite(mean, sizeof *mean, 2u, estimates) != 2u) {
        (void)fprintf(stderr, "study: cannot write the estimates\n");
        exit(3);
    }
}

WRAP(pfl_status_t, pfl_predict, (pfl_t * f, uint64_t t_us, const void *u))
{
    if (cycles_max > 0u && cycles == cycles_max) {
        (void)fprintf(stderr, "cycles %lu\n", cycles);
        exit(0);
    }
    return is_counted() ? count_predict(f, t_us, u) : __real_pfl_predict(f, t_us, u);
}

WRAP(pfl_status_t, pfl_update, (pfl_t * f, uint16_t sensor, uint64_t t_us, const void *z))
{
    return is_counted() ? count_update(f, sensor, t_us, z) : __real_pfl_update(f, sensor, t_us, z);
}

WRAP(pfl_status_t, pfl_resample, (pfl_t * f))
{
    return is_counted() ? count_resample(f) : __real_pfl_resample(f);
}

WRAP(pfl_status_t, pfl_estimate, (pfl_t * f, float *mean, float *cov))
{
    if (!is_counted()) {
        return __real_pfl_estimate(f, mean, cov);
    }
    const pfl_status_t status = count_estimate(f, mean, cov);
    write_estimate(mean);
    return status;
}

/* ---- The runs' values ------------------------------------------------------------------------------------------------- */

static bool write_values(const char *path, const study_t *study, const plan_t *plan, const results_t *results)
{
    FILE *file = fopen(path, "w");

    if (file == NULL) {
        return false;
    }
    for (uint32_t r = 0u; r < study->runs; r++) {
        for (size_t v = 0u; v < plan->values; v++) {
            (void)fprintf(file, "%.17g%c", results->value[r * plan->values + v], v + 1u < plan->values ? ' ' : '\n');
        }
    }
    return fclose(file) == 0;
}

WRAP(bool, monte_carlo,
     (const study_t *study, const plan_t *plan, unsigned threads, results_t *results, failure_t *failure))
{
    const char *path = wish("PFLIGHT_STUDY_VALUES", NULL);
    const char *wanted = wish("PFLIGHT_STUDY_FILTER", "");
    const char *file = wish("PFLIGHT_STUDY_ESTIMATES", NULL);
    char *rest;

    looked_at = strtoul(wanted, &rest, 10);
    of_filters = looked_at > 0u ? strtoul(rest + 1, NULL, 10) : 1u;
    cycles_max = strtoul(wish("PFLIGHT_STUDY_CYCLES", "0"), NULL, 10);
    estimates = file != NULL ? fopen(file, "wb") : NULL;
    const bool done = __real_monte_carlo(study, plan, looked_at > 0u ? 1u : threads, results, failure);
    if (estimates != NULL) {
        (void)fclose(estimates);
    }
    if (looked_at > 0u) {
        (void)fprintf(stderr, "cycles %lu\n", cycles);
    }
    if (done && path != NULL && !write_values(path, study, plan, results)) {
        results_free(results);
        return fail(failure, EXIT_HARNESS, "PFLIGHT_STUDY_VALUES='%s': cannot write this file", path);
    }
    return done;
}
