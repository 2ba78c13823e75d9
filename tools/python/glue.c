/* See glue.h. */
#include "glue.h"

#include <string.h>

#define FNV_PRIME UINT64_C(0x00000100000001B3)

void pflight_motion_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    const pflight_motion_t *motion = user;
    motion->predict(motion->user, u, dt_s, p);
}

void pflight_motion_draw(void *user, const pfl_batch_t *p)
{
    const pflight_motion_t *motion = user;
    motion->draw(motion->draw_user, p);
}

void pflight_gaussian_draw(void *user, const pfl_batch_t *p)
{
    const pflight_gaussian_t *prior = user;

    for (uint32_t d = 0u; d < prior->states; d++) {
        float *x = PFL_STATE(p, d);
        const float *w = PFL_NOISE(p, d);
        for (uint32_t i = 0u; i < p->n; i++) {
            x[i] = prior->mean[d] + prior->sigma[d] * w[i];
        }
    }
}

uint64_t pflight_hash_floats(uint64_t hash, const float *x, size_t n)
{
    for (size_t i = 0u; i < n; i++) {
        uint32_t bits;
        memcpy(&bits, &x[i], sizeof bits);
        for (unsigned byte = 0u; byte < 4u; byte++) {
            hash = (hash ^ ((bits >> (8u * byte)) & 0xFFu)) * FNV_PRIME;
        }
    }
    return hash;
}
