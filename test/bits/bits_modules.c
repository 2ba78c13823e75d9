/* Hashes of the optional modules: each model moves a cloud some steps, each sensor weighs it, constraints project it, and
 * guidance answers for states all over. Inputs come from integers only. */
#include "hashing.h"

#include "flights.h"

#include "pflight/pflight.h"

#include <stddef.h>
#include <stdio.h>

#define N 64u
#define D 9u
#define Q 4u

static float cloud[D * N];
static float noise[(Q + 2u) * PFL_BATCH];
static float ll[N];
static pfl_rng_t rng;

static const pfl_waypoint_t places[] = {{40.0f, 0.0f}, {40.0f, 40.0f}, {0.0f, 40.0f}, {0.0f, 0.0f}};
static const pfl_route_t route = {places, 4u, true, PFL_SWITCH_HALF_PLANE, 9.0f, 1.0f, 0.05f};

static void scatter(float around, float width)
{
    for (uint32_t k = 0u; k < D * N; k++) {
        cloud[k] = around + between(-width, width);
    }
}

static void mix_cloud(void)
{
    for (uint32_t k = 0u; k < D * N; k++) {
        mix(cloud[k]);
    }
}

static pfl_batch_t batch(uint32_t n)
{
    const pfl_batch_t b = {cloud, N, noise, 0u, n};
    return b;
}

static void of_model(const char *part, pfl_predict_fn predict, void *user, const void *u, float around, float width)
{
    begin(71u);
    pfl_rng_seed(&rng, 5u);
    scatter(around, width);
    for (uint32_t k = 0u; k < 20u; k++) {
        const pfl_batch_t b = batch((k & 1u) != 0u ? 64u : 37u);
        pfl_rng_normals(&rng, noise, Q * PFL_BATCH / 16u);
        predict(user, u, (k % 5u == 0u) ? 0.5f : 0.02f, &b);
        mix_cloud();
    }
    end(part);
}

static void of_models(void)
{
    static pfl_autopilot_t pilot = {0.5f, 1.0f, 0.36f, 1.2f, 15.0f, 25.0f, 0.4f, 1.0f, -0.5f, 0.3f, 0.1f, 10u, 6u, 8u};
    static const pfl_autopilot_input_t wanted = {20.0f, 100.0f, 0.4f, 0.1f, &route};
    static pfl_planar_uav_t uav = {0.33f, 10u, 0.2f, 0.05f};
    static pfl_planar_uav_t stepped = {0.5f, 0u, 0.2f, 0.05f};
    static const pfl_planar_uav_input_t command = {15.0f, 0.4f};
    static pfl_road_target_t road = {.inner_m = 96.0f, .outer_m = 100.0f, .sigma_across = 0.3f, .sigma_along = 0.5f};
    static pfl_lane_target_t lane = {0.7f, 1.5f, 6.5f, 2.0f, 0.7f, 5.0f};
    static pfl_coast_t coast = {3u, 1u};
    static pfl_turn_t turn = {0.15f, 0.05f, 0.1f, 0.3f, 1u};
    static pfl_constant_velocity_t still = {0.0f, 0.0f};
    static pfl_constant_velocity_t moving = {1.5f, 0.3f};
    static pfl_proposal_t proposal = {pfl_constant_velocity_predict,
                                      &still,
                                      4u,
                                      2u,
                                      {0u, 1u},
                                      {0u, 1u},
                                      {2u, 3u},
                                      {0.3f, 0.2f},
                                      {1.1f, 0.0f},
                                      {0.5f, 0.7f}};
    static const float seen[2] = {1.5f, -0.5f};
    static const pfl_proposal_input_t with_seen = {NULL, seen};
    static const pfl_proposal_input_t without = {NULL, NULL};
    static pfl_antithetic_t antithetic = {pfl_constant_velocity_predict, &moving, 4u};
    of_model("model-autopilot", pfl_autopilot_predict, &pilot, &wanted, 1.0f, 20.0f);
    pilot.waypoint_state = 0u;
    of_model("model-autopilot-heading", pfl_autopilot_predict, &pilot, &wanted, 1.0f, 3.0f);
    of_model("model-planar-uav", pfl_planar_uav_predict, &uav, &command, 2.0f, 5.0f);
    of_model("model-planar-uav-euler", pfl_planar_uav_predict, &stepped, &command, 2.0f, 5.0f);
    of_model("model-road-target", pfl_road_target_predict, &road, NULL, 60.0f, 60.0f);
    of_model("model-lane-target", pfl_lane_target_predict, &lane, NULL, 2.0f, 3.0f);
    of_model("model-coast", pfl_coast_predict, &coast, NULL, 0.0f, 9.0f);
    of_model("model-turn", pfl_turn_predict, &turn, NULL, 0.0f, 3.0f);
    of_model("proposal", pfl_proposal_predict, &proposal, &with_seen, 0.0f, 3.0f);
    of_model("proposal-free", pfl_proposal_predict, &proposal, &without, 0.0f, 3.0f);
    of_model("antithetic", pfl_antithetic_predict, &antithetic, NULL, 0.0f, 3.0f);
}

static void of_sensor(const char *part, pfl_loglik_fn loglik, void *user, const void *z)
{
    begin(72u);
    for (uint32_t k = 0u; k < 20u; k++) {
        const pfl_view_t view = {cloud, N, 0u, (k & 1u) != 0u ? 64u : 29u};
        scatter(0.5f, 3.0f);
        loglik(user, z, &view, ll);
        for (uint32_t i = 0u; i < view.n; i++) {
            mix(ll[i]);
        }
    }
    end(part);
}

static void of_sensors(void)
{
    static pfl_coloured_t coloured = {2u, {0u, 1u}, {5u, 6u}, 0.5f, {0.7f, 0.6f}};
    static const pfl_coloured_z_t pair = {.now = {1.0f, -0.5f}, .before = {0.8f, 0.1f}};
    static pfl_velocity_t velocity = {2u, 3u, 4.0f};
    static const float seen[3] = {1.2f, -0.4f, 0.3f};
    static pfl_position_t distance = {3u, {0u, 1u, 2u}, {1.4f, 1.4f, 1.4f}};
    of_sensor("sensor-coloured", pfl_coloured_loglik, &coloured, &pair);
    of_sensor("sensor-velocity", pfl_velocity_loglik, &velocity, seen);
    of_sensor("sensor-position-distance", pfl_position_distance_loglik, &distance, seen);
}

static void of_ring(void)
{
    static pfl_ring_t ring = {0u, 1u, 2u, 3u, 1.0f, -2.0f, 96.0f, 100.0f};
    static const pfl_project_fn projections[] = {pfl_ring_slide, pfl_ring_bounce, pfl_ring_clamp};
    begin(73u);
    for (uint32_t k = 0u; k < 30u; k++) {
        uint32_t inside[N];
        const pfl_batch_t b = batch(N);
        const pfl_view_t view = {cloud, N, 0u, N};
        scatter(0.0f, 120.0f);
        projections[k % 3u](&ring, &b);
        pfl_ring_inside(&ring, &view, inside);
        mix_cloud();
        for (uint32_t i = 0u; i < N; i++) {
            mix((float)inside[i]);
        }
    }
    end("constraint-ring");
}

static pfl_uav_t any_uav(void)
{
    pfl_uav_t uav;
    uav.x_m = between(-150.0f, 150.0f);
    uav.y_m = between(-150.0f, 150.0f);
    uav.heading_rad = between(-9.0f, 9.0f);
    uav.speed_mps = between(8.0f, 22.0f);
    uav.turn_radps = between(-0.7f, 0.7f);
    return uav;
}

static void of_field(void)
{
    const pfl_uav_limits_t limits = {15.0f, 7.0f, 0.7f};
    begin(74u);
    for (uint32_t k = 0u; k < 2000u; k++) {
        const pfl_lvfg_t lvfg = {limits, 0.5f, 1.2f, (k & 1u) != 0u};
        const pfl_uav_t uav[2] = {any_uav(), any_uav()};
        const pfl_target_t target = {between(-9.0f, 9.0f), between(-9.0f, 9.0f), between(-5.0f, 5.0f), 1.0f};
        const pfl_standoff_state_t state = {between(30.0f, 100.0f), between(-5.0f, 5.0f), 50.0f, k};
        pfl_planar_uav_input_t command[2] = {{0.0f, 0.0f}, {0.0f, 0.0f}};
        mix((float)pfl_lvfg_command(&lvfg, uav, 1u + (k % 2u), &target, &state, command));
        mix(command[0].speed_mps);
        mix(command[0].turn_radps);
        mix(command[1].speed_mps);
        mix(command[1].turn_radps);
    }
    end("guidance-lvfg");
}

static void of_predictive_control(void)
{
    pfl_nmpc_t nmpc = {
        {15.0f, 7.0f, 0.7f}, 0.5f, 0.77687f, 0.5f, 83.3f, 16.7f, 500.0f, 100.0f, 100.0f, 50.0f, 1000.0f, 30.0f,
        PFL_PHASE_PRODUCT};
    begin(75u);
    for (uint32_t k = 0u; k < 200u; k++) {
        const pfl_uav_t uav = any_uav();
        const pfl_uav_t other = any_uav();
        const pfl_target_t target = {between(-9.0f, 9.0f), between(-9.0f, 9.0f), between(-5.0f, 5.0f), 1.0f};
        pfl_nmpc_plan_t plan;
        pfl_nmpc_path_t path;
        pfl_nmpc_path_t pair;
        pfl_nmpc_work_t work;
        pfl_nmpc_report_t report = {0.0f, 0u};
        for (uint32_t j = 0u; j < PFL_NMPC_STEPS; j++) {
            plan.speed_mps[j] = 15.0f;
            plan.turn_radps[j] = 0.5f;
        }
        nmpc.phase_form = (k & 1u) != 0u ? PFL_PHASE_PRODUCT : PFL_PHASE_DIRECTION;
        mix((float)pfl_nmpc_rollout(&nmpc, &other, &plan, &pair, NULL));
        mix((float)pfl_nmpc_extrapolate(&nmpc, &target, &path));
        const pfl_nmpc_problem_t problem = {uav, &path, (k % 3u) != 0u ? &pair : NULL, 45.0f};
        mix((float)pfl_nmpc_solve(&nmpc, &problem, &plan, &work, &report));
        mix(report.cost);
        mix((float)report.evaluations);
        for (uint32_t j = 0u; j < PFL_NMPC_STEPS; j++) {
            mix(plan.speed_mps[j]);
            mix(plan.turn_radps[j]);
        }
    }
    end("guidance-nmpc");
}

static void of_waypoints(void)
{
    uint32_t target = 0u;
    begin(76u);
    for (uint32_t k = 0u; k < 2000u; k++) {
        const float x_m = between(-20.0f, 60.0f);
        const float y_m = between(-20.0f, 60.0f);
        target = pfl_route_switch(&route, target, x_m, y_m);
        mix((float)target);
        mix(pfl_route_bearing(&route, target, x_m, y_m));
        mix(pfl_route_course(&route, target, x_m, y_m));
        mix(pfl_route_cross_track(&route, target, x_m, y_m));
    }
    end("waypoints");
}

static void of_wind(void)
{
    static pfl_wind_t wind = {.wind_walk = 0.03f,
                              .gust_sigma_mps = 1.0f,
                              .gust_time_s = 10.0f,
                              .scale_walk = 0.002f,
                              .offset_sigma_rad = 0.1f,
                              .offset_time_s = 30.0f,
                              .sigma_position_m = 3.0f,
                              .sigma_velocity_mps = 2.5f,
                              .dof = 4.0f,
                              .start_wind_mps = 6.0f};
    static const pfl_wind_fix_t fix = {2.0f, -1.0f, 14.0f, 3.0f, 15.0f, 0.4f, 1.3f};
    static const pfl_wind_input_t input = {&fix, 15.0f, 0.4f};
    float mean[PFL_WIND_STATES] = {1.0f, 0.5f, -0.2f, -2.0f, 1.5f, 0.1f, 1.02f, 0.05f};
    begin(77u);
    pfl_wind_start(&wind);
    for (uint32_t k = 0u; k < 50u; k++) {
        pfl_wind_move(&wind, 0.2f);
        pfl_wind_weigh(&wind, mean, &fix);
        pfl_wind_fuse(&wind, mean, &fix);
        for (uint32_t j = 0u; j < PFL_WIND_COV; j++) {
            mix(wind.cov[j]);
            mix(mean[j]);
        }
    }
    end("wind");
    of_model("model-wind", pfl_wind_predict, &wind, &input, 1.0f, 2.0f);
    of_sensor("sensor-wind", pfl_wind_loglik, &wind, &fix);
}

static void of_hover(void)
{
    static pfl_hover_t hover = {3u, 1u, 2.0f, {3.0f, 2.0f, 1.0f}, {0.1f}};
    static pfl_biased_t biased = {3u, {0u, 2u, 5u}, {PFL_UNBIASED, 6u, PFL_UNBIASED}, {0.5f, 2.0f, 1.0f}};
    static const float seen[3] = {1.2f, -0.4f, 0.3f};
    of_model("model-hover", pfl_hover_predict, &hover, NULL, 0.0f, 3.0f);
    of_sensor("sensor-biased", pfl_biased_loglik, &biased, seen);
}

/* Columns 0 n, 1 .. 2 means, 3 .. 5 a covariance for each, 6 the log-likelihood; n turns the linear part of `each`. */
static void turn_linear(void *user, const void *u, float dt_s, const pfl_view_t *p, float *drive, float *transition)
{
    (void)user;
    (void)u;
    for (uint32_t i = 0u; i < p->n; i++) {
        drive[i] = dt_s + (0.01f * p->x[i]);
        transition[PFL_MARGINAL_STRIP + i] = 0.1f * p->x[i];
    }
}

static void square(void *user, uint32_t k, const pfl_view_t *p, float *h, float *see)
{
    (void)user;
    (void)k;
    for (uint32_t i = 0u; i < p->n; i++) {
        h[i] = 0.1f * (p->x[i] * p->x[i]);
        if (see != NULL) {
            see[i] = 1.0f + (0.1f * p->x[i]);
        }
    }
}

static void of_marginal(void)
{
    static const pfl_marginal_t model = {
        .measure = square,
        .linear = 2u,
        .mean = 1u,
        .driven = 1u,
        .measured = 1u,
        .loglik_state = 6u,
        .drive = {{0.5f, 0.2f}},
        .drive_variance = {0.3f},
        .transition = {{0.9f, 0.1f}, {0.0f, 0.8f}},
        .drift = {0.1f, -0.2f},
        .process_cov = {0.2f, 0.05f, 0.3f},
        .see = {{1.0f, -0.5f}},
        .see_variance = {0.4f},
    };
    static const float seen[1] = {0.7f};
    static const pfl_marginal_input_t with = {NULL, seen};
    static const pfl_marginal_input_t without = {NULL, NULL};
    static float work[PFL_MARGINAL_WORK(2u, 1u)];
    pfl_marginal_shared_t shared = {.model = model, .cov = {2.0f, 0.3f, 1.0f}};
    pfl_marginal_each_t each = {.model = model, .matrices = turn_linear, .cov = 3u, .work = work};
    for (uint32_t form = 0u; form < 2u; form++) {
        begin(79u);
        pfl_rng_seed(&rng, 5u);
        scatter(0.0f, 3.0f);
        for (uint32_t i = 0u; i < N; i++) {
            cloud[(3u * N) + i] = between(1.5f, 3.0f);
            cloud[(4u * N) + i] = between(-0.5f, 0.5f);
            cloud[(5u * N) + i] = between(1.5f, 3.0f);
        }
        for (uint32_t k = 0u; k < 20u; k++) {
            const pfl_batch_t b = batch((k & 1u) != 0u ? 64u : 37u);
            const void *in = (k % 3u) != 0u ? &with : &without;
            pfl_rng_normals(&rng, noise, Q * PFL_BATCH / 16u);
            if (form == 0u) {
                pfl_marginal_shared_step(&shared, (k % 3u) != 0u);
                pfl_marginal_shared_predict(&shared, in, 0.1f, &b);
            } else {
                pfl_marginal_each_predict(&each, in, 0.1f, &b);
            }
            mix_cloud();
        }
        end(form == 0u ? "marginal-shared" : "marginal-each");
    }
}

static void of_terrain(void)
{
    static int16_t height_m[12u * 9u];
    static const pfl_grid_t grid = {height_m, 12u, 9u, -5.0f, -4.0f, 1.1f, 0.9f};
    static pfl_terrain_t radar = {&grid, 0u, 1u, 2u, 0u, 0.12f, 0.01f, 15.0f, 6.5f, 1000.0f};
    static const pfl_terrain_z_t z = {900.0f, 650.0f, 3.5f, 0.6f};
    static pfl_dead_reckoning_t motion = {0.1f, 0.998f, 0.07f, 0.1f};
    static const pfl_dead_reckoning_input_t velocity = {30.0f, -12.0f};
    begin(80u);
    for (uint32_t k = 0u; k < (12u * 9u); k++) {
        height_m[k] = (int16_t)between(200.0f, 300.0f);
    }
    of_sensor("terrain", pfl_terrain_loglik, &radar, &z);
    radar.bias_state = PFL_TERRAIN_NO_BIAS;
    of_sensor("terrain-no-bias", pfl_terrain_loglik, &radar, &z);
    of_model("dead-reckoning", pfl_dead_reckoning_rest_predict, &motion, &velocity, 0.0f, 9.0f);
}

static void of_flights(void)
{
    for (uint32_t k = 0u; k < FLIGHTS; k++) {
        flown_t flown;
        char part[32];
        begin(77u);
        mix(flight_fly(k, 0u, &flown) ? 1.0f : 0.0f);
        mix(flown.square);
        (void)snprintf(part, sizeof part, "flight-%s", flight_names[k]);
        end(part);
    }
}

static void clocks_of(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    pfl_clocks_fused(user);
    pfl_clocks_predict(user, u, dt_s, p);
}

static void of_pseudoranges(void)
{
    static const pfl_odometry_input_t moving = {3.0f, -0.4f};
    static const pfl_pseudoranges_t ranges = {
        3u, {{0.6f, -0.3f, 12.0f, 0.4f, 0u}, {-0.2f, 0.7f, 55.0f, 0.8f, 1u}, {0.1f, 0.1f, -9.0f, 0.05f, 1u}}};
    static pfl_wheels_t wheels = {0.05f, 0.1f, 0.02f, 0.3f, 0.01f, 0.004f};
    pfl_pseudorange_t sensor = {.x_state = 0u,
                                .y_state = 1u,
                                .clock_state = 5u,
                                .sigma_m = 8.0f,
                                .tail_m = 40.0f,
                                .power = 0.1f,
                                .clip_m = 30.0f,
                                .leak = 0.03f,
                                .gain = 0.05f,
                                .interval_s = 0.2f};
    pfl_rng_seed(&rng, 6u);
    pfl_rng_normals(&rng, &noise[Q * PFL_BATCH], 2u * PFL_BATCH / 16u);
    of_model("model-wheels", pfl_wheels_predict, &wheels, &moving, 0.0f, 3.0f);
    of_model("clocks", clocks_of, &sensor, &ranges, 5.0f, 60.0f);
    of_sensor("sensor-pseudorange", pfl_pseudorange_loglik, &sensor, &ranges);
    sensor.tail_m = 0.0f;
    of_sensor("sensor-pseudorange-gauss", pfl_pseudorange_loglik, &sensor, &ranges);
}

static void learnt_bias(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    pfl_range_bias_move(user, dt_s);
    pfl_range_bias_fused(user, u);
    pfl_range_bias_correct(user, u, p);
}

static void of_range_bias(void)
{
    static const pfl_range_bias_z_t range = {1.0f, -2.0f, 0.5f, 4.0f, 1u};
    static pfl_range_bias_t biases = {.x_state = 0u,
                                      .y_state = 1u,
                                      .bias_state = 4u,
                                      .anchors = 2u,
                                      .sigma_m = 0.1f,
                                      .dof = 3.0f,
                                      .walk = 0.01f,
                                      .variance_m2 = {0.0025f, 0.0025f}};
    of_model("range-bias", learnt_bias, &biases, &range, 0.0f, 3.0f);
    of_sensor("sensor-range-bias", pfl_range_bias_loglik, &biases, &range);
}

static void of_roads(void)
{
    static pfl_road_node_t node[4] = {
        {0.0f, 0.0f, 0u, 0u}, {7.0f, 1.0f, 0u, 0u}, {6.0f, 8.0f, 0u, 0u}, {-1.5f, 6.0f, 0u, 0u}};
    static pfl_road_edge_t edge[8] = {{.from = 0u, .to = 1u}, {.from = 0u, .to = 2u}, {.from = 0u, .to = 3u},
                                      {.from = 1u, .to = 0u}, {.from = 1u, .to = 2u}, {.from = 2u, .to = 3u},
                                      {.from = 3u, .to = 0u}, {.from = 3u, .to = 2u}};
    static const pfl_road_graph_t graph = {node, edge, 4u, 8u};
    static pfl_road_network_t network = {&graph, {4.0f, 3.0f, 1.0f, 9.0f, 2.0f, 1.0f, 2.5f, 0.1f}};
    begin(81u);
    mix((float)pfl_road_prepare(&graph));
    scatter(3.0f, 9.0f);
    const pfl_batch_t all = batch(N);
    pfl_road_put(&graph, 1.5f, &all);
    mix_cloud();
    end("road-put");
    of_model("model-road-network", pfl_road_network_predict, &network, NULL, 2.0f, 5.0f);
}

void of_modules(void)
{
    of_models();
    of_sensors();
    of_ring();
    of_field();
    of_predictive_control();
    of_waypoints();
    of_wind();
    of_hover();
    of_marginal();
    of_terrain();
    of_flights();
    of_pseudoranges();
    of_range_bias();
    of_roads();
}
