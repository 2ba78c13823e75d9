/* Antithetic noise: antithetic.h tells what it is. Each column that the library makes serves two of the model's: the
 * first half of its normals one of them, the second half the other. */
#include "pflight/antithetic.h"

static void mirror(const float *restrict half, uint32_t n, float *restrict noise)
{
    for (uint32_t i = 0u; i < (n / 2u); i++) {
        noise[(size_t)2u * i] = half[i];
        noise[((size_t)2u * i) + 1u] = -half[i];
    }
    if ((n & 1u) != 0u) { /* without a partner */
        noise[n - 1u] = half[n / 2u];
    }
}

void pfl_antithetic_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    const pfl_antithetic_t *m = (const pfl_antithetic_t *)user;
    const uint32_t noises = (m->noises < PFL_ANTITHETIC_MAX) ? m->noises : PFL_ANTITHETIC_MAX;
    float noise[PFL_ANTITHETIC_MAX * PFL_BATCH];
    const pfl_batch_t mirrored = {p->x, p->stride, noise, p->first, p->n};
    for (uint32_t q = 0u; q < noises; q++) {
        /* With n odd the halves share the normal in the middle, for different particles. */
        const float *column = PFL_NOISE(p, q / 2u);
        mirror(((q & 1u) == 0u) ? column : &column[p->n / 2u], p->n, &noise[(size_t)q * PFL_BATCH]);
    }
    m->predict(m->user, u, dt_s, &mirrored);
}
