/* The regularised filter (Musso, Oudjane and Le Gland 2001): after each resampling the particles are drawn anew from a
 * smooth density around them, so that copies of one particle come apart. Kernels to be named in pfl_kernel_t.move beside
 * pfl_kernel_move, and the widths that suit them. docs/filters.md tells when to use which.
 *
 * pfl_kernel_move shrinks the cloud as much as its noise widens it (Liu and West 2001): mean and covariance stay, over any
 * number of resamplings. It is the one for static parameters and biases, and for tempered.h. The two below do not shrink:
 * the mean stays, the covariance grows to (1 + width^2) of itself at each resampling, but a cloud in several heaps keeps
 * its heaps in place, where shrinking pulls them together. */
#ifndef PFLIGHT_REGULARISED_H
#define PFLIGHT_REGULARISED_H

#include "pflight/filter.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Not to be called, but to be named in pfl_kernel_t.move. x <- x + width L n, L L' the covariance of the resampled
 * particles. O(N D^2) in a step that resamples. */
void pfl_kernel_gaussian(pfl_t *f);     /* n standard normal */
void pfl_kernel_epanechnikov(pfl_t *f); /* n bounded, |n| < sqrt(d + 4), of unit variance: no particle far out. Four
                                           normals a particle more; d: states that take part. Stack: 128 B more */

/* The widths of least mean integrated squared error for a Gaussian density (Silverman 1986), as pfl_kernel_t.width: the
 * deviation of the noise in those of the cloud. particles: N >= 1; states: 1 .. PFL_STATES_MAX, those that take part.
 * At most 0.99. Half of it or less where the density has several heaps: the covariance is that of all of them. O(1). */
float pfl_kernel_width_gaussian(uint32_t particles, uint32_t states);
float pfl_kernel_width_epanechnikov(uint32_t particles, uint32_t states);

/* The width for pfl_kernel_move that belongs to Liu and West's discount factor: sqrt(1 - ((3 delta - 1) / (2 delta))^2);
 * delta 0.95 .. 0.99 usual, 1/2 < delta < 1. O(1). */
float pfl_kernel_width_discount(float delta);

#ifdef __cplusplus
}
#endif

#endif
