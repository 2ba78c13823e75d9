/* Looking ahead in `wind`: 60 s without GPS but with air data, as a receiver's outage leaves them; and 5 and 10 s without
 * any measurement, held turn against straight flight against the waypoint controller that the aircraft flew by. */
#include "wind.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define STEP_US 200000u
#define AHEAD_STEPS 50u

static bool check(pfl_status_t status, const char *call, size_t i, failure_t *failure)
{
    return status >= 0 || fail(failure, EXIT_HARNESS, "ahead of fix %zu: %s: %s", i, call, pfl_status_string(status));
}

/* Distance to a fix, and whether that lies in the 95 % region of the fork. */
static bool look(pfl_t *fork, float shared_m2, const pfl_wind_fix_t *fix, double *error, bool *covered)
{
    float mean[PFL_WIND_STATES];
    float cov[PFL_WIND_STATES * PFL_WIND_STATES];

    if (pfl_estimate(fork, mean, cov) < 0) {
        return false;
    }
    const double xx = (double)(cov[0] + shared_m2);
    const double xy = (double)cov[PFL_WIND_Y];
    const double yy = (double)(cov[PFL_WIND_Y * PFL_WIND_STATES + PFL_WIND_Y] + shared_m2);
    const double x = (double)(fix->x_m - mean[PFL_WIND_X]);
    const double y = (double)(fix->y_m - mean[PFL_WIND_Y]);
    *error = hypot(x, y);
    *covered = (yy * x * x - 2.0 * xy * x * y + xx * y * y) <= WIND_CHI2_95 * (xx * yy - xy * xy);
    return true;
}

bool wind_outage(wind_filter_t *f, size_t i, wind_ahead_t *ahead, failure_t *failure)
{
    const wind_study_t *s = f->study;
    const double start_s = s->epoch[i].t_s;
    pfl_wind_t wind = f->wind;
    const pfl_wind_fix_t *fused = f->fused;
    double error[2] = {0.0, 0.0};
    pfl_t *fork;

    if (!check(pfl_fork(f->filter, f->spare, f->bytes, &fork), "pfl_fork", i, failure)) {
        return false;
    }
    for (size_t j = i + 1u; j < s->epochs && s->epoch[j].t_s <= start_s + 60.1; j++) {
        const wind_epoch_t *epoch = &s->epoch[j];
        const pfl_wind_input_t input = {fused, epoch->fix.air_mps, epoch->fix.yaw_rad};
        double off;
        bool covered;
        pfl_wind_move(&wind, (float)((double)(epoch->t_us - epoch[-1].t_us) * 1e-6));
        if (!check(pfl_predict(fork, epoch->t_us, &input), "pfl_predict", j, failure)) {
            return false;
        }
        fused = NULL;
        if (!look(fork, s->bootstrap ? 0.0f : wind.cov[PFL_WIND_PP], &epoch->fix, &off, &covered)) {
            return fail(failure, EXIT_HARNESS, "no estimate ahead of fix %zu", i);
        }
        error[0] = epoch->t_s <= start_s + 30.1 ? off : error[0];
        error[1] = off;
        ahead->sum[2] += covered ? 1.0 : 0.0;
        ahead->fixes += 1.0;
    }
    ahead->sum[0] += error[0];
    ahead->sum[1] += error[1];
    ahead->starts += 1.0;
    return true;
}

/* ---- The waypoint controller ------------------------------------------------------------------------------------ */

/* The loiter point of the recording's autopilot, as corners to steer for; aiming the autopilot's tracking distance ahead
 * on the circle is how it flies one (20 s period and damping 0.75, its defaults, at 17 m/s). */
#define CENTER_X_M 193.59f
#define CENTER_Y_M (-83.46f)
#define RADIUS_M 100.0f
#define TRACKING_M 80.0f
#define CORNERS 36u

typedef struct {
    const wind_filter_t *from; /* stands for the model's parameters in the draw */
    pfl_autopilot_t model;
    pfl_view_t cloud;
    float heading_rad;
    float air_mps;
} orbit_t;

enum { ORBIT_WIND = PFL_AUTOPILOT_STATES, ORBIT_CORNER = ORBIT_WIND + 2, ORBIT_STATES };

static void orbit_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    orbit_t *orbit = user;

    pfl_autopilot_predict(&orbit->model, u, dt_s, p);
}

/* The wind filter's cloud, one to one, each particle's means spread by the covariance that they share. */
static void orbit_draw(void *user, const pfl_batch_t *p)
{
    const orbit_t *orbit = user;
    const float *c = orbit->from->wind.cov;
    const float *mean = orbit->from->mean;
    const float wind_sigma = sqrtf(c[PFL_WIND_WW] + 2.0f * c[PFL_WIND_WG] + c[PFL_WIND_GG]);
    const float place_sigma = sqrtf(c[PFL_WIND_PP]);
    const pfl_view_t *cloud = &orbit->cloud;

    for (uint32_t i = 0u; i < p->n; i++) {
        const size_t at = p->first + i;
        const float x = mean[PFL_WIND_X] + place_sigma * PFL_NOISE(p, 0)[i];
        const float y = mean[PFL_WIND_Y] + place_sigma * PFL_NOISE(p, 1)[i];
        const float ahead = pfl_atan2f(y - CENTER_Y_M, x - CENTER_X_M) + TRACKING_M / RADIUS_M;
        const float corner = ceilf(ahead / (2.0f * PFL_PI) * (float)CORNERS);
        PFL_STATE(p, PFL_AUTOPILOT_X)[i] = x;
        PFL_STATE(p, PFL_AUTOPILOT_Y)[i] = y;
        PFL_STATE(p, PFL_AUTOPILOT_HEIGHT)[i] = 0.0f;
        PFL_STATE(p, PFL_AUTOPILOT_CLIMB)[i] = 0.0f;
        PFL_STATE(p, PFL_AUTOPILOT_SPEED)[i] = PFL_STATE(cloud, PFL_WIND_SCALE)[at] * orbit->air_mps;
        PFL_STATE(p, PFL_AUTOPILOT_HEADING)[i] = orbit->heading_rad + PFL_STATE(cloud, PFL_WIND_OFFSET)[at];
        PFL_STATE(p, ORBIT_WIND)
        [i] = mean[PFL_WIND_X_WIND] + mean[PFL_WIND_X_GUST] + wind_sigma * PFL_NOISE(p, ORBIT_WIND)[i];
        PFL_STATE(p, ORBIT_WIND + 1)
        [i] = mean[PFL_WIND_Y_WIND] + mean[PFL_WIND_Y_GUST] + wind_sigma * PFL_NOISE(p, ORBIT_WIND + 1)[i];
        PFL_STATE(p, ORBIT_CORNER)[i] = corner - (float)CORNERS * floorf(corner / (float)CORNERS);
    }
}

static bool fly_orbit(const pfl_config_t *config, float *place, size_t i, failure_t *failure)
{
    pfl_waypoint_t corner[CORNERS];
    const pfl_route_t route = {corner, CORNERS, true, PFL_SWITCH_RADIUS, TRACKING_M, 0.0f, 1.0f};
    const pfl_autopilot_input_t input = {0.0f, 0.0f, 0.0f, 0.0f, &route};
    const size_t bytes = pfl_arena_bytes(config);
    void *arena = malloc(bytes);
    pfl_t *filter;
    bool flown = arena != NULL || fail(failure, EXIT_HARNESS, "out of memory");

    for (uint32_t k = 0u; k < CORNERS; k++) {
        const double angle = 2.0 * 3.14159265358979 * k / CORNERS;
        corner[k].x_m = CENTER_X_M + RADIUS_M * (float)cos(angle);
        corner[k].y_m = CENTER_Y_M + RADIUS_M * (float)sin(angle);
    }
    flown = flown && check(pfl_init(arena, bytes, config, 0u, &filter), "pfl_init", i, failure);
    for (uint32_t k = 1u; flown && k <= AHEAD_STEPS; k++) {
        float mean[ORBIT_STATES];
        flown = check(pfl_predict(filter, (uint64_t)k * STEP_US, &input), "pfl_predict", i, failure) &&
                check(pfl_estimate(filter, mean, NULL), "pfl_estimate", i, failure);
        if (flown && 2u * k % AHEAD_STEPS == 0u) {
            memcpy(&place[2u * (2u * k / AHEAD_STEPS - 1u)], mean, 2u * sizeof *mean);
        }
    }
    free(arena);
    return flown;
}

bool wind_orbit(wind_filter_t *f, size_t i, float *place, failure_t *failure)
{
    const pfl_wind_fix_t *fix = &f->study->epoch[i].fix;
    orbit_t orbit = {
        .from = f,
        .model = {.alpha_heading = 1.0f,
                  .speed_max_mps = 100.0f,
                  .turn_max_radps = 0.5f,
                  .wind_walk = 0.45f, /* what a gust of 1 m/s and 10 s begins like */
                  .substeps = 2u,
                  .wind_state = ORBIT_WIND,
                  .waypoint_state = ORBIT_CORNER},
        .heading_rad = fix->yaw_rad,
        .air_mps = fix->air_mps,
    };
    const pfl_config_t config = {
        .abi = PFL_ABI,
        .particles = f->config.particles,
        .states = ORBIT_STATES,
        .noises = 4u,
        .moments = PFL_MOMENTS_MEAN,
        .seed = f->config.seed + i,
        .predict = orbit_predict,
        .draw = orbit_draw,
        .user = &orbit,
    };

    /* Equal weights: the cloud is to be copied one to one. */
    pfl_t *fork;
    return check(pfl_fork(f->filter, f->spare, f->bytes, &fork), "pfl_fork", i, failure) &&
           check(pfl_resample(fork), "pfl_resample", i, failure) &&
           check(pfl_particles(fork, &orbit.cloud, NULL), "pfl_particles", i, failure) &&
           fly_orbit(&config, place, i, failure);
}

/* ---- 5 and 10 s ahead --------------------------------------------------------------------------------------------- */

/* Held airspeed and turn rate in the fork; yaw is known up to now, which is later than where the fork begins. */
static bool fly_turn(wind_filter_t *f, size_t i, float *place, failure_t *failure)
{
    const wind_epoch_t *epoch = &f->study->epoch[i];
    const float lag_s = (float)WIND_LAG_S;
    const pfl_wind_fix_t *fused = f->fused;
    pfl_t *fork;

    if (!check(pfl_fork(f->filter, f->spare, f->bytes, &fork), "pfl_fork", i, failure)) {
        return false;
    }
    for (uint32_t k = 1u; k <= AHEAD_STEPS; k++) {
        const float since_s = 1e-6f * (float)STEP_US * ((float)k - 0.5f);
        const float known = since_s < lag_s ? since_s / lag_s : 1.0f;
        const float yaw_rad = epoch->fix.yaw_rad + known * (epoch->yaw_now_rad - epoch->fix.yaw_rad) +
                              epoch->turn_radps * fmaxf(since_s - lag_s, 0.0f);
        const pfl_wind_input_t input = {fused, epoch->fix.air_mps, yaw_rad};
        float mean[PFL_WIND_STATES];
        if (!check(pfl_predict(fork, epoch->t_us + (uint64_t)k * STEP_US, &input), "pfl_predict", i, failure) ||
            !check(pfl_estimate(fork, mean, NULL), "pfl_estimate", i, failure)) {
            return false;
        }
        fused = NULL;
        if (2u * k % AHEAD_STEPS == 0u) {
            place[2u * (2u * k / AHEAD_STEPS - 1u)] = mean[PFL_WIND_X];
            place[2u * (2u * k / AHEAD_STEPS - 1u) + 1u] = mean[PFL_WIND_Y];
        }
    }
    return true;
}

/* Where GPS had the aircraft at a time, between two fixes. */
static void place_at(const wind_study_t *s, size_t i, double t_s, double *x, double *y)
{
    while (i + 1u < s->epochs && s->epoch[i + 1u].t_s < t_s) {
        i++;
    }
    const wind_epoch_t *a = &s->epoch[i];
    const wind_epoch_t *b = i + 1u < s->epochs ? a + 1 : a;
    const double share = b->t_s > a->t_s ? (t_s - a->t_s) / (b->t_s - a->t_s) : 0.0;
    *x = (double)a->fix.x_m + share * (double)(b->fix.x_m - a->fix.x_m);
    *y = (double)a->fix.y_m + share * (double)(b->fix.y_m - a->fix.y_m);
}

bool wind_ahead(wind_filter_t *f, size_t i, wind_ahead_t *ahead, failure_t *failure)
{
    const wind_epoch_t *epoch = &f->study->epoch[i];
    const bool orbits =
        f->study->px4 && !f->study->bootstrap && epoch->t_s >= WIND_LOITER_FROM_S && epoch->t_s <= WIND_LOITER_TO_S;
    float turn[4];
    float orbit[4] = {0.0f};

    if (!fly_turn(f, i, turn, failure) || (orbits && !wind_orbit(f, i, orbit, failure))) {
        return false;
    }
    for (size_t h = 0u; h < 2u; h++) {
        const double span_s = 5.0 * (double)(h + 1u);
        double x;
        double y;
        place_at(f->study, i, epoch->t_s + span_s, &x, &y);
        const double straight = hypot((double)epoch->fix.x_m + span_s * (double)epoch->fix.vx_mps - x,
                                      (double)epoch->fix.y_m + span_s * (double)epoch->fix.vy_mps - y);
        const double turned = hypot((double)turn[2u * h] - x, (double)turn[2u * h + 1u] - y);
        ahead->ahead[h][0] += straight;
        ahead->ahead[h][1] += turned;
        if (orbits) {
            ahead->orbit[h][0] += straight;
            ahead->orbit[h][1] += turned;
            ahead->ahead[h][2] += hypot((double)orbit[2u * h] - x, (double)orbit[2u * h + 1u] - y);
        }
    }
    ahead->aheads += 1.0;
    ahead->orbits += orbits ? 1.0 : 0.0;
    return true;
}
