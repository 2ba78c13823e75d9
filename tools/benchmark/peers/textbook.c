/* A particle filter as a textbook has it: an array of structures, the C library's functions, Box and Muller, weights
 * multiplied and divided by their sum, systematic resampling into a second array. REAL is float or double. */
#include "work.h"

#ifndef REAL
#define REAL float
#endif
#define IS_FLOAT (sizeof(REAL) == sizeof(float))
#define F(name, x) ((REAL)(IS_FLOAT ? (REAL)name##f((float)(x)) : (REAL)name((double)(x))))

typedef struct {
    REAL east, north, speed, heading, weight;
} particle_t;

static work_t work;
static unsigned count, resampled;
static particle_t *now, *next;
static uint64_t random_state[2];

static uint64_t random_bits(void) /* xoroshiro128+ */
{
    const uint64_t a = random_state[0];
    const uint64_t b = random_state[1] ^ a;
    const uint64_t sum = a + random_state[1];
    random_state[0] = ((a << 24) | (a >> 40)) ^ b ^ (b << 16);
    random_state[1] = (b << 37) | (b >> 27);
    return sum;
}

static REAL uniform(void) /* in (0, 1) */
{
    return IS_FLOAT ? ((REAL)(int32_t)(random_bits() >> 41) + (REAL)0.5) * (REAL)(1.0 / 8388608.0)
                    : ((REAL)(int64_t)(random_bits() >> 12) + (REAL)0.5) * (REAL)(1.0 / 4503599627370496.0);
}

void peer_start(const work_t *w, unsigned n, unsigned seed)
{
    work = *w;
    count = n;
    resampled = 0;
    random_state[0] = 0x9E3779B97F4A7C15u * seed;
    random_state[1] = 0xD1B54A32D192ED03u ^ seed;
    free(now);
    free(next);
    now = (particle_t *)calloc(n, sizeof *now);
    next = (particle_t *)calloc(n, sizeof *next);
    if (now == NULL || next == NULL) {
        exit(3);
    }
    for (unsigned i = 0; i < n; i++) {
        now[i] = (particle_t){(REAL)w->start[0], (REAL)w->start[1], (REAL)w->start[2], (REAL)w->start[3], 1 / (REAL)n};
    }
}

static void move(particle_t *p, REAL throttle, REAL tan_steer)
{
    const REAL dt = (REAL)work.dt;
    const REAL radius = F(sqrt, -2 * F(log, uniform()));
    const REAL angle = (REAL)6.283185307179586 * uniform();
    const REAL v = p->speed;
    const REAL drive = (REAL)work.power * throttle / ((v > (REAL)work.speed_min) ? v : (REAL)work.speed_min);
    p->east += dt * v * F(cos, p->heading) + dt * (REAL)work.sigma_position * radius * F(cos, angle);
    p->north += dt * v * F(sin, p->heading) + dt * (REAL)work.sigma_position * radius * F(sin, angle);
    p->speed += dt * (drive - (REAL)work.drag_area * v * v) / (REAL)work.mass;
    p->heading += dt * v * tan_steer / (REAL)work.wheelbase;
}

static void resample(void)
{
    const REAL step = 1 / (REAL)count;
    REAL point = uniform() * step;
    REAL sum = now[0].weight;
    unsigned from = 0;
    for (unsigned i = 0; i < count; i++, point += step) {
        while (sum < point && from < count - 1) {
            from++;
            sum += now[from].weight;
        }
        next[i] = now[from];
        next[i].weight = step;
    }
    particle_t *old = now;
    now = next;
    next = old;
    resampled++;
}

void peer_cycle(double throttle, double steer, const double *z, double *mean)
{
    const REAL tan_steer = F(tan, steer);
    const REAL inverse = (REAL)(1.0 / work.sigma_seen);
    REAL sum = 0;
    for (unsigned i = 0; i < count; i++) {
        particle_t *p = &now[i];
        move(p, (REAL)throttle, tan_steer);
        const REAL a = (p->east - (REAL)z[0]) * inverse;
        const REAL b = (p->north - (REAL)z[1]) * inverse;
        const REAL c = (p->speed - (REAL)z[2]) * inverse;
        p->weight *= F(exp, (REAL)-0.5 * (a * a + b * b + c * c));
        sum += p->weight;
    }
    REAL squares = 0, m[4] = {0, 0, 0, 0};
    for (unsigned i = 0; i < count; i++) {
        particle_t *p = &now[i];
        p->weight /= sum;
        squares += p->weight * p->weight;
        m[0] += p->weight * p->east;
        m[1] += p->weight * p->north;
        m[2] += p->weight * p->speed;
        m[3] += p->weight * p->heading;
    }
    for (unsigned d = 0; d < 4; d++) {
        mean[d] = (double)m[d];
    }
    if (1 / squares < (REAL)0.5 * (REAL)count) {
        resample();
    }
}

unsigned peer_resampled(void)
{
    return resampled;
}
