/* A UAV seen through its autopilot loops, in held wind: models.h has its equations. */
#include "pflight/models.h"

#include "math_kernels.h"
#include "sqrt_kernel.h"

#define PART 16u /* particles at a time: what they need on the way stays on the stack, which is small */

/* Wind over the ground of each particle of a part, held over a step. */
typedef struct {
    float x_mps[PART];
    float y_mps[PART];
} wind_t;

static inline float clip(float x, float lo, float hi)
{
    const float low = (x < lo) ? lo : x;
    return (low > hi) ? hi : low;
}

static void hold_wind(const pfl_autopilot_t *m, const pfl_batch_t *p, wind_t *wind)
{
    const float *restrict gust_x = PFL_NOISE(p, 0);
    const float *restrict gust_y = PFL_NOISE(p, 1);
    for (uint32_t i = 0u; i < p->n; i++) {
        wind->x_mps[i] = m->wind_x_mps + (m->sigma_gust_mps * gust_x[i]);
        wind->y_mps[i] = m->wind_y_mps + (m->sigma_gust_mps * gust_y[i]);
    }
    if (m->wind_state != 0u) {
        const float *restrict x = PFL_STATE(p, m->wind_state);
        const float *restrict y = PFL_STATE(p, m->wind_state + 1u);
        for (uint32_t i = 0u; i < p->n; i++) {
            wind->x_mps[i] += x[i];
            wind->y_mps[i] += y[i];
        }
    }
}

static void walk_wind(const pfl_autopilot_t *m, float dt_s, const pfl_batch_t *p)
{
    if (m->wind_state == 0u) {
        return;
    }
    const float spread = m->wind_walk * pfl_sqrt_kernel(dt_s);
    float *restrict x = PFL_STATE(p, m->wind_state);
    float *restrict y = PFL_STATE(p, m->wind_state + 1u);
    const float *restrict walk_x = PFL_NOISE(p, 2);
    const float *restrict walk_y = PFL_NOISE(p, 3);
    for (uint32_t i = 0u; i < p->n; i++) {
        x[i] += spread * walk_x[i];
        y[i] += spread * walk_y[i];
    }
}

/* The index that a state holds; whatever it holds, one that the route has. */
static uint32_t index_of(float state, uint32_t count)
{
    const float last = (float)(count - 1u);
    const float held = (state > 0.0f) ? state : 0.0f;
    return (uint32_t)(int32_t)(((held < last) ? held : last) + 0.5f);
}

/* Heading error of each particle on the way to its waypoint, after switching. */
static void steer_route(const pfl_autopilot_t *m, const pfl_route_t *route, const pfl_batch_t *p, float *error)
{
    const float *restrict x = PFL_STATE(p, PFL_AUTOPILOT_X);
    const float *restrict y = PFL_STATE(p, PFL_AUTOPILOT_Y);
    const float *restrict heading = PFL_STATE(p, PFL_AUTOPILOT_HEADING);
    float *restrict waypoint = PFL_STATE(p, m->waypoint_state);
    float *restrict out = error;
    float to_x[PART];
    for (uint32_t i = 0u; i < p->n; i++) {
        const uint32_t target = pfl_route_switch(route, index_of(waypoint[i], route->count), x[i], y[i]);
        waypoint[i] = (float)target;
        to_x[i] = route->waypoint[target].x_m - x[i];
        out[i] = route->waypoint[target].y_m - y[i];
    }
    for (uint32_t i = 0u; i < p->n; i++) {
        out[i] = pfl_wrap_pi_kernel(pfl_atan2_kernel(out[i], to_x[i]) - heading[i]);
    }
}

static void steer_heading(float wanted_rad, const pfl_batch_t *p, float *error)
{
    const float *restrict heading = PFL_STATE(p, PFL_AUTOPILOT_HEADING);
    float *restrict out = error;
    for (uint32_t i = 0u; i < p->n; i++) {
        out[i] = wanted_rad - heading[i];
    }
}

/* Position, speed and heading. */
static void move_plane(const pfl_autopilot_t *m, float speed_mps, float dt_s, const pfl_batch_t *p, const wind_t *wind,
                       const float *error)
{
    const float accelerate = dt_s * m->alpha_speed;
    const float alpha_heading = m->alpha_heading;
    const float turn_max = m->turn_max_radps;
    const float slowest = m->speed_min_mps;
    const float fastest = m->speed_max_mps;
    float *restrict x = PFL_STATE(p, PFL_AUTOPILOT_X);
    float *restrict y = PFL_STATE(p, PFL_AUTOPILOT_Y);
    float *restrict speed = PFL_STATE(p, PFL_AUTOPILOT_SPEED);
    float *restrict heading = PFL_STATE(p, PFL_AUTOPILOT_HEADING);
    for (uint32_t i = 0u; i < p->n; i++) {
        float along_x;
        float along_y;
        const float v = speed[i];
        pfl_way_kernel(v, heading[i], &along_x, &along_y);
        x[i] += dt_s * (along_x + wind->x_mps[i]);
        y[i] += dt_s * (along_y + wind->y_mps[i]);
        heading[i] += dt_s * clip(alpha_heading * error[i], -turn_max, turn_max);
        speed[i] = clip(v + (accelerate * (speed_mps - v)), slowest, fastest);
    }
}

static void move_height(const pfl_autopilot_t *m, float height_m, float dt_s, const pfl_batch_t *p)
{
    const float spring = dt_s * m->alpha_height;
    const float damper = dt_s * m->alpha_climb;
    float *restrict height = PFL_STATE(p, PFL_AUTOPILOT_HEIGHT);
    float *restrict climb = PFL_STATE(p, PFL_AUTOPILOT_CLIMB);
    for (uint32_t i = 0u; i < p->n; i++) {
        const float h = height[i];
        const float up = climb[i];
        height[i] = h + (dt_s * up);
        climb[i] = up + ((spring * (height_m - h)) - (damper * up));
    }
}

static void move_part(const pfl_autopilot_t *m, const pfl_autopilot_input_t *wanted, float dt_s, const pfl_batch_t *p)
{
    const uint32_t substeps = (m->substeps > 0u) ? m->substeps : 1u;
    const float step_s = dt_s / (float)substeps;
    wind_t wind;
    float error[PART];
    hold_wind(m, p, &wind);
    for (uint32_t k = 0u; k < substeps; k++) {
        if ((wanted->route != NULL) && (m->waypoint_state != 0u)) {
            steer_route(m, wanted->route, p, error);
        } else {
            steer_heading(wanted->heading_rad + (wanted->turn_radps * ((float)k * step_s)), p, error);
        }
        move_plane(m, wanted->speed_mps, step_s, p, &wind, error);
        move_height(m, wanted->height_m, step_s, p);
    }
    walk_wind(m, dt_s, p);
}

void pfl_autopilot_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    for (uint32_t first = 0u; first < p->n; first += PART) {
        const uint32_t rest = p->n - first;
        const pfl_batch_t part = {p->x + first, p->stride, p->noise + first, p->first + first,
                                  (rest < PART) ? rest : PART};
        move_part((const pfl_autopilot_t *)user, (const pfl_autopilot_input_t *)u, dt_s, &part);
    }
}
