/* The world of `road-network`: two ring roads of straight pieces, joined by eight radial streets, and a vehicle that drives
 * on them in double precision. It is not quite the filter's model: it brakes before a corner, not in it, and sways by a
 * metre about the middle of the road. */
#include "host_random.h"
#include "road_network.h"

#include <math.h>
#include <string.h>

#define PI 3.14159265358979323846
#define INNER_M 70.0
#define OUTER_M 130.0
#define SWAY_M 1.0
#define SWAY_PERIOD_S 20.0
#define PIECES 10         /* of a step of the target's motion */
#define BRAKING_MPS2 2.0  /* before a corner */
#define CORNER 0.70710678 /* cosine of the turn from which on it is one */
#define START_MPS 5.0

static const double prior_sigma[TARGET_STATES] = {10.0, 10.0, 3.0, 3.0};

/* The car is quick, and turns at every second junction; the lorry is slow and steady, and keeps to its road. */
const pfl_road_vehicle_t road_vehicles[ROAD_VEHICLES] = {
    [ROAD_CAR] = {7.0f, 4.0f, 1.5f, 12.0f, 4.0f, 1.0f, 0.5f, 0.0f},
    [ROAD_LORRY] = {4.0f, 10.0f, 0.6f, 7.0f, 2.5f, 0.1f, 1.0f, 0.0f},
};

/* Node i of the inner ring is i, of the outer one ROAD_RING_NODES + i; every second one is a junction. */
bool road_make_map(road_map_t *map, failure_t *failure)
{
    uint32_t edges = 0u;

    memset(map, 0, sizeof *map);
    map->graph = (pfl_road_graph_t){map->node, map->edge, ROAD_NODES, ROAD_EDGES};
    for (uint32_t i = 0u; i < ROAD_NODES; i++) {
        const uint32_t ring = i / ROAD_RING_NODES * ROAD_RING_NODES;
        const uint32_t at = i - ring;
        const double angle = 2.0 * PI * (double)at / (double)ROAD_RING_NODES;
        const double radius = ring == 0u ? INNER_M : OUTER_M;
        map->node[i].x_m = (float)(radius * cos(angle));
        map->node[i].y_m = (float)(radius * sin(angle));
        map->edge[edges++] = (pfl_road_edge_t){.from = i, .to = ring + (at + 1u) % ROAD_RING_NODES};
        map->edge[edges++] = (pfl_road_edge_t){.from = i, .to = ring + (at + ROAD_RING_NODES - 1u) % ROAD_RING_NODES};
        if (at % 2u == 0u) {
            map->edge[edges++] = (pfl_road_edge_t){.from = i, .to = (i + ROAD_RING_NODES) % ROAD_NODES};
        }
    }
    const pfl_status_t status = pfl_road_prepare(&map->graph);
    return status == PFL_OK || fail(failure, EXIT_HARNESS, "pfl_road_prepare: %s", pfl_status_string(status));
}

/* ---- The vehicle -------------------------------------------------------------------------------------------------- */

typedef struct {
    const road_map_t *map;
    const pfl_road_vehicle_t *vehicle;
    host_random_t random;
    uint32_t edge, next;                 /* it knows where it will turn */
    double along_m, speed_mps, mood_mps; /* the speed that it would drive without corners */
} driver_t;

static double cosine(const pfl_road_edge_t *a, const pfl_road_edge_t *b)
{
    return (double)a->ux * (double)b->ux + (double)a->uy * (double)b->uy;
}

static uint32_t choose(driver_t *d, uint32_t edge)
{
    const pfl_road_edge_t *here = &d->map->edge[edge];
    const pfl_road_node_t *node = &d->map->node[here->to];
    double weight[PFL_ROAD_WAYS_MAX];
    double sum = 0.0;

    for (uint32_t k = 0u; k < node->ways; k++) {
        const pfl_road_edge_t *on = &d->map->edge[node->first + k];
        weight[k] = on->to == here->from
                        ? (double)d->vehicle->back
                        : (double)d->vehicle->turn + (double)d->vehicle->ahead * fmax(cosine(here, on), 0.0);
        sum += weight[k];
    }
    double left = sum * host_random_uniform(&d->random); /* in (0, sum] */
    uint32_t way = 0u;
    while (way + 1u < node->ways && left > weight[way]) {
        left -= weight[way];
        way++;
    }
    return node->first + way;
}

static void drive(driver_t *d, double dt_s)
{
    const pfl_road_edge_t *edge = d->map->edge;
    const double cruise = (double)d->vehicle->cruise_mps;
    const double keep = exp(-dt_s / (double)d->vehicle->time_s);
    const double spread = (double)d->vehicle->sigma_mps * sqrt(1.0 - keep * keep);
    const double corner = (double)d->vehicle->corner_mps;

    d->mood_mps = cruise + keep * (d->mood_mps - cruise) + spread * host_random_normal(&d->random);
    d->mood_mps = fmin(fmax(d->mood_mps, 0.0), (double)d->vehicle->speed_max_mps);
    double wanted = d->mood_mps;
    if (cosine(&edge[d->edge], &edge[d->next]) < CORNER) {
        const double left = fmax((double)edge[d->edge].length_m - d->along_m, 0.0);
        wanted = fmin(wanted, sqrt(corner * corner + 2.0 * BRAKING_MPS2 * left));
    }
    d->speed_mps = fmin(wanted, d->speed_mps + BRAKING_MPS2 * dt_s);
    d->along_m += dt_s * d->speed_mps;
    if (d->along_m >= (double)edge[d->edge].length_m) {
        d->along_m -= (double)edge[d->edge].length_m;
        d->edge = d->next;
        d->next = choose(d, d->edge);
    }
}

unsigned road_make_track(const road_study_t *s, const road_map_t *map, uint32_t run, standoff_track_t *track)
{
    driver_t d = {.map = map};
    host_random_t measured;

    memset(track, 0, sizeof *track);
    host_random_start(&d.random, s->seed, run, RANDOM_TRUTH);
    const unsigned which = host_random_uniform(&d.random) <= 0.5 ? ROAD_CAR : ROAD_LORRY;
    const double phase = 2.0 * PI * host_random_uniform(&d.random);
    d.vehicle = &road_vehicles[which];
    d.edge = (uint32_t)(host_random_u64(&d.random) % ROAD_EDGES);
    d.next = choose(&d, d.edge);
    d.speed_mps = START_MPS;
    d.mood_mps = (double)d.vehicle->cruise_mps;
    for (unsigned k = 0u; k <= STANDOFF_STEPS; k++) {
        const double rate = 2.0 * PI / SWAY_PERIOD_S;
        const double turn = rate * (double)k * STANDOFF_PERIOD_S + phase;
        for (int piece = 0; k > 0u && piece < PIECES; piece++) {
            drive(&d, STANDOFF_PERIOD_S / (double)PIECES);
        }
        const pfl_road_edge_t *e = &map->edge[d.edge];
        const double ux = (double)e->ux, uy = (double)e->uy;
        const double aside = SWAY_M * sin(turn), aside_mps = SWAY_M * rate * cos(turn);
        track->target[k][TARGET_X] = (double)map->node[e->from].x_m + d.along_m * ux - aside * uy;
        track->target[k][TARGET_Y] = (double)map->node[e->from].y_m + d.along_m * uy + aside * ux;
        track->target[k][TARGET_VX] = d.speed_mps * ux - aside_mps * uy;
        track->target[k][TARGET_VY] = d.speed_mps * uy + aside_mps * ux;
    }
    host_random_start(&measured, s->seed, run, RANDOM_MEASUREMENT);
    for (int i = 0; i < TARGET_STATES; i++) {
        track->prior[i] = track->target[0][i] + prior_sigma[i] * host_random_normal(&measured);
    }
    for (unsigned k = 1u; k <= STANDOFF_STEPS; k++) {
        track->noise[k][0][0] = host_random_normal(&measured);
        track->noise[k][0][1] = host_random_normal(&measured);
    }
    return which;
}
