/* The scenario `gps` against the check values of its page: the document's filter, geodesy, the coloured noise, the exact
 * errors, the paths, and the particle filter beside the Kalman filter. */
#include "../../tools/runner/gps.h"
#include "../../tools/runner/gps_geodesy.h"
#include "../../tools/runner/host_random.h"

#include "unity.h"

#include <math.h>
#include <string.h>

static gps_study_t study;
static gps_track_t track;
static gps_estimate_t estimate;
static gps_estimate_t partner;
static failure_t failure;

void setUp(void)
{
    study = (gps_study_t){
        .filter = GPS_KF,
        .variant = GPS_LINE,
        .steps = GPS_STEPS_LINE,
        .axes = 1,
        .decay = 0.5,
        .accuracy_m = 1.5,
        .noise_m = 1.5,
        .r_m2 = 2.25,
        .kernel = true,
        .particles = 1000u,
        .seed = 1u,
    };
}

void tearDown(void)
{
}

/* ---- The document's filter ------------------------------------------------------------------------------------------- */

void test_gain_and_covariance_of_the_document(void)
{
    static const unsigned at[4] = {1u, 10u, 50u, 100u};
    static const double p[4][3] = {{0.41376496, 0.05712731, 0.69822271},
                                   {0.32930088, 0.28054030, 0.45198159},
                                   {0.15997690, 0.04461201, 0.01676796},
                                   {0.08502268, 0.01228680, 0.00237772}};
    gps_axis_t axis = gps_axis_start(&study, false, 0.0, 0);
    unsigned row = 0u;

    for (unsigned k = 1u; k <= GPS_STEPS_LINE; k++) {
        double gain[2];
        gps_axis_predict(&axis);
        TEST_ASSERT_TRUE(gps_axis_gain(&axis, gain));
        TEST_ASSERT_TRUE(gps_axis_update(&axis, 3.0, 0.0));
        if (k == 1u) {
            TEST_ASSERT_DOUBLE_WITHIN(1e-7, 0.18389554, gain[0]);
            TEST_ASSERT_DOUBLE_WITHIN(1e-7, 0.02538992, gain[1]);
            TEST_ASSERT_DOUBLE_WITHIN(1e-7, 0.05 + 0.18389554 * 2.95, axis.belief.x[GPS_P]);
        }
        if (k == at[row]) {
            TEST_ASSERT_DOUBLE_WITHIN(1e-7, p[row][0], axis.belief.p[0]);
            TEST_ASSERT_DOUBLE_WITHIN(1e-7, p[row][1], axis.belief.p[1]);
            TEST_ASSERT_DOUBLE_WITHIN(1e-7, p[row][2], axis.belief.p[3]);
            row++;
        }
    }
    TEST_ASSERT_EQUAL_UINT(4u, row);
}

void test_nees_is_the_quadratic_form(void)
{
    const double error[2] = {1.0, 2.0};

    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 1.0 / 4.0 + 4.0 / 16.0, gps_nees(error, 4.0, 0.0, 16.0));
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, (2.0 - 4.0 + 8.0) / 3.0, gps_nees(error, 2.0, 1.0, 2.0));
}

/* ---- Exact errors ---------------------------------------------------------------------------------------------------- */

static double expected_rmse(gps_filter_t filter, double decay, bool longrun)
{
    gps_expected_t expected;

    study.filter = filter;
    study.decay = decay;
    study.noise_m = 1.5 * sqrt(2.0 * (1.0 - decay));
    study.r_m2 = longrun ? 4.5 / (1.0 - decay) : 2.25;
    TEST_ASSERT_TRUE(gps_expect(&study, &expected));
    return expected.rmse_m;
}

void test_expected_errors_over_the_decay(void)
{
    static const double decay[7] = {0.0, 0.25, 0.5, 0.75, 0.9, 0.99, 0.999};
    static const double raw[7] = {2.121, 1.897, 1.731, 1.598, 1.512, 1.147, 0.466};
    static const double document[7] = {0.558, 0.630, 0.746, 0.970, 1.260, 1.216, 0.495};
    static const double longrun[7] = {0.521, 0.573, 0.656, 0.821, 1.058, 1.371, 2.342};
    static const double coloured[7] = {0.521, 0.576, 0.660, 0.822, 1.042, 1.072, 0.461};

    for (int i = 0; i < 7; i++) {
        TEST_ASSERT_DOUBLE_WITHIN(0.00051, raw[i], expected_rmse(GPS_RAW, decay[i], false));
        TEST_ASSERT_DOUBLE_WITHIN(0.00051, document[i], expected_rmse(GPS_KF, decay[i], false));
        TEST_ASSERT_DOUBLE_WITHIN(0.00051, longrun[i], expected_rmse(GPS_KF, decay[i], true));
        TEST_ASSERT_DOUBLE_WITHIN(0.00051, coloured[i], expected_rmse(GPS_KF_COLOURED, decay[i], false));
    }
}

void test_a_drawn_truth_makes_the_coloured_filter_consistent(void)
{
    gps_expected_t expected;

    study.drawn = true;
    study.filter = GPS_KF_COLOURED;
    TEST_ASSERT_TRUE(gps_expect(&study, &expected));
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 2.0, expected.nees);
    TEST_ASSERT_DOUBLE_WITHIN(0.00051, 0.718, expected.rmse_m);
    study.filter = GPS_KF;
    TEST_ASSERT_TRUE(gps_expect(&study, &expected));
    TEST_ASSERT_DOUBLE_WITHIN(0.051, 6.2, expected.nees);
    TEST_ASSERT_DOUBLE_WITHIN(0.00051, 0.765, expected.rmse_m);
}

/* The same errors by sampling: 400 runs, five standard errors of a mean square of about 25 independent samples each. */
void test_expected_errors_are_those_of_runs(void)
{
    gps_expected_t expected;
    double squares = 0.0;
    double final_velocity = 0.0;

    study.velocity = true;
    study.axes = 3;
    TEST_ASSERT_TRUE(gps_expect(&study, &expected));
    for (uint32_t r = 0u; r < 400u; r++) {
        gps_make_track(&study, r, &track);
        TEST_ASSERT_TRUE(gps_kalman(&study, false, 0.0, &track, &estimate, &failure));
        for (int a = 0; a < 3; a++) {
            for (unsigned k = 1u; k <= study.steps; k++) {
                squares += pow(estimate.position[k][a] - track.position[k][a], 2.0) / (400.0 * (double)study.steps);
            }
            final_velocity += pow(estimate.velocity[study.steps][a] - track.velocity[study.steps][a], 2.0) / 400.0;
        }
    }
    TEST_ASSERT_DOUBLE_WITHIN(0.08, 1.0, sqrt(squares) / expected.rmse_m);
    TEST_ASSERT_DOUBLE_WITHIN(0.12, 1.0, sqrt(final_velocity) / expected.final_velocity_mps);
}

/* ---- Geodesy ------------------------------------------------------------------------------------------------------------ */

void test_geodesy_of_the_published_pair(void)
{
    const flat_earth_t earth = flat_earth_at((geodetic_t){46.017, 7.750, 1673.0});
    double ned[3];

    flat_earth_to_ned(&earth, (geodetic_t){45.976, 7.658, 4531.0}, ned);
    TEST_ASSERT_DOUBLE_WITHIN(0.06, -4557.2, ned[0]);
    TEST_ASSERT_DOUBLE_WITHIN(0.06, -7124.4, ned[1]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, -2858.0, ned[2]);
}

void test_geodesy_at_the_origin(void)
{
    const double deg = 57.295779513082320877;
    const double truth[3] = {10.0, 0.0, -5.0};
    const double point[3] = {-7.25, 13.5, 2.0};
    const flat_earth_t earth = flat_earth_at((geodetic_t){42.2825, -71.343, 53.0352});
    geodetic_t at = flat_earth_from_ned(&earth, truth);
    double back[3];

    TEST_ASSERT_DOUBLE_WITHIN(0.005, 6364344.84, earth.meridian_m);
    TEST_ASSERT_DOUBLE_WITHIN(0.0005, 6387822.392, earth.normal_m);
    TEST_ASSERT_DOUBLE_WITHIN(1e-14, 9.00262022e-6, deg * earth.north_rad_each);
    TEST_ASSERT_DOUBLE_WITHIN(1e-13, 1.21236663e-5, deg * earth.east_rad_each);
    TEST_ASSERT_DOUBLE_WITHIN(5e-9, 42.28259003, at.latitude_deg);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, -71.343, at.longitude_deg);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 58.0352, at.altitude_m);
    flat_earth_to_ned(&earth, flat_earth_from_ned(&earth, point), back);
    for (int a = 0; a < 3; a++) {
        TEST_ASSERT_DOUBLE_WITHIN(1e-8, point[a], back[a]);
    }
}

/* ---- Noise ---------------------------------------------------------------------------------------------------------------- */

/* Moments of the GPS error over 3 axes of 1500 runs, at the first sample and at the last. */
void test_gps_error_begins_as_innovation_and_becomes_stationary(void)
{
    double first = 0.0;
    double last = 0.0;
    double product = 0.0;

    for (uint32_t r = 0u; r < 1500u; r++) {
        gps_make_track(&study, r, &track);
        for (int a = 0; a < 3; a++) {
            const double e0 = track.gps[0][a] - track.position[0][a];
            const double e1 = track.gps[99][a] - track.position[99][a];
            const double e2 = track.gps[100][a] - track.position[100][a];
            first += e0 * e0 / 4500.0;
            last += e2 * e2 / 4500.0;
            product += e1 * e2 / 4500.0;
        }
    }
    TEST_ASSERT_DOUBLE_WITHIN(0.08, 1.5, sqrt(first)); /* five standard errors */
    TEST_ASSERT_DOUBLE_WITHIN(0.09, 1.732, sqrt(last));
    TEST_ASSERT_DOUBLE_WITHIN(0.28, 1.5, product); /* d times the variance */
}

/* The variance of a long sum, by its length, is the one at zero frequency: 9 m2, not 2.25. */
void test_gps_error_has_its_long_run_variance(void)
{
    host_random_t random;
    double e = 0.0;
    double variance = 0.0;

    host_random_start(&random, 1u, 0u, RANDOM_MEASUREMENT);
    for (int block = 0; block < 1000; block++) {
        double sum = 0.0;
        for (int k = 0; k < 1000; k++) {
            e = gps_colour(0.5, e, 1.5 * host_random_normal(&random));
            sum += e;
        }
        variance += sum * sum / 1000.0 / 1000.0;
    }
    TEST_ASSERT_DOUBLE_WITHIN(2.0, 9.0, variance); /* five standard errors */
}

void test_a_run_has_the_same_dice_whatever_is_used(void)
{
    const gps_study_t wide = study;

    gps_make_track(&study, 5u, &track);
    const double north = track.gps[70][0];
    study.axes = 3;
    study.velocity = true;
    study.filter = GPS_PF;
    gps_make_track(&study, 5u, &track);
    TEST_ASSERT_DOUBLE_WITHIN(0.0, north, track.gps[70][0]);
    study = wide;
    gps_make_track(&study, 6u, &track);
    TEST_ASSERT_TRUE(fabs(north - track.gps[70][0]) > 1e-9);
}

/* ---- Paths ----------------------------------------------------------------------------------------------------------------- */

void test_the_line_is_the_documents(void)
{
    gps_make_track(&study, 0u, &track);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 10.0, track.position[100][0]);
    TEST_ASSERT_DOUBLE_WITHIN(0.0, 0.0, track.position[100][1]);
    TEST_ASSERT_DOUBLE_WITHIN(0.0, -5.0, track.position[100][2]);
}

void test_the_curve_ends_where_the_page_says(void)
{
    study.variant = GPS_CURVE;
    study.steps = GPS_STEPS_CURVE;
    study.axes = 2;
    gps_make_track(&study, 0u, &track);
    TEST_ASSERT_DOUBLE_WITHIN(0.0006, -3.877, track.position[400][0]);
    TEST_ASSERT_DOUBLE_WITHIN(0.0006, -2.346, track.position[400][1]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 3.0, hypot(track.velocity[400][0], track.velocity[400][1]));
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 4.0 - 6.283185307179586, atan2(track.velocity[400][1], track.velocity[400][0]));
}

void test_the_radar_sees_the_ranges_of_the_page(void)
{
    double nearest = 1e9;
    double farthest = 0.0;
    int crossings = 0;

    study.variant = GPS_RADAR;
    study.steps = GPS_STEPS_CURVE;
    study.axes = 2;
    gps_make_track(&study, 0u, &track); /* without noise */
    for (unsigned k = 0u; k <= study.steps; k++) {
        nearest = fmin(nearest, track.range[k]);
        farthest = fmax(farthest, track.range[k]);
        crossings += k > 0u && fabs(track.azimuth[k] - track.azimuth[k - 1u]) > 3.0 ? 1 : 0;
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, track.position[k][0], track.gps[k][0]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, track.position[k][1], track.gps[k][1]);
    }
    TEST_ASSERT_DOUBLE_WITHIN(0.05, 4.3, nearest);
    TEST_ASSERT_DOUBLE_WITHIN(0.05, 36.4, farthest);
    TEST_ASSERT_EQUAL_INT(2, crossings);
}

void test_angles_wrap(void)
{
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 4.0 - 6.283185307179586, gps_wrap(4.0));
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.5, gps_wrap(0.5 - 4.0 * 3.14159265358979324));
}

/* ---- The library beside the Kalman filter ----------------------------------------------------------------------------------- */

static double distance_to_kf(bool coloured, uint32_t runs)
{
    double squares = 0.0;

    for (uint32_t r = 0u; r < runs; r++) {
        gps_make_track(&study, r, &track);
        TEST_ASSERT_TRUE(gps_particle_filter(&study, coloured, r, &track, &estimate, NULL, &failure));
        TEST_ASSERT_TRUE(gps_kalman(&study, coloured, 0.0, &track, &partner, &failure));
        for (unsigned k = 1u; k <= study.steps; k++) {
            squares += pow(estimate.position[k][0] - partner.position[k][0], 2.0);
        }
    }
    return sqrt(squares / (double)runs / (double)study.steps);
}

void test_particles_stay_by_the_kalman_filter(void)
{
    TEST_ASSERT_TRUE(distance_to_kf(false, 40u) <= 0.15);
    TEST_ASSERT_TRUE(distance_to_kf(true, 40u) <= 0.06);
}

void test_without_the_kernel_step_they_do_not(void)
{
    study.kernel = false;
    TEST_ASSERT_TRUE(distance_to_kf(false, 40u) > 0.2);
}
