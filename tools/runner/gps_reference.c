/* The figures of the scenario page, each with the settings that it holds for. */
#include "gps.h"

#include <math.h>

static const gps_reference_t none = {MISSING, MISSING};

bool gps_is_value(double x, double value)
{
    return fabs(x - value) < 1e-9;
}

/* ---- Groups of settings -------------------------------------------------------------------------------------------- */

/* A straight line with one axis, position only, the stated guess and truth. */
static bool is_plain_line(const gps_study_t *s)
{
    return s->variant == GPS_LINE && s->axes == 1 && !s->velocity && s->guess == GPS_GUESS_DOCUMENT && !s->drawn;
}

static bool is_standard_noise(const gps_study_t *s)
{
    return !s->white && gps_is_value(s->decay, 0.5) && gps_is_value(s->accuracy_m, 1.5);
}

bool gps_is_standard(const gps_study_t *s)
{
    return is_standard_noise(s) && (s->variant != GPS_LINE || is_plain_line(s)) && !s->velocity;
}

/* Rows of the line's tables, in the order of their columns; -1: none of them. */
static int line_row(const gps_study_t *s)
{
    switch (s->filter) {
    case GPS_RAW:
        return 0;
    case GPS_KF:
        return s->longrun ? 2 : 1;
    case GPS_KF_COLOURED:
        return 3;
    case GPS_KF_TUNED:
    case GPS_EKF:
    case GPS_PF:
    case GPS_PF_COLOURED:
    default:
        return -1;
    }
}

/* ---- The straight line ---------------------------------------------------------------------------------------------- */

enum { DECAYS = 7 };
static const double decay_of[DECAYS] = {0.0, 0.25, 0.5, 0.75, 0.9, 0.99, 0.999};

/* GPS only, document, R = R_L, coloured: expected RMSE. */
static const double expected_of[4][DECAYS] = {
    {2.121, 1.897, 1.731, 1.598, 1.512, 1.147, 0.466},
    {0.558, 0.630, 0.746, 0.970, 1.260, 1.216, 0.495},
    {0.521, 0.573, 0.656, 0.821, 1.058, 1.371, 2.342},
    {0.521, 0.576, 0.660, 0.822, 1.042, 1.072, 0.461},
};
static const double standard_expected[4] = {1.7313, 0.7455, 0.6559, 0.6604}; /* d = 0.5, to more digits */
static const double nees_document[DECAYS] = {3.2, 4.1, 5.8, 10.3, 18.5, 17.9, 2.9};
static const double nees_coloured[DECAYS] = {1.5, 1.4, 1.3, 1.3, 1.4, 1.8, 2.0};

static int decay_column(const gps_study_t *s)
{
    for (int i = 0; i < DECAYS; i++) {
        if (gps_is_value(s->decay, decay_of[i])) {
            return i;
        }
    }
    return -1;
}

static gps_reference_t expected_white(const gps_study_t *s)
{
    if (s->filter == GPS_RAW) {
        return (gps_reference_t){1.5, 0.00005};
    }
    return s->filter == GPS_KF ? (gps_reference_t){0.3991, 0.00005} : none;
}

/* Truth drawn from N(x0, P0): document and coloured, at two decays. */
static gps_reference_t expected_drawn(const gps_study_t *s)
{
    const bool coloured = s->filter == GPS_KF_COLOURED;

    if (s->longrun || s->axes != 1 || s->velocity || s->guess != GPS_GUESS_DOCUMENT || s->white ||
        (!coloured && s->filter != GPS_KF)) {
        return none;
    }
    if (gps_is_value(s->decay, 0.5)) {
        return (gps_reference_t){coloured ? 0.718 : 0.765, 0.0005};
    }
    return gps_is_value(s->decay, 0.9) ? (gps_reference_t){coloured ? 1.103 : 1.271, 0.0005} : none;
}

/* The document's modifications that have an exact figure: accuracies and guesses, document and coloured. */
static gps_reference_t expected_modified(const gps_study_t *s)
{
    static const double accuracy[3] = {0.5, 3.0, 5.0};
    static const double by_accuracy[3][2] = {{0.293, 0.272}, {1.278, 1.110}, {1.871, 1.580}};
    static const double by_guess[2][2] = {{1.183, 1.485}, {0.849, 0.794}}; /* far, far-wide */
    const int coloured = s->filter == GPS_KF_COLOURED ? 1 : 0;

    if (s->white || s->longrun || s->axes != 1 || s->velocity || !gps_is_value(s->decay, 0.5) ||
        (!coloured && s->filter != GPS_KF)) {
        return none;
    }
    for (int i = 0; i < 3 && s->guess == GPS_GUESS_DOCUMENT; i++) {
        if (gps_is_value(s->accuracy_m, accuracy[i])) {
            return (gps_reference_t){by_accuracy[i][coloured], 0.0005};
        }
    }
    if (s->guess != GPS_GUESS_DOCUMENT && gps_is_value(s->accuracy_m, 1.5)) {
        return (gps_reference_t){by_guess[s->guess == GPS_GUESS_FAR ? 0 : 1][coloured], 0.0005};
    }
    return none;
}

gps_reference_t gps_reference_expected(const gps_study_t *s)
{
    const int row = line_row(s);
    const int column = decay_column(s);

    if (s->variant != GPS_LINE || row < 0) {
        return none;
    }
    if (s->drawn) {
        return gps_is_value(s->accuracy_m, 1.5) ? expected_drawn(s) : none;
    }
    if (!is_plain_line(s) || !gps_is_value(s->accuracy_m, 1.5)) {
        return expected_modified(s);
    }
    if (s->white) {
        return expected_white(s);
    }
    if (gps_is_standard(s)) {
        return (gps_reference_t){standard_expected[row], 0.00005};
    }
    return column < 0 ? none : (gps_reference_t){expected_of[row][column], 0.0005};
}

gps_reference_t gps_reference_nees(const gps_study_t *s)
{
    const int row = line_row(s);
    const int column = decay_column(s);
    const bool half = gps_is_value(s->decay, 0.5);

    if (s->variant != GPS_LINE || row < 1 || s->axes != 1 || s->velocity || !gps_is_value(s->accuracy_m, 1.5) ||
        s->guess != GPS_GUESS_DOCUMENT) {
        return none;
    }
    if (s->white) {
        return row == 1 && !s->drawn ? (gps_reference_t){1.6, 0.05} : none;
    }
    if (s->drawn && (half || gps_is_value(s->decay, 0.9)) && row != 2) {
        return row == 3 ? (gps_reference_t){2.0, 0.0005} : (gps_reference_t){half ? 6.2 : 18.9, 0.05};
    }
    if (s->drawn || column < 0 || (row == 2 && !half)) {
        return none;
    }
    if (row == 2) {
        return (gps_reference_t){1.2, 0.05};
    }
    return (gps_reference_t){(row == 1 ? nees_document : nees_coloured)[column], 0.05};
}

static gps_reference_t rmse_of_three_axes(const gps_study_t *s)
{
    if (!is_standard_noise(s) || s->velocity || s->guess != GPS_GUESS_DOCUMENT || s->drawn || s->longrun) {
        return none;
    }
    switch (s->filter) {
    case GPS_RAW:
        return (gps_reference_t){3.003, 0.0005};
    case GPS_KF:
        return (gps_reference_t){1.271, 0.0005};
    case GPS_KF_COLOURED:
        return (gps_reference_t){1.113, 0.0005};
    case GPS_KF_TUNED:
    case GPS_EKF:
    case GPS_PF:
    case GPS_PF_COLOURED:
    default:
        return none;
    }
}

/* Particle filters by number of particles. */
static gps_reference_t rmse_of_line_particles(const gps_study_t *s)
{
    const bool coloured = s->filter == GPS_PF_COLOURED;
    const uint32_t n = s->particles;

    if (!s->kernel) {
        return n == 1000u && !coloured && !s->longrun ? (gps_reference_t){0.713, 0.0005} : none;
    }
    if (coloured) {
        const double rmse = n == 200u ? 0.623 : n == 500u ? 0.616 : n == 1000u ? 0.613 : MISSING;
        return (gps_reference_t){rmse, 0.0005};
    }
    if (s->longrun) {
        return (gps_reference_t){n == 200u ? 0.612 : n == 1000u ? 0.610 : MISSING, 0.0005};
    }
    const double rmse = n == 500u ? 0.687 : n == 1000u ? 0.686 : n == 5000u ? 0.685 : MISSING;
    return (gps_reference_t){rmse, 0.0005};
}

static gps_reference_t rmse_of_line(const gps_study_t *s)
{
    static const double mean_of_runs[4] = {1.7234, 0.7128, 0.6213, 0.6288};
    const int row = line_row(s);

    if (s->axes == 3) {
        return rmse_of_three_axes(s);
    }
    if (s->velocity && s->filter == GPS_KF && is_standard_noise(s) && !s->longrun && !s->drawn &&
        s->guess == GPS_GUESS_DOCUMENT) {
        return (gps_reference_t){0.374, 0.0005};
    }
    if (!gps_is_standard(s)) {
        return none;
    }
    if (s->filter == GPS_PF || s->filter == GPS_PF_COLOURED) {
        return rmse_of_line_particles(s);
    }
    return row < 0 ? none : (gps_reference_t){mean_of_runs[row], 0.00005};
}

gps_reference_t gps_reference_to_kf(const gps_study_t *s)
{
    const uint32_t n = s->particles;

    if (s->variant != GPS_LINE || !gps_is_standard(s) || s->longrun) {
        return none;
    }
    if (s->filter == GPS_PF_COLOURED && s->kernel) {
        const double distance = n == 200u ? 0.11 : n == 500u ? 0.05 : n == 1000u ? 0.04 : n == 5000u ? 0.02 : MISSING;
        return (gps_reference_t){distance, 0.005};
    }
    if (s->filter == GPS_PF && s->kernel) {
        return (gps_reference_t){n == 500u ? 0.12 : n == 1000u ? 0.10 : n == 5000u ? 0.06 : MISSING, 0.005};
    }
    return s->filter == GPS_PF && n == 1000u ? (gps_reference_t){0.34, 0.005} : none;
}

/* ---- Turns ------------------------------------------------------------------------------------------------------------ */

/* Rows of the table of the curve. */
static int curve_row(const gps_study_t *s)
{
    switch (s->filter) {
    case GPS_RAW:
        return 0;
    case GPS_KF:
        return s->longrun ? -1 : 1;
    case GPS_KF_TUNED:
        return s->longrun ? -1 : 2;
    case GPS_KF_COLOURED:
        return 3;
    case GPS_EKF:
        return s->longrun ? -1 : 4;
    case GPS_PF:
        return s->longrun ? 6 : 5;
    case GPS_PF_COLOURED:
    default:
        return 7;
    }
}

static gps_reference_t rmse_of_curve(const gps_study_t *s)
{
    static const double decay[3] = {0.0, 0.5, 0.9};
    static const double rmse[8][3] = {
        {2.99, 2.44, 2.17},    {11.86, 11.88, 11.86}, {0.955, 1.224, 1.940}, {0.949, 1.189, 1.775},
        {0.899, 1.195, 1.994}, {0.961, 1.400, 2.525}, {0.891, 1.127, 1.819}, {0.883, 1.113, 1.680},
    };
    const bool particles = s->filter == GPS_PF || s->filter == GPS_PF_COLOURED;
    const int row = curve_row(s);

    if (s->white || s->velocity || row < 0 || !gps_is_value(s->accuracy_m, 1.5) ||
        (particles && (s->particles != 1000u || s->kernel))) {
        return none;
    }
    for (int i = 0; i < 3; i++) {
        if (gps_is_value(s->decay, decay[i])) {
            return (gps_reference_t){rmse[row][i], row < 2 ? 0.005 : 0.0005};
        }
    }
    return none;
}

static gps_reference_t rmse_of_radar(const gps_study_t *s)
{
    static const double pf[3][2] = {{0.548, 2.41}, {0.515, 1.81}, {0.510, 1.72}}; /* N = 500, 1000, 2000 */
    const int c = s->variant == GPS_RADAR_COARSE ? 1 : 0;
    const double raw[2] = {1.50, 7.38};
    const double kf[2] = {11.70, 11.84};
    const double tuned[2] = {0.581, 2.41};
    const double ekf[2] = {0.501, 2.05};
    const double frozen[2][2] = {{20.3, 21.3}, {17.2, 18.8}}; /* Q = 0, q = 0.3 */

    switch (s->filter) {
    case GPS_RAW:
        return (gps_reference_t){raw[c], 0.005};
    case GPS_KF:
        return (gps_reference_t){s->linear ? frozen[0][c] : kf[c], 0.05};
    case GPS_KF_TUNED:
        return (gps_reference_t){s->linear ? frozen[1][c] : tuned[c], 0.05};
    case GPS_EKF:
        return (gps_reference_t){ekf[c], 0.005};
    case GPS_PF:
        for (int i = 0; i < 3 && !s->kernel; i++) {
            if (s->particles == 500u << i) {
                return (gps_reference_t){pf[i][c], 0.005};
            }
        }
        return none;
    case GPS_KF_COLOURED:
    case GPS_PF_COLOURED:
    default:
        return none;
    }
}

gps_reference_t gps_reference_rmse(const gps_study_t *s)
{
    if (s->variant == GPS_LINE) {
        return rmse_of_line(s);
    }
    return s->variant == GPS_CURVE ? rmse_of_curve(s) : rmse_of_radar(s);
}

/* ---- The document's filter, which needs no data for its covariance -------------------------------------------------- */

/* K_1, and P11, P12, P22 after k steps. */
static const double page_gain[2] = {0.18389554, 0.02538992};
static const struct {
    unsigned k;
    double p[3];
} page_covariance[] = {
    {1u, {0.41376496, 0.05712731, 0.69822271}},
    {10u, {0.32930088, 0.28054030, 0.45198159}},
    {50u, {0.15997690, 0.04461201, 0.01676796}},
    {100u, {0.08502268, 0.01228680, 0.00237772}},
};

bool gps_document_deviation(double *deviation)
{
    const gps_study_t document = {.variant = GPS_LINE, .axes = 1, .r_m2 = 2.25, .noise_m = 1.5, .decay = 0.5};
    gps_axis_t axis = gps_axis_start(&document, false, 0.0, 0);
    unsigned row = 0u;

    *deviation = 0.0;
    for (unsigned k = 1u; k <= GPS_STEPS_LINE; k++) {
        double gain[2];
        gps_axis_predict(&axis);
        if (!gps_axis_gain(&axis, gain) || !gps_axis_update(&axis, 0.0, 0.0)) {
            return false;
        }
        for (int i = 0; i < 2 && k == 1u; i++) {
            *deviation = fmax(*deviation, fabs(gain[i] - page_gain[i]));
        }
        if (k == page_covariance[row].k) {
            const double p[3] = {axis.belief.p[0], axis.belief.p[1], axis.belief.p[3]};
            for (int i = 0; i < 3; i++) {
                *deviation = fmax(*deviation, fabs(p[i] - page_covariance[row].p[i]));
            }
            row++;
        }
    }
    return true;
}
