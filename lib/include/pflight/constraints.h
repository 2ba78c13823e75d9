/* Ready state constraints for pfl_constraint_t, in lib/src/constraint_*.c: use them, or read them as examples. Each is a
 * pfl_inside_fn with the pfl_project_fns that suit it; `user` (pfl_constraint_t.user) is the parameter structure. All
 * O(n) per batch. */
#ifndef PFLIGHT_CONSTRAINTS_H
#define PFLIGHT_CONSTRAINTS_H

#include "pflight/filter.h"

#ifdef __cplusplus
extern "C" {
#endif

/* ---- A ring road: inner_m <= |p - center| <= outer_m ------------------------------------------------------------ */
typedef struct {
    uint16_t x_state, y_state;   /* position */
    uint16_t vx_state, vy_state; /* velocity; pfl_ring_clamp leaves it alone */
    float center_x_m, center_y_m;
    float inner_m, outer_m; /* 0 <= inner_m < outer_m */
} pfl_ring_t;

void pfl_ring_inside(void *user, const pfl_view_t *p, uint32_t *inside);

/* All three move a particle that is outside straight to the nearer edge: within it by some 5e-7 of the radius and of
 * the center's coordinates, so that it counts as inside whatever the rounding. They differ in the speed that points
 * further out, v.n: slide takes it off, bounce reverses it, clamp leaves it, so that the particle leaves again with the next step. */
void pfl_ring_slide(void *user, const pfl_batch_t *p);
void pfl_ring_bounce(void *user, const pfl_batch_t *p);
void pfl_ring_clamp(void *user, const pfl_batch_t *p);

/* The point of the ring that is nearest to (*x_m, *y_m). O(1). */
void pfl_ring_nearest(const pfl_ring_t *ring, float *x_m, float *y_m);

#ifdef __cplusplus
}
#endif

#endif
