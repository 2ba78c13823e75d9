/* Routes of straight segments: waypoints.h tells what each function does. */
#include "pflight/waypoints.h"

#include "math_kernels.h"
#include "sqrt_kernel.h"

#define TWO_OVER_PI 0.636619772f

/* A direction of length one; zeros between two points that coincide. */
typedef struct {
    float x, y;
} direction_t;

static uint32_t within(const pfl_route_t *route, uint32_t target)
{
    return (target < route->count) ? target : (route->count - 1u);
}

static uint32_t after(const pfl_route_t *route, uint32_t target)
{
    const uint32_t last = route->closed ? 0u : target;
    return ((target + 1u) < route->count) ? (target + 1u) : last;
}

static uint32_t before(const pfl_route_t *route, uint32_t target)
{
    const uint32_t first = route->closed ? (route->count - 1u) : target;
    return (target > 0u) ? (target - 1u) : first;
}

static direction_t direction_between(const pfl_waypoint_t *from, const pfl_waypoint_t *to)
{
    const float dx = to->x_m - from->x_m;
    const float dy = to->y_m - from->y_m;
    const float length = pfl_sqrt_kernel((dx * dx) + (dy * dy));
    const float inverse = (length > 0.0f) ? (1.0f / length) : 0.0f;
    const direction_t direction = {dx * inverse, dy * inverse};
    return direction;
}

/* Of the segment that ends in the target. */
static direction_t segment(const pfl_route_t *route, uint32_t target)
{
    return direction_between(&route->waypoint[before(route, target)], &route->waypoint[target]);
}

static bool is_past(const pfl_route_t *route, uint32_t target, float x_m, float y_m)
{
    const direction_t in = segment(route, target);
    const direction_t out = segment(route, after(route, target));
    const float dx = x_m - route->waypoint[target].x_m;
    const float dy = y_m - route->waypoint[target].y_m;
    return ((dx * (in.x + out.x)) + (dy * (in.y + out.y))) >= 0.0f;
}

uint32_t pfl_route_switch(const pfl_route_t *route, uint32_t target, float x_m, float y_m)
{
    const uint32_t now = within(route, target);
    const uint32_t next = after(route, now);
    const float dx = x_m - route->waypoint[now].x_m;
    const float dy = y_m - route->waypoint[now].y_m;
    if (((dx * dx) + (dy * dy)) < (route->reach_m * route->reach_m)) {
        return next;
    }
    if ((route->switching == PFL_SWITCH_HALF_PLANE) && is_past(route, now, x_m, y_m)) {
        return next;
    }
    return now;
}

float pfl_route_bearing(const pfl_route_t *route, uint32_t target, float x_m, float y_m)
{
    const pfl_waypoint_t *to = &route->waypoint[within(route, target)];
    return pfl_atan2_kernel(to->y_m - y_m, to->x_m - x_m);
}

float pfl_route_cross_track(const pfl_route_t *route, uint32_t target, float x_m, float y_m)
{
    const uint32_t now = within(route, target);
    const direction_t q = segment(route, now);
    const float dx = x_m - route->waypoint[now].x_m;
    const float dy = y_m - route->waypoint[now].y_m;
    return (q.x * dy) - (q.y * dx);
}

float pfl_route_course(const pfl_route_t *route, uint32_t target, float x_m, float y_m)
{
    const uint32_t now = within(route, target);
    const direction_t q = segment(route, now);
    const pfl_waypoint_t *to = &route->waypoint[now];
    if (((q.x * q.x) + (q.y * q.y)) > 0.0f) {
        const float left_m = (q.x * (y_m - to->y_m)) - (q.y * (x_m - to->x_m));
        const float bend = pfl_atan2_kernel(route->follow_per_m * left_m, 1.0f);
        return pfl_wrap_pi_kernel(pfl_atan2_kernel(q.y, q.x) - ((route->approach_rad * TWO_OVER_PI) * bend));
    }
    return pfl_atan2_kernel(to->y_m - y_m, to->x_m - x_m);
}
