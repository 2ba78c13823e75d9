/* What the kernel steps share: kernel.c has the loop, regularised.c more kernels. */
#ifndef PFL_KERNEL_H
#define PFL_KERNEL_H

#include "core.h"

static inline bool pfl_kernel_takes(const pfl_t *f, uint32_t d)
{
    const uint32_t mask = f->config->kernel->states_mask;
    return (mask == 0u) || (((mask >> d) & 1u) != 0u);
}

/* x <- x + pull (mean - x) + width L n for every particle, n from `shape`: it finds D columns of standard normals in
 * f->work and a free column behind the last that noise can have. null: n is standard normal. */
void pfl_kernel_spread(pfl_t *f, float pull, void (*shape)(pfl_t *f, uint32_t n));

#endif
