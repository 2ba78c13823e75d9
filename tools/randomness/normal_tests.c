/* The library's normals against the normal distribution, in floats as they come:
 *     normal_tests NUMBERS SEED
 * prints a line "p NAME VALUE" for each two-sided p-value and last "numbers COUNT" and "largest |Z|".
 *
 * A float z stands for all reals that round to it. So every edge of a bin lies half a step below the float that begins
 * the bin, and the masses are exact: what remains to be seen are faults of the generator, not its number format. */
#include "source.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define GROUP 16u         /* normals that one step of the eight streams makes */
#define GROUPS 256u       /* made at once */
#define BEFORE 8u         /* groups kept of those before: two columns of a batch of 128 lie eight groups apart */
#define BINS_PER_UNIT 128 /* of the histogram */
#define Z_MAX 8
#define BINS (2 * Z_MAX * BINS_PER_UNIT)
#define LEAST_EXPECTED 20.0 /* of a bin; less is put together with its neighbours */
#define CELLS 16u           /* on each axis of the tables of pairs */
#define BITS 16u

enum { MOMENTS = 6 };
static const uint32_t apart[] = {1u, 2u, 4u, 8u, 16u, 64u}; /* of the tables of pairs */
enum { TABLES = sizeof apart / sizeof apart[0] };

typedef struct {
    double near[2][GROUP][GROUP]; /* sums of products with the same group (upper half) and the group before */
    double far[2][GROUP];         /* and with the same place 4 and 8 groups before */
} products_t;

static uint64_t bin[BINS];
static uint64_t bit_set[BITS];
static uint64_t table[TABLES][CELLS * CELLS];
static double power[MOMENTS];
static products_t of_values, of_squares;

/* ---- Counting ----------------------------------------------------------------------------------------------------- */

static void add_products(const float *x, products_t *sum)
{
    for (uint32_t i = 0u; i < GROUP; i++) {
        for (uint32_t same = 0u; same < 2u; same++) {
            const float *other = same == 1u ? x : x - GROUP;
            for (uint32_t j = 0u; j < GROUP; j++) {
                sum->near[same][i][j] += (double)x[i] * (double)other[j];
            }
        }
    }
    for (uint32_t i = 0u; i < GROUP; i++) {
        sum->far[0][i] += (double)x[i] * (double)(x - 4u * GROUP)[i];
        sum->far[1][i] += (double)x[i] * (double)(x - 8u * GROUP)[i];
    }
}

static void add_bins(const float *z, uint32_t n)
{
    for (uint32_t i = 0u; i < n; i++) {
        const int k = (int)floorf(z[i] * (float)BINS_PER_UNIT) + Z_MAX * BINS_PER_UNIT;
        bin[k < 0 ? 0 : (k >= BINS ? BINS - 1 : k)]++;
    }
}

/* `part` holds the first 16 bits of Phi(z), BEFORE groups of them before z[0]. */
static void add_bits(const uint16_t *part, uint32_t n)
{
    for (uint32_t b = 0u; b < BITS; b++) {
        uint32_t count = 0u;
        for (uint32_t i = 0u; i < n; i++) {
            count += ((uint32_t)part[i] >> b) & 1u;
        }
        bit_set[b] += count;
    }
    for (uint32_t t = 0u; t < TABLES; t++) {
        for (uint32_t i = 0u; i < n; i++) {
            table[t][(uint32_t)(part[i] >> 12) * CELLS + (uint32_t)((part - apart[t])[i] >> 12)]++;
        }
    }
}

static void add_powers(const float *z, uint32_t n)
{
    double sum[MOMENTS] = {0.0};

    for (uint32_t i = 0u; i < n; i++) {
        const double x = (double)z[i];
        const double x2 = x * x;
        sum[0] += x;
        sum[1] += x2;
        sum[2] += x2 * x;
        sum[3] += x2 * x2;
        sum[4] += x2 * x2 * x;
        sum[5] += x2 * x2 * x2;
    }
    for (int m = 0; m < MOMENTS; m++) {
        power[m] += sum[m];
    }
}

static float count_all(uint64_t numbers, uint64_t seed)
{
    enum { KEPT = BEFORE * GROUP, FRESH = GROUPS * GROUP };
    static float z[KEPT + FRESH], squares[KEPT + FRESH];
    static uint16_t part[KEPT + FRESH];
    float largest = 0.0f;
    source_t source;

    source_start(&source, SOURCE_NORMAL, seed, 0u);
    pfl_rng_normals(&source.rng, &z[FRESH], KEPT / GROUP); /* what goes before the first */
    for (uint64_t done = 0u; done <= numbers; done += FRESH) {
        if (done > 0u) {
            memcpy(z, &z[FRESH], KEPT * sizeof *z);
            pfl_rng_normals(&source.rng, &z[KEPT], GROUPS);
        }
        for (uint32_t i = 0u; i < KEPT + FRESH; i++) {
            squares[i] = z[i] * z[i] - 1.0f;
            part[i] = (uint16_t)(65536.0 * normal_cdf(z[i]));
        }
        if (done == 0u) {
            continue;
        }
        for (uint32_t i = KEPT; i < KEPT + FRESH; i++) {
            largest = fabsf(z[i]) > largest ? fabsf(z[i]) : largest;
        }
        for (uint32_t g = BEFORE; g < BEFORE + GROUPS; g++) {
            add_products(&z[g * GROUP], &of_values);
            add_products(&squares[g * GROUP], &of_squares);
        }
        add_bins(&z[KEPT], FRESH);
        add_bits(&part[KEPT], FRESH);
        add_powers(&z[KEPT], FRESH);
    }
    return largest;
}

/* ---- Judging ------------------------------------------------------------------------------------------------------ */

static void say(const char *name, double p)
{
    (void)printf("p %.17g %s\n", p, name);
}

static void say_score(const char *name, double score)
{
    say(name, erfc(fabs(score) * sqrt(0.5)));
}

/* The upper tail of chi-square by Wilson and Hilferty's cube root; good to a few per cent of p from 30 degrees on. */
static double score_of_chi_square(double chi_square, double freedom)
{
    const double c = 2.0 / (9.0 * freedom);
    return (cbrt(chi_square / freedom) - (1.0 - c)) / sqrt(c);
}

/* Mass below the float with which bin k begins. */
static double mass_below(int k)
{
    const float edge = (float)(k - Z_MAX * BINS_PER_UNIT) / (float)BINS_PER_UNIT;
    const double middle = 0.5 * ((double)edge + (double)nextafterf(edge, -FLT_MAX));

    return k == 0 ? 0.0 : 0.5 * erfc(-middle * sqrt(0.5));
}

/* Chi-square of the bins from first to last, the mass outside left out of account. */
static void judge_bins(const char *name, int first, int last, double n)
{
    double expected = 0.0, seen = 0.0, chi_square = 0.0, all_expected = 0.0, all_seen = 0.0;
    unsigned freedom = 0u;

    for (int k = first; k <= last; k++) {
        const double above = k == BINS - 1 ? 1.0 : mass_below(k + 1);
        expected += n * (above - mass_below(k));
        seen += (double)bin[k];
        if (expected >= LEAST_EXPECTED) {
            chi_square += (seen - expected) * (seen - expected) / expected;
            all_expected += expected;
            all_seen += seen;
            expected = seen = 0.0;
            freedom++;
        }
    }
    if (freedom > 30u) {
        say_score(name, score_of_chi_square(chi_square, (double)freedom));
        if (last - first < BINS - 1) {
            char sum[64];
            (void)snprintf(sum, sizeof sum, "count, %s", name);
            say_score(sum, (all_seen - all_expected) / sqrt(all_expected));
        }
    }
}

/* Two-sided p of a Poisson count. */
static double poisson_p(double seen, double mean)
{
    double below = 0.0, at = 0.0;

    if (mean > 1e4) {
        return erfc(fabs(seen - mean) / sqrt(2.0 * mean));
    }
    for (double k = 0.0; k <= seen; k += 1.0) {
        at = exp(k * log(mean) - mean - lgamma(k + 1.0));
        below += at;
    }
    return fmin(1.0, 2.0 * fmin(below, 1.0 - below + at));
}

static void judge_tails(double n)
{
    char name[64];

    for (double from = 3.0; from < 6.6; from += 0.5) {
        const int k = (int)(from * BINS_PER_UNIT);
        const double mass = 1.0 - mass_below(Z_MAX * BINS_PER_UNIT + k);
        const double exact = from > 5.0 ? 0.5 * erfc(from * sqrt(0.5)) : mass;
        double high = 0.0, low = 0.0;
        for (int i = Z_MAX * BINS_PER_UNIT + k; i < BINS; i++) {
            high += (double)bin[i];
            low += (double)bin[BINS - 1 - i];
        }
        if (n * exact < 3.0) {
            break;
        }
        (void)snprintf(name, sizeof name, "tail: z >= %.1f, %.0f of %.1f", from, high, n * exact);
        say(name, poisson_p(high, n * exact));
        (void)snprintf(name, sizeof name, "tail: z <= -%.1f, %.0f of %.1f", from, low, n * exact);
        say(name, poisson_p(low, n * exact));
    }
}

static void judge_moments(double n)
{
    static const double mean[MOMENTS] = {0.0, 1.0, 0.0, 3.0, 0.0, 15.0};
    static const double variance[MOMENTS] = {1.0, 2.0, 15.0, 96.0, 945.0, 10170.0};
    char name[32];

    for (int m = 0; m < MOMENTS; m++) {
        (void)snprintf(name, sizeof name, "moment %d", m + 1);
        say_score(name, (power[m] / n - mean[m]) / sqrt(variance[m] / n));
    }
}

static void judge_products(const char *what, const products_t *sum, double deviation)
{
    char name[64];

    for (uint32_t i = 0u; i < GROUP; i++) {
        for (uint32_t j = 0u; j < GROUP; j++) {
            (void)snprintf(name, sizeof name, "%s of places %u and %u", what, i, j);
            if (j < i) {
                say_score(name, sum->near[1][i][j] / deviation);
            }
            (void)snprintf(name, sizeof name, "%s of place %u and %u a group before", what, i, j);
            say_score(name, sum->near[0][i][j] / deviation);
        }
        for (uint32_t k = 0u; k < 2u; k++) {
            (void)snprintf(name, sizeof name, "%s of place %u and %u groups before", what, i, 4u * (k + 1u));
            say_score(name, sum->far[k][i] / deviation);
        }
    }
}

static void judge_bits(double n)
{
    char name[64];

    for (uint32_t b = 0u; b < BITS; b++) {
        (void)snprintf(name, sizeof name, "bit %u of Phi(z)", BITS - b);
        say_score(name, ((double)bit_set[b] - 0.5 * n) / sqrt(0.25 * n));
    }
    for (uint32_t t = 0u; t < TABLES; t++) {
        const double expected = n / (double)(CELLS * CELLS);
        double chi_square = 0.0;
        for (uint32_t c = 0u; c < CELLS * CELLS; c++) {
            chi_square += ((double)table[t][c] - expected) * ((double)table[t][c] - expected) / expected;
        }
        (void)snprintf(name, sizeof name, "table 16 x 16 of normals %u apart", apart[t]);
        say_score(name, score_of_chi_square(chi_square, (double)(CELLS * CELLS - 1u)));
    }
}

int main(int argc, char **argv)
{
    const int zero = Z_MAX * BINS_PER_UNIT;

    if (argc != 3 || strtoull(argv[1], NULL, 10) < 1u) {
        (void)fprintf(stderr, "usage: normal_tests NUMBERS SEED\n");
        return 2;
    }
    const uint64_t block = (uint64_t)GROUPS * GROUP;
    const uint64_t numbers = (strtoull(argv[1], NULL, 10) + block - 1u) / block * block;
    const double n = (double)numbers;
    const float largest = count_all(numbers, strtoull(argv[2], NULL, 10));
    judge_bins("histogram, 128 bins a unit", 0, BINS - 1, n);
    judge_bins("z < -3.5", 0, zero - 7 * BINS_PER_UNIT / 2 - 1, n);
    judge_bins("z >= 3.5", zero + 7 * BINS_PER_UNIT / 2, BINS - 1, n);
    judge_tails(n);
    judge_moments(n);
    judge_bits(n);
    judge_products("product", &of_values, sqrt(n / GROUP));
    judge_products("product of squares", &of_squares, sqrt(4.0 * n / GROUP));
    (void)printf("numbers %llu\nlargest %.4f\n", (unsigned long long)numbers, (double)largest);
    return 0;
}
