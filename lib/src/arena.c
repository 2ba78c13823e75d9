/* Checks a configuration, carves the arena, and guards the door of every call. */
#include "guard.h"

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

static bool box_is_good(const pfl_config_t *c)
{
    if ((c->lo == NULL) || (c->hi == NULL)) {
        return (c->lo == NULL) && (c->hi == NULL);
    }
    for (uint32_t d = 0u; d < c->states; d++) {
        if (!pfl_is_not_nan(c->lo[d]) || !pfl_is_not_nan(c->hi[d]) || (c->lo[d] >= c->hi[d])) {
            return false;
        }
    }
    return true;
}

/* NaN is none. */
PFL_NOINLINE static bool is_share(float x)
{
    return (x >= 0.0f) && (x <= 1.0f);
}

static bool deviations_are_good(const pfl_config_t *c)
{
    const float *ok_sigma = c->watch->ok_sigma;
    for (uint32_t d = 0u; (ok_sigma != NULL) && (d < c->states); d++) {
        if (!(ok_sigma[d] > 0.0f)) {
            return false;
        }
    }
    return (ok_sigma == NULL) || (c->moments == (uint16_t)PFL_MOMENTS_FULL);
}

static bool watch_is_good(const pfl_config_t *c)
{
    const pfl_watch_t *w = c->watch;
    return (w == NULL) ||
           ((w->keep != NULL) && is_share(w->lean_ratio) && is_share(w->reinject) && deviations_are_good(c));
}

static bool constraint_is_good(const pfl_config_t *c)
{
    const pfl_constraint_t *k = c->constraint;
    return (k == NULL) || ((k->inside != NULL) && (k->project != NULL) && (k->keep != NULL) && (k->tries >= 1u) &&
                           (k->tries <= PFL_TRIES_MAX));
}

static bool kernel_is_good(const pfl_config_t *c)
{
    const pfl_kernel_t *k = c->kernel;
    return (k == NULL) || ((k->move != NULL) && (c->moments == (uint16_t)PFL_MOMENTS_FULL) && (k->width > 0.0f) &&
                           (k->width < 1.0f) && ((k->states_mask >> c->states) == 0u));
}

static bool sizes_are_good(const pfl_config_t *c)
{
    return (c->particles >= 1u) && (c->particles <= PFL_PARTICLES_MAX) && (c->states >= 1u) &&
           (c->states <= PFL_STATES_MAX) && (c->noises <= PFL_NOISES_MAX);
}

static bool choices_are_good(const pfl_config_t *c)
{
    return (c->moments <= (uint16_t)PFL_MOMENTS_MEAN) && ((c->circular_mask >> c->states) == 0u) &&
           ((c->circular_mask == 0u) || (c->circular != NULL)) && is_share(c->ess_ratio);
}

bool pfl_config_is_good(const pfl_config_t *c)
{
    return sizes_are_good(c) && (c->predict != NULL) && choices_are_good(c) && sensors_are_good(c) && box_is_good(c) &&
           constraint_is_good(c) && kernel_is_good(c) && watch_is_good(c);
}

size_t pfl_arena_bytes(const pfl_config_t *config)
{
    if ((config == NULL) || !pfl_config_is_good(config)) {
        return 0u;
    }
    const bool retries = (config->constraint != NULL) && (config->constraint->tries > 1u);
    return PFL_ARENA_BYTES(config->particles, config->states, config->noises) +
           ((PFL_GUARD_CONFIG == 2) ? pfl_config_copy_bytes(config) : 0u) +
           (retries ? PFL_RETRY_BYTES(config->states) : 0u) +
           ((config->watch != NULL) ? PFL_WATCH_BYTES(config->sensor_count) : 0u);
}

pfl_status_t pfl_lay_out(void *arena, size_t arena_bytes, const pfl_config_t *c, pfl_t **out)
{
    const size_t d = c->states;
    const size_t stride = PFL_STRIDE(c->particles);
    if ((arena == NULL) || (((uintptr_t)arena & 7u) != 0u) || (arena_bytes < pfl_arena_bytes(c))) {
        return PFL_ERR_MEMORY;
    }
    memset(arena, 0, pfl_arena_bytes(c));
    pfl_t *f = (pfl_t *)arena;
    float *next = (float *)(void *)((unsigned char *)arena + PFL_CONTROL_BYTES);
    f->config = c;
#if PFL_GUARD_CONFIG == 2
    f->original = c;
#endif
    f->stride = (uint32_t)stride;
    f->mean = next;
    f->best = f->mean + d;
    f->centre = f->best + d;
    f->delta = f->centre + d;
    f->cov = f->delta + d;
    f->kernel_mean = f->cov + ((d * (d + 1u)) / 2u);
    f->kernel_cov = f->kernel_mean + d;
    next += PFL_MOMENT_FLOATS(d);
    f->lanes = next;
    next += PFL_LANE_FLOATS(d);
    f->work = next;
    next += PFL_WORK_FLOATS(d, c->noises);
    f->x = next + PFL_CANARY_FLOATS;
    f->log_weight = f->x + (d * stride);
    f->scratch = f->log_weight + stride + PFL_CANARY_FLOATS;
    next = f->scratch + stride + PFL_CANARY_FLOATS;
    if (c->watch != NULL) {
        f->sensor = (pfl_sensor_track_t *)(void *)next;
        next += PFL_WATCH_BYTES(c->sensor_count) / sizeof(float);
    }
    f->retry = ((c->constraint != NULL) && (c->constraint->tries > 1u)) ? next : NULL;
    *out = f;
    return PFL_OK;
}

pfl_status_t pfl_look(const pfl_t *f)
{
    return (f != NULL) ? pfl_guard_look(f) : PFL_ERR_ARG;
}

pfl_status_t pfl_enter(const pfl_t *f)
{
    const pfl_status_t looked = pfl_look(f);
    return ((looked == PFL_OK) && (f->busy != 0u)) ? PFL_ERR_BUSY : looked;
}

pfl_status_t pfl_begin(pfl_t *f)
{
    if (f == NULL) {
        return PFL_ERR_ARG;
    }
    const pfl_status_t opened = pfl_guard_open(f);
    if (opened != PFL_OK) {
        return opened;
    }
    return (f->busy != 0u) ? pfl_fault(f, PFL_ERR_BUSY) : PFL_OK;
}

pfl_status_t pfl_end(pfl_t *f, pfl_status_t status)
{
    return pfl_guard_close(f, status);
}

void pfl_count(uint32_t *counter, uint32_t more)
{
    *counter = ((UINT32_MAX - *counter) > more) ? (*counter + more) : UINT32_MAX;
}

/* The mask's bit for a status of the fault class. */
/*@ assigns \nothing; */
static uint32_t fault_bit(pfl_status_t status)
{
    switch (status) {
    case PFL_ERR_NONFINITE:
        return PFL_FAULT_NONFINITE;
    case PFL_ERR_LOGLIK:
        return PFL_FAULT_LOGLIK;
    case PFL_ERR_BUDGET:
        return PFL_FAULT_BUDGET;
    case PFL_ERR_BUSY:
        return PFL_FAULT_BUSY;
    case PFL_ERR_CORRUPT:
        return PFL_FAULT_CANARY;
    default:
        return 0u; /* quarantined particles have an event of their own */
    }
}

pfl_status_t pfl_fault(pfl_t *f, pfl_status_t status)
{
    f->watched.fault |= fault_bit(status);
    pfl_count(&f->faulted, 1u);
    pfl_port_fault((int32_t)status);
    return status;
}
