/* Measures the library's float functions against the double ones of the C library, over every float of the range that
 * pflight/math.h states, and holds them against the bounds stated there. tools/ulp builds and runs it. */
#include "pflight/math.h"

#include "../../lib/src/sqrt_kernel.h"

#include <inttypes.h>
#include <math.h>
#include <pthread.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define TWO_PI 6.283185307179586477
#define CHUNK 0x100000u
#define THREADS_MAX 64u
#define RANDOM_PAIRS 100000000u
#define SEAMS 1024u /* multiples of pi/2 up to 1608 */
#define SEAM_REACH 512u

/* ---- The bounds: the only place ------------------------------------------------------------------------------ */

/* What the error is measured in. */
typedef enum { UNIT_RESULT, UNIT_ARGUMENT, UNIT_ABSOLUTE } unit_t;

typedef struct case_s case_t;

/* Adds up the results that one input bears on; `bits` is a float's image or a counter, as the case says. */
typedef struct {
    double worst[3];
    uint32_t at[3];
    uint64_t tested;
} tally_t;
typedef void (*measure_fn)(const case_t *c, uint32_t bits, tally_t *t);

typedef struct {
    const char *declared; /* function of math.h; its comment must hold `phrase` */
    const char *label;    /* function as printed */
    const char *phrase;   /* null: a bound that math.h does not state */
    double bound;
} result_t;

struct case_s {
    measure_fn measure;
    unit_t unit;
    float low, high; /* every float of it; both signs when low < 0 */
    float param;     /* atan2: x */
    const char *range;
    uint32_t results; /* how many functions one pass measures */
    result_t result[3];
};

static void of_exp(const case_t *c, uint32_t bits, tally_t *t);
static void of_log(const case_t *c, uint32_t bits, tally_t *t);
static void of_circle(const case_t *c, uint32_t bits, tally_t *t);
static void of_circle_seam(const case_t *c, uint32_t counter, tally_t *t);
static void of_sqrt(const case_t *c, uint32_t bits, tally_t *t);
static void of_wrap(const case_t *c, uint32_t bits, tally_t *t);
static void of_atan2(const case_t *c, uint32_t bits, tally_t *t);
static void of_atan2_pair(const case_t *c, uint32_t counter, tally_t *t);

#define SMALLEST 1.401298464e-45f
#define NORMAL 1.175494351e-38f
#define LARGEST 3.402823466e38f

static const case_t cases[] = {
    {of_exp, UNIT_RESULT, -87.33f, 88.72f, 0.0f, "-87.33 .. 88.72", 1u, {{"pfl_expf", "pfl_expf", "1 ULP", 1.0}}},
    {of_log, UNIT_RESULT, NORMAL, LARGEST, 0.0f, "normal x > 0", 1u, {{"pfl_logf", "pfl_logf", "1 ULP", 1.0}}},
    {of_circle,
     UNIT_RESULT,
     -1608.0f,
     1608.0f,
     0.0f,
     "|x| <= 1608",
     3u,
     {{"pfl_sinf", "pfl_sinf", "2.6 ULP", 2.6},
      {"pfl_cosf", "pfl_cosf", "2.6 ULP", 2.6},
      {"pfl_tanf", "pfl_tanf", "4.5 ULP", 4.5}}},
    {of_circle_seam,
     UNIT_RESULT,
     0.0f,
     0.0f,
     0.0f,
     "near k pi/2, |x| <= 1608",
     3u,
     {{"pfl_sinf", "pfl_sinf", "2.6 ULP", 2.6},
      {"pfl_cosf", "pfl_cosf", "2.6 ULP", 2.6},
      {"pfl_tanf", "pfl_tanf", "4.5 ULP", 4.5}}},
    {of_circle,
     UNIT_ARGUMENT,
     -6.5e6f,
     6.5e6f,
     0.0f,
     "|x| <= 6.5e6, in ULP of x",
     2u,
     {{"pfl_sinf", "pfl_sinf", "one ULP of x", 1.0}, {"pfl_cosf", "pfl_cosf", "one ULP of x", 1.0}}},
    {of_sqrt,
     UNIT_RESULT,
     0.0f,
     LARGEST,
     0.0f,
     "x >= 0",
     2u,
     {{"pfl_sqrtf", "pfl_sqrtf", "Correctly rounded", 0.5}, {"pfl_sqrtf", "  in integers", "Correctly rounded", 0.5}}},
    {of_atan2,
     UNIT_RESULT,
     -LARGEST,
     LARGEST,
     1.0f,
     "every y, x = 1",
     1u,
     {{"pfl_atan2f", "pfl_atan2f", "3 ULP", 3.0}}},
    {of_atan2,
     UNIT_RESULT,
     -LARGEST,
     LARGEST,
     -1.0f,
     "every y, x = -1",
     1u,
     {{"pfl_atan2f", "pfl_atan2f", "3 ULP", 3.0}}},
    {of_atan2_pair,
     UNIT_RESULT,
     0.0f,
     0.0f,
     0.0f,
     "1e8 random pairs",
     1u,
     {{"pfl_atan2f", "pfl_atan2f", "3 ULP", 3.0}}},
    {of_wrap,
     UNIT_ABSOLUTE,
     -6400.0f,
     6400.0f,
     0.0f,
     "|x| <= 6400, absolute",
     2u,
     {{"pfl_wrap_pi", "pfl_wrap_pi", "4e-7", 4e-7}, {"pfl_wrap_pi", "  beyond pi", NULL, 5e-4}}},
};
#define CASES (sizeof cases / sizeof cases[0])

/* ---- Measuring ------------------------------------------------------------------------------------------------ */

static float float_of(uint32_t bits)
{
    float x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

static uint32_t bits_of(float x)
{
    uint32_t bits;
    memcpy(&bits, &x, sizeof bits);
    return bits;
}

/* 1 / ULP of the float format at a true value: subnormals share the smallest normals' ULP. */
static double per_ulp(double value)
{
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    int64_t e = (int64_t)((bits >> 52) & 0x7FFu) - 1023;
    e = (e < -126) ? -126 : e;
    const uint64_t image = (uint64_t)(1023 + 23 - e) << 52;
    double scale;
    memcpy(&scale, &image, sizeof scale);
    return scale;
}

static void note(tally_t *t, uint32_t k, double error, uint32_t bits)
{
    if (!(error <= t->worst[k])) { /* a NaN is the worst of all */
        t->worst[k] = (error >= 0.0) ? error : (double)INFINITY;
        t->at[k] = bits;
    }
}

static void note_ulp(tally_t *t, uint32_t k, float got, double want, uint32_t bits)
{
    note(t, k, fabs((double)got - want) * per_ulp(want), bits);
}

static void of_exp(const case_t *c, uint32_t bits, tally_t *t)
{
    const float x = float_of(bits);
    (void)c;
    note_ulp(t, 0u, pfl_expf(x), exp((double)x), bits);
}

static void of_log(const case_t *c, uint32_t bits, tally_t *t)
{
    const float x = float_of(bits);
    (void)c;
    note_ulp(t, 0u, pfl_logf(x), log((double)x), bits);
}

static void of_circle(const case_t *c, uint32_t bits, tally_t *t)
{
    const float x = float_of(bits);
    const double s = sin((double)x);
    const double cosine = cos((double)x);
    const float got_s = pfl_sinf(x);
    const float got_c = pfl_cosf(x);
    if (c->unit == UNIT_ARGUMENT) {
        if (fabsf(x) > 1608.0f) { /* below, the other case is stricter */
            note(t, 0u, fabs((double)got_s - s) * per_ulp((double)x), bits);
            note(t, 1u, fabs((double)got_c - cosine) * per_ulp((double)x), bits);
        } else {
            t->tested--;
        }
        return;
    }
    note_ulp(t, 0u, got_s, s, bits);
    note_ulp(t, 1u, got_c, cosine, bits);
    note_ulp(t, 2u, pfl_tanf(x), s / cosine, bits);
}

/* The hard arguments, which no stride may miss: the 2 SEAM_REACH floats around each multiple of pi/2, of both signs. */
static uint32_t seam_bits(uint32_t counter)
{
    const uint32_t sign = (counter & 1u) << 31;
    const uint32_t place = counter >> 1;
    const uint32_t k = (place / (2u * SEAM_REACH)) + 1u;
    return (bits_of((float)((double)k * 0.25 * TWO_PI)) - SEAM_REACH + (place % (2u * SEAM_REACH))) | sign;
}

static void of_circle_seam(const case_t *c, uint32_t counter, tally_t *t)
{
    const uint32_t bits = seam_bits(counter);
    if (fabsf(float_of(bits)) <= 1608.0f) {
        of_circle(c, bits, t);
    } else {
        t->tested--;
    }
}

/* Correctly rounded means equal to the rounded double root, and its error, at most half an ULP, is printed. */
static void of_sqrt(const case_t *c, uint32_t bits, tally_t *t)
{
    const float x = float_of(bits);
    const double want = sqrt((double)x);
    const float a = pfl_sqrtf(x);
    const float b = pfl_sqrt_in_integers(x);
    const uint32_t rounded = bits_of((float)want);
    (void)c;
    note(t, 0u, (bits_of(a) == rounded) ? fabs((double)a - want) * per_ulp(want) : 1.0, bits);
    note(t, 1u, (bits_of(b) == rounded) ? fabs((double)b - want) * per_ulp(want) : 1.0, bits);
}

/* The multiple of 2 pi taken off may be either of two at the seam, so the error is compared on the circle. */
static void of_wrap(const case_t *c, uint32_t bits, tally_t *t)
{
    const double x = (double)float_of(bits);
    const double got = (double)pfl_wrap_pi(float_of(bits));
    const double turns = nearbyint((x - got) / TWO_PI);
    const double beyond = fabs(got) - (0.5 * TWO_PI);
    (void)c;
    note(t, 0u, fabs((x - (turns * TWO_PI)) - got), bits);
    note(t, 1u, (beyond > 0.0) ? beyond : 0.0, bits);
}

static void of_atan2(const case_t *c, uint32_t bits, tally_t *t)
{
    const float y = float_of(bits);
    const double want = atan2((double)y, (double)c->param);
    if (fabs(want) < (double)NORMAL) {
        t->tested--; /* subnormal results are not promised */
        return;
    }
    note_ulp(t, 0u, pfl_atan2f(y, c->param), want, bits);
}

/* SplitMix64 of a counter: the pairs do not depend on how threads share them. */
static uint64_t scrambled(uint64_t z)
{
    z *= 0x9E3779B97F4A7C15u;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return z ^ (z >> 31);
}

/* Odd counters: any two finite floats. Even ones: within a factor 2^8 of each other, where atan is curved. */
static void pair_of(uint32_t counter, float *y, float *x)
{
    const uint64_t r = scrambled((uint64_t)counter + 1u);
    uint32_t a = (uint32_t)r;
    uint32_t b = (uint32_t)(r >> 32);
    if ((counter & 1u) == 0u) {
        a = (a & 0x807FFFFFu) | ((120u + ((a >> 23) & 15u)) << 23);
        b = (b & 0x807FFFFFu) | ((120u + ((b >> 23) & 15u)) << 23);
    }
    *y = float_of(a);
    *x = float_of(b);
}

static void of_atan2_pair(const case_t *c, uint32_t counter, tally_t *t)
{
    float y;
    float x;
    (void)c;
    pair_of(counter, &y, &x);
    const double want = atan2((double)y, (double)x);
    if (!isfinite(y) || !isfinite(x) || (fabs(want) < (double)NORMAL)) {
        t->tested--;
        return;
    }
    note_ulp(t, 0u, pfl_atan2f(y, x), want, counter);
}

/* ---- Threads over chunks of bits ------------------------------------------------------------------------------ */

/* A case is one or two runs of consecutive images: positive floats, negative floats. */
typedef struct {
    uint32_t first[2];
    uint64_t count[2];
} span_t;

static span_t span_of(const case_t *c)
{
    span_t s = {{0u, 0u}, {0u, 0u}};
    if (c->measure == of_atan2_pair) {
        s.count[0] = RANDOM_PAIRS;
        return s;
    }
    if (c->measure == of_circle_seam) {
        s.count[0] = (uint64_t)SEAMS * SEAM_REACH * 4u;
        return s;
    }
    s.first[0] = (c->low > 0.0f) ? bits_of(c->low) : 0u;
    s.count[0] = (uint64_t)bits_of(c->high) - s.first[0] + 1u;
    if (c->low < 0.0f) {
        s.first[1] = 0x80000000u;
        s.count[1] = (uint64_t)bits_of(c->low) - 0x80000000u + 1u;
    }
    return s;
}

typedef struct {
    pthread_mutex_t lock;
    const case_t *c;
    span_t span;
    uint64_t next, total; /* images handed out, of both runs together */
    uint32_t stride;
    bool progress;
    tally_t sum;
} job_t;

static void show_progress(const job_t *job)
{
    const int width = 40;
    const int done = (int)((job->next * (uint64_t)width) / job->total);
    fprintf(stderr, "\r%-12s [%.*s%*s] %3d %%", job->c->result[0].label, done,
            "########################################", width - done, "", (int)((job->next * 100u) / job->total));
}

static bool take_chunk(job_t *job, uint64_t *from, uint64_t *to)
{
    (void)pthread_mutex_lock(&job->lock);
    const uint64_t size = (uint64_t)CHUNK * job->stride;
    const bool any = job->next < job->total;
    *from = job->next;
    *to = (job->total - job->next < size) ? job->total : (job->next + size);
    job->next = *to;
    if (any && job->progress) {
        show_progress(job);
    }
    (void)pthread_mutex_unlock(&job->lock);
    return any;
}

static void merge(job_t *job, const tally_t *t)
{
    (void)pthread_mutex_lock(&job->lock);
    job->sum.tested += t->tested;
    for (uint32_t k = 0u; k < 3u; k++) {
        const bool tie = !(t->worst[k] < job->sum.worst[k]) && !(t->worst[k] > job->sum.worst[k]);
        if ((t->worst[k] > job->sum.worst[k]) || (tie && (t->at[k] < job->sum.at[k]))) {
            job->sum.worst[k] = t->worst[k];
            job->sum.at[k] = t->at[k];
        }
    }
    (void)pthread_mutex_unlock(&job->lock);
}

static void *work(void *argument)
{
    job_t *job = (job_t *)argument;
    tally_t t;
    uint64_t from;
    uint64_t to;
    while (take_chunk(job, &from, &to)) {
        memset(&t, 0, sizeof t);
        for (uint64_t i = from; i < to; i += job->stride) {
            const bool positive = i < job->span.count[0];
            const uint64_t bits = positive ? (job->span.first[0] + i) : (job->span.first[1] + (i - job->span.count[0]));
            t.tested++;
            job->c->measure(job->c, (uint32_t)bits, &t);
        }
        merge(job, &t);
    }
    return NULL;
}

/* ---- The table ------------------------------------------------------------------------------------------------ */

static void describe(const case_t *c, uint32_t bits, char *text, size_t size)
{
    if (c->measure == of_atan2_pair) {
        float y;
        float x;
        pair_of(bits, &y, &x);
        (void)snprintf(text, size, "(%.9g, %.9g)", (double)y, (double)x);
    } else {
        (void)snprintf(text, size, "%.9g (%08" PRIx32 ")", (double)float_of(bits), bits);
    }
}

static bool print_rows(const case_t *c, const tally_t *t)
{
    bool good = true;
    for (uint32_t k = 0u; k < c->results; k++) {
        char where[64];
        const bool ok = (t->worst[k] <= c->result[k].bound) && (t->tested > 0u);
        describe(c, t->at[k], where, sizeof where);
        printf("%-13s  %-25s  %11" PRIu64 "  %-11.5g  %-34s  %-6g  %s\n", c->result[k].label, c->range, t->tested,
               t->worst[k], where, c->result[k].bound, ok ? "ok" : "BROKEN");
        good = good && ok;
    }
    (void)fflush(stdout);
    return good;
}

static bool run_case(const case_t *c, uint32_t stride, uint32_t threads)
{
    pthread_t id[THREADS_MAX];
    uint32_t started = 0u;
    job_t job;
    memset(&job, 0, sizeof job);
    (void)pthread_mutex_init(&job.lock, NULL);
    job.c = c;
    job.span = span_of(c);
    job.total = job.span.count[0] + job.span.count[1];
    job.stride = (c->measure == of_circle_seam) ? 1u : stride;
    job.progress = isatty(STDERR_FILENO) != 0;
    while (((started + 1u) < threads) && (pthread_create(&id[started], NULL, work, &job) == 0)) {
        started++;
    }
    (void)work(&job);
    for (uint32_t k = 0u; k < started; k++) {
        (void)pthread_join(id[k], NULL);
    }
    if (job.progress) {
        fprintf(stderr, "\r%*s\r", 64, "");
    }
    return print_rows(c, &job.sum);
}

static void print_bounds(void)
{
    for (size_t k = 0u; k < CASES; k++) {
        for (uint32_t r = 0u; r < cases[k].results; r++) {
            if (cases[k].result[r].phrase != NULL) {
                printf("%s\t%s\n", cases[k].result[r].declared, cases[k].result[r].phrase);
            }
        }
    }
}

static uint32_t number_or_exit(const char *name, const char *text, uint32_t most)
{
    char *end = NULL;
    const long value = (text != NULL) ? strtol(text, &end, 10) : 0;
    if ((text == NULL) || (end == text) || (*end != '\0') || (value < 1) || (value > (long)most)) {
        fprintf(stderr, "ulp: %s wants a whole number from 1 to %" PRIu32 ", not '%s'\n", name, most,
                (text != NULL) ? text : "");
        exit(2);
    }
    return (uint32_t)value;
}

int main(int argc, char **argv)
{
    static const char usage[] = "usage: tools/ulp [--stride S] [--threads T] [--bounds]";
    const long processors = sysconf(_SC_NPROCESSORS_ONLN);
    uint32_t threads = (processors > 1) ? (uint32_t)processors : 1u;
    uint32_t stride = 1u;
    bool good = true;
    threads = (threads > THREADS_MAX) ? THREADS_MAX : threads;
    for (int k = 1; k < argc; k++) {
        if (strcmp(argv[k], "--stride") == 0) {
            stride = number_or_exit("--stride", argv[++k], 1000000u);
        } else if (strcmp(argv[k], "--threads") == 0) {
            threads = number_or_exit("--threads", argv[++k], THREADS_MAX);
        } else if (strcmp(argv[k], "--bounds") == 0) {
            print_bounds();
            return 0;
        } else if (strcmp(argv[k], "--help") == 0) {
            puts(usage);
            return 0;
        } else {
            fprintf(stderr, "ulp: unknown option '%s'; %s\n", argv[k], usage);
            return 2;
        }
    }
    printf("%-13s  %-25s  %11s  %-11s  %-34s  %-6s\n", "function", "range", "tested", "max [ULP]", "where", "bound");
    for (size_t k = 0u; k < CASES; k++) {
        good = run_case(&cases[k], stride, threads) && good;
    }
    return good ? 0 : 1;
}
