/* Models and sensors of the recordings and of streets, laws of errors, and what wraps a model: as the filter calls them. */
#include "kernels_batches.h"

/* ---- Wind ---------------------------------------------------------------------------------------------------------------- */

static pfl_wind_t wind = {.wind_walk = 0.03f,
                          .gust_sigma_mps = 1.0f,
                          .gust_time_s = 10.0f,
                          .scale_walk = 0.002f,
                          .offset_sigma_rad = 0.1f,
                          .offset_time_s = 30.0f,
                          .sigma_position_m = 3.0f,
                          .sigma_velocity_mps = 2.5f,
                          .dof = 4.0f,
                          .start_wind_mps = 6.0f,
                          .start_scale = 0.08f};
static const pfl_wind_fix_t fix = {2.0f, -1.0f, 14.0f, 3.0f, 15.0f, 0.4f, 1.3f};

static void prepare_wind(void)
{
    static const float mean[PFL_WIND_STATES] = {10.0f, 10.0f, 10.0f, 10.0f, 10.0f, 10.0f, 10.0f, 10.0f};
    pfl_wind_start(&wind);
    pfl_wind_move(&wind, KERNEL_DT_S);
    pfl_wind_weigh(&wind, mean, &fix);
}

KERNEL(wind)
{
    static const pfl_wind_input_t u = {&fix, 15.0f, 0.4f};
    move(pfl_wind_predict, &wind, &u);
}

KERNEL(wind_fix)
{
    weigh(pfl_wind_loglik, &wind, &fix);
}

/* ---- A multirotor that hovers, its height through an offset ------------------------------------------------------------------- */

KERNEL(hover)
{
    static const pfl_hover_t model = {3u, 1u, 1.0f, {3.0f, 3.0f, 3.0f}, {0.05f}};
    move(pfl_hover_predict, &model, NULL);
}

KERNEL(biased)
{
    static const pfl_biased_t sensor = {6u,
                                        {0u, 1u, 2u, 3u, 4u, 5u},
                                        {PFL_UNBIASED, PFL_UNBIASED, 6u, PFL_UNBIASED, PFL_UNBIASED, PFL_UNBIASED},
                                        {0.5f, 0.5f, 0.66f, 1.0f, 1.0f, 0.5f}};
    static const float z[6] = {10.5f, 9.5f, 20.2f, 9.8f, 10.1f, 10.3f};
    weigh(pfl_biased_loglik, &sensor, z);
}

/* ---- Wheels and satellites -------------------------------------------------------------------------------------------------- */

static const pfl_pseudoranges_t ranges = {4u,
                                          {{0.6f, -0.3f, 12.0f, 0.4f, 0u},
                                           {-0.2f, 0.7f, 55.0f, 0.8f, 1u},
                                           {0.1f, 0.1f, -9.0f, 0.05f, 1u},
                                           {-0.5f, -0.6f, 3.0f, 0.2f, 0u}}};
static const pfl_pseudorange_t satellites = {.x_state = 0u,
                                             .y_state = 1u,
                                             .clock_state = 5u,
                                             .sigma_m = 8.0f,
                                             .tail_m = 40.0f,
                                             .power = 0.1f,
                                             .clip_m = 30.0f,
                                             .leak = 0.03f,
                                             .gain = 0.05f,
                                             .interval_s = 0.2f,
                                             .epochs = 50u};

KERNEL(wheels)
{
    static const pfl_wheels_t model = {0.05f, 0.02f, 0.01f, 0.3f, 0.001f, 0.0005f};
    static const pfl_odometry_input_t u = {3.0f, 0.2f};
    move(pfl_wheels_predict, &model, &u);
}

static void clocks_of(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    pfl_clocks_predict((const pfl_pseudorange_t *)user, (const pfl_pseudoranges_t *)u, dt_s, p);
}

KERNEL(clocks_four)
{
    move(clocks_of, &satellites, &ranges);
}

KERNEL(pseudorange_four)
{
    weigh(pfl_pseudorange_loglik, &satellites, &ranges);
}

/* ---- Ranges with biases that are learnt ------------------------------------------------------------------------------------------ */

static const pfl_range_bias_t biases = {.x_state = 0u,
                                        .y_state = 1u,
                                        .bias_state = 4u,
                                        .anchors = 3u,
                                        .sigma_m = 0.1f,
                                        .dof = 3.0f,
                                        .walk = 0.001f,
                                        .variance_m2 = {0.001f, 0.001f, 0.001f}};
static const pfl_range_bias_z_t biased_range = {1.0f, -2.0f, 0.5f, 24.0f, 1u};

static void correct(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    (void)dt_s;
    pfl_range_bias_correct((const pfl_range_bias_t *)user, (const pfl_range_bias_z_t *)u, p);
}

KERNEL(range_bias_correct)
{
    move(correct, &biases, &biased_range);
}

KERNEL(range_bias)
{
    weigh(pfl_range_bias_loglik, &biases, &biased_range);
}

/* ---- Streets: a square with its diagonal, both ways ------------------------------------------------------------------------------- */

static pfl_road_node_t node[4] = {
    {0.0f, 0.0f, 0u, 0u}, {20.0f, 0.0f, 0u, 0u}, {20.0f, 20.0f, 0u, 0u}, {0.0f, 20.0f, 0u, 0u}};
static pfl_road_edge_t edge[10] = {{.from = 0u, .to = 1u}, {.from = 0u, .to = 2u}, {.from = 0u, .to = 3u},
                                   {.from = 1u, .to = 0u}, {.from = 1u, .to = 2u}, {.from = 2u, .to = 0u},
                                   {.from = 2u, .to = 1u}, {.from = 2u, .to = 3u}, {.from = 3u, .to = 0u},
                                   {.from = 3u, .to = 2u}};
static const pfl_road_graph_t streets = {node, edge, 4u, 10u};

static void put_on_streets(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    (void)user;
    (void)u;
    (void)dt_s;
    pfl_road_put(&streets, 1.5f, p);
}

static void prepare_streets(void)
{
    (void)pfl_road_prepare(&streets);
    move(put_on_streets, NULL, NULL);
}

KERNEL(road_network)
{
    static const pfl_road_network_t model = {&streets, {7.0f, 5.0f, 2.0f, 14.0f, 4.0f, 1.0f, 0.5f, 0.0f}};
    move(pfl_road_network_predict, &model, NULL);
}

/* ---- Laws of errors, drifting states, several models, a proposal, about a model of constant velocity --------------------------------- */

static pfl_constant_velocity_t calm = {0.2f, 0.0f};
static pfl_constant_velocity_t wild = {2.0f, 0.0f};
static const float seen[2] = {10.5f, 9.5f};

KERNEL(law_student)
{
    static const pfl_student_law_t law = {2.0f, 4.0f};
    static const pfl_scalar_t sensor = {0u, 4u, pfl_student_law, &law};
    weigh(pfl_scalar_loglik, &sensor, seen);
}

KERNEL(law_mixture)
{
    static const pfl_mixture_law_t law = {2.0f, {0.01f, 0.02f}, 0.0f};
    static const pfl_scalar_t sensor = {0u, 4u, pfl_mixture_law, &law};
    weigh(pfl_scalar_loglik, &sensor, seen);
}

KERNEL(law_split)
{
    static const pfl_split_law_t law = {{2.0f, 1.0f}, {0.0f, 3.0f}};
    static const pfl_scalar_t sensor = {0u, 4u, pfl_split_law, &law};
    weigh(pfl_scalar_loglik, &sensor, seen);
}

KERNEL(drift)
{
    static const pfl_drift_t model = {pfl_constant_velocity_predict, &calm, 1u, {4u}, {2u}, {0.05f}, {20.0f}};
    move(pfl_drift_predict, &model, NULL);
}

static void first_regimes(void)
{
    for (uint32_t i = 0u; i < KERNEL_N; i++) {
        kernel_data.x[4][i] = (float)(int32_t)(i & 1u);
    }
}

KERNEL(jump)
{
    static float room[PFL_JUMP_FLOATS(5, 2)];
    static const pfl_jump_t model = {2u,
                                     {{pfl_constant_velocity_predict, &calm}, {pfl_constant_velocity_predict, &wild}},
                                     {{0.0f, 0.1f}, {0.3f, 0.0f}},
                                     5u,
                                     2u,
                                     4u,
                                     40u,
                                     0.5f,
                                     room};
    move(pfl_jump_predict, &model, NULL);
}

KERNEL(proposal)
{
    static const pfl_proposal_t model = {pfl_constant_velocity_predict,
                                         &calm,
                                         4u,
                                         2u,
                                         {0u, 1u},
                                         {0u, 1u},
                                         {2u, 3u},
                                         {0.3f, 0.3f},
                                         {1.1f, 1.1f},
                                         {0.5f, 0.5f}};
    static const pfl_proposal_input_t u = {NULL, seen};
    move(pfl_proposal_predict, &model, &u);
}

const kernel_t kernels_recordings[] = {
    {"wind", kernel_wind, prepare_wind},
    {"wind_fix", kernel_wind_fix, prepare_wind},
    {"hover", kernel_hover, NULL},
    {"biased", kernel_biased, NULL},
    {"wheels", kernel_wheels, NULL},
    {"clocks_four", kernel_clocks_four, NULL},
    {"pseudorange_four", kernel_pseudorange_four, NULL},
    {"range_bias_correct", kernel_range_bias_correct, NULL},
    {"range_bias", kernel_range_bias, NULL},
    {"road_network", kernel_road_network, prepare_streets},
    {"law_student", kernel_law_student, NULL},
    {"law_mixture", kernel_law_mixture, NULL},
    {"law_split", kernel_law_split, NULL},
    {"drift", kernel_drift, NULL},
    {"jump", kernel_jump, first_regimes},
    {"proposal", kernel_proposal, NULL},
};
const uint32_t kernels_recordings_count = sizeof kernels_recordings / sizeof kernels_recordings[0];
