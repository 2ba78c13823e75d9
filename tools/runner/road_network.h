/* The scenario `road-network`: a UAV keeps a distance to a car or a lorry on a network of streets, which it loses twice for
 * ten seconds, by the estimates of filters that know the streets and of filters that do not. UAV, sensor and outages are
 * those of `standoff`. */
#ifndef RUNNER_ROAD_NETWORK_H
#define RUNNER_ROAD_NETWORK_H

#include "scenario.h"
#include "standoff.h"

#include "pflight/road_network.h"

extern const scenario_t road_network_scenario;

typedef enum { ROAD_FREE, ROAD_ANNULUS, ROAD_ONE, ROAD_TWO, ROAD_FILTERS } road_filter_kind_t;

typedef struct {
    uint32_t particles;
    uint64_t seed;
    double accel; /* of the filters without streets */
} road_study_t;

/* ---- road_network_world.c ------------------------------------------------------------------------------------------- */

enum { ROAD_CAR, ROAD_LORRY, ROAD_VEHICLES };
enum { ROAD_RING_NODES = 16, ROAD_NODES = 2 * ROAD_RING_NODES, ROAD_EDGES = 80 };

/* The annulus that holds all streets and the vehicles' sway. */
#define ROAD_MAP_INNER_M 66.0
#define ROAD_MAP_OUTER_M 132.0

/* Streets. */
typedef struct {
    pfl_road_node_t node[ROAD_NODES];
    pfl_road_edge_t edge[ROAD_EDGES];
    pfl_road_graph_t graph; /* of the two above: not to be copied */
} road_map_t;

extern const pfl_road_vehicle_t road_vehicles[ROAD_VEHICLES];

bool road_make_map(road_map_t *map, failure_t *failure);

/* The target's way, as `standoff` has it; which vehicle it is, is drawn too. */
unsigned road_make_track(const road_study_t *s, const road_map_t *map, uint32_t run, standoff_track_t *track);

/* ---- road_network_filter.c ------------------------------------------------------------------------------------------ */

typedef struct road_filter road_filter_t;

/* Null on a failure. To be closed. */
road_filter_t *road_filter_open(const road_study_t *s, const road_map_t *map, road_filter_kind_t kind, uint32_t run,
                                const double *prior, failure_t *failure);
void road_filter_close(road_filter_t *r);

/* A cycle; sight: null in an outage. lorry: its probability, where the filter tells. */
bool road_filter_step(road_filter_t *r, unsigned k, const standoff_sight_t *sight, standoff_belief_t *belief,
                      double *lorry, uint32_t *cycles_ns, cycle_t *cycle, failure_t *failure);

/* The step, to be looked at. */
void road_filter_show(const road_filter_t *r, unsigned k, const double *target, const standoff_belief_t *belief,
                      look_t *look);

#endif
