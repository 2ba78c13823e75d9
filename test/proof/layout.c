/* The arena's layout by exhaustion: every number of states and noises, with and without retries and watch, at three strides. The
 * pieces must lie end to end, in order, aligned, with room for what is kept in them, and end where the arena ends. The
 * columns are the only pieces that grow with N, each by one stride: so it holds for every N. */
#include "core.h"

#include <stdio.h>

#define PARTICLES 24u

static union {
    uint64_t align;
    unsigned char bytes[PFL_ARENA_BYTES(PARTICLES, PFL_STATES_MAX, PFL_NOISES_MAX) + PFL_RETRY_BYTES(PFL_STATES_MAX) +
                        PFL_WATCH_BYTES(PFL_SENSORS_MAX)];
} arena;

static void predict(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    (void)user;
    (void)u;
    (void)dt_s;
    (void)p;
}

static void inside(void *user, const pfl_view_t *p, uint32_t *flags)
{
    (void)user;
    (void)p;
    (void)flags;
}

static void project(void *user, const pfl_batch_t *p)
{
    (void)user;
    (void)p;
}

static void keep(pfl_t *f, const void *u, float dt_s, uint32_t first, uint32_t n)
{
    (void)f;
    (void)u;
    (void)dt_s;
    (void)first;
    (void)n;
}

void pfl_port_fault(int32_t status)
{
    (void)status;
}

static bool follows(const float **end, const float *piece, size_t floats, size_t slack)
{
    const bool good = (piece >= *end) && (piece <= (*end + slack));
    *end = piece + floats;
    return good;
}

/* Canaries. */
static bool gap(const float **end)
{
    *end += PFL_CANARY_FLOATS;
    return true;
}

static bool lies_well(const pfl_t *f, const pfl_config_t *c, const unsigned char *stop)
{
    const size_t d = c->states;
    const size_t triangle = (d * (d + 1u)) / 2u;
    const size_t wide = PFL_MAX(d, c->noises);
    const float *end = (const float *)(const void *)(arena.bytes + PFL_CONTROL_BYTES);
    bool good = sizeof(pfl_t) <= PFL_CONTROL_BYTES;
    good = good && follows(&end, f->mean, d, 0u) && follows(&end, f->best, d, 0u) && follows(&end, f->centre, d, 0u);
    good = good && follows(&end, f->delta, d, 0u) && follows(&end, f->cov, triangle, 0u);
    good = good && follows(&end, f->kernel_mean, d, 0u) && follows(&end, f->kernel_cov, triangle, 0u);
    good = good && follows(&end, f->lanes, 8u * (2u + (3u * d) + triangle), 7u); /* rows of moments.c */
    good = good && ((8u * (2u + (3u * d) + triangle)) >= (d * PFL_GROUP)); /* and particles that a predict saves */
    good = good && follows(&end, f->work, PFL_BATCH * (wide + 1u), 0u);
    good = good && gap(&end) && follows(&end, f->x, d * f->stride, 0u) && follows(&end, f->log_weight, f->stride, 0u);
    good = good && gap(&end) && follows(&end, f->scratch, f->stride, 0u) && gap(&end);
    good = good && ((f->sensor == NULL) || follows(&end, (const float *)(const void *)f->sensor,
                                                   (c->sensor_count * sizeof *f->sensor) / sizeof(float), 0u));
    good = good && (((uintptr_t)f->sensor & 7u) == 0u);
    good = good && ((f->retry == NULL) || follows(&end, f->retry, 2u * PFL_BATCH * d, 0u));
    good = good && ((const void *)end == (const void *)stop) && (((uintptr_t)f->x & 7u) == 0u);
    return good && (f->stride > c->particles) && (f->stride <= (c->particles + 8u)) && ((f->stride % 8u) == 0u);
}

static pfl_status_t judge(pfl_t *f, uint32_t what, uint32_t number, const void *z)
{
    (void)f;
    (void)what;
    (void)number;
    (void)z;
    return PFL_OK;
}

static void loglik(void *user, const void *z, const pfl_view_t *p, float *ll)
{
    (void)user;
    (void)z;
    (void)p;
    (void)ll;
}

static const pfl_watch_t watch = {.keep = judge};
static pfl_sensor_t sensors[PFL_SENSORS_MAX];

static bool is_laid_out_well(const pfl_config_t *c)
{
    pfl_t *f = NULL;
    const size_t bytes = pfl_arena_bytes(c);
    const bool short_of_one = pfl_lay_out(&arena, bytes - 1u, c, &f) == PFL_ERR_MEMORY;
    const bool laid = pfl_lay_out(&arena, bytes, c, &f) == PFL_OK;
    return short_of_one && laid && lies_well(f, c, arena.bytes + bytes);
}

/* What the proofs take on trust of pfl_padded: the least multiple of eight that is not below N, less than a stride. */
static bool is_padded_well(uint32_t n)
{
    const pfl_config_t c = {.particles = n};
    const pfl_t f = {.config = &c};
    const uint32_t padded = pfl_padded(&f);
    return ((padded % 8u) == 0u) && (padded >= n) && (padded < (n + 8u)) && (padded <= PFL_STRIDE(n)) &&
           (padded == (((n + 7u) / 8u) * 8u)) && (PFL_STRIDE(n) <= ((size_t)n + 8u));
}

int main(void)
{
    unsigned good = 0u;
    unsigned all = 0u;
    for (uint32_t k = 0u; k < PFL_SENSORS_MAX; k++) {
        sensors[k].loglik = loglik;
    }
    for (uint32_t n = 1u; n <= PFL_PARTICLES_MAX; n++) {
        good += is_padded_well(n) ? 1u : 0u;
        all++;
    }
    for (uint32_t n = 1u; n <= PARTICLES; n++) {
        for (uint16_t d = 1u; d <= PFL_STATES_MAX; d++) {
            for (uint16_t q = 0u; q <= PFL_NOISES_MAX; q++) {
                for (uint32_t k = 0u; k < 9u; k++) { /* 0 .. 2 tries; no watch, or one of one sensor or all */
                    const uint32_t tries = k % 3u;
                    const uint16_t watched = (uint16_t)((k < 6u) ? (k / 3u) : PFL_SENSORS_MAX);
                    const pfl_constraint_t constraint = {inside, project, NULL, tries, 0u, keep};
                    const pfl_config_t c = {.abi = PFL_ABI,
                                            .particles = n,
                                            .states = d,
                                            .noises = q,
                                            .sensors = sensors,
                                            .sensor_count = watched,
                                            .watch = (watched > 0u) ? &watch : NULL,
                                            .constraint = (tries > 0u) ? &constraint : NULL,
                                            .predict = predict};
                    good += is_laid_out_well(&c) ? 1u : 0u;
                    all++;
                }
            }
        }
    }
    printf("%u of %u layouts\n", good, all);
    return (good == all) ? 0 : 1;
}
