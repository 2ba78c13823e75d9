/* Routes: when the next waypoint is due, and which course leads there. */
#include "pflight/waypoints.h"

#include "unity.h"

#include <math.h>

#define PI 3.14159265358979323846

static const pfl_waypoint_t square[] = {{400.0f, 0.0f}, {400.0f, 400.0f}, {0.0f, 400.0f}, {0.0f, 0.0f}};
static pfl_route_t route;

void setUp(void)
{
    route = (pfl_route_t){
        .waypoint = square, .count = 4u, .closed = true, .reach_m = 40.0f, .approach_rad = 1.2f, .follow_per_m = 0.02f};
}

void tearDown(void)
{
}

/* ---- Switching -------------------------------------------------------------------------------------------------- */

void test_a_waypoint_is_reached_within_its_radius_only(void)
{
    TEST_ASSERT_EQUAL_UINT32(0u, pfl_route_switch(&route, 0u, 359.9f, 0.0f));
    TEST_ASSERT_EQUAL_UINT32(0u, pfl_route_switch(&route, 0u, 360.0f, 0.0f)); /* closer than, not as close as */
    TEST_ASSERT_EQUAL_UINT32(1u, pfl_route_switch(&route, 0u, 360.1f, 0.0f));
    TEST_ASSERT_EQUAL_UINT32(1u, pfl_route_switch(&route, 0u, 400.0f, 0.0f));
    TEST_ASSERT_EQUAL_UINT32(0u, pfl_route_switch(&route, 0u, 500.0f, 0.0f)); /* flown past: the radius alone forgets */
}

void test_a_closed_route_begins_again_and_an_open_one_holds_its_last(void)
{
    TEST_ASSERT_EQUAL_UINT32(0u, pfl_route_switch(&route, 3u, 0.0f, 0.0f));
    route.closed = false;
    TEST_ASSERT_EQUAL_UINT32(3u, pfl_route_switch(&route, 3u, 0.0f, 0.0f));
    TEST_ASSERT_EQUAL_UINT32(2u, pfl_route_switch(&route, 1u, 400.0f, 400.0f));
}

void test_an_index_beyond_the_route_means_its_last(void)
{
    TEST_ASSERT_EQUAL_UINT32(3u, pfl_route_switch(&route, 4u, 200.0f, 200.0f));
    TEST_ASSERT_EQUAL_UINT32(3u, pfl_route_switch(&route, UINT32_MAX, 200.0f, 200.0f));
    TEST_ASSERT_FLOAT_WITHIN(1.0e-6f, pfl_route_bearing(&route, 3u, 10.0f, 70.0f),
                             pfl_route_bearing(&route, 77u, 10.0f, 70.0f));
}

void test_a_half_plane_cannot_be_missed(void)
{
    route.switching = PFL_SWITCH_HALF_PLANE;
    /* The plane through (400, 0) halves the corner: x + y = 400. */
    TEST_ASSERT_EQUAL_UINT32(0u, pfl_route_switch(&route, 0u, 300.0f, 99.0f));
    TEST_ASSERT_EQUAL_UINT32(1u, pfl_route_switch(&route, 0u, 300.0f, 101.0f));
    TEST_ASSERT_EQUAL_UINT32(1u, pfl_route_switch(&route, 0u, 600.0f, -100.0f));
    TEST_ASSERT_EQUAL_UINT32(1u, pfl_route_switch(&route, 0u, 380.0f, 0.0f)); /* within the radius too */
}

void test_routes_of_one_point_and_of_equal_points_end(void)
{
    const pfl_waypoint_t twice[] = {{1.0f, 2.0f}, {1.0f, 2.0f}};
    route.count = 1u;
    route.switching = PFL_SWITCH_HALF_PLANE;
    TEST_ASSERT_EQUAL_UINT32(0u, pfl_route_switch(&route, 0u, 0.0f, 0.0f));
    TEST_ASSERT_FLOAT_WITHIN(1.0e-6f, 0.0f, pfl_route_course(&route, 0u, 0.0f, 0.0f));
    route.waypoint = twice;
    route.count = 2u;
    TEST_ASSERT_EQUAL_UINT32(1u, pfl_route_switch(&route, 0u, 500.0f, 500.0f));
    TEST_ASSERT_FLOAT_WITHIN(1.0e-6f, (float)(PI / 2.0), pfl_route_course(&route, 1u, 1.0f, -7.0f));
    TEST_ASSERT_FLOAT_WITHIN(0.0f, 0.0f, pfl_route_cross_track(&route, 1u, 5.0f, 9.0f));
}

/* ---- Courses ---------------------------------------------------------------------------------------------------- */

void test_bearing_points_at_the_waypoint(void)
{
    TEST_ASSERT_FLOAT_WITHIN(1.0e-6f, 0.0f, pfl_route_bearing(&route, 0u, 0.0f, 0.0f));
    TEST_ASSERT_FLOAT_WITHIN(1.0e-6f, (float)(PI / 4.0), pfl_route_bearing(&route, 1u, 100.0f, 100.0f));
    TEST_ASSERT_FLOAT_WITHIN(1.0e-6f, (float)(-3.0 * PI / 4.0), pfl_route_bearing(&route, 3u, 50.0f, 50.0f));
    TEST_ASSERT_FLOAT_WITHIN(0.0f, 0.0f, pfl_route_bearing(&route, 0u, 400.0f, 0.0f));
}

void test_cross_track_is_positive_to_the_left(void)
{
    /* Segment 0 to 1 runs along +y at x = 400: left is smaller x. */
    TEST_ASSERT_FLOAT_WITHIN(1.0e-4f, 30.0f, pfl_route_cross_track(&route, 1u, 370.0f, 123.0f));
    TEST_ASSERT_FLOAT_WITHIN(1.0e-4f, -25.0f, pfl_route_cross_track(&route, 1u, 425.0f, -9.0f));
    const pfl_waypoint_t oblique[] = {{0.0f, 0.0f}, {300.0f, 400.0f}};
    route.closed = false;
    TEST_ASSERT_FLOAT_WITHIN(0.0f, 0.0f, pfl_route_cross_track(&route, 0u, 370.0f, 123.0f)); /* no segment before it */
    route.waypoint = oblique;
    route.count = 2u;
    TEST_ASSERT_FLOAT_WITHIN(1.0e-4f, 60.0f, pfl_route_cross_track(&route, 1u, 0.0f, 100.0f));
}

void test_course_follows_the_vector_field(void)
{
    for (int k = -20; k <= 20; k++) {
        const float left_m = 10.0f * (float)k;
        const double expected = PI / 2.0 - 1.2 * (2.0 / PI) * atan(0.02 * (double)left_m);
        TEST_ASSERT_FLOAT_WITHIN(2.0e-6f, (float)expected, pfl_route_course(&route, 1u, 400.0f - left_m, 111.0f));
    }
}

/* A point that flies the course at constant speed comes onto the segment from either side, and stays. */
void test_flying_the_course_leads_onto_the_segment(void)
{
    for (int side = -1; side <= 1; side += 2) {
        double x = 400.0 + 150.0 * side;
        double y = -2000.0;
        for (int k = 0; k < 1500; k++) {
            const double course = (double)pfl_route_course(&route, 1u, (float)x, (float)y);
            x += 1.0 * cos(course);
            y += 1.0 * sin(course);
        }
        TEST_ASSERT_DOUBLE_WITHIN(0.1, 400.0, x);
        TEST_ASSERT_TRUE(y > -1000.0);
    }
}
