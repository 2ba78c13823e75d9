/* The standoff scenario's own world in double, and that the library flies the same model in single precision. */
#include "standoff.h"

#include "unity.h"

#include <math.h>
#include <string.h>

void setUp(void)
{
}

void tearDown(void)
{
}

static standoff_study_t study(bool calm)
{
    standoff_study_t s;

    memset(&s, 0, sizeof s);
    s.calm = calm;
    s.seed = 5u;
    s.uavs = 1u;
    s.sigma_along = calm ? 0.3 : 0.7;
    return s;
}

void test_plant_flies_the_page_s_step(void)
{
    standoff_uav_t uav = {140.0, 10.0, 1.9, 15.0, 0.5};

    standoff_move_uav(false, 16.0, 0.3, &uav);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 136.728367, uav.x_m);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 17.001089, uav.y_m);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 2.101888, uav.heading_rad);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 15.776870, uav.speed_mps);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 0.344626, uav.turn_radps);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 0.776870, standoff_lag_share(false));
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 1.5, standoff_lag_share(true));
}

void test_target_keeps_to_its_road_and_its_speed(void)
{
    for (uint32_t run = 0u; run < 50u; run++) {
        const standoff_study_t s = study((run & 1u) != 0u);
        standoff_track_t track;

        standoff_make_track(&s, run, &track);
        for (unsigned k = 0u; k <= STANDOFF_STEPS; k++) {
            const double *x = track.target[k];
            const double r = hypot(x[TARGET_X], x[TARGET_Y]);
            const double along = (x[TARGET_X] * x[TARGET_VY] - x[TARGET_Y] * x[TARGET_VX]) / r * 98.0 / r;
            TEST_ASSERT_TRUE(r >= 97.0 - 1e-9 && r <= 99.0 + 1e-9);
            TEST_ASSERT_TRUE(along >= (s.calm ? 2.5 : 1.5) - 1e-9 && along <= (s.calm ? 7.5 : 6.5) + 1e-9);
        }
    }
}

void test_outages_are_the_page_s(void)
{
    unsigned out = 0u;

    for (unsigned k = 1u; k <= STANDOFF_STEPS; k++) {
        const double t = 0.5 * (double)k;
        TEST_ASSERT_EQUAL_INT((t > 20.0 && t <= 30.0) || (t > 45.0 && t <= 55.0), standoff_is_out(k));
        out += standoff_is_out(k) ? 1u : 0u;
    }
    TEST_ASSERT_EQUAL_UINT(STANDOFF_OUT_STEPS, out);
}

void test_sight_is_the_truth_without_noise(void)
{
    const standoff_uav_t uav = {0.0, 0.0, 0.0, 15.0, 0.0};
    standoff_track_t track;

    memset(&track, 0, sizeof track);
    track.target[3][TARGET_X] = -3.0;
    track.target[3][TARGET_Y] = 4.0;
    const standoff_sight_t sight = standoff_see(&track, 3u, 0u, &uav);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 5.0, sight.range_m);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, atan2(4.0, -3.0), sight.bearing_rad);
}

/* Seen without errors for a while, a steady target is found, offset included. */
void test_ekf_converges(void)
{
    const standoff_study_t s = study(true);
    const double prior[TARGET_STATES] = {95.0, -8.0, 1.0, 3.0};
    standoff_ekf_t ekf;
    standoff_belief_t belief;

    standoff_ekf_start(&s, prior, &ekf);
    for (unsigned k = 1u; k <= 200u; k++) {
        const double angle = 5.0 * 0.5 * (double)k / 98.0;
        const double x = 98.0 * cos(angle);
        const double y = 98.0 * sin(angle);
        const standoff_sight_t sight = {60.0, 0.0, hypot(x - 60.0, y), atan2(y, x - 60.0), true};
        TEST_ASSERT_TRUE(standoff_ekf_step(&s, &sight, &ekf, &belief));
        if (k == 200u) {
            TEST_ASSERT_DOUBLE_WITHIN(0.05, x, belief.target[TARGET_X]);
            TEST_ASSERT_DOUBLE_WITHIN(0.05, y, belief.target[TARGET_Y]);
            TEST_ASSERT_DOUBLE_WITHIN(0.05, 5.0, hypot(belief.target[TARGET_VX], belief.target[TARGET_VY]));
        }
    }
    const double seen = belief.reach_m;
    for (int k = 0; k < 20; k++) {
        TEST_ASSERT_TRUE(standoff_ekf_step(&s, NULL, &ekf, &belief));
    }
    TEST_ASSERT_TRUE(belief.reach_m > seen + 10.0);
}

/* The lane's sensor sees a particle where the ready one sees its place. */
void test_lane_sensor_agrees_with_the_ready_one(void)
{
    float lane[PFL_LANE_STATES * PFL_BATCH] = {0.0f};
    float place[2u * PFL_BATCH];
    float on_lane[PFL_BATCH];
    float on_plane[PFL_BATCH];
    pfl_range_bearing_t sensor = {0u, 1u, 0.1f, 10.0f};
    const pfl_range_bearing_z_t z = {60.0f, 20.0f, 45.0f, 2.0f};
    const pfl_view_t lanes = {lane, PFL_BATCH, 0u, PFL_BATCH};
    const pfl_view_t places = {place, PFL_BATCH, 0u, PFL_BATCH};

    for (unsigned i = 0u; i < PFL_BATCH; i++) {
        const double arc = -300.0 + 11.0 * (double)i;
        const double offset = -2.0 + 4.0 * (double)i / 63.0;
        lane[i] = (float)arc;
        lane[PFL_LANE_OFFSET * PFL_BATCH + i] = (float)offset;
        place[i] = (float)((98.0 + offset) * cos(arc / 98.0));
        place[PFL_BATCH + i] = (float)((98.0 + offset) * sin(arc / 98.0));
    }
    standoff_lane_loglik(&sensor, &z, &lanes, on_lane);
    pfl_range_bearing_loglik(&sensor, &z, &places, on_plane);
    for (unsigned i = 0u; i < PFL_BATCH; i++) {
        TEST_ASSERT_FLOAT_WITHIN(2e-5f * (1.0f - on_plane[i]), on_plane[i], on_lane[i]);
    }
}

/* The same seed is the same flight, for any filter the same target. */
void test_run_is_a_function_of_seed_and_run(void)
{
    standoff_study_t s = study(false);
    standoff_track_t a;
    standoff_track_t b;

    standoff_make_track(&s, 3u, &a);
    s.ekf = true;
    s.uavs = 2u;
    standoff_make_track(&s, 3u, &b);
    TEST_ASSERT_EQUAL_MEMORY(&a, &b, sizeof a);
    s.seed++;
    standoff_make_track(&s, 3u, &b);
    TEST_ASSERT_TRUE(memcmp(&a, &b, sizeof a) != 0);
}
