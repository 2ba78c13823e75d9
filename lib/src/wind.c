/* Wind, gusts and position, linear once the airspeed's scale and the yaw's offset are given: wind.h has the equations.
 * One covariance for all particles and both axes, because nothing in it depends on either. */
#include "pflight/wind.h"

#include "math_kernels.h"

#include "pflight/math.h"

/* Where a fix pulls one axis: innovations of position and velocity. */
typedef struct {
    float position;
    float velocity;
} pull_t;

void pfl_wind_start(pfl_wind_t *wind)
{
    for (uint32_t k = 0u; k < PFL_WIND_COV; k++) {
        wind->cov[k] = 0.0f;
    }
    wind->cov[PFL_WIND_PP] = wind->sigma_position_m * wind->sigma_position_m;
    wind->cov[PFL_WIND_WW] = wind->start_wind_mps * wind->start_wind_mps;
    wind->cov[PFL_WIND_GG] = wind->gust_sigma_mps * wind->gust_sigma_mps;
}

void pfl_wind_draw(void *user, const pfl_batch_t *p)
{
    const pfl_wind_t *m = (const pfl_wind_t *)user;
    float *restrict x = PFL_STATE(p, PFL_WIND_X);
    float *restrict y = PFL_STATE(p, PFL_WIND_Y);
    float *restrict scale = PFL_STATE(p, PFL_WIND_SCALE);
    float *restrict offset = PFL_STATE(p, PFL_WIND_OFFSET);
    const float *restrict w_scale = PFL_NOISE(p, PFL_WIND_SCALE);
    const float *restrict w_offset = PFL_NOISE(p, PFL_WIND_OFFSET);
    for (uint32_t i = 0u; i < p->n; i++) {
        x[i] = m->start_x_m;
        y[i] = m->start_y_m;
        scale[i] = 1.0f + (m->start_scale * w_scale[i]);
        offset[i] = m->offset_sigma_rad * w_offset[i];
    }
    for (uint32_t axis = 0u; axis < 2u; axis++) {
        float *restrict wind = PFL_STATE(p, PFL_WIND_X_WIND + (3u * axis));
        float *restrict gust = PFL_STATE(p, PFL_WIND_X_GUST + (3u * axis));
        for (uint32_t i = 0u; i < p->n; i++) {
            wind[i] = 0.0f;
            gust[i] = 0.0f;
        }
    }
}

void pfl_wind_move(pfl_wind_t *wind, float dt_s)
{
    float *c = wind->cov;
    const float keep = pfl_expf(-dt_s / wind->gust_time_s);
    const float gust = wind->gust_sigma_mps * wind->gust_sigma_mps;
    const float pw = c[PFL_WIND_PW] + (dt_s * (c[PFL_WIND_WW] + c[PFL_WIND_WG]));
    const float pg = c[PFL_WIND_PG] + (dt_s * (c[PFL_WIND_WG] + c[PFL_WIND_GG]));
    c[PFL_WIND_PP] += dt_s * ((c[PFL_WIND_PW] + pw) + (c[PFL_WIND_PG] + pg));
    c[PFL_WIND_PW] = pw;
    c[PFL_WIND_PG] = keep * pg;
    c[PFL_WIND_WW] += dt_s * (wind->wind_walk * wind->wind_walk);
    c[PFL_WIND_WG] = keep * c[PFL_WIND_WG];
    c[PFL_WIND_GG] = ((keep * keep) * (c[PFL_WIND_GG] - gust)) + gust;
}

/* The way that the air data tell, per second: the same for one particle as for its neighbours but for two states. */
static inline void through_air(float air_mps, float yaw_rad, float scale, float offset, float *vx, float *vy)
{
    pfl_way_kernel(scale * air_mps, yaw_rad + offset, vx, vy);
}

/* Moves in the fix that the last update weighed by: each particle's means go to where the fix pulls them. */
static void correct(const pfl_wind_t *m, const pfl_wind_fix_t *fix, const pfl_batch_t *p)
{
    const float *restrict scale = PFL_STATE(p, PFL_WIND_SCALE);
    const float *restrict offset = PFL_STATE(p, PFL_WIND_OFFSET);
    for (uint32_t axis = 0u; axis < 2u; axis++) {
        const float measured_m = (axis == 0u) ? fix->x_m : fix->y_m;
        const float measured_mps = (axis == 0u) ? fix->vx_mps : fix->vy_mps;
        const float share_x = (axis == 0u) ? 1.0f : 0.0f;
        float *restrict position = PFL_STATE(p, PFL_WIND_X + (3u * axis));
        float *restrict wind = PFL_STATE(p, PFL_WIND_X_WIND + (3u * axis));
        float *restrict gust = PFL_STATE(p, PFL_WIND_X_GUST + (3u * axis));
        for (uint32_t i = 0u; i < p->n; i++) {
            float vx;
            float vy;
            through_air(fix->air_mps, fix->yaw_rad, scale[i], offset[i], &vx, &vy);
            const float air = (share_x * vx) + ((1.0f - share_x) * vy);
            const float off_m = measured_m - position[i];
            const float off_mps = measured_mps - ((air + wind[i]) + gust[i]);
            position[i] += (m->gain_position[0] * off_m) + (m->gain_velocity[0] * off_mps);
            wind[i] += (m->gain_position[1] * off_m) + (m->gain_velocity[1] * off_mps);
            gust[i] += (m->gain_position[2] * off_m) + (m->gain_velocity[2] * off_mps);
        }
    }
}

static void walk(const pfl_wind_t *m, const pfl_wind_input_t *in, float dt_s, const pfl_batch_t *p)
{
    float *restrict x = PFL_STATE(p, PFL_WIND_X);
    float *restrict y = PFL_STATE(p, PFL_WIND_Y);
    float *restrict scale = PFL_STATE(p, PFL_WIND_SCALE);
    float *restrict offset = PFL_STATE(p, PFL_WIND_OFFSET);
    const float *restrict w_scale = PFL_NOISE(p, 0);
    const float *restrict w_offset = PFL_NOISE(p, 1);
    const float scale_spread = m->scale_walk * pfl_sqrtf(dt_s);
    const float keep = pfl_expf(-dt_s / m->offset_time_s);
    const float offset_spread = m->offset_sigma_rad * pfl_sqrtf(1.0f - (keep * keep));
    const float way = dt_s * in->air_mps;
    for (uint32_t i = 0u; i < p->n; i++) {
        float to_x;
        float to_y;
        scale[i] += scale_spread * w_scale[i];
        offset[i] = (keep * offset[i]) + (offset_spread * w_offset[i]);
        through_air(way, in->yaw_rad, scale[i], offset[i], &to_x, &to_y);
        x[i] += to_x;
        y[i] += to_y;
    }
}

/* Position by wind and gust, which then fades. */
static void drift(const pfl_wind_t *m, float dt_s, const pfl_batch_t *p)
{
    const float keep = pfl_expf(-dt_s / m->gust_time_s);
    for (uint32_t axis = 0u; axis < 2u; axis++) {
        float *restrict position = PFL_STATE(p, PFL_WIND_X + (3u * axis));
        const float *restrict wind = PFL_STATE(p, PFL_WIND_X_WIND + (3u * axis));
        float *restrict gust = PFL_STATE(p, PFL_WIND_X_GUST + (3u * axis));
        for (uint32_t i = 0u; i < p->n; i++) {
            position[i] += dt_s * (wind[i] + gust[i]);
            gust[i] = keep * gust[i];
        }
    }
}

void pfl_wind_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    const pfl_wind_t *m = (const pfl_wind_t *)user;
    const pfl_wind_input_t *in = (const pfl_wind_input_t *)u;
    if (in->fused != NULL) {
        correct(m, in->fused, p);
    }
    drift(m, dt_s, p);
    walk(m, in, dt_s, p);
}

static void pulls(const float *mean, const pfl_wind_fix_t *fix, pull_t *x, pull_t *y)
{
    float vx;
    float vy;
    through_air(fix->air_mps, fix->yaw_rad, mean[PFL_WIND_SCALE], mean[PFL_WIND_OFFSET], &vx, &vy);
    x->position = fix->x_m - mean[PFL_WIND_X];
    y->position = fix->y_m - mean[PFL_WIND_Y];
    x->velocity = fix->vx_mps - ((vx + mean[PFL_WIND_X_WIND]) + mean[PFL_WIND_X_GUST]);
    y->velocity = fix->vy_mps - ((vy + mean[PFL_WIND_Y_WIND]) + mean[PFL_WIND_Y_GUST]);
}

void pfl_wind_weigh(pfl_wind_t *wind, const float *mean, const pfl_wind_fix_t *fix)
{
    const float *c = wind->cov;
    const float seen[3] = {c[PFL_WIND_PW] + c[PFL_WIND_PG], c[PFL_WIND_WW] + c[PFL_WIND_WG],
                           c[PFL_WIND_WG] + c[PFL_WIND_GG]}; /* covariance of each state with wind + gust */
    const float position[3] = {c[PFL_WIND_PP], c[PFL_WIND_PW], c[PFL_WIND_PG]};
    const float sigma = wind->sigma_velocity_mps * fix->widen;
    const float pp = position[0] + (wind->sigma_position_m * wind->sigma_position_m);
    float noise = sigma * sigma;
    pull_t x;
    pull_t y;
    pulls(mean, fix, &x, &y);
    const float miss = (x.velocity * x.velocity) + (y.velocity * y.velocity);
    if (wind->dof > 0.0f) { /* Student's t on two axes is a Gaussian that is this much wider */
        const float ratio = miss / ((seen[1] + seen[2]) + noise);
        const float wider = (wind->dof + ratio) / (wind->dof + 2.0f);
        noise = (wider > 1.0f) ? (noise * wider) : noise;
    }
    const float vv = (seen[1] + seen[2]) + noise;
    const float scale = 1.0f / ((pp * vv) - (seen[0] * seen[0]));
    wind->inverse[0] = vv * scale;
    wind->inverse[1] = -seen[0] * scale;
    wind->inverse[2] = pp * scale;
    for (uint32_t k = 0u; k < 3u; k++) {
        wind->gain_position[k] = (position[k] * wind->inverse[0]) + (seen[k] * wind->inverse[1]);
        wind->gain_velocity[k] = (position[k] * wind->inverse[1]) + (seen[k] * wind->inverse[2]);
    }
}

void pfl_wind_loglik(void *user, const void *z, const pfl_view_t *p, float *ll)
{
    const pfl_wind_t *m = (const pfl_wind_t *)user;
    const pfl_wind_fix_t *fix = (const pfl_wind_fix_t *)z;
    const float *restrict x = PFL_STATE(p, PFL_WIND_X);
    const float *restrict y = PFL_STATE(p, PFL_WIND_Y);
    const float *restrict scale = PFL_STATE(p, PFL_WIND_SCALE);
    const float *restrict offset = PFL_STATE(p, PFL_WIND_OFFSET);
    const float *restrict wind_x = PFL_STATE(p, PFL_WIND_X_WIND);
    const float *restrict gust_x = PFL_STATE(p, PFL_WIND_X_GUST);
    const float *restrict wind_y = PFL_STATE(p, PFL_WIND_Y_WIND);
    const float *restrict gust_y = PFL_STATE(p, PFL_WIND_Y_GUST);
    float *restrict out = ll;
    for (uint32_t i = 0u; i < p->n; i++) {
        float vx;
        float vy;
        through_air(fix->air_mps, fix->yaw_rad, scale[i], offset[i], &vx, &vy);
        const float px = fix->x_m - x[i];
        const float py = fix->y_m - y[i];
        const float ex = fix->vx_mps - ((vx + wind_x[i]) + gust_x[i]);
        const float ey = fix->vy_mps - ((vy + wind_y[i]) + gust_y[i]);
        out[i] = -0.5f * ((m->inverse[0] * ((px * px) + (py * py))) + (m->inverse[2] * ((ex * ex) + (ey * ey)))) -
                 (m->inverse[1] * ((px * ex) + (py * ey)));
    }
}

/* cov - gain (rows of the covariance that the fix sees). */
static void shrink(pfl_wind_t *wind)
{
    const float *c = wind->cov;
    const float position[3] = {c[PFL_WIND_PP], c[PFL_WIND_PW], c[PFL_WIND_PG]};
    const float seen[3] = {c[PFL_WIND_PW] + c[PFL_WIND_PG], c[PFL_WIND_WW] + c[PFL_WIND_WG],
                           c[PFL_WIND_WG] + c[PFL_WIND_GG]};
    uint32_t k = 0u;
    for (uint32_t row = 0u; row < 3u; row++) {
        for (uint32_t column = row; column < 3u; column++) {
            wind->cov[k] -= (wind->gain_position[row] * position[column]) + (wind->gain_velocity[row] * seen[column]);
            k++;
        }
    }
}

void pfl_wind_fuse(pfl_wind_t *wind, float *mean, const pfl_wind_fix_t *fix)
{
    pull_t x;
    pull_t y;
    pulls(mean, fix, &x, &y);
    for (uint32_t k = 0u; k < 3u; k++) {
        mean[PFL_WIND_X + k] += (wind->gain_position[k] * x.position) + (wind->gain_velocity[k] * x.velocity);
        mean[PFL_WIND_Y + k] += (wind->gain_position[k] * y.position) + (wind->gain_velocity[k] * y.velocity);
    }
    shrink(wind);
}
