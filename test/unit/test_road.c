/* Roads and those who drive or fly around them: the ring constraint, road targets and the planar UAV, by the check values
 * of the standoff scenario's page and by what must always hold. */
#include "support.h"

#include "pflight/pflight.h"

#include "unity.h"

#include <math.h>
#include <string.h>

#define DRAWS 20000u

static float x[PFL_UAV_STATES][PFL_BATCH];
static float noise[2][PFL_BATCH];
static uint32_t inside[PFL_BATCH];
static uint64_t dice;
static pfl_ring_t ring = {0u, 1u, 2u, 3u, 0.0f, 0.0f, 96.0f, 100.0f};

void setUp(void)
{
    dice = 99u;
    memset(x, 0, sizeof x);
    memset(noise, 0, sizeof noise);
}

void tearDown(void)
{
}

static pfl_batch_t batch_of(uint32_t n)
{
    return (pfl_batch_t){x[0], PFL_BATCH, noise[0], 0u, n};
}

static void set(uint32_t i, float a, float b, float c, float d)
{
    x[0][i] = a;
    x[1][i] = b;
    x[2][i] = c;
    x[3][i] = d;
}

static void expect(uint32_t i, double a, double b, double c, double d, double tolerance)
{
    TEST_ASSERT_DOUBLE_WITHIN(tolerance, a, (double)x[0][i]);
    TEST_ASSERT_DOUBLE_WITHIN(tolerance, b, (double)x[1][i]);
    TEST_ASSERT_DOUBLE_WITHIN(tolerance, c, (double)x[2][i]);
    TEST_ASSERT_DOUBLE_WITHIN(tolerance, d, (double)x[3][i]);
}

/* ---- Constraint ------------------------------------------------------------------------------------------------------ */

void test_slide_takes_the_page_s_way(void)
{
    const pfl_batch_t p = batch_of(4u);

    set(0u, 100.0f, 10.0f, 3.0f, 4.0f);
    set(1u, 90.0f, 20.0f, -3.0f, 4.0f);
    set(2u, 98.0f, 0.0f, 5.0f, 5.0f);
    set(3u, 101.0f, 0.0f, -1.0f, 5.0f);
    pfl_ring_slide(&ring, &p);
    expect(0u, 99.503719, 9.950372, -0.366337, 3.663366, 1e-4);
    expect(1u, 93.713958, 20.825324, -0.988235, 4.447059, 1e-4);
    expect(2u, 98.0, 0.0, 5.0, 5.0, 0.0);    /* inside: left alone */
    expect(3u, 100.0, 0.0, -1.0, 5.0, 1e-4); /* on its way back: keeps its speed */
}

void test_bounce_reverses_and_clamp_leaves_the_speed(void)
{
    const pfl_batch_t p = batch_of(1u);

    set(0u, 101.0f, 0.0f, 3.0f, 4.0f);
    pfl_ring_bounce(&ring, &p);
    expect(0u, 100.0, 0.0, -3.0, 4.0, 1e-4);
    set(0u, 0.0f, -90.0f, 3.0f, 4.0f);
    pfl_ring_bounce(&ring, &p);
    expect(0u, 0.0, -96.0, 3.0, -4.0, 1e-4);
    set(0u, 101.0f, 0.0f, 0.25f, 4.0f); /* slowly, too */
    pfl_ring_bounce(&ring, &p);
    expect(0u, 100.0, 0.0, -0.25, 4.0, 1e-4);
    set(0u, 101.0f, 0.0f, 3.0f, 4.0f);
    pfl_ring_clamp(&ring, &p);
    expect(0u, 100.0, 0.0, 3.0, 4.0, 1e-4);
}

/* At 1e-12 m from the center a particle still has a direction, nearer it takes that of x. */
void test_the_smallest_distance_from_the_center_still_has_a_direction(void)
{
    const pfl_batch_t p = batch_of(2u);
    set(0u, 0.0f, 1.0e-12f, 0.0f, 0.0f);
    set(1u, 0.0f, 0.5e-12f, 0.0f, 0.0f);
    pfl_ring_clamp(&ring, &p);
    expect(0u, 0.0, 96.0, 0.0, 0.0, 1e-4);
    expect(1u, 96.0, 0.0, 0.0, 0.0, 1e-4);
}

/* Whatever was projected counts as inside, on any ring, around the origin or far from it. */
void test_what_was_projected_is_inside(void)
{
    static const pfl_project_fn way[] = {pfl_ring_slide, pfl_ring_bounce, pfl_ring_clamp};
    const pfl_batch_t p = batch_of(PFL_BATCH);
    const pfl_view_t view = {x[0], PFL_BATCH, 0u, PFL_BATCH};

    for (uint32_t draw = 0u; draw < DRAWS; draw += PFL_BATCH) {
        const float inner = (float)(1000.0 * ut_uniform(&dice));
        const float far = ((draw & PFL_BATCH) != 0u) ? (float)(5000.0 * ut_gaussian(&dice)) : 0.0f;
        pfl_ring_t any = {0u, 1u, 2u, 3u, far, -far, inner, inner + 0.1f + (float)(10.0 * ut_uniform(&dice))};
        for (uint32_t i = 0u; i < PFL_BATCH; i++) {
            set(i, far + (float)(2.0 * (double)inner * ut_gaussian(&dice)),
                -far + (float)(2.0 * (double)inner * ut_gaussian(&dice)), (float)ut_gaussian(&dice),
                (float)ut_gaussian(&dice));
        }
        set(0u, far, -far, 1.0f, 1.0f); /* no direction: any will do */
        way[draw % 3u](&any, &p);
        pfl_ring_inside(&any, &view, inside);
        for (uint32_t i = 0u; i < PFL_BATCH; i++) {
            TEST_ASSERT_EQUAL_UINT32(1u, inside[i]);
        }
    }
}

void test_inside_knows_both_edges(void)
{
    const pfl_view_t view = {x[0], PFL_BATCH, 0u, 4u};
    pfl_ring_t moved = ring;

    moved.center_x_m = 10.0f;
    set(0u, 105.9f, 0.0f, 0.0f, 0.0f);
    set(1u, 106.1f, 0.0f, 0.0f, 0.0f);
    set(2u, 10.0f, -99.9f, 0.0f, 0.0f);
    set(3u, 10.0f, -100.1f, 0.0f, 0.0f);
    pfl_ring_inside(&moved, &view, inside);
    TEST_ASSERT_EQUAL_UINT32(0u, inside[0]);
    TEST_ASSERT_EQUAL_UINT32(1u, inside[1]);
    TEST_ASSERT_EQUAL_UINT32(1u, inside[2]);
    TEST_ASSERT_EQUAL_UINT32(0u, inside[3]);
}

void test_inside_writes_no_more_than_its_batch(void)
{
    const pfl_view_t view = {x[0], PFL_BATCH, 0u, 3u};
    inside[3] = 77u;
    pfl_ring_inside(&ring, &view, inside);
    TEST_ASSERT_EQUAL_UINT32(77u, inside[3]);
}

void test_nearest_point_of_the_ring(void)
{
    float px = 200.0f;
    float py = 0.0f;

    pfl_ring_nearest(&ring, &px, &py);
    TEST_ASSERT_EQUAL_FLOAT(100.0f, px);
    px = 0.0f;
    py = -48.0f;
    pfl_ring_nearest(&ring, &px, &py);
    TEST_ASSERT_EQUAL_FLOAT(-96.0f, py);
    px = 97.0f;
    py = 1.0f;
    pfl_ring_nearest(&ring, &px, &py);
    TEST_ASSERT_EQUAL_FLOAT(97.0f, px);
    px = 0.0f;
    py = 0.0f;
    pfl_ring_nearest(&ring, &px, &py);
    TEST_ASSERT_EQUAL_FLOAT(96.0f, px);
}

/* ---- Targets --------------------------------------------------------------------------------------------------------- */

/* The page's w, 1 m/s^2 held over a step of 0.5 s, as the spectral density that the model wants. */
void test_constant_velocity_propagates_as_the_page(void)
{
    pfl_constant_velocity_t cv = {(float)sqrt(0.5), 0.0f};
    const pfl_batch_t p = batch_of(1u);

    set(0u, 97.5f, 5.0f, 1.0f, 5.0f);
    noise[0][0] = 0.4f;
    noise[1][0] = -0.3f;
    pfl_constant_velocity_predict(&cv, NULL, 0.5f, &p);
    expect(0u, 98.05, 7.4625, 1.2, 4.85, 1e-5);
}

void test_road_target_propagates_as_the_page(void)
{
    pfl_road_target_t road = {0.0f, 0.0f, 96.0f, 100.0f, (float)(0.3 * sqrt(0.5)), (float)(0.5 * sqrt(0.5))};
    const pfl_batch_t p = batch_of(1u);

    set(0u, 97.5f, 5.0f, 1.0f, 5.0f);
    noise[0][0] = 0.4f;
    noise[1][0] = 0.4f;
    pfl_road_target_predict(&road, NULL, 0.5f, &p);
    expect(0u, 97.982056, 7.523844, 0.924857, 5.128085, 2e-5);
}

void test_road_target_never_leaves_the_road(void)
{
    pfl_road_target_t road = {0.0f, 0.0f, 96.0f, 100.0f, 3.0f, 3.0f};
    const pfl_batch_t p = batch_of(PFL_BATCH);

    for (uint32_t i = 0u; i < PFL_BATCH; i++) {
        set(i, 98.0f, 0.0f, 0.0f, 5.0f);
    }
    set(0u, 0.0f, 0.0f, 0.0f, 0.0f); /* a particle on the center */
    for (uint32_t step = 0u; step < 300u; step++) {
        for (uint32_t i = 0u; i < PFL_BATCH; i++) {
            noise[0][i] = (float)ut_gaussian(&dice);
            noise[1][i] = (float)ut_gaussian(&dice);
        }
        pfl_road_target_predict(&road, NULL, 0.5f, &p);
        for (uint32_t i = 0u; i < PFL_BATCH; i++) {
            const double r = hypot((double)x[0][i], (double)x[1][i]);
            TEST_ASSERT_TRUE(r >= 96.0 - 1e-4 && r <= 100.0 + 1e-4);
        }
    }
}

/* Who would leave the road loses the speed across it, at either edge, and keeps the one along it; who is at the edge
 * and on his way back keeps both. */
void test_road_target_loses_its_speed_across_at_the_edges(void)
{
    pfl_road_target_t road = {0.0f, 0.0f, 96.0f, 100.0f, 0.0f, 0.0f};
    const pfl_batch_t p = batch_of(3u);
    const double turn_out = 0.5 * 5.0 / 100.0; /* along the edge where he ends up */
    const double turn_in = 0.5 * 5.0 / 96.0;

    set(0u, 98.0f, 0.0f, 20.0f, 5.0f);
    set(1u, 98.0f, 0.0f, -20.0f, 5.0f);
    set(2u, 100.0f, 0.0f, -2.0f, 0.0f);
    pfl_road_target_predict(&road, NULL, 0.5f, &p);
    expect(0u, 100.0 * cos(turn_out), 100.0 * sin(turn_out), -5.0 * sin(turn_out), 5.0 * cos(turn_out), 2e-5);
    expect(1u, 96.0 * cos(turn_in), 96.0 * sin(turn_in), -5.0 * sin(turn_in), 5.0 * cos(turn_in), 2e-5);
    expect(2u, 99.0, 0.0, -2.0, 0.0, 2e-5);
}

void test_lane_target_moves_and_mixes_as_it_says(void)
{
    pfl_lane_target_t lane = {(float)(0.6 * sqrt(0.5)), 1.0f, 6.0f, 2.0f, 0.7f, (float)(-0.5 / log(0.9))};
    const pfl_batch_t p = batch_of(3u);

    set(0u, 10.0f, 4.0f, 0.5f, 0.0f);
    set(1u, 10.0f, 5.9f, -1.9f, 0.0f);
    set(2u, 10.0f, 1.1f, 0.0f, 0.0f);
    noise[0][0] = 0.5f;
    noise[0][1] = 2.0f;
    noise[0][2] = -2.0f;
    noise[1][0] = -1.0f;
    noise[1][1] = -3.0f;
    pfl_lane_target_predict(&lane, NULL, 0.5f, &p);
    TEST_ASSERT_FLOAT_WITHIN(1e-5f, 4.15f, x[1][0]);
    TEST_ASSERT_FLOAT_WITHIN(1e-5f, 12.0375f, x[0][0]);
    TEST_ASSERT_FLOAT_WITHIN(1e-5f, (float)(0.45 - 0.7 * sqrt(0.19)), x[2][0]);
    TEST_ASSERT_EQUAL_FLOAT(6.0f, x[1][1]);
    TEST_ASSERT_EQUAL_FLOAT(-2.0f, x[2][1]);
    TEST_ASSERT_EQUAL_FLOAT(1.0f, x[1][2]);
}

/* ---- UAV ------------------------------------------------------------------------------------------------------------- */

void test_planar_uav_flies_the_page_s_step(void)
{
    pfl_planar_uav_t uav = {(float)(1.0 / 3.0), 10u, 0.0f, 0.0f};
    const pfl_planar_uav_input_t command = {16.0f, 0.3f};
    const pfl_batch_t p = batch_of(1u);

    set(0u, 140.0f, 10.0f, 1.9f, 15.0f);
    x[PFL_UAV_TURN][0] = 0.5f;
    pfl_planar_uav_predict(&uav, &command, 0.5f, &p);
    expect(0u, 136.728367, 17.001089, 2.101888, 15.776870, 4e-5);
    TEST_ASSERT_FLOAT_WITHIN(1e-6f, 0.344626f, x[PFL_UAV_TURN][0]);
}

void test_planar_uav_by_euler_overshoots(void)
{
    pfl_planar_uav_t uav = {(float)(1.0 / 3.0), 0u, 0.0f, 0.0f};
    const pfl_planar_uav_input_t command = {16.0f, 0.7f};
    const pfl_batch_t p = batch_of(1u);

    set(0u, 0.0f, 0.0f, 0.0f, 15.0f);
    pfl_planar_uav_predict(&uav, &command, 0.5f, &p);
    expect(0u, 7.5, 0.0, 0.0, 16.5, 1e-5);
    TEST_ASSERT_FLOAT_WITHIN(1e-6f, 1.05f, x[PFL_UAV_TURN][0]); /* 1.5 times the limit */
}

void test_planar_uav_is_disturbed_as_told(void)
{
    pfl_planar_uav_t uav = {1.0f, 1u, 2.0f, 4.0f};
    const pfl_planar_uav_input_t command = {15.0f, 0.0f};
    const pfl_batch_t p = batch_of(1u);

    set(0u, 0.0f, 0.0f, 0.0f, 15.0f);
    noise[0][0] = 1.0f;
    noise[1][0] = -1.0f;
    pfl_planar_uav_predict(&uav, &command, 0.25f, &p);
    TEST_ASSERT_FLOAT_WITHIN(1e-6f, 16.0f, x[PFL_UAV_SPEED][0]);
    TEST_ASSERT_FLOAT_WITHIN(1e-6f, -2.0f, x[PFL_UAV_TURN][0]);
}

void test_planar_uav_is_disturbed_in_one_command_alone(void)
{
    const pfl_planar_uav_input_t command = {15.0f, 0.0f};
    const pfl_batch_t p = batch_of(1u);

    noise[0][0] = 1.0f;
    noise[1][0] = -1.0f;
    for (uint32_t k = 0u; k < 2u; k++) {
        pfl_planar_uav_t uav = {1.0f, 1u, (k == 0u) ? 2.0f : 0.0f, (k == 0u) ? 0.0f : 4.0f};
        set(0u, 0.0f, 0.0f, 0.0f, 15.0f);
        x[PFL_UAV_TURN][0] = 0.0f;
        pfl_planar_uav_predict(&uav, &command, 0.25f, &p);
        TEST_ASSERT_FLOAT_WITHIN(1e-6f, (k == 0u) ? 16.0f : 15.0f, x[PFL_UAV_SPEED][0]);
        TEST_ASSERT_FLOAT_WITHIN(1e-6f, (k == 0u) ? 0.0f : -2.0f, x[PFL_UAV_TURN][0]);
    }
}

/* More pieces than the most are the most: the same bits, and the time is bounded. */
void test_planar_uav_bounds_its_pieces(void)
{
    const pfl_planar_uav_input_t command = {16.0f, 0.3f};
    const pfl_batch_t p = batch_of(1u);
    float end[2];

    for (uint32_t k = 0u; k < 2u; k++) {
        pfl_planar_uav_t uav = {0.5f, (k == 0u) ? PFL_UAV_PIECES_MAX : UINT32_MAX, 0.0f, 0.0f};
        set(0u, 140.0f, 10.0f, 1.9f, 15.0f);
        x[PFL_UAV_TURN][0] = 0.5f;
        pfl_planar_uav_predict(&uav, &command, 0.5f, &p);
        end[k] = x[PFL_UAV_X][0];
    }
    TEST_ASSERT_EQUAL_HEX32(ut_bits(end[0]), ut_bits(end[1]));
}

/* ---- In a filter ------------------------------------------------------------------------------------------------------ */

static void draw_on_road(void *user, const pfl_batch_t *p)
{
    (void)user;
    for (uint32_t i = 0u; i < p->n; i++) {
        PFL_STATE(p, PFL_CV_X)[i] = 98.0f;
        PFL_STATE(p, PFL_CV_Y)[i] = 0.0f;
        PFL_STATE(p, PFL_CV_VX)[i] = 3.0f * PFL_NOISE(p, 0)[i];
        PFL_STATE(p, PFL_CV_VY)[i] = 5.0f;
    }
}

/* The bound holds: at most `tries` draws a particle, and none off the road. */
void test_filter_stays_on_the_road_with_bounded_draws(void)
{
    static const uint32_t tries[] = {1u, 4u, 64u};
    static pfl_constant_velocity_t cv = {0.7071068f, 0.0f};
    enum { N = 200, STEPS = 100 };
    static union {
        uint64_t align;
        unsigned char bytes[PFL_ARENA_BYTES(N, PFL_CV_STATES, 2) + PFL_RETRY_BYTES(PFL_CV_STATES)];
    } arena;

    for (uint32_t t = 0u; t < 3u; t++) {
        const pfl_constraint_t road = {pfl_ring_inside, pfl_ring_slide, &ring, tries[t], 0u, pfl_constraint_keep};
        const pfl_config_t config = {
            .abi = PFL_ABI,
            .particles = N,
            .states = PFL_CV_STATES,
            .noises = 2u,
            .moments = PFL_MOMENTS_MEAN,
            .seed = 7u,
            .constraint = &road,
            .predict = pfl_constant_velocity_predict,
            .draw = draw_on_road,
            .user = &cv,
        };
        pfl_t *f;
        pfl_health_t health;
        pfl_view_t view;

        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_init(&arena, sizeof arena, &config, 0u, &f));
        for (uint32_t k = 1u; k <= STEPS; k++) {
            TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(f, k * 500000u, NULL));
            TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_particles(f, &view, NULL));
            for (uint32_t i = 0u; i < N; i++) {
                const double r = hypot((double)view.x[i], (double)view.x[view.stride + i]);
                TEST_ASSERT_TRUE(r >= 96.0 - 1e-4 && r <= 100.0 + 1e-4);
            }
        }
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_health(f, &health));
        TEST_ASSERT_TRUE(health.redrawn <= (tries[t] - 1u) * N * STEPS);
        TEST_ASSERT_TRUE(health.projected > 0u);
    }
}
