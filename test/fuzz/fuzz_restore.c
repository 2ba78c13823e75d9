/* Damaged snapshots: an input is a list of changes to a good one, or a whole snapshot of its own, and most get a right
 * checksum, so that it hides nothing. A refusal leaves no trace; whatever is taken is a filter that flies on.
 *
 *     byte 0: bits 0..2 shape, 3..4 which snapshot, 5 the bytes are the snapshot, 6 shorter or longer, 7 no checksum */
#include "fuzz.h"

#include "pflight/filter.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define SHAPES 8u
#define PHASES 4u
#define STATES_MAX 4u
#define PARTICLES_MAX 20u
#define CRC_BYTES 4u

typedef struct {
    pfl_config_t config;
    void *arena; /* a filter, as it was before each run */
    unsigned char *pristine;
    size_t bytes;
    pfl_t *f;
    unsigned char *kept[PHASES];
    size_t kept_bytes;
} shape_t;

static shape_t shapes[SHAPES];

/* ---- A plain filter ------------------------------------------------------------------------------------------------ */

static void predict(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    const pfl_config_t *c = (const pfl_config_t *)user;
    (void)u;
    for (uint32_t d = 0u; d < c->states; d++) {
        REQUIRE(all_finite(PFL_STATE(p, d), p->n));
        for (uint32_t i = 0u; i < p->n; i++) {
            PFL_STATE(p, d)[i] += dt_s * ((c->noises > 0u) ? PFL_NOISE(p, d % c->noises)[i] : 0.1f);
        }
    }
}

static void draw(void *user, const pfl_batch_t *p)
{
    const pfl_config_t *c = (const pfl_config_t *)user;
    for (uint32_t d = 0u; d < c->states; d++) {
        memcpy(PFL_STATE(p, d), PFL_NOISE(p, d), sizeof(float) * p->n);
    }
}

static void loglik(void *user, const void *z, const pfl_view_t *p, float *ll)
{
    (void)user;
    for (uint32_t i = 0u; i < p->n; i++) {
        const float off = p->x[i] - *(const float *)z;
        ll[i] = -0.5f * (off * off);
    }
}

static const pfl_sensor_t sensor = {loglik, NULL, 0.0f};
static const pfl_kernel_t kernel = {0.3f, 0u};

static void make_shape(shape_t *s, uint32_t k)
{
    static const uint8_t particles[SHAPES] = {1u, 2u, 3u, 5u, 8u, 9u, 17u, PARTICLES_MAX};
    const float z = 0.3f;
    s->config = (pfl_config_t){.abi = PFL_ABI,
                               .particles = particles[k],
                               .states = (uint16_t)(1u + (k % STATES_MAX)),
                               .noises = (uint16_t)(k % 3u),
                               .sensor_count = 1u,
                               .resampling = (uint16_t)(k % 4u),
                               .moments = (k == 2u) ? PFL_MOMENTS_MEAN : PFL_MOMENTS_FULL,
                               .circular_mask = k & 1u,
                               .ess_ratio = (k == 4u) ? 0.0f : 0.6f,
                               .seed = k % 4u,
                               .sensors = &sensor,
                               .kernel = (k == 6u) ? &kernel : NULL,
                               .predict = predict,
                               .draw = draw,
                               .user = &s->config};
    s->bytes = pfl_arena_bytes(&s->config);
    s->arena = malloc(s->bytes);
    s->pristine = malloc(s->bytes);
    REQUIRE(pfl_init(s->arena, s->bytes, &s->config, 5u, &s->f) == PFL_OK);
    s->kept_bytes = pfl_snapshot_bytes(s->f);
    for (uint32_t phase = 0u; phase < PHASES; phase++) {
        s->kept[phase] = malloc(s->kept_bytes);
        if (phase > 0u) {
            REQUIRE(pfl_predict(s->f, phase * 100000u, NULL) == PFL_OK);
        }
        if (phase > 1u) {
            REQUIRE(pfl_update(s->f, 0u, phase * 100000u, &z) == PFL_OK);
        }
        REQUIRE((phase < 3u) || (pfl_reset(s->f, 300000u) == PFL_OK));
        REQUIRE(pfl_snapshot(s->f, s->kept[phase], s->kept_bytes) == PFL_OK);
    }
    REQUIRE(pfl_update(s->f, 0u, 300000u, &z) == PFL_OK);
    memcpy(s->pristine, s->arena, s->bytes);
}

/* ---- Damage -------------------------------------------------------------------------------------------------------- */

static uint32_t crc32_of(const unsigned char *bytes, size_t n)
{
    static uint32_t table[256];
    uint32_t crc = 0xFFFFFFFFu;
    for (uint32_t b = 0u; (b < 256u) && (table[255] == 0u); b++) {
        uint32_t word = b;
        for (uint32_t bit = 0u; bit < 8u; bit++) {
            word = (word >> 1) ^ ((word & 1u) * 0xEDB88320u);
        }
        table[b] = word;
    }
    for (size_t i = 0u; i < n; i++) {
        crc = table[(crc ^ bytes[i]) & 0xFFu] ^ (crc >> 8);
    }
    return ~crc;
}

static void put_u32(unsigned char *at, uint32_t word)
{
    for (uint32_t k = 0u; k < 4u; k++) {
        at[k] = (unsigned char)(word >> (8u * k));
    }
}

/* Each change: a place, and a float, a word, a bit or a small number that goes there. */
static void change(stream_t *in, unsigned char *bytes, size_t n)
{
    while (!stream_ended(in) && (n >= 4u)) {
        const uint8_t how = take_u8(in);
        const size_t word = (((size_t)(how & 3u) << 8) | take_u8(in)) % (n / 4u);
        const float x = ((how & 12u) == 0u) ? take_float(in) : 0.0f;
        uint32_t value;
        memcpy(&value, &x, sizeof value);
        if ((how & 12u) == 4u) {
            value = take_u32(in);
        } else if ((how & 12u) == 8u) {
            value = take_u8(in);
        } else if ((how & 12u) == 12u) {
            bytes[4u * word + (how >> 6)] ^= (unsigned char)(1u << ((how >> 3) & 7u));
            continue;
        }
        const uint32_t times = ((how & 16u) != 0u) ? take_u8(in) : 1u;
        for (size_t k = word; (k < (word + times)) && (k < (n / 4u)); k++) {
            put_u32(&bytes[4u * k], value);
        }
    }
}

/* The snapshot of an input, in a block of exactly its size. */
static unsigned char *make_snapshot(const shape_t *s, uint8_t head, stream_t *in, size_t *size)
{
    const bool raw = (head & 32u) != 0u;
    *size = raw ? (size_t)(in->end - in->at) : s->kept_bytes;
    if ((head & 64u) != 0u) {
        const size_t less = take_u8(in);
        *size = ((*size + 128u) > less) ? ((*size + 128u) - less) : 0u;
    }
    unsigned char *bytes = calloc(1u, *size + 1u);
    if (raw) {
        const size_t there = (size_t)(in->end - in->at);
        memcpy(bytes, in->at, (there < *size) ? there : *size);
    } else {
        memcpy(bytes, s->kept[(head >> 3) & 3u], (*size < s->kept_bytes) ? *size : s->kept_bytes);
        change(in, bytes, *size);
    }
    if (((head & 128u) == 0u) && (*size >= s->kept_bytes)) {
        const size_t n = s->kept_bytes - CRC_BYTES;
        put_u32(&bytes[n], crc32_of(bytes, n));
    }
    unsigned char *exact = malloc(*size > 0u ? *size : 1u);
    memcpy(exact, bytes, *size);
    free(bytes);
    return exact;
}

/* ---- A restored filter answers and flies on -------------------------------------------------------------------------- */

static void check_estimate(pfl_t *f, const pfl_config_t *c)
{
    float mean[STATES_MAX];
    float cov[STATES_MAX * STATES_MAX];
    const bool full = c->moments == PFL_MOMENTS_FULL;
    const pfl_status_t status = pfl_estimate(f, mean, full ? cov : NULL);
    REQUIRE((status == PFL_OK) || (status == PFL_ERR_NONFINITE));
    if (status == PFL_OK) {
        REQUIRE(all_finite(mean, c->states) && (!full || all_finite(cov, (size_t)c->states * c->states)));
    }
}

static void check_answers(pfl_t *f, const pfl_config_t *c)
{
    float value[STATES_MAX];
    float weight[PARTICLES_MAX];
    pfl_view_t view;
    pfl_health_t health;
    REQUIRE(pfl_invariants_hold(f));
    REQUIRE((pfl_health(f, &health) == PFL_OK) && isfinite(health.ess) && isfinite(health.test_ratio));
    REQUIRE((pfl_most_likely(f, value) == PFL_OK) && all_finite(value, c->states));
    REQUIRE((pfl_last_reset(f, NULL, NULL, value) == PFL_OK) && all_finite(value, c->states));
    REQUIRE(pfl_particles(f, &view, weight) == PFL_OK);
    float top = -INFINITY;
    for (uint32_t i = 0u; i < c->particles; i++) {
        top = fmaxf(top, weight[i]);
    }
    REQUIRE(fabsf(top) < 1.0e-3f);
}

static void fly_on(pfl_t *f, const pfl_config_t *c, uint64_t t_us)
{
    const float z = 0.1f;
    float value = NAN;
    check_estimate(f, c);
    REQUIRE((pfl_quantile(f, 0u, 0.5f, &value) == PFL_OK) && isfinite(value));
    if (t_us < (UINT64_MAX - 1000000u)) {
        const pfl_status_t moved = pfl_predict(f, t_us + 1000000u, NULL);
        REQUIRE((moved == PFL_OK) || (moved == PFL_QUARANTINED));
        const pfl_status_t fused = pfl_update(f, 0u, t_us + 1000000u, &z);
        REQUIRE((fused == PFL_OK) || (fused == PFL_REJECTED));
        check_answers(f, c);
    }
    REQUIRE(pfl_resample(f) == PFL_OK);
    check_estimate(f, c);
    check_answers(f, c);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    stream_t in = stream_of(data, size);
    const uint8_t head = take_u8(&in);
    shape_t *s = &shapes[head & 7u];
    size_t bytes = 0u;
    if (s->f == NULL) {
        make_shape(s, head & 7u);
    }
    unsigned char *snapshot = make_snapshot(s, head, &in, &bytes);
    const pfl_status_t status = pfl_restore(s->f, snapshot, bytes);
    if (status == PFL_OK) {
        pfl_health_t health;
        unsigned char again[4096];
        REQUIRE(bytes >= s->kept_bytes);
        REQUIRE(pfl_snapshot(s->f, again, sizeof again) == PFL_OK);
        REQUIRE(memcmp(again, snapshot, s->kept_bytes) == 0);
        check_answers(s->f, &s->config);
        REQUIRE(pfl_health(s->f, &health) == PFL_OK);
        fly_on(s->f, &s->config, health.t_us);
        memcpy(s->arena, s->pristine, s->bytes);
    } else {
        REQUIRE(status == PFL_ERR_CORRUPT);
        REQUIRE(memcmp(s->arena, s->pristine, s->bytes) == 0);
    }
    free(snapshot);
    return 0;
}
