/* A target on a network of roads: road_network.h tells what it is. One uniform number a step is enough for all nodes of
 * that step: where it lies within the interval of the way that was chosen is uniform again. */
#include "pflight/road_network.h"

#include "sqrt_kernel.h"
#include "uniform_kernel.h"

#include "pflight/math.h"

#include <float.h>

#define BEND 0.70710678f /* cosine of 45 degrees */

/* NaN stays NaN, for the filter to see. */
static inline float clip(float x, float lo, float hi)
{
    const float low = (x < lo) ? lo : x;
    return (low > hi) ? hi : low;
}

/* ---- The graph ---------------------------------------------------------------------------------------------------- */

static bool measure(const pfl_road_graph_t *g, pfl_road_edge_t *e)
{
    const float dx = g->node[e->to].x_m - g->node[e->from].x_m;
    const float dy = g->node[e->to].y_m - g->node[e->from].y_m;
    const float length = pfl_sqrt_kernel((dx * dx) + (dy * dy));
    if (!((length > 0.0f) && (length <= FLT_MAX))) {
        return false;
    }
    e->length_m = length;
    e->ux = dx / length;
    e->uy = dy / length;
    return true;
}

/* Edge k among the ways of its node, the next of the edges so far. */
static bool enter(const pfl_road_graph_t *g, uint32_t k, uint32_t before)
{
    pfl_road_edge_t *e = &g->edge[k];
    if ((e->from < before) || (e->from >= g->nodes) || (e->to >= g->nodes)) {
        return false;
    }
    pfl_road_node_t *node = &g->node[e->from];
    node->first = (node->ways == 0u) ? k : node->first;
    node->ways++;
    return (node->ways <= PFL_ROAD_WAYS_MAX) && measure(g, e);
}

/* Edges into their nodes, one after the other. */
static bool enter_all(const pfl_road_graph_t *g)
{
    uint32_t before = 0u;
    for (uint32_t k = 0u; k < g->nodes; k++) {
        g->node[k].first = 0u;
        g->node[k].ways = 0u;
    }
    for (uint32_t k = 0u; k < g->edges; k++) {
        if (!enter(g, k, before)) {
            return false;
        }
        before = g->edge[k].from;
    }
    return true;
}

static bool is_left(const pfl_road_graph_t *g)
{
    uint32_t left = 0u; /* nodes with a way out */
    for (uint32_t k = 0u; k < g->nodes; k++) {
        left += (g->node[k].ways != 0u) ? 1u : 0u;
    }
    return left == g->nodes;
}

pfl_status_t pfl_road_prepare(const pfl_road_graph_t *graph)
{
    if ((graph == NULL) || (graph->node == NULL) || (graph->edge == NULL)) {
        return PFL_ERR_ARG;
    }
    const bool counted = (graph->nodes > 0u) && (graph->edges >= graph->nodes) && (graph->edges <= PFL_ROAD_EDGES_MAX);
    return (counted && enter_all(graph) && is_left(graph)) ? PFL_OK : PFL_ERR_CONFIG;
}

/* ---- Places on it --------------------------------------------------------------------------------------------------- */

typedef struct {
    uint32_t edge;
    float along_m, speed_mps;
} on_road_t;

static inline uint32_t edge_of(const pfl_road_graph_t *g, float number)
{
    const float low = (number > 0.0f) ? number : 0.0f; /* none for NaN */
    return (uint32_t)(int32_t)(clip(low, 0.0f, (float)(int32_t)(g->edges - 1u)) + 0.5f);
}

static void write(const pfl_road_graph_t *g, const on_road_t *at, uint32_t i, const pfl_batch_t *p)
{
    const pfl_road_edge_t *e = &g->edge[at->edge];
    PFL_STATE(p, PFL_ROAD_EDGE)[i] = (float)(int32_t)at->edge;
    PFL_STATE(p, PFL_ROAD_ALONG)[i] = at->along_m;
    PFL_STATE(p, PFL_ROAD_SPEED)[i] = at->speed_mps;
    PFL_STATE(p, PFL_ROAD_X)[i] = g->node[e->from].x_m + (at->along_m * e->ux);
    PFL_STATE(p, PFL_ROAD_Y)[i] = g->node[e->from].y_m + (at->along_m * e->uy);
    PFL_STATE(p, PFL_ROAD_VX)[i] = at->speed_mps * e->ux;
    PFL_STATE(p, PFL_ROAD_VY)[i] = at->speed_mps * e->uy;
}

static inline float cosine(const pfl_road_edge_t *a, const pfl_road_edge_t *b)
{
    return (a->ux * b->ux) + (a->uy * b->uy);
}

/* The way on from the end of an edge. *u: uniform in [0, 1], and again afterwards. */
static uint32_t choose(const pfl_road_network_t *m, uint32_t edge, float *u)
{
    const pfl_road_edge_t *here = &m->graph->edge[edge];
    const pfl_road_node_t *node = &m->graph->node[here->to];
    float weight[PFL_ROAD_WAYS_MAX];
    float sum = 0.0f;
    for (uint32_t k = 0u; k < node->ways; k++) {
        const pfl_road_edge_t *on = &m->graph->edge[node->first + k];
        const float ahead = m->vehicle.turn + (m->vehicle.ahead * clip(cosine(here, on), 0.0f, 1.0f));
        weight[k] = (on->to == here->from) ? m->vehicle.back : ahead;
        sum += weight[k];
    }
    const float point = *u * sum;
    float end = 0.0f;
    float start = 0.0f;
    float width = 1.0f;
    uint32_t way = 0u;
    for (uint32_t k = 0u; k < node->ways; k++) {
        if ((weight[k] > 0.0f) && (point >= end)) { /* the last that begins below: never one of weight 0 */
            way = k;
            start = end;
            width = weight[k];
        }
        end += weight[k];
    }
    *u = (point - start) / width;
    return node->first + way;
}

static void follow(const pfl_road_network_t *m, float u, on_road_t *at)
{
    const pfl_road_edge_t *edge = m->graph->edge;
    for (uint32_t k = 0u; (k < PFL_ROAD_CROSSINGS_MAX) && (at->along_m >= edge[at->edge].length_m); k++) {
        const uint32_t next = choose(m, at->edge, &u);
        const bool bends = cosine(&edge[at->edge], &edge[next]) < BEND;
        at->along_m -= edge[at->edge].length_m;
        at->speed_mps = clip(at->speed_mps, 0.0f, bends ? m->vehicle.corner_mps : m->vehicle.speed_max_mps);
        at->edge = next;
    }
    at->along_m = clip(at->along_m, 0.0f, edge[at->edge].length_m);
}

void pfl_road_network_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    const pfl_road_network_t *m = (const pfl_road_network_t *)user;
    const pfl_road_vehicle_t v = m->vehicle;
    const float keep = pfl_expf(-dt_s / v.time_s);
    const float spread = v.sigma_mps * pfl_sqrtf(1.0f - (keep * keep));
    const float *w_speed = PFL_NOISE(p, 0);
    const float *w_way = PFL_NOISE(p, 1);
    (void)u;
    for (uint32_t i = 0u; i < p->n; i++) {
        const float speed = PFL_STATE(p, PFL_ROAD_SPEED)[i];
        const float next = v.cruise_mps + ((keep * (speed - v.cruise_mps)) + (spread * w_speed[i]));
        on_road_t at = {edge_of(m->graph, PFL_STATE(p, PFL_ROAD_EDGE)[i]), PFL_STATE(p, PFL_ROAD_ALONG)[i],
                        clip(next, 0.0f, v.speed_max_mps)};
        at.along_m += (0.5f * dt_s) * (speed + at.speed_mps);
        follow(m, pfl_uniform_kernel(w_way[i]), &at);
        write(m->graph, &at, i, p);
    }
}

/* ---- From the plane onto it ----------------------------------------------------------------------------------------- */

void pfl_road_put(const pfl_road_graph_t *graph, float against_s, const pfl_batch_t *p)
{
    for (uint32_t i = 0u; i < p->n; i++) {
        const float x = PFL_STATE(p, PFL_ROAD_X)[i];
        const float y = PFL_STATE(p, PFL_ROAD_Y)[i];
        const float vx = PFL_STATE(p, PFL_ROAD_VX)[i];
        const float vy = PFL_STATE(p, PFL_ROAD_VY)[i];
        on_road_t best = {0u, 0.0f * (x + y), 0.0f}; /* what is not finite stays so */
        float least = FLT_MAX;
        for (uint32_t k = 0u; k < graph->edges; k++) {
            const pfl_road_edge_t *e = &graph->edge[k];
            const float dx = x - graph->node[e->from].x_m;
            const float dy = y - graph->node[e->from].y_m;
            const float along = clip((dx * e->ux) + (dy * e->uy), 0.0f, e->length_m);
            const float off_x = dx - (along * e->ux);
            const float off_y = dy - (along * e->uy);
            const float speed = (vx * e->ux) + (vy * e->uy);
            const float against = against_s * clip(-speed, 0.0f, FLT_MAX);
            const float far = ((off_x * off_x) + (off_y * off_y)) + (against * against);
            if (far < least) {
                least = far;
                best = (on_road_t){k, along, clip(speed, 0.0f, FLT_MAX)};
            }
        }
        write(graph, &best, i, p);
    }
}
