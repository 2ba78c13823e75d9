/* The world of the scenario `uav-trajectory` against the check values of its page, and the library's vehicle in it. */
#include "uav_trajectory.h"

#include "unity.h"

#include <math.h>
#include <string.h>

static uav_study_t study;
static uav_track_t track;

void setUp(void)
{
    memset(&study, 0, sizeof study);
    study.set = (uav_set_t){'S', 0.25, 0.7, 5u, {1.2, 1.2, 1.0, 1.0, 0.1, 0.2}};
    study.fixes = true;
    study.seed = 1u;
}

void tearDown(void)
{
}

void test_vehicle_check(void)
{
    static const double end[UAV_STATES] = {11.998935, 152.000258, 99.848289, 19.970397, 1.999281, 0.078697};
    const pfl_autopilot_input_t wanted = {.speed_mps = 20.0f, .height_m = 100.0f, .heading_rad = 2.0f};
    const double wind[2] = {1.0, -0.5};
    double x[UAV_STATES] = {0.0, 0.0, 90.0, 15.0, 0.0, 0.0};
    uint32_t waypoint = 0u;

    for (unsigned k = 0u; k < 100u; k++) {
        uav_euler_step(&uav_vehicle, &wanted, k % UAV_SUBSTEPS, wind, x, &waypoint);
    }
    for (int d = 0; d < UAV_STATES; d++) {
        TEST_ASSERT_DOUBLE_WITHIN(2.0e-6, end[d], x[d]);
    }
}

void test_line_ends_where_the_page_says(void)
{
    study.sim = UAV_LINE;
    study.seconds = 60u;
    study.wind[0] = 1.0;
    study.wind[1] = 1.0;
    uav_make_track(&study, 0u, &track);
    TEST_ASSERT_DOUBLE_WITHIN(1.0e-4, 1260.0, track.truth[60][PFL_AUTOPILOT_X]);
    TEST_ASSERT_DOUBLE_WITHIN(1.0e-4, 60.0, track.truth[60][PFL_AUTOPILOT_Y]);
    const double track_deg =
        atan2(track.truth[60][PFL_AUTOPILOT_Y], track.truth[60][PFL_AUTOPILOT_X]) * 180.0 / 3.14159265358979323846;
    TEST_ASSERT_DOUBLE_WITHIN(5.0e-4, 2.726, track_deg);
}

void test_circle_ends_where_the_page_says(void)
{
    study.sim = UAV_CIRCLE;
    study.seconds = 63u;
    study.wind[1] = 1.0;
    uav_make_track(&study, 0u, &track);
    TEST_ASSERT_DOUBLE_WITHIN(1.0e-3, 199.989, track.nominal[63][PFL_AUTOPILOT_X]);
    TEST_ASSERT_DOUBLE_WITHIN(1.0e-3, 66.363, track.nominal[63][PFL_AUTOPILOT_Y]);
    TEST_ASSERT_EQUAL_MEMORY(track.nominal, track.truth, sizeof track.truth);
}

/* Without wind the path is the circle of radius 200 m about the origin, but for Euler's half step. */
void test_circle_without_wind_is_one(void)
{
    study.sim = UAV_CIRCLE;
    study.seconds = 63u;
    uav_make_track(&study, 0u, &track);
    for (unsigned k = 0u; k <= 63u; k++) {
        const double radius_m = hypot(track.truth[k][PFL_AUTOPILOT_X], track.truth[k][PFL_AUTOPILOT_Y]);
        TEST_ASSERT_DOUBLE_WITHIN(2.1, 200.0, radius_m);
    }
}

void test_the_librarys_vehicle_follows_the_worlds(void)
{
    static const uav_sim_t sims[] = {UAV_LINE, UAV_CIRCLE};
    for (size_t m = 0u; m < sizeof sims / sizeof sims[0]; m++) {
        float x[UAV_STATES * 8] = {0.0f};
        const float noise[2u * PFL_BATCH] = {0.0f};
        const pfl_batch_t batch = {x, 8u, noise, 0u, 1u};
        pfl_autopilot_t vehicle = uav_vehicle;
        study.sim = sims[m];
        study.seconds = 60u;
        study.wind[0] = -1.5;
        vehicle.wind_x_mps = -1.5f;
        uav_make_track(&study, 3u, &track);
        for (int d = 0; d < UAV_STATES; d++) {
            x[8 * d] = (float)track.truth[0][d];
        }
        for (unsigned k = 0u; k < 60u; k++) {
            const pfl_autopilot_input_t wanted = uav_reference(&study, k);
            pfl_autopilot_predict(&vehicle, &wanted, 1.0f, &batch);
        }
        for (int d = 0; d < UAV_STATES; d++) {
            /* 600 additions to a position of 1 km, each rounded to 6e-5 m */
            TEST_ASSERT_DOUBLE_WITHIN(2.0e-2, track.truth[60][d], (double)x[8 * d]);
        }
    }
}

void test_fixes_come_when_they_are_due_and_are_the_same_for_every_filter(void)
{
    uav_track_t again;
    study.sim = UAV_LINE;
    study.seconds = 60u;
    uav_make_track(&study, 5u, &track);
    study.wind_model = UAV_WIND_IN_STATE;
    study.particles = 77u;
    uav_make_track(&study, 5u, &again);
    TEST_ASSERT_EQUAL_MEMORY(&track, &again, sizeof track);
    for (unsigned k = 0u; k <= 60u; k++) {
        TEST_ASSERT_TRUE(uav_has_fix(&study, k) == (k > 0u && k % 5u == 0u));
    }
}

void test_replay_flies_round_its_waypoints(void)
{
    study.sim = UAV_REPLAY;
    study.seconds = 120u;
    study.wind[0] = -2.0;
    study.wind[1] = 3.0;
    uav_make_track(&study, 0u, &track);
    for (uint32_t w = 0u; w < uav_route.count; w++) {
        double closest_m = 1.0e9;
        for (unsigned k = 0u; k <= 120u; k++) {
            closest_m = fmin(closest_m, hypot(track.truth[k][PFL_AUTOPILOT_X] - (double)uav_route.waypoint[w].x_m,
                                              track.truth[k][PFL_AUTOPILOT_Y] - (double)uav_route.waypoint[w].y_m));
        }
        TEST_ASSERT_TRUE(closest_m < 60.0);
    }
}
