/* The recordings of `wind`: fixes while airborne, each with the airspeed, pitch and yaw of its time, and the batch fit
 * that the filter is held against. */
#include "recording.h"
#include "wind.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846
#define TURN_SPAN_S 1.0
#define FIT_ROUNDS 40
#define FIT_SCALE_MPS 2.0 /* residuals beyond this count less and less (Cauchy) */
#define SHARP_MPS2 10.0   /* an acceleration at which a velocity says a third as much: aligned in time only so well */

typedef struct {
    recording_t gps, air, att;
} files_t;

static void close_files(files_t *files)
{
    recording_free(&files->gps);
    recording_free(&files->air);
    recording_free(&files->att);
}

static bool read_files(files_t *files, const wind_study_t *s, const char *folder, failure_t *failure)
{
    static const char *const gps[] = {"t_s", "north_m", "east_m", "vn_mps", "ve_mps", "vd_mps"};
    static const char *const att[] = {"t_s", "pitch_rad", "yaw_rad"};
    const char *const air[] = {"t_s", s->px4 ? "tas_mps" : "ias_mps"};

    return recording_read(&files->gps, folder, "gps.csv", gps, 6u, failure) &&
           recording_read(&files->air, folder, "air.csv", air, 2u, failure) &&
           recording_read(&files->att, folder, "att.csv", att, 3u, failure);
}

/* Yaw without jumps, so that it can be interpolated. */
static void unwrap(recording_t *att)
{
    for (size_t i = 1u; i < att->rows; i++) {
        double *yaw = &att->value[i * att->columns + 2u];
        const double before = yaw[-(ptrdiff_t)att->columns];
        *yaw = before + remainder(*yaw - before, 2.0 * PI);
    }
}

static void fill(wind_epoch_t *epoch, const files_t *files, size_t row, double start_s)
{
    const double *gps = &files->gps.value[row * files->gps.columns];
    const double *before = row > 0u ? gps - files->gps.columns : gps;
    const double t_s = gps[0];
    const double air_s = t_s - WIND_LAG_S;
    const double yaw = recording_at(&files->att, 2u, t_s);
    const double change = hypot(gps[3] - before[3], gps[4] - before[4]) / fmax(t_s - before[0], 0.1) / SHARP_MPS2;

    epoch->t_s = t_s;
    epoch->t_us = (uint64_t)llround((t_s - start_s) * 1e6);
    epoch->fix.x_m = (float)gps[1];
    epoch->fix.y_m = (float)gps[2];
    epoch->fix.vx_mps = (float)gps[3];
    epoch->fix.vy_mps = (float)gps[4];
    epoch->climb_mps = (float)-gps[5];
    epoch->fix.air_mps = (float)(recording_at(&files->air, 1u, air_s) * cos(recording_at(&files->att, 1u, air_s)));
    epoch->fix.yaw_rad = (float)recording_at(&files->att, 2u, air_s);
    epoch->fix.widen = (float)(1.0 + 2.0 * change * change);
    epoch->yaw_now_rad = (float)yaw;
    epoch->turn_radps = (float)((yaw - recording_at(&files->att, 2u, t_s - TURN_SPAN_S)) / TURN_SPAN_S);
}

/* Airborne from and to, as the recordings' descriptions say. */
static bool take_epochs(wind_study_t *s, const files_t *files, const char *folder, failure_t *failure)
{
    const double from_s = s->px4 ? 15.0 : 222.0;
    const double to_s = s->px4 ? 524.0 : 545.0;

    s->epoch = calloc(files->gps.rows, sizeof *s->epoch);
    if (s->epoch == NULL) {
        return fail(failure, EXIT_HARNESS, "out of memory");
    }
    for (size_t row = 0u; row < files->gps.rows; row++) {
        const double t_s = files->gps.value[row * files->gps.columns];
        if (t_s >= from_s && t_s <= to_s) {
            fill(&s->epoch[s->epochs], files, row, s->epochs > 0u ? s->epoch[0].t_s : t_s);
            s->epochs++;
        }
    }
    if (s->epochs < 2u) {
        return fail(failure, EXIT_HARNESS, "%s/gps.csv: no fixes between %g and %g s", folder, from_s, to_s);
    }
    return true;
}

static double determinant(const double *a, const double *b, const double *c)
{
    return a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) + a[2] * (b[0] * c[1] - b[1] * c[0]);
}

/* Adds the solution of a symmetric 3 x 3 system to x, by Cramer's rule. */
static bool add_solution(double normal[3][3], const double *right, double *x)
{
    const double whole = determinant(normal[0], normal[1], normal[2]);

    if (!(fabs(whole) > 0.0)) {
        return false;
    }
    x[0] += determinant(right, normal[1], normal[2]) / whole;
    x[1] += determinant(normal[0], right, normal[2]) / whole;
    x[2] += determinant(normal[0], normal[1], right) / whole;
    return true;
}

/* One robust Gauss-Newton round for wind and scale: |v - w|, climb included, against scale times airspeed. */
static bool fit_round(const wind_study_t *s, const recording_t *air, double *fit)
{
    double normal[3][3] = {{0.0}};
    double right[3] = {0.0};

    for (size_t i = 0u; i < s->epochs; i++) {
        const wind_epoch_t *e = &s->epoch[i];
        const double measured = recording_at(air, 1u, e->t_s - WIND_LAG_S);
        const double dx = (double)e->fix.vx_mps - fit[0];
        const double dy = (double)e->fix.vy_mps - fit[1];
        const double speed = sqrt(dx * dx + dy * dy + (double)e->climb_mps * (double)e->climb_mps);
        const double off = (speed - fit[2] * measured);
        const double weight = 1.0 / (1.0 + off * off / (FIT_SCALE_MPS * FIT_SCALE_MPS));
        const double slope[3] = {-dx / speed, -dy / speed, -measured};
        for (size_t r = 0u; r < 3u; r++) {
            right[r] -= weight * slope[r] * off;
            for (size_t c = 0u; c < 3u; c++) {
                normal[r][c] += weight * slope[r] * slope[c];
            }
        }
    }
    return add_solution(normal, right, fit);
}

static bool fit_batch(wind_study_t *s, const recording_t *air, failure_t *failure)
{
    double fit[3] = {0.0, 0.0, 1.0};

    for (int round = 0; round < FIT_ROUNDS; round++) {
        if (!fit_round(s, air, fit)) {
            return fail(failure, EXIT_HARNESS, "the recording does not tell the wind");
        }
    }
    memcpy(s->batch_wind_mps, fit, sizeof s->batch_wind_mps);
    s->batch_scale = fit[2];
    return true;
}

bool wind_load(wind_study_t *s, const char *data, failure_t *failure)
{
    char folder[900];
    files_t files;

    memset(&files, 0, sizeof files);
    const int length = snprintf(folder, sizeof folder, "%s/%s", data, s->px4 ? "fixedwing_px4_proto" : "fixedwing_x8");
    if (length < 0 || (size_t)length >= sizeof folder) {
        return fail(failure, EXIT_HARNESS, "--data: path too long");
    }
    bool loaded = read_files(&files, s, folder, failure);
    if (loaded) {
        unwrap(&files.att);
        loaded = take_epochs(s, &files, folder, failure) && fit_batch(s, &files.air, failure);
    }
    close_files(&files);
    if (!loaded) {
        free(s->epoch);
        s->epoch = NULL;
    }
    return loaded;
}
