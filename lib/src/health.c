/* What a filter tells of its health: everything, one sensor, and the record of a filter cycle. */
#include "guard.h"

typedef char pfl_record_has_32_bytes[(sizeof(pfl_record_t) == 32u) ? 1 : -1];

static uint32_t mode_of(const pfl_t *f)
{
    return f->watched.mode | ((f->resample_pending != 0u) ? PFL_MODE_PENDING : 0u);
}

float pfl_worst_ratio(const pfl_t *f)
{
    float worst = f->test_ratio;
    for (uint32_t k = 0u; (f->sensor != NULL) && (k < f->config->sensor_count); k++) {
        const float ratio = f->sensor[k].test_ratio;
        worst = (pfl_is_finite(ratio) && (ratio > worst)) ? ratio : worst;
    }
    const bool settling = f->watched.phase == (uint32_t)PFL_PHASE_SETTLING;
    return (settling && (worst < f->watched.ratio_before)) ? f->watched.ratio_before : worst;
}

pfl_status_t pfl_health(const pfl_t *f, pfl_health_t *out)
{
    const pfl_status_t looked = (out != NULL) ? pfl_look(f) : PFL_ERR_ARG;
    const bool known =
        looked == PFL_OK; /* how many sensors there are; the rest is told whatever the configuration is */
    if (!known && (looked != PFL_ERR_CONFIG)) {
        return looked;
    }
    memset(out, 0, sizeof *out);
    out->t_us = f->t_us;
    out->t_fused_us = f->t_fused_us;
    out->ess = f->ess;
    out->test_ratio = known ? pfl_worst_ratio(f) : f->test_ratio;
    out->best_loglik = f->watched.best_loglik;
    out->phase = (pfl_phase_t)f->watched.phase;
    out->fault = f->watched.fault | (known ? 0u : PFL_FAULT_CONFIG);
    out->reject = f->watched.reject;
    out->mode = mode_of(f);
    out->event = f->watched.event;
    out->fused = f->fused;
    out->rejected = f->rejected;
    out->faulted = f->faulted;
    out->resampled = f->resampled;
    out->quarantined = f->quarantined;
    out->redrawn = f->redrawn;
    out->projected = f->projected;
    out->resets = f->resets;
    out->mended = f->mended;
    out->overruns = f->overruns;
    out->cycles_last = f->meter.used;
    out->cycles_max = f->cycles_max;
    out->cycles_resample = f->cycles_resample;
    out->counter_usable = f->meter.mask != 0u;
    return PFL_OK;
}

pfl_status_t pfl_sensor_health(const pfl_t *f, uint16_t sensor, pfl_sensor_health_t *out)
{
    const pfl_status_t entered = (out != NULL) ? pfl_enter(f) : PFL_ERR_ARG;
    if (entered != PFL_OK) {
        return entered;
    }
    if (sensor >= f->config->sensor_count) {
        return PFL_ERR_SENSOR;
    }
    if (f->sensor == NULL) {
        return PFL_ERR_CONFIG;
    }
    const pfl_sensor_track_t *track = &f->sensor[sensor];
    const float ratio = pfl_is_finite(track->test_ratio) ? track->test_ratio : FLT_MAX;
    const pfl_sensor_health_t health = {track->t_fused_us, ratio, track->refused, track->same};
    *out = health;
    return PFL_OK;
}

pfl_status_t pfl_record(const pfl_t *f, pfl_record_t *out)
{
    const pfl_status_t entered = (out != NULL) ? pfl_enter(f) : PFL_ERR_ARG;
    if (entered != PFL_OK) {
        return entered;
    }
    const float ratio = pfl_worst_ratio(f) * 32.0f;
    out->t_us = f->t_us;
    out->ess = f->ess;
    out->best_loglik = f->watched.best_loglik;
    out->active = f->config->particles;
    out->cycles = f->meter.used;
    out->fault = (uint16_t)f->watched.fault;
    out->event = (uint16_t)f->watched.event;
    out->reject = (uint16_t)(f->watched.reject & 0xFFFFu);
    out->state = (uint8_t)((f->watched.phase & 0xFu) | ((mode_of(f) & 0xFu) << 4));
    const uint32_t whole = ((ratio >= 0.0f) && (ratio < 255.0f)) ? (uint32_t)ratio : 255u;
    out->ratio = (uint8_t)whole;
    return PFL_OK;
}
