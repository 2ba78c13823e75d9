/* The library's normals with a fault put in, FAULT 1 .. 5: what tools/randomness/normal_tests.c must find. FAULT 0: none.
 * Compiled in place of normals.c by test/checks/battery. */
#define pfl_rng_normals sound_normals
#include "../../lib/src/normals.c"
#undef pfl_rng_normals

static float spoil(float z, float neighbour, size_t i)
{
    switch (FAULT) {
    case 1: /* too wide by half a per cent */
        return 1.005f * z;
    case 2: /* no tails beyond 4 */
        return (z > 4.0f) ? 4.0f : ((z < -4.0f) ? -4.0f : z);
    case 3: /* one lane leans on the next */
        return ((i % 16u) == 5u) ? (0.9998f * z) + (0.02f * neighbour) : z;
    case 4: /* a gap in the middle */
        return ((z > 0.499f) && (z < 0.5f)) ? z + 0.001f : z;
    case 5: /* in one lane the sign never changes */
        return (((i % 16u) == 9u) && (z < 0.0f)) ? -z : z;
    default:
        return z;
    }
}

void pfl_rng_normals(pfl_rng_t *rng, float *out, size_t groups)
{
    sound_normals(rng, out, groups);
    for (size_t i = 0; i < (16u * groups); i++) {
        out[i] = spoil(out[i], out[i ^ 1u], i);
    }
}
