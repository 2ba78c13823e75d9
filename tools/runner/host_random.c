/* xoshiro256** seeded through SplitMix64, and normals by Box and Muller: see host_random.h. */
#include "host_random.h"

#include <math.h>

#define TWO_PI 6.283185307179586476925

/* The next number of a SplitMix64 sequence: a bijection of its state, well mixed. */
static uint64_t split_mix(uint64_t *state)
{
    uint64_t z = (*state += 0x9E3779B97F4A7C15u);

    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return z ^ (z >> 31);
}

void host_random_start(host_random_t *random, uint64_t seed, uint64_t run, random_purpose_t purpose)
{
    uint64_t state = seed;

    state = split_mix(&state) ^ run;
    state = split_mix(&state) ^ (uint64_t)purpose;
    for (int i = 0; i < 4; i++) {
        random->s[i] = split_mix(&state); /* four in a row are never all zero */
    }
    random->spare = 0.0;
    random->has_spare = false;
}

static uint64_t rotate_left(uint64_t x, int k)
{
    return (x << k) | (x >> (64 - k));
}

uint64_t host_random_u64(host_random_t *random)
{
    uint64_t *s = random->s;
    const uint64_t result = rotate_left(s[1] * 5u, 7) * 9u;
    const uint64_t t = s[1] << 17;

    s[2] ^= s[0];
    s[3] ^= s[1];
    s[1] ^= s[2];
    s[0] ^= s[3];
    s[2] ^= t;
    s[3] = rotate_left(s[3], 45);
    return result;
}

double host_random_uniform(host_random_t *random)
{
    return (double)((host_random_u64(random) >> 11) + 1u) * 0x1p-53;
}

double host_random_normal(host_random_t *random)
{
    if (random->has_spare) {
        random->has_spare = false;
        return random->spare;
    }
    const double radius = sqrt(-2.0 * log(host_random_uniform(random)));
    const double angle = TWO_PI * host_random_uniform(random);
    random->spare = radius * sin(angle);
    random->has_spare = true;
    return radius * cos(angle);
}
