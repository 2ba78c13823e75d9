/* A copy of a configuration and of all that it points to, user data aside: what a filter lives on that is built with
 * -DPFL_GUARD_CONFIG=2. A file of its own, so that the linker leaves it out of all others. */
#include "core.h"

#include <string.h>

/* In this order, then the sensors, then the limits: lo, hi, ok_sigma. */
typedef struct {
    pfl_config_t config;
    pfl_constraint_t constraint;
    pfl_kernel_t kernel;
    pfl_watch_t watch;
} parts_t;

size_t pfl_config_copy_bytes(const pfl_config_t *c)
{
    return PFL_CEIL8(sizeof(parts_t) + ((size_t)c->sensor_count * sizeof(pfl_sensor_t)) +
                     (3u * (size_t)c->states * sizeof(float)));
}

/* All but bytes without a name, which may differ from copy to copy. */
static void copy_config(pfl_config_t *to, const pfl_config_t *from)
{
    (void)memcpy(to, from, offsetof(pfl_config_t, user) + sizeof from->user);
}

static const float *copy_limits(float *to, const float *from, size_t states)
{
    if (from == NULL) {
        return NULL;
    }
    (void)memcpy(to, from, sizeof(float) * states);
    return to;
}

static const pfl_watch_t *copy_watch(pfl_watch_t *to, const pfl_watch_t *from, float *limits, size_t states)
{
    if (from == NULL) {
        return NULL;
    }
    *to = *from;
    to->ok_sigma = copy_limits(limits, from->ok_sigma, states);
    return to;
}

static void copy_sensors(pfl_sensor_t *to, const pfl_config_t *c)
{
    if (c->sensor_count > 0u) {
        (void)memcpy(to, c->sensors, (size_t)c->sensor_count * sizeof *to);
    }
}

const pfl_config_t *pfl_config_copy(const pfl_config_t *c, void *at)
{
    parts_t *parts = (parts_t *)at;
    pfl_sensor_t *sensors = (pfl_sensor_t *)(void *)(parts + 1);
    float *limits = (float *)(void *)(sensors + c->sensor_count);
    const size_t states = c->states;
    (void)memset(at, 0, pfl_config_copy_bytes(c)); /* parts that there are not, too */
    copy_config(&parts->config, c);
    copy_sensors(sensors, c);
    parts->config.sensors = sensors;
    parts->config.lo = copy_limits(limits, c->lo, states);
    parts->config.hi = copy_limits(limits + states, c->hi, states);
    if (c->constraint != NULL) {
        parts->constraint = *c->constraint;
        parts->config.constraint = &parts->constraint;
    }
    if (c->kernel != NULL) {
        parts->kernel = *c->kernel;
        parts->config.kernel = &parts->kernel;
    }
    parts->config.watch = copy_watch(&parts->watch, c->watch, limits + (2u * states), states);
    return &parts->config;
}
