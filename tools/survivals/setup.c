/* How the filters of the aircraft are configured, and their callbacks: the library's models and sensors, each wrapped so
 * that a fault can come in. */
#include "setup.h"

#include "fault.h"

#include "pflight/sensors.h"

#define PI 3.14159265f

static pfl_land_vehicle_t vehicle;
static const pfl_constant_velocity_t target = {.sigma_accel = 2.0f, .sigma_position = 1.5f};
static const pfl_position_t positions[2] = {{.count = 2, .state = {0, 1}, .inv_sigma = {0.5f, 0.5f}},
                                            {.count = 2, .state = {0, 1}, .inv_sigma = {1.0f / 3.0f, 1.0f / 3.0f}}};
static const pfl_position_t components = {.count = 2, .state = {2, 3}, .inv_sigma = {1.0f, 1.0f}};
static const pfl_velocity_t course = {.speed_state = 2, .heading_state = 3, .inv_sigma = 1.0f};

/* ---- Callbacks ---------------------------------------------------------------------------------------------------- */

static void charge(uint32_t particles)
{
    plane.counter.count += fault_callback_cost(particles);
}

static void land_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    pfl_land_vehicle_jitter_predict(user, u, dt_s, p);
    charge(p->n);
    fault_in_predict(p);
}

static void gps_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    pfl_constant_velocity_predict(user, u, dt_s, p);
    charge(p->n);
    fault_in_predict(p);
}

static void first_fix(void *user, const void *z, const pfl_view_t *p, float *ll)
{
    pfl_position_loglik(user, z, p, ll);
    charge(p->n);
    fault_in_loglik(0u, p, ll);
}

static void second_fix(void *user, const void *z, const pfl_view_t *p, float *ll)
{
    pfl_position_loglik(user, z, p, ll);
    charge(p->n);
    fault_in_loglik(1u, p, ll);
}

static void land_velocity(void *user, const void *z, const pfl_view_t *p, float *ll)
{
    pfl_velocity_loglik(user, z, p, ll);
    charge(p->n);
    fault_in_loglik(2u, p, ll);
}

static void gps_velocity(void *user, const void *z, const pfl_view_t *p, float *ll)
{
    pfl_position_loglik(user, z, p, ll);
    charge(p->n);
    fault_in_loglik(2u, p, ll);
}

/* ---- Priors ------------------------------------------------------------------------------------------------------- */

/* What is known without a sensor: home, and how fast such a vehicle goes. */
static void draw_motion(bool land, const pfl_batch_t *p)
{
    for (uint32_t i = 0u; i < p->n; i++) {
        PFL_STATE(p, 2)[i] = (land ? 14.0f : 0.0f) + ((land ? 3.0f : 12.0f) * PFL_NOISE(p, 2)[i]);
        PFL_STATE(p, 3)[i] = (land ? 1.5f : 12.0f) * PFL_NOISE(p, 3)[i];
    }
}

static void draw_at(const float centre[2], float sigma, const pfl_batch_t *p)
{
    for (uint32_t i = 0u; i < p->n; i++) {
        PFL_STATE(p, 0)[i] = centre[0] + (sigma * PFL_NOISE(p, 0)[i]);
        PFL_STATE(p, 1)[i] = centre[1] + (sigma * PFL_NOISE(p, 1)[i]);
    }
}

static const float home[2] = {0.0f, 0.0f};

static void land_draw(void *user, const pfl_batch_t *p)
{
    (void)user;
    draw_at(home, 40.0f, p);
    draw_motion(true, p);
}

static void gps_draw(void *user, const pfl_batch_t *p)
{
    (void)user;
    draw_at(home, 40.0f, p);
    draw_motion(false, p);
}

static void land_redraw(void *user, const void *z, const pfl_batch_t *p)
{
    (void)user;
    draw_at((const float *)z, 2.0f, p);
    draw_motion(true, p);
    for (uint32_t i = 0u; i < p->n; i++) { /* a course may be any by then */
        PFL_STATE(p, 3)[i] = (PI / 1.5f) * PFL_STATE(p, 3)[i];
    }
}

static void gps_redraw(void *user, const void *z, const pfl_batch_t *p)
{
    (void)user;
    draw_at((const float *)z, 2.0f, p);
    draw_motion(false, p);
}

/* ---- Settings ----------------------------------------------------------------------------------------------------- */

static void *parameters(const void *constant)
{
    void *pointer;
    memcpy(&pointer, &constant, sizeof pointer); /* callbacks take a plain pointer, and do not write to these */
    return pointer;
}

static void set_sensors(settings_t *s, const plan_t *plan)
{
    const bool land = plan->kind == WORLD_LAND;
    const pfl_loglik_fn look[SENSORS] = {first_fix, second_fix, land ? land_velocity : gps_velocity};
    const void *user[SENSORS] = {&positions[0], &positions[1],
                                 land ? (const void *)&course : (const void *)&components};
    for (uint32_t k = 0u; k < SENSORS; k++) {
        s->sensors[k].loglik = look[k];
        s->sensors[k].user = parameters(user[k]);
        if (plan->gates) {
            s->sensors[k].gate = 13.8f;
            s->sensors[k].timeout_us = 500000u;
            s->sensors[k].z_bytes = 2u * sizeof(float);
            s->sensors[k].frozen_after = 3u;
        }
    }
    for (uint32_t k = 0u; plan->gates && (k < 2u); k++) {
        s->sensors[k].redraw = land ? land_redraw : gps_redraw;
    }
}

static void set_limits(settings_t *s, bool land)
{
    const float lo[STATES] = {-20000.0f, -20000.0f, land ? 0.5f : -60.0f, land ? -20000.0f : -60.0f};
    const float sigma[STATES] = {5.0f, 5.0f, 3.0f, land ? 0.5f : 3.0f};
    for (uint32_t d = 0u; d < STATES; d++) {
        s->lo[d] = lo[d];
        s->hi[d] = (d == 2u) ? 60.0f : -lo[d];
        s->ok_sigma[d] = sigma[d];
    }
}

void setup_filter(settings_t *s, const plan_t *plan)
{
    const bool land = plan->kind == WORLD_LAND;
    memset(s, 0, sizeof *s);
    vehicle = world_vehicle(1.0 / plan->rate_hz);
    set_sensors(s, plan);
    set_limits(s, land);
    s->watch.ok_sigma = s->ok_sigma;
    s->watch.reinject = 0.3f;
    s->watch.lost_rejects = 10u; /* a second: outliers do not come ten in a row */
    s->watch.keep = pfl_watch_keep;
    pfl_config_t *c = &s->config;
    c->abi = PFL_ABI;
    c->particles = PARTICLES;
    c->states = STATES;
    c->noises = 4u;
    c->sensor_count = SENSORS;
    c->ess_ratio = plan->resample_always ? 1.0f : 0.5f;
    c->seed = 12345u;
    c->budget_cycles = 40000u;
    c->lo = s->lo;
    c->hi = s->hi;
    c->sensors = s->sensors;
    c->watch = plan->gates ? &s->watch : NULL;
    c->predict = land ? land_predict : gps_predict;
    c->draw = land ? land_draw : gps_draw;
    c->user = land ? (void *)&vehicle : parameters(&target);
}

const pfl_config_t *setup_second(void)
{
    static const pfl_sensor_t sensor = {.loglik = pfl_position_loglik};
    static pfl_sensor_t sensors[1];
    static pfl_config_t config;
    sensors[0] = sensor;
    sensors[0].user = parameters(&positions[1]);
    memset(&config, 0, sizeof config);
    config.abi = PFL_ABI;
    config.particles = SECOND_PARTICLES;
    config.states = STATES;
    config.noises = 4u;
    config.sensor_count = 1u;
    config.ess_ratio = 0.5f;
    config.seed = 7u;
    config.sensors = sensors;
    config.predict = pfl_constant_velocity_predict;
    config.draw = gps_draw;
    config.user = parameters(&target);
    return &config;
}
