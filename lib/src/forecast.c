/* Copies of a filter, and prediction to a horizon on such a copy. */
#include "guard.h"

static float *moved(const float *p, const pfl_t *from, pfl_t *to)
{
    return (float *)(void *)((unsigned char *)to + ((const unsigned char *)p - (const unsigned char *)from));
}

pfl_status_t pfl_fork(const pfl_t *f, void *arena, size_t arena_bytes, pfl_t **out)
{
    if (out == NULL) {
        return PFL_ERR_ARG;
    }
    *out = NULL;
    const pfl_status_t entered = pfl_enter(f);
    if (entered != PFL_OK) {
        return entered;
    }
    const pfl_config_t *c = f->config;
    const size_t bytes = pfl_arena_bytes(c);
    if ((arena == (const void *)f) || (arena == NULL) || (((uintptr_t)arena & 7u) != 0u) || (arena_bytes < bytes)) {
        return PFL_ERR_MEMORY;
    }
    (void)memcpy(arena, f, bytes);
    pfl_t *copy = (pfl_t *)arena;
    copy->mean = moved(f->mean, f, copy);
    copy->best = moved(f->best, f, copy);
    copy->centre = moved(f->centre, f, copy);
    copy->delta = moved(f->delta, f, copy);
    copy->cov = moved(f->cov, f, copy);
    copy->lanes = moved(f->lanes, f, copy);
    copy->work = moved(f->work, f, copy);
    copy->x = moved(f->x, f, copy);
    copy->log_weight = moved(f->log_weight, f, copy);
    copy->scratch = moved(f->scratch, f, copy);
    copy->kernel_mean = moved(f->kernel_mean, f, copy);
    copy->kernel_cov = moved(f->kernel_cov, f, copy);
    copy->retry = (f->retry != NULL) ? moved(f->retry, f, copy) : NULL;
    copy->sensor = (f->sensor != NULL)
                       ? (pfl_sensor_track_t *)(void *)moved((const float *)(const void *)f->sensor, f, copy)
                       : NULL;
    pfl_rng_long_jump(&copy->rng);
    pfl_guard_start(copy);
    *out = copy;
    return PFL_OK;
}

/* The fork, its cloud with equal weights. */
static pfl_status_t start(const pfl_t *f, void *arena, size_t arena_bytes, const pfl_horizon_t *horizon, bool wants_cov,
                          pfl_t **out)
{
    if ((horizon == NULL) || (horizon->step_us == 0u) || (horizon->steps == 0u)) {
        return PFL_ERR_ARG;
    }
    const pfl_status_t forked = pfl_fork(f, arena, arena_bytes, out);
    if (forked != PFL_OK) {
        return forked;
    }
    const bool has_cov = (*out)->config->moments == (uint16_t)PFL_MOMENTS_FULL;
    return (wants_cov && !has_cov) ? PFL_ERR_CONFIG : pfl_resample(*out);
}

static pfl_status_t look_ahead(pfl_t *copy, const pfl_horizon_t *horizon, uint32_t k, float *mean, float *cov)
{
    const uint64_t t_us = copy->t_us;
    const void *u = (horizon->control != NULL) ? horizon->control(horizon->control_user, k, t_us) : NULL;
    const pfl_status_t predicted = pfl_predict(copy, t_us + horizon->step_us, u);
    pfl_status_t status = (predicted < PFL_OK) ? predicted : pfl_estimate(copy, mean, cov);
    if ((status >= PFL_OK) && (horizon->visit != NULL)) {
        status = horizon->visit(horizon->visit_user, k, copy);
    }
    return (status < PFL_OK) ? status : predicted;
}

pfl_status_t pfl_forecast(const pfl_t *f, void *arena, size_t arena_bytes, const pfl_horizon_t *horizon, float *mean,
                          float *cov, pfl_t **out)
{
    pfl_t *copy = NULL;
    if (out != NULL) {
        *out = NULL;
    }
    pfl_status_t worst = (mean != NULL) ? start(f, arena, arena_bytes, horizon, cov != NULL, &copy) : PFL_ERR_ARG;
    if (worst != PFL_OK) {
        return worst;
    }
    const size_t states = copy->config->states;
    for (uint32_t k = 0u; (k < horizon->steps) && (worst >= PFL_OK); k++) {
        const pfl_status_t status =
            look_ahead(copy, horizon, k, &mean[k * states], (cov != NULL) ? &cov[k * states * states] : NULL);
        worst = (status != PFL_OK) ? status : worst;
    }
    if (out != NULL) {
        *out = copy;
    }
    return worst;
}
