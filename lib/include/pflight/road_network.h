/* A target on a network of roads: straight edges between nodes, the way on at each junction drawn at random. Unlike a ring
 * (pfl_ring_t, pfl_road_target_predict) it knows junctions, bends, dead ends and one-way streets, and a particle never
 * leaves the roads, so that nothing has to be projected or redrawn. Several kinds of vehicle are regimes of jump.h, each
 * with its own pfl_road_network_t on the same graph. docs/filters.md shows what that gives.
 *
 * The graph is the caller's memory; nothing is allocated, and after pfl_road_prepare nothing of it is written. */
#ifndef PFLIGHT_ROAD_NETWORK_H
#define PFLIGHT_ROAD_NETWORK_H

#include "pflight/filter.h"

#ifdef __cplusplus
extern "C" {
#endif

#define PFL_ROAD_WAYS_MAX 8u      /* edges that begin at one node */
#define PFL_ROAD_CROSSINGS_MAX 4u /* nodes passed in one step; a particle that would pass more waits at the next one */
#define PFL_ROAD_EDGES_MAX 1048576u /* edges of a graph: their numbers are floats in particles */

/* States. The first three are the particle's, the others follow from them: what sensors, estimates and guidance want. */
enum {
    PFL_ROAD_EDGE = 0,  /* number of the edge */
    PFL_ROAD_ALONG = 1, /* way from its beginning [m] */
    PFL_ROAD_SPEED = 2, /* [m/s] */
    PFL_ROAD_X = 3,     /* [m] */
    PFL_ROAD_Y = 4,
    PFL_ROAD_VX = 5, /* [m/s] */
    PFL_ROAD_VY = 6,
    PFL_ROAD_STATES = 7
};

/* Where edges meet. */
typedef struct {
    float x_m, y_m;
    uint32_t first; /* set by pfl_road_prepare: the first edge that begins here */
    uint32_t ways;  /* likewise: how many do */
} pfl_road_node_t;

/* A road in one direction; most roads are two of them. */
typedef struct {
    uint32_t from, to; /* nodes */
    float length_m;    /* set by pfl_road_prepare */
    float ux, uy;      /* likewise: direction, of length 1 */
} pfl_road_edge_t;

/* The network. */
typedef struct {
    pfl_road_node_t *node;
    pfl_road_edge_t *edge; /* sorted by `from` */
    uint32_t nodes, edges; /* at least 1 each */
} pfl_road_graph_t;

/* How a kind of vehicle drives. Its speed is coloured noise about a cruising speed:
 *     v <- clip(cruise + k (v - cruise) + sqrt(1 - k^2) sigma w0, 0, v_max), k = exp(-dt/time)    s += dt (v_old + v) / 2
 * At a node w1 draws the way on, with probabilities in proportion to: turn + ahead * max(0, cos(angle of the turn)); but
 * `back` for the way it came from. Where all are 0 it takes the first. Beyond 45 degrees it goes on at corner at most. */
typedef struct {
    float cruise_mps;        /* 0 .. speed_max */
    float time_s;            /* correlation time of the speed, > 0 */
    float sigma_mps;         /* standard deviation of the speed */
    float speed_max_mps;     /* > 0 */
    float corner_mps;        /* > 0 */
    float turn, ahead, back; /* weights, >= 0 */
} pfl_road_vehicle_t;

/* The model's parameters. */
typedef struct {
    const pfl_road_graph_t *graph; /* prepared */
    pfl_road_vehicle_t vehicle;
} pfl_road_network_t;

/* Sets what the graph's members name. PFL_OK; PFL_ERR_ARG for a null pointer; PFL_ERR_CONFIG for counts out of range, edges
 * not sorted or to nodes that do not exist, an edge without length or of one that is not finite, a node that no edge leaves
 * (a dead end needs the way back) or more than PFL_ROAD_WAYS_MAX: the graph is not to be used then. O(nodes + edges). */
pfl_status_t pfl_road_prepare(const pfl_road_graph_t *graph);

/* Q = 2. user: pfl_road_network_t. u: not used. Whatever the numbers in the states, no edge outside the graph is looked at.
 * O(n) per batch, and ways per node passed. */
void pfl_road_network_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p);

/* Puts particles with x, y, vx, vy on the network, for pfl_config_t.draw and redraw: on the nearest point of an edge, one
 * against which the velocity points counting as `against_s` times that speed further away. Speed: along the edge, not below
 * 0. O(n edges). */
void pfl_road_put(const pfl_road_graph_t *graph, float against_s, const pfl_batch_t *p);

#ifdef __cplusplus
}
#endif

#endif
