/* Checks a configuration, carves the arena, and guards the door of every call. */
#include "core.h"

#include "pflight/port.h"

/* The macro that users size their arenas with must cover the block. */
typedef char pfl_control_block_fits[(sizeof(struct pfl) <= PFL_CONTROL_BYTES) ? 1 : -1];

static bool sensors_are_good(const pfl_config_t *c)
{
    if ((c->sensor_count > PFL_SENSORS_MAX) || ((c->sensor_count > 0u) && (c->sensors == NULL))) {
        return false;
    }
    for (uint32_t k = 0u; k < c->sensor_count; k++) {
        const pfl_sensor_t *s = &c->sensors[k];
        if ((s->loglik == NULL) || !pfl_is_finite(s->gate) || (s->gate < 0.0f)) {
            return false;
        }
    }
    return true;
}

static bool is_nan(float x)
{
    return ((uint32_t)pfl_bits(x) & 0x7FFFFFFFu) > 0x7F800000u;
}

static bool box_is_good(const pfl_config_t *c)
{
    if ((c->lo == NULL) || (c->hi == NULL)) {
        return (c->lo == NULL) && (c->hi == NULL);
    }
    for (uint32_t d = 0u; d < c->states; d++) {
        if (is_nan(c->lo[d]) || is_nan(c->hi[d]) || (c->lo[d] >= c->hi[d])) {
            return false;
        }
    }
    return true;
}

bool pfl_config_is_good(const pfl_config_t *c)
{
    const bool sizes = (c->particles >= 1u) && (c->particles <= PFL_PARTICLES_MAX) && (c->states >= 1u) &&
                       (c->states <= PFL_STATES_MAX) && (c->noises <= PFL_NOISES_MAX);
    if (!sizes || (c->predict == NULL) || (c->reserved != 0u)) {
        return false;
    }
    const bool choices = (c->resampling <= (uint16_t)PFL_RESAMPLE_MULTINOMIAL) &&
                         (c->moments <= (uint16_t)PFL_MOMENTS_MEAN) && ((c->circular_mask >> c->states) == 0u);
    const bool ratio = pfl_is_finite(c->ess_ratio) && (c->ess_ratio >= 0.0f) && (c->ess_ratio <= 1.0f);
    return choices && ratio && sensors_are_good(c) && box_is_good(c);
}

pfl_status_t pfl_lay_out(void *arena, size_t arena_bytes, const pfl_config_t *c, pfl_t **out)
{
    const size_t d = c->states;
    const size_t stride = PFL_CEIL8(c->particles);
    if ((arena == NULL) || (((uintptr_t)arena & 7u) != 0u) ||
        (arena_bytes < PFL_ARENA_BYTES(c->particles, c->states, c->noises))) {
        return PFL_ERR_MEMORY;
    }
    memset(arena, 0, PFL_ARENA_BYTES(c->particles, c->states, c->noises));
    pfl_t *f = (pfl_t *)arena;
    float *next = (float *)(void *)((unsigned char *)arena + PFL_CONTROL_BYTES);
    f->config = c;
    f->stride = (uint32_t)stride;
    f->mean = next;
    f->best = f->mean + d;
    f->delta = f->best + d;
    f->cov = f->delta + d;
    next += PFL_MOMENT_FLOATS(d);
    f->lanes = next;
    next += PFL_LANE_FLOATS(d);
    f->work = next;
    next += PFL_WORK_FLOATS(d, c->noises);
    f->x = next;
    f->log_weight = f->x + (d * stride);
    f->scratch = f->log_weight + stride;
    *out = f;
    return PFL_OK;
}

bool pfl_is_alive(const pfl_t *f)
{
    return f->alive == PFL_ALIVE;
}

pfl_status_t pfl_enter(const pfl_t *f)
{
    if (f == NULL) {
        return PFL_ERR_ARG;
    }
    if (!pfl_is_alive(f)) {
        return PFL_ERR_CORRUPT;
    }
    return (f->busy != 0u) ? PFL_ERR_BUSY : PFL_OK;
}

pfl_status_t pfl_fault(pfl_t *f, pfl_status_t status)
{
    f->faulted += (f->faulted < UINT32_MAX) ? 1u : 0u;
    pfl_port_fault((int32_t)status);
    return status;
}
