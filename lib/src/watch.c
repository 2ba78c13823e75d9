/* The watch over a filter: which phase it is in, from what its cycles report. health.h tells the phases, filter.h the
 * limits. Everything that decides a phase stands in this file, so no caller needs a hysteresis of its own. */
#include "core.h"

#include "sqrt_kernel.h"

#define CONFIRM_US 1000000u
#define SETTLE_US 1000000u
#define SETTLE_UPDATES 10u
#define LOST_US 5000000u
#define LOST_REJECTS 3u
#define LEAN_RATIO 0.05f
#define LEAN_UPDATES 2u

static uint32_t limit(uint32_t configured, uint32_t standard)
{
    return (configured != 0u) ? configured : standard;
}

static uint64_t since(uint64_t now_us, uint64_t then_us)
{
    return (now_us > then_us) ? (now_us - then_us) : 0u;
}

/* ---- What holds now ------------------------------------------------------------------------------------------- */

static bool sensor_is_stale(const pfl_t *f, uint32_t k)
{
    const uint32_t timeout_us = f->config->sensors[k].timeout_us;
    return (timeout_us != 0u) && (since(f->t_us, f->sensor[k].t_fused_us) > timeout_us);
}

static bool is_stale(const pfl_t *f)
{
    bool stale = false;
    for (uint32_t k = 0u; k < f->config->sensor_count; k++) {
        stale = stale || sensor_is_stale(f, k);
    }
    return stale;
}

static bool is_wide(const pfl_t *f)
{
    const float *ok_sigma = f->config->watch->ok_sigma;
    const float *variance = f->cov;
    bool wide = (ok_sigma != NULL) && (f->moments_current == MOMENTS_OVERFLOWED);
    for (uint32_t d = 0u; (ok_sigma != NULL) && (d < f->config->states); d++) {
        wide = wide || !(pfl_sqrt_kernel(*variance) < ok_sigma[d]);
        variance += f->config->states - d;
    }
    return wide;
}

static void set_mode(pfl_t *f, uint32_t bit, bool on)
{
    f->watched.mode = on ? (f->watched.mode | bit) : (f->watched.mode & ~bit);
}

static bool has_complaint(const pfl_t *f)
{
    const pfl_watched_t *w = &f->watched;
    const uint32_t unusual = PFL_EVENT_OVERRUN | PFL_EVENT_MENDED;
    const bool many_lost = w->quarantined > (f->config->particles / 100u);
    return ((w->fault & ~PFL_FAULT_PORT) != 0u) || (w->reject != 0u) || ((w->event & unusual) != 0u) || many_lost ||
           ((w->mode & (PFL_MODE_STALE | PFL_MODE_WIDE | PFL_MODE_LEAN)) != 0u);
}

/* Are all sensors that could place the cloud anew, those with a redraw, refused or silent? Others may well agree with a
 * cloud in the wrong place: a velocity does not tell where it is. */
static bool is_misplaced(const pfl_t *f, uint32_t rejects)
{
    bool any_against = false;
    for (uint32_t k = 0u; k < f->config->sensor_count; k++) {
        const bool against = f->sensor[k].refused >= rejects;
        if ((f->config->sensors[k].redraw != NULL) && !against && !sensor_is_stale(f, k)) {
            return false;
        }
        any_against = any_against || (against && (f->config->sensors[k].redraw != NULL));
    }
    return any_against;
}

static bool is_lost(const pfl_t *f)
{
    const pfl_watch_t *limits = f->config->watch;
    const uint32_t rejects = limit(limits->lost_rejects, LOST_REJECTS);
    return (f->watched.refused >= rejects) || is_misplaced(f, rejects) ||
           (since(f->t_us, f->t_fused_us) > limit(limits->lost_us, LOST_US));
}

/* ---- Phases --------------------------------------------------------------------------------------------------- */

static void enter(pfl_t *f, pfl_phase_t phase)
{
    f->watched.phase = (uint32_t)phase;
    f->watched.since_us = f->t_us;
    set_mode(f, PFL_MODE_USABLE, (phase == PFL_PHASE_TRACKING) || (phase == PFL_PHASE_DEGRADED));
}

/* A reset must not look better than what made it necessary. */
PFL_NOINLINE static void settle(pfl_t *f)
{
    f->watched.settled = 0u;
    f->watched.refused = 0u;
    for (uint32_t k = 0u; k < f->config->sensor_count; k++) {
        f->sensor[k].refused = 0u;
    }
    enter(f, PFL_PHASE_SETTLING);
}

static void judge_calm(pfl_t *f, bool complaint)
{
    if (complaint) {
        f->watched.since_us = f->t_us; /* calm begins anew */
    } else if (since(f->t_us, f->watched.since_us) >= limit(f->config->watch->confirm_us, CONFIRM_US)) {
        enter(f, PFL_PHASE_TRACKING);
    } else {
        /* calm, but not for long enough */
    }
}

static void judge(pfl_t *f)
{
    pfl_watched_t *w = &f->watched;
    const bool complaint = has_complaint(f);
    if ((w->phase > (uint32_t)PFL_PHASE_INIT) && (w->phase != (uint32_t)PFL_PHASE_LOST) && is_lost(f)) {
        w->ratio_before = pfl_worst_ratio(f);
        w->event |= PFL_EVENT_LOST;
        enter(f, PFL_PHASE_LOST);
        return;
    }
    switch ((pfl_phase_t)w->phase) {
    case PFL_PHASE_CONVERGING:
    case PFL_PHASE_DEGRADED:
        judge_calm(f, complaint);
        break;
    case PFL_PHASE_TRACKING:
        if (complaint) {
            enter(f, PFL_PHASE_DEGRADED);
        }
        break;
    case PFL_PHASE_SETTLING:
        if ((w->settled >= limit(f->config->watch->settle_updates, SETTLE_UPDATES)) ||
            (since(f->t_us, w->since_us) >= SETTLE_US)) {
            enter(f, complaint ? PFL_PHASE_CONVERGING : PFL_PHASE_TRACKING);
        }
        break;
    default: /* INIT, LOST: only a fused measurement or a reset leads out */
        break;
    }
}

/* ---- What the filter tells ------------------------------------------------------------------------------------- */

static void moved(pfl_t *f, uint32_t quarantined)
{
    f->watched.quarantined += quarantined;
    set_mode(f, PFL_MODE_STALE, is_stale(f));
    judge(f);
}

static void fused(pfl_t *f, uint32_t sensor)
{
    pfl_watched_t *w = &f->watched;
    const float configured = f->config->watch->lean_ratio;
    const float lean = ((configured > 0.0f) ? configured : LEAN_RATIO) * (float)f->config->particles;
    w->lean = (f->ess < lean) ? (w->lean + 1u) : 0u;
    w->refused = 0u;
    w->settled++;
    f->sensor[sensor].t_fused_us = f->t_us;
    f->sensor[sensor].test_ratio = f->test_ratio;
    f->sensor[sensor].refused = 0u;
    set_mode(f, PFL_MODE_STALE, is_stale(f));
    set_mode(f, PFL_MODE_LEAN, w->lean >= LEAN_UPDATES);
    if (f->moments_current != MOMENTS_STALE) {
        set_mode(f, PFL_MODE_WIDE, is_wide(f));
    }
    if (w->phase == (uint32_t)PFL_PHASE_INIT) {
        enter(f, PFL_PHASE_CONVERGING);
    } else if (w->phase == (uint32_t)PFL_PHASE_LOST) {
        settle(f);
    } else {
        judge(f);
    }
}

static void refused(pfl_t *f, uint32_t sensor, const void *z)
{
    f->watched.refused++;
    f->sensor[sensor].test_ratio = f->test_ratio;
    f->sensor[sensor].refused++;
    judge(f);
    const bool lost = f->watched.phase == (uint32_t)PFL_PHASE_LOST;
    if (lost && (f->config->watch->reinject > 0.0f) && pfl_reinject(f, sensor, z)) {
        settle(f);
    }
}

static void restarted(pfl_t *f)
{
    if (f->watched.phase == (uint32_t)PFL_PHASE_INIT) {
        return;
    }
    if (f->watched.phase != (uint32_t)PFL_PHASE_LOST) {
        f->watched.ratio_before = pfl_worst_ratio(f);
    }
    settle(f);
}

/* ---- Measurements that stand still, and those that come twice ------------------------------------------------- */

static uint32_t hash_of(const void *z, size_t bytes)
{
    uint32_t hash = 0x811C9DC5u; /* FNV-1a */
    for (size_t k = 0u; k < bytes; k++) {
        hash = (hash ^ ((const unsigned char *)z)[k]) * 0x01000193u;
    }
    return hash;
}

static pfl_status_t admit(pfl_t *f, uint32_t sensor, const void *z)
{
    const pfl_sensor_t *s = &f->config->sensors[sensor];
    pfl_sensor_track_t *track = &f->sensor[sensor];
    if (s->z_bytes == 0u) {
        return PFL_OK;
    }
    const uint32_t content = hash_of(z, s->z_bytes);
    const bool same = (content == track->content) && (track->seen != 0u);
    if (same && (f->t_us == track->t_fused_us)) {
        return PFL_ERR_TIME;
    }
    track->same = same ? (track->same + 1u) : 0u;
    track->content = content;
    track->seen = 1u;
    if ((s->frozen_after == 0u) || (track->same < s->frozen_after)) {
        return PFL_OK;
    }
    f->watched.event |= PFL_EVENT_FROZEN;
    return PFL_REJECTED;
}

pfl_status_t pfl_watch_keep(pfl_t *f, uint32_t what, uint32_t number, const void *z)
{
    switch ((pfl_watch_call_t)what) {
    case WATCH_ADMIT:
        return admit(f, number, z);
    case WATCH_MOVED:
        moved(f, number);
        break;
    case WATCH_FUSED:
        fused(f, number);
        break;
    case WATCH_REFUSED:
        refused(f, number, z);
        break;
    default: /* WATCH_RESET */
        restarted(f);
        break;
    }
    return PFL_OK;
}
