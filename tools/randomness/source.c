/* Words under test: see source.h. */
#include "source.h"

#include "rng_kernels.h"

#include <math.h>
#include <string.h>

/* Phi at the knots of a cubic Hermite interpolation; its slope is the density. Error below step^4 / 384. */
#define KNOTS_PER_UNIT 512
#define Z_MAX 8
#define KNOTS (2 * Z_MAX * KNOTS_PER_UNIT + 1)

static double knot_value[KNOTS];
static double knot_slope[KNOTS]; /* times the distance of two knots */

static void make_knots(void)
{
    const double step = 1.0 / KNOTS_PER_UNIT;

    for (int k = 0; k < KNOTS; k++) {
        const double z = k * step - Z_MAX;
        knot_value[k] = 0.5 * erfc(-z * sqrt(0.5));
        knot_slope[k] = step * exp(-0.5 * z * z) / sqrt(2.0 * 3.14159265358979323846);
    }
}

double normal_cdf(float z)
{
    const double at = ((double)z + Z_MAX) * KNOTS_PER_UNIT;
    const int k = (int)at;
    const double t = at - k;
    const double a = knot_value[k];
    const double b = knot_value[k + 1];
    const double rise = b - a;
    const double bend = (knot_slope[k] - rise) * (1.0 - t) - (knot_slope[k + 1] - rise) * t;

    return a + t * (rise + (1.0 - t) * bend);
}

void source_start(source_t *source, source_kind_t kind, uint64_t seed, unsigned stream)
{
    make_knots();
    pfl_rng_seed(&source->rng, seed);
    for (unsigned i = 0u; i < stream; i++) {
        pfl_rng_long_jump(&source->rng);
    }
    source->kind = kind;
    source->numbers = 0u;
    source->next = SOURCE_ROWS * PFL_RNG_LANES;
}

static void fill_uniform(source_t *source)
{
    for (uint32_t row = 0u; row < SOURCE_ROWS; row++) {
        for (uint32_t l = 0u; l < PFL_RNG_LANES; l++) {
            uint32_t s[4];
            for (uint32_t k = 0u; k < 4u; k++) {
                s[k] = source->rng.s[k][l];
            }
            source->word[row * PFL_RNG_LANES + l] = pfl_xoshiro_next(s);
            for (uint32_t k = 0u; k < 4u; k++) {
                source->rng.s[k][l] = s[k];
            }
        }
    }
    source->numbers += SOURCE_ROWS * PFL_RNG_LANES;
}

static void fill_normal(source_t *source)
{
    float z[SOURCE_ROWS * 2u * PFL_RNG_LANES];

    pfl_rng_normals(&source->rng, z, SOURCE_ROWS);
    for (uint32_t i = 0u; i < SOURCE_ROWS * PFL_RNG_LANES; i++) {
        const uint32_t high = (uint32_t)(65536.0 * normal_cdf(z[2u * i]));
        const uint32_t low = (uint32_t)(65536.0 * normal_cdf(z[2u * i + 1u]));
        source->word[i] = (high << 16) | (low & 0xFFFFu);
    }
    source->numbers += SOURCE_ROWS * 2u * PFL_RNG_LANES;
}

uint32_t source_word(source_t *source)
{
    if (source->next == SOURCE_ROWS * PFL_RNG_LANES) {
        if (source->kind == SOURCE_UNIFORM) {
            fill_uniform(source);
        } else {
            fill_normal(source);
        }
        source->next = 0u;
    }
    return source->word[source->next++];
}

static uint64_t add_word(uint64_t hash, uint32_t word)
{
    for (uint32_t shift = 0u; shift < 32u; shift += 8u) {
        hash = (hash ^ ((word >> shift) & 0xFFu)) * 0x100000001B3u; /* FNV-1a */
    }
    return hash;
}

uint64_t source_fingerprint(source_kind_t kind, uint64_t seed)
{
    enum { NUMBERS = 65536 };
    static float z[NUMBERS];
    static source_t source;
    uint64_t hash = 0xCBF29CE484222325u;

    source_start(&source, kind, seed, 0u);
    pfl_rng_t rng = source.rng;
    pfl_rng_normals(&rng, z, NUMBERS / (2u * PFL_RNG_LANES));
    for (uint32_t i = 0u; i < NUMBERS; i++) {
        uint32_t bits;
        memcpy(&bits, &z[i], sizeof bits);
        hash = add_word(hash, kind == SOURCE_NORMAL ? bits : source_word(&source));
    }
    return hash;
}
