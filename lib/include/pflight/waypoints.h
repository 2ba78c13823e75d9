/* Waypoint tracking: routes of straight segments, when to switch to the next one, and which course to fly. Pure
 * functions of a route, a waypoint's index and a position: an aircraft keeps one index, a particle filter keeps one a
 * particle (pfl_autopilot_predict does). lib/src/guidance_waypoint.c; an optional module. */
#ifndef PFLIGHT_WAYPOINTS_H
#define PFLIGHT_WAYPOINTS_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* A place to fly to. */
typedef struct {
    float x_m, y_m;
} pfl_waypoint_t;

/* When the waypoint steered for counts as reached. */
typedef enum {
    PFL_SWITCH_RADIUS = 0,    /* closer than reach_m */
    PFL_SWITCH_HALF_PLANE = 1 /* past the plane through it that halves the angle of its two segments, or closer than
                                 reach_m: cannot be missed by flying past (Beard and McLain 2012, algorithm 7) */
} pfl_switching_t;

/* Constant while in use; may be in flash. */
typedef struct {
    const pfl_waypoint_t *waypoint; /* `count` of them, owned by the caller */
    uint32_t count;                 /* >= 1 */
    bool closed;                    /* after the last comes the first; else the last is held */
    pfl_switching_t switching;
    float reach_m;      /* >= 0 */
    float approach_rad; /* pfl_route_course: angle at which a segment is approached from far off, 0 .. pi/2 */
    float follow_per_m; /* pfl_route_course: how sharply that angle goes to zero near the segment, > 0 [1/m] */
} pfl_route_t;

/* The index to steer for from here on: `target`, or the one after it when target is reached. One switch a call at most;
 * the last of an open route stays. An index beyond the route means its last. O(1). */
uint32_t pfl_route_switch(const pfl_route_t *route, uint32_t target, float x_m, float y_m);

/* Course straight to the target: its bearing [rad, -pi .. pi], 0 on top of it. Wind drifts the track into a curve.
 * O(1). */
float pfl_route_bearing(const pfl_route_t *route, uint32_t target, float x_m, float y_m);

/* Course onto the segment that ends in the target and along it, a vector field (Nelson et al. 2007):
 * q - approach_rad 2/pi atan(follow_per_m e), q the segment's course and e the position's distance to its left.
 * In -pi .. pi. The bearing where there is no segment: before the first of an open route, or one of no length. O(1). */
float pfl_route_course(const pfl_route_t *route, uint32_t target, float x_m, float y_m);

/* Distance to the left of the segment that ends in the target [m], negative to its right; 0 where there is none.
 * O(1). */
float pfl_route_cross_track(const pfl_route_t *route, uint32_t target, float x_m, float y_m);

#ifdef __cplusplus
}
#endif

#endif
