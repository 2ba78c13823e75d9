/* Roads as a graph: what pfl_road_prepare sets and refuses, moves along edges and round corners with known answers, no
 * particle off the roads whatever the numbers, the odds at a junction, and the way from the plane onto it. */
#include "support.h"

#include "pflight/rng.h"
#include "pflight/road_network.h"

#include "unity.h"

#include <math.h>
#include <string.h>

/* A cross with arms of 100 m: node 0 in the middle, 1 east, 2 north, 3 west, 4 south; arms are dead ends but for one
 * street from the eastern to the northern end, one way. */
enum { NODES = 5, EDGES = 9 };
enum { TO_EAST, TO_NORTH, TO_WEST, TO_SOUTH, FROM_EAST, SLANT, FROM_NORTH, FROM_WEST, FROM_SOUTH };
static pfl_road_node_t node[NODES];
static pfl_road_edge_t edge[EDGES];
static const pfl_road_graph_t graph = {node, edge, NODES, EDGES};
static pfl_road_network_t network;

static float x[PFL_ROAD_STATES * PFL_BATCH];
static float noise[4u * PFL_BATCH];
static pfl_rng_t rng;

void setUp(void)
{
    static const float places[NODES][2] = {{0, 0}, {100, 0}, {0, 100}, {-100, 0}, {0, -100}};
    static const uint32_t ends[EDGES][2] = {{0, 1}, {0, 2}, {0, 3}, {0, 4}, {1, 0}, {1, 2}, {2, 0}, {3, 0}, {4, 0}};
    memset(node, 0xFF, sizeof node);
    memset(edge, 0, sizeof edge);
    for (uint32_t k = 0u; k < NODES; k++) {
        node[k].x_m = places[k][0];
        node[k].y_m = places[k][1];
    }
    for (uint32_t k = 0u; k < EDGES; k++) {
        edge[k].from = ends[k][0];
        edge[k].to = ends[k][1];
    }
    memset(x, 0, sizeof x);
    memset(noise, 0, sizeof noise);
    network = (pfl_road_network_t){
        &graph, {10.0f, 5.0f, 2.0f, 30.0f, 4.0f, 1.0f, 2.0f, 0.0f}}; /* ways ahead, left, right: 3 : 1 : 1 */
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_road_prepare(&graph));
}

void tearDown(void)
{
    ut_arenas_end();
}

static pfl_batch_t batch_of(uint32_t n)
{
    const pfl_batch_t b = {x, PFL_BATCH, noise, 0u, n};
    return b;
}

static void place(uint32_t i, float number, float along, float speed)
{
    x[PFL_ROAD_EDGE * PFL_BATCH + i] = number;
    x[PFL_ROAD_ALONG * PFL_BATCH + i] = along;
    x[PFL_ROAD_SPEED * PFL_BATCH + i] = speed;
}

static float state(uint32_t d, uint32_t i)
{
    return x[d * PFL_BATCH + i];
}

/* ---- The graph ---------------------------------------------------------------------------------------------------- */

void test_a_graph_is_prepared(void)
{
    static const uint32_t first[NODES] = {TO_EAST, FROM_EAST, FROM_NORTH, FROM_WEST, FROM_SOUTH};
    static const uint32_t ways[NODES] = {4, 2, 1, 1, 1};
    for (uint32_t k = 0u; k < NODES; k++) {
        TEST_ASSERT_EQUAL_UINT32(first[k], node[k].first);
        TEST_ASSERT_EQUAL_UINT32(ways[k], node[k].ways);
    }
    TEST_ASSERT_EQUAL_FLOAT(100.0f, edge[TO_WEST].length_m);
    TEST_ASSERT_EQUAL_FLOAT(-1.0f, edge[TO_WEST].ux);
    TEST_ASSERT_FLOAT_WITHIN(1e-4f, 141.421356f, edge[SLANT].length_m);
    TEST_ASSERT_FLOAT_WITHIN(1e-7f, 0.70710678f, edge[SLANT].uy);
}

static void refuse(pfl_road_graph_t g)
{
    TEST_ASSERT_EQUAL_INT(PFL_ERR_CONFIG, pfl_road_prepare(&g));
    setUp();
}

void test_what_is_no_graph_is_refused(void)
{
    const pfl_road_graph_t no_node = {NULL, edge, NODES, EDGES};
    const pfl_road_graph_t no_edge = {node, NULL, NODES, EDGES};
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_road_prepare(NULL));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_road_prepare(&no_node));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_road_prepare(&no_edge));
    refuse((pfl_road_graph_t){node, edge, 0u, EDGES});
    refuse((pfl_road_graph_t){node, edge, NODES, NODES - 1u});
    refuse((pfl_road_graph_t){node, edge, NODES, PFL_ROAD_EDGES_MAX + 1u});
    refuse((pfl_road_graph_t){node, edge, NODES, EDGES - 1u}); /* node 4 is left by none */
    refuse((pfl_road_graph_t){node, edge, NODES - 1u, EDGES}); /* edges to node 4, which is none now */
    edge[FROM_SOUTH].from = NODES;
    refuse(graph);
    edge[SLANT].from = 0u; /* not sorted */
    refuse(graph);
    node[2] = node[0]; /* no length */
    refuse(graph);
    node[2].x_m = 1e30f; /* one that overflows */
    refuse(graph);
    node[2].x_m = NAN;
    refuse(graph);
    pfl_road_edge_t many[PFL_ROAD_WAYS_MAX + 2u] = {{0u, 1u, 0.0f, 0.0f, 0.0f}};
    for (uint32_t k = 0u; k <= PFL_ROAD_WAYS_MAX; k++) {
        many[k].to = 1u;
    }
    many[PFL_ROAD_WAYS_MAX + 1u].from = 1u;
    refuse((pfl_road_graph_t){node, many, 2u, PFL_ROAD_WAYS_MAX + 2u});
    many[PFL_ROAD_WAYS_MAX].from = 1u;
    many[PFL_ROAD_WAYS_MAX].to = 0u;
    const pfl_road_graph_t full = {node, many, 2u, PFL_ROAD_WAYS_MAX + 2u};
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_road_prepare(&full));
}

/* ---- Moves ---------------------------------------------------------------------------------------------------------- */

/* k = exp(-0.5/5) = 0.904837418, sqrt(1 - k^2) = 0.425757, sigma 2, cruise 10. */
void test_a_step_along_an_edge(void)
{
    const pfl_batch_t b = batch_of(2u);
    place(0u, TO_NORTH, 20.0f, 6.0f);
    place(1u, SLANT, 50.0f, 12.0f);
    noise[1] = 1.5f;
    pfl_road_network_predict(&network, NULL, 0.5f, &b);
    TEST_ASSERT_FLOAT_WITHIN(2e-6f, 6.380650f, state(PFL_ROAD_SPEED, 0u));
    TEST_ASSERT_FLOAT_WITHIN(4e-6f, 23.095163f, state(PFL_ROAD_ALONG, 0u));
    TEST_ASSERT_EQUAL_FLOAT(0.0f, state(PFL_ROAD_X, 0u));
    TEST_ASSERT_FLOAT_WITHIN(4e-6f, 23.095163f, state(PFL_ROAD_Y, 0u));
    TEST_ASSERT_FLOAT_WITHIN(4e-6f, 13.086947f, state(PFL_ROAD_SPEED, 1u));
    TEST_ASSERT_FLOAT_WITHIN(1e-5f, 56.271737f, state(PFL_ROAD_ALONG, 1u));
    TEST_ASSERT_FLOAT_WITHIN(1e-5f, 100.0f - 39.790127f, state(PFL_ROAD_X, 1u));
    TEST_ASSERT_FLOAT_WITHIN(1e-5f, 39.790127f, state(PFL_ROAD_Y, 1u));
    TEST_ASSERT_FLOAT_WITHIN(4e-6f, -9.253869f, state(PFL_ROAD_VX, 1u));
    TEST_ASSERT_FLOAT_WITHIN(4e-6f, 9.253869f, state(PFL_ROAD_VY, 1u));
}

/* At the end of the eastern arm: back is forbidden, the slanted street turns by 135 degrees and is taken at corner speed. */
void test_corners_are_taken_slowly_and_straights_are_not(void)
{
    const pfl_batch_t b = batch_of(2u);
    network.vehicle.sigma_mps = 0.0f;
    network.vehicle.turn = 0.0f;
    place(0u, TO_EAST, 98.0f, 10.0f);
    place(1u, FROM_WEST, 98.0f, 10.0f); /* ahead only: onto the eastern arm */
    noise[PFL_BATCH] = 6.0f;            /* a uniform number of 1 */
    noise[PFL_BATCH + 1u] = 6.0f;
    network.vehicle.ahead = 1.0f;
    pfl_road_network_predict(&network, NULL, 0.5f, &b);
    TEST_ASSERT_EQUAL_FLOAT((float)FROM_EAST, state(PFL_ROAD_EDGE, 0u)); /* all weights 0: the first way */
    TEST_ASSERT_EQUAL_FLOAT(4.0f, state(PFL_ROAD_SPEED, 0u));
    TEST_ASSERT_EQUAL_FLOAT(3.0f, state(PFL_ROAD_ALONG, 0u));
    TEST_ASSERT_EQUAL_FLOAT((float)TO_EAST, state(PFL_ROAD_EDGE, 1u));
    TEST_ASSERT_EQUAL_FLOAT(10.0f, state(PFL_ROAD_SPEED, 1u));
    network.vehicle.turn = 1.0f;
    place(0u, TO_EAST, 98.0f, 10.0f);
    pfl_road_network_predict(&network, NULL, 0.5f, &b);
    TEST_ASSERT_EQUAL_FLOAT((float)SLANT, state(PFL_ROAD_EDGE, 0u));
    TEST_ASSERT_EQUAL_FLOAT(4.0f, state(PFL_ROAD_SPEED, 0u));
}

/* 800 m in a step: from the western arm over the middle three more times, and then it waits at a node. */
void test_a_step_passes_no_more_nodes_than_it_may(void)
{
    const pfl_batch_t b = batch_of(1u);
    network.vehicle = (pfl_road_vehicle_t){800.0f, 1.0f, 0.0f, 900.0f, 900.0f, 0.0f, 0.0f, 1.0f};
    place(0u, FROM_WEST, 0.0f, 800.0f);
    pfl_road_network_predict(&network, NULL, 1.0f, &b); /* it turns round at each node */
    TEST_ASSERT_EQUAL_FLOAT((float)FROM_WEST, state(PFL_ROAD_EDGE, 0u));
    TEST_ASSERT_EQUAL_FLOAT(100.0f, state(PFL_ROAD_ALONG, 0u));
    TEST_ASSERT_EQUAL_FLOAT(0.0f, state(PFL_ROAD_X, 0u));
}

/* 51 200 particles from the western arm for dt_s: how many are on each edge then. */
static void count_edges(float dt_s, double *count)
{
    const pfl_batch_t b = batch_of(PFL_BATCH);
    for (uint32_t round = 0u; round < 400u; round++) {
        for (uint32_t i = 0u; i < PFL_BATCH; i++) {
            place(i, FROM_WEST, 98.0f, 10.0f);
        }
        pfl_rng_normals(&rng, noise, 4u * PFL_BATCH / 16u);
        pfl_road_network_predict(&network, NULL, dt_s, &b);
        for (uint32_t i = 0u; i < PFL_BATCH; i++) {
            count[(uint32_t)state(PFL_ROAD_EDGE, i)] += 1.0;
        }
    }
}

static void expect_share(double share, double count)
{
    const double all = 400.0 * (double)PFL_BATCH;
    TEST_ASSERT_DOUBLE_WITHIN(5.5 * sqrt(share * (1.0 - share) / all), share, count / all);
}

/* Arrived at the middle from the west: ahead 3, left 1, back 3, right 1. Those that went ahead come to the eastern end in a
 * longer step, back 3, slanted 1: their second choice is as free as the first. To 5.5 standard deviations (4e-8 each). */
void test_the_odds_at_a_junction(void)
{
    double count[EDGES] = {0.0};
    pfl_rng_seed(&rng, 11u);
    network.vehicle.sigma_mps = 0.0f;
    network.vehicle.corner_mps = 30.0f;
    network.vehicle.back = 3.0f;
    count_edges(0.5f, count);
    expect_share(0.375, count[TO_EAST]);
    expect_share(0.125, count[TO_NORTH]);
    expect_share(0.375, count[TO_WEST]);
    expect_share(0.125, count[TO_SOUTH]);
    memset(count, 0, sizeof count);
    count_edges(10.4f, count);
    expect_share(0.375 * 0.75, count[FROM_EAST]);
    expect_share(0.375 * 0.25, count[SLANT]);
}

/* Whatever the state: edge numbers beyond the graph, NaN, places and speeds of any size. */
void test_no_particle_leaves_the_roads(void)
{
    const float wild[] = {-1e9f, -1.0f, 0.49f, 3.5f, 8.6f, 1e9f, NAN, INFINITY, -INFINITY};
    pfl_rng_seed(&rng, 12u);
    network.vehicle.back = 0.5f;
    for (uint32_t round = 0u; round < 300u; round++) {
        const pfl_batch_t b = batch_of(PFL_BATCH);
        pfl_rng_normals(&rng, noise, 4u * PFL_BATCH / 16u);
        for (uint32_t i = 0u; (i < PFL_BATCH) && (round % 50u == 0u); i++) {
            place(i, wild[i % 9u], 80.0f * noise[i], 50.0f * noise[2u * PFL_BATCH + i]);
        }
        pfl_road_network_predict(&network, NULL, (float)(round % 7u), &b);
        for (uint32_t i = 0u; i < PFL_BATCH; i++) {
            const float number = state(PFL_ROAD_EDGE, i);
            TEST_ASSERT_TRUE(number >= 0.0f && number < (float)EDGES);
            const pfl_road_edge_t *e = &edge[(uint32_t)number];
            const float along = state(PFL_ROAD_ALONG, i);
            TEST_ASSERT_TRUE(along >= 0.0f && along <= e->length_m);
            TEST_ASSERT_TRUE(state(PFL_ROAD_SPEED, i) >= 0.0f && state(PFL_ROAD_SPEED, i) <= 30.0f);
            TEST_ASSERT_FLOAT_WITHIN(1e-4f, node[e->from].x_m + along * e->ux, state(PFL_ROAD_X, i));
            TEST_ASSERT_FLOAT_WITHIN(1e-4f, node[e->from].y_m + along * e->uy, state(PFL_ROAD_Y, i));
        }
    }
}

/* A place that is no number stays one, so that the filter quarantines the particle. */
void test_a_place_that_is_no_number_shows(void)
{
    const pfl_batch_t b = batch_of(2u);
    place(0u, TO_EAST, NAN, 5.0f);
    place(1u, TO_EAST, 5.0f, NAN);
    pfl_road_network_predict(&network, NULL, 0.5f, &b);
    TEST_ASSERT_TRUE(isnan(state(PFL_ROAD_X, 0u)));
    TEST_ASSERT_TRUE(isnan(state(PFL_ROAD_SPEED, 1u)));
}

/* ---- From the plane onto it ------------------------------------------------------------------------------------------- */

static void fly_at(uint32_t i, float px, float py, float vx, float vy)
{
    x[PFL_ROAD_X * PFL_BATCH + i] = px;
    x[PFL_ROAD_Y * PFL_BATCH + i] = py;
    x[PFL_ROAD_VX * PFL_BATCH + i] = vx;
    x[PFL_ROAD_VY * PFL_BATCH + i] = vy;
}

/* Only speed against a road counts against it: a particle that goes its way is put on the nearest. */
void test_a_particle_that_goes_its_way_is_put_on_the_nearest_road(void)
{
    const pfl_batch_t b = batch_of(2u);
    fly_at(0u, 4.2f, 4.0f, 5.0f, 0.0f);
    fly_at(1u, 3.0f, 50.0f, 0.0f, 5.0f);
    pfl_road_put(&graph, 2.0f, &b);
    TEST_ASSERT_EQUAL_FLOAT((float)TO_EAST, state(PFL_ROAD_EDGE, 0u));
    TEST_ASSERT_EQUAL_FLOAT((float)TO_NORTH, state(PFL_ROAD_EDGE, 1u));
}

void test_particles_are_put_on_the_nearest_road_that_goes_their_way(void)
{
    const pfl_batch_t b = batch_of(5u);
    fly_at(0u, 40.0f, 3.0f, 5.0f, 2.0f);
    fly_at(1u, 40.0f, 3.0f, -5.0f, 2.0f);
    fly_at(2u, 60.0f, 50.0f, 3.0f, -3.0f); /* against the one-way street, which is near all the same */
    fly_at(3u, -130.0f, -4.0f, -6.0f, 0.0f);
    fly_at(4u, NAN, 0.0f, 1.0f, 0.0f);
    pfl_road_put(&graph, 2.0f, &b);
    TEST_ASSERT_EQUAL_FLOAT((float)TO_EAST, state(PFL_ROAD_EDGE, 0u));
    TEST_ASSERT_EQUAL_FLOAT(40.0f, state(PFL_ROAD_ALONG, 0u));
    TEST_ASSERT_EQUAL_FLOAT(5.0f, state(PFL_ROAD_SPEED, 0u));
    TEST_ASSERT_EQUAL_FLOAT(0.0f, state(PFL_ROAD_Y, 0u));
    TEST_ASSERT_EQUAL_FLOAT((float)FROM_EAST, state(PFL_ROAD_EDGE, 1u));
    TEST_ASSERT_EQUAL_FLOAT(60.0f, state(PFL_ROAD_ALONG, 1u));
    TEST_ASSERT_EQUAL_FLOAT((float)SLANT, state(PFL_ROAD_EDGE, 2u));
    TEST_ASSERT_EQUAL_FLOAT(0.0f, state(PFL_ROAD_SPEED, 2u));
    TEST_ASSERT_FLOAT_WITHIN(1e-4f, 55.0f, state(PFL_ROAD_X, 2u));
    TEST_ASSERT_EQUAL_FLOAT((float)TO_WEST, state(PFL_ROAD_EDGE, 3u));
    TEST_ASSERT_EQUAL_FLOAT(100.0f, state(PFL_ROAD_ALONG, 3u));
    TEST_ASSERT_TRUE(isnan(state(PFL_ROAD_X, 4u)));
}
