/* A ring road: inside or not, and the ways back onto it. constraints.h has the rules. */
#include "pflight/constraints.h"

#include "sqrt_kernel.h"

/* Edges are met from within by this share of the farthest coordinates there: eight roundings, more than the way makes. */
#define MARGIN 4.76837158e-7f

#define NO_RADIUS 1.0e-12f /* nearer to the center than this there is no direction: any will do */

static inline bool is_outside(const pfl_ring_t *ring, float square)
{
    return (square < (ring->inner_m * ring->inner_m)) | (square > (ring->outer_m * ring->outer_m));
}

static inline float size_of(float x)
{
    return (x < 0.0f) ? -x : x;
}

/* Where a radius outside lands. A ring far from the origin has coarser coordinates than its radius tells. */
static inline float landing(const pfl_ring_t *ring, float radius)
{
    const float far = size_of(ring->center_x_m) + size_of(ring->center_y_m);
    const float out = ring->outer_m - ((ring->outer_m + far) * MARGIN);
    const float in = ring->inner_m + ((ring->inner_m + far) * MARGIN);
    return (radius < ring->inner_m) ? in : out;
}

void pfl_ring_inside(void *user, const pfl_view_t *p, uint32_t *inside)
{
    const pfl_ring_t ring = *(const pfl_ring_t *)user;
    const float *restrict x = &p->x[(size_t)ring.x_state * p->stride];
    const float *restrict y = &p->x[(size_t)ring.y_state * p->stride];
    uint32_t *restrict out = inside;
    for (uint32_t i = 0u; i < p->n; i++) {
        const float dx = x[i] - ring.center_x_m;
        const float dy = y[i] - ring.center_y_m;
        out[i] = is_outside(&ring, (dx * dx) + (dy * dy)) ? 0u : 1u;
    }
}

/* speed_share: how much of the speed that points out is taken off. */
static inline void project(const pfl_ring_t ring, const pfl_batch_t *p, float speed_share)
{
    float *restrict x = PFL_STATE(p, ring.x_state);
    float *restrict y = PFL_STATE(p, ring.y_state);
    float *restrict vx = PFL_STATE(p, ring.vx_state);
    float *restrict vy = PFL_STATE(p, ring.vy_state);
    for (uint32_t i = 0u; i < p->n; i++) {
        const float dx = x[i] - ring.center_x_m;
        const float dy = y[i] - ring.center_y_m;
        const float square = (dx * dx) + (dy * dy);
        const bool outside = is_outside(&ring, square);
        const float r = pfl_sqrt_kernel(square);
        const bool nowhere = r < NO_RADIUS;
        const float nx = nowhere ? 1.0f : (dx / r);
        const float ny = nowhere ? 0.0f : (dy / r);
        const float radius = landing(&ring, r);
        const float speed = (vx[i] * nx) + (vy[i] * ny);
        const float off = (r < ring.inner_m) ? -speed : speed; /* > 0: it points further out of the ring */
        const float take = (outside && (off > 0.0f)) ? (speed_share * speed) : 0.0f;
        x[i] = outside ? (ring.center_x_m + (nx * radius)) : x[i];
        y[i] = outside ? (ring.center_y_m + (ny * radius)) : y[i];
        vx[i] -= take * nx;
        vy[i] -= take * ny;
    }
}

void pfl_ring_slide(void *user, const pfl_batch_t *p)
{
    project(*(const pfl_ring_t *)user, p, 1.0f);
}

void pfl_ring_bounce(void *user, const pfl_batch_t *p)
{
    project(*(const pfl_ring_t *)user, p, 2.0f);
}

void pfl_ring_clamp(void *user, const pfl_batch_t *p)
{
    project(*(const pfl_ring_t *)user, p, 0.0f);
}

void pfl_ring_nearest(const pfl_ring_t *ring, float *x_m, float *y_m)
{
    const float dx = *x_m - ring->center_x_m;
    const float dy = *y_m - ring->center_y_m;
    const float r = pfl_sqrt_kernel((dx * dx) + (dy * dy));
    if (r < NO_RADIUS) {
        *x_m = ring->center_x_m + ring->inner_m;
    } else if ((r < ring->inner_m) || (r > ring->outer_m)) {
        const float scale = ((r < ring->inner_m) ? ring->inner_m : ring->outer_m) / r;
        *x_m = ring->center_x_m + (dx * scale);
        *y_m = ring->center_y_m + (dy * scale);
    } else {
        /* on the ring already */
    }
}
