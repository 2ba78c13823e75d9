/* What every peer in C and C++ shares: the recorded work, the loop over it, and what is told of it. A peer defines the
 * three functions below; main() is here.
 *
 *     PEER FILE N FLIGHTS REPETITIONS
 *
 * FILE holds numbers in text (tools/benchmark/peers/record.c): flights, steps, T, power, drag area, mass, wheelbase, least speed, sigma
 * of the position noise, sigma of the measurements, start (4), then for each flight and step throttle, steering, three
 * measurements, and the true position. Prints "rmse", "ns" (per step the least of the repetitions, for a particle) and
 * "resampled" (share of the steps). */
#ifndef PEERS_WORK_H
#define PEERS_WORK_H

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

typedef struct {
    double dt, power, drag_area, mass, wheelbase, speed_min, sigma_position, sigma_seen;
    double start[4];
} work_t;

typedef struct {
    double throttle, steer, z[3], east, north;
} step_t;

#ifdef __cplusplus
extern "C" {
#endif
/* A new filter of n particles, all at the start. */
void peer_start(const work_t *work, unsigned n, unsigned seed);

/* One filter cycle: move by 2 normals a particle, weigh by 3 measurements, normalise, effective sample size, mean,
 * resample when it is below n / 2. Counted and timed. */
void peer_cycle(double throttle, double steer, const double *z, double *mean);

/* How often it has resampled since its start. */
unsigned peer_resampled(void);
#ifdef __cplusplus
}
#endif

static double peer_number(FILE *file)
{
    double value = 0.0;
    if (fscanf(file, "%lf", &value) != 1) {
        fprintf(stderr, "the work's file is cut short\n");
        exit(3);
    }
    return value;
}

static double peer_now_ns(void)
{
    struct timespec t;
    (void)clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec * 1e9 + (double)t.tv_nsec;
}

int main(int argc, char **argv)
{
    static work_t work;
    FILE *file = (argc == 5) ? fopen(argv[1], "r") : NULL;
    if (file == NULL) {
        fprintf(stderr, "usage: FILE N FLIGHTS REPETITIONS\n");
        return 2;
    }
    const unsigned n = (unsigned)strtoul(argv[2], NULL, 10);
    const unsigned flights = (unsigned)strtoul(argv[3], NULL, 10);
    const unsigned repeats = (unsigned)strtoul(argv[4], NULL, 10);
    const unsigned recorded = (unsigned)peer_number(file);
    const unsigned steps = (unsigned)peer_number(file);
    double *numbers = &work.dt;
    for (unsigned k = 0; k < 12; k++) {
        numbers[k] = peer_number(file);
    }
    step_t *step = (step_t *)calloc((size_t)recorded * steps, sizeof *step);
    double *best = (double *)calloc(steps, sizeof *best);
    if (step == NULL || best == NULL || flights > recorded) {
        return 3;
    }
    for (size_t k = 0; k < (size_t)recorded * steps; k++) {
        double *to = &step[k].throttle;
        for (unsigned m = 0; m < 7; m++) {
            to[m] = peer_number(file);
        }
    }
    double square = 0.0, sum = 0.0, mean[4];
    unsigned resampled = 0;
    for (unsigned f = 0; f < flights; f++) {
        for (unsigned r = 0; r < repeats; r++) {
            peer_start(&work, n, f + 1u);
            for (unsigned k = 0; k < steps; k++) {
                const step_t *s = &step[(size_t)f * steps + k];
                const double start = peer_now_ns();
                peer_cycle(s->throttle, s->steer, s->z, mean);
                const double took = peer_now_ns() - start;
                best[k] = (r == 0 || took < best[k]) ? took : best[k];
                if (r == 0) {
                    square += (mean[0] - s->east) * (mean[0] - s->east) + (mean[1] - s->north) * (mean[1] - s->north);
                }
            }
            resampled += (r == 0) ? peer_resampled() : 0u;
        }
        for (unsigned k = 0; k < steps; k++) {
            sum += best[k];
        }
    }
    printf("rmse %.6f\n", sqrt(square / ((double)flights * steps)));
    printf("ns %.3f\n", sum / ((double)flights * steps * n));
    printf("resampled %.4f\n", (double)resampled / ((double)flights * steps));
    free(step);
    free(best);
    return 0;
}

#endif
