/* The application: it flies the filter, heeds what it answers, and looks at every number that comes out. */
#include "plane.h"

#include "calls.h"

#include "fault.h"
#include "setup.h"

#include "pflight/clock.h"
#include "pflight/port.h"

#include <math.h>
#include <string.h>

#define FENCE 0x5Au
#define HASH_START 0xCBF29CE484222325u
#define SCRUB_CYCLES 10u
#define GAP_MOST_US 6000000u /* a stamp further ahead is not believed until it lasts */
#define MISFITS_MOST 5u
#define LOST_MOST_US 5000000u

plane_t plane;

static const float nothing[1] = {-1.0f};

/* ---- The port ----------------------------------------------------------------------------------------------------- */

uint32_t pfl_port_cycles(void)
{
    plane.counter.count += plane.counter.step;
    return fault_counter(plane.counter.count) & plane.counter.mask;
}

uint32_t pfl_port_cycles_mask(void)
{
    return 0xFFFFFFFFu;
}

uint32_t pfl_port_cycles_hz(void)
{
    return 1000000u;
}

void pfl_port_fault(int32_t status)
{
    (void)status;
}

bool pfl_port_self_test(void)
{
    return true;
}

/* ---- Numbers that come out ------------------------------------------------------------------------------------------ */

static uint64_t mix(uint64_t hash, const float *x, uint32_t n)
{
    for (uint32_t k = 0u; k < n; k++) {
        uint32_t word;
        memcpy(&word, &x[k], sizeof word);
        hash = (hash ^ word) * 0x100000001B3u;
    }
    return hash;
}

static void look(cycle_t *out, const float *x, uint32_t n)
{
    for (uint32_t k = 0u; k < n; k++) {
        out->nonfinite = out->nonfinite || !isfinite(x[k]);
    }
}

static void look_at_answers(const pfl_t *f, cycle_t *out)
{
    float state[STATES];
    pfl_record_t record;
    pfl_sensor_health_t sensor;
    if (pfl_most_likely(f, state) == PFL_OK) {
        look(out, state, STATES);
    }
    if (pfl_last_reset(f, NULL, NULL, state) == PFL_OK) {
        look(out, state, STATES);
    }
    if (pfl_record(f, &record) == PFL_OK) {
        const float numbers[2] = {record.ess, record.best_loglik};
        look(out, numbers, 2u);
    }
    for (uint16_t k = 0u; k < SENSORS; k++) {
        if (pfl_sensor_health(f, k, &sensor) == PFL_OK) {
            look(out, &sensor.test_ratio, 1u);
        }
    }
    const float ess = pfl_effective_sample_size(f);
    look(out, &ess, 1u);
}

/* Dear ones, once a second. */
static void look_further(pfl_t *f, cycle_t *out)
{
    float number;
    if (pfl_quantile(f, 0u, 0.5f, &number) == PFL_OK) {
        look(out, &number, 1u);
    }
    if (pfl_farthest(f, 0u, 1u, 0.0f, 0.0f, &number) == PFL_OK) {
        look(out, &number, 1u);
    }
}

/* ---- Life ----------------------------------------------------------------------------------------------------------- */

static pfl_status_t start_filter(void)
{
    const size_t bytes = pfl_arena_bytes(&plane.settings.config);
    if ((bytes == 0u) || (bytes > ARENA_BYTES)) {
        return PFL_ERR_CONFIG;
    }
    unsigned char *arena =
        (unsigned char *)plane.arena + (ARENA_BYTES - bytes); /* the second filter lies right behind */
    pfl_t *f = NULL;
    const pfl_status_t status = pfl_init(arena, bytes, &plane.settings.config, plane.now_us, &f);
    plane.f = (status == PFL_OK) ? f : NULL;
    plane.flown_us = plane.now_us;
    return status;
}

bool plane_start(const plan_t *plan)
{
    memset(&plane, 0, sizeof plane);
    memset(plane.fence_before, FENCE, sizeof plane.fence_before);
    memset(plane.fence_behind, FENCE, sizeof plane.fence_behind);
    plane.plan = *plan;
    plane.sensors_live = 0xFFFFFFFFu;
    plane.counter.mask = 0xFFFFFFFFu;
    plane.counter.step = 10u;
    plane.counter.per_particle = 30u;
    plane.clock_us = 0xFFFF0000u - 20000000u;
    plane.now_us = plane.clock_us;
    plane.hash_a = HASH_START;
    plane.hash_b = HASH_START;
    setup_filter(&plane.settings, plan);
    plane.rom = plane.settings;
    return (start_filter() == PFL_OK) &&
           (pfl_init(plane.second, sizeof plane.second, setup_second(), 0u, &plane.b) == PFL_OK);
}

bool plane_fences_stand(void)
{
    bool stand = true;
    for (size_t k = 0u; k < FENCE_BYTES; k++) {
        stand = stand && (plane.fence_before[k] == FENCE) && (plane.fence_behind[k] == FENCE);
    }
    return stand;
}

/* ---- What the application does about an answer ---------------------------------------------------------------------- */

/* True when the call is worth a second try. */
static bool heed(pfl_status_t status)
{
    pfl_health_t health;
    if (status == PFL_ERR_CONFIG) {
        plane.settings = plane.rom;
        return true;
    }
    if ((status == PFL_ERR_CORRUPT) && (pfl_health(plane.f, &health) != PFL_OK)) {
        plane.settings = plane.rom;
        plane.restarts++;
        (void)start_filter();
        return plane.f != NULL;
    }
    return false;
}

static void heed_time(pfl_status_t status)
{
    const bool misfit = (status == PFL_ERR_TIME) || (status == PFL_ERR_GAP);
    plane.misfits = misfit ? (plane.misfits + 1u) : 0u;
    if (plane.misfits >= MISFITS_MOST) {
        plane.misfits = 0u;
        plane.resets++;
        plane.flown_us = plane.now_us;
        (void)pfl_reset(plane.f, plane.now_us);
    }
}

static void heed_phase(const cycle_t *cycle)
{
    const bool lost = cycle->healthy && (cycle->health.phase == PFL_PHASE_LOST);
    plane.lost_since = lost ? ((plane.lost_since != 0u) ? plane.lost_since : plane.now_us) : 0u;
    if (lost && ((plane.now_us - plane.lost_since) > LOST_MOST_US)) {
        plane.lost_since = 0u;
        plane.resets++;
        (void)pfl_reset(plane.f, plane.now_us);
    }
}

static pfl_status_t predict_once(const instant_t *instant)
{
    if (plane.now_us > (plane.flown_us + GAP_MOST_US)) {
        return PFL_ERR_GAP;
    }
    const pfl_status_t status = call_predict(plane.f, plane.now_us, &instant->input);
    plane.flown_us = (status >= PFL_OK) ? plane.now_us : plane.flown_us;
    return status;
}

static pfl_status_t predict(const instant_t *instant)
{
    const pfl_status_t status = predict_once(instant);
    return heed(status) ? predict_once(instant) : status;
}

static pfl_status_t update(uint16_t sensor, uint64_t t_us, const float *z)
{
    const pfl_status_t status = call_update(plane.f, sensor, t_us, z);
    return heed(status) ? call_update(plane.f, sensor, t_us, z) : status;
}

static pfl_status_t estimate(cycle_t *out)
{
    const pfl_status_t status = call_estimate(plane.f, out->mean, out->cov);
    return heed(status) ? call_estimate(plane.f, out->mean, out->cov) : status;
}

/* ---- One cycle ------------------------------------------------------------------------------------------------------ */

/* The worse answer of two. */
static void keep(pfl_status_t *kept, pfl_status_t status)
{
    *kept = ((*kept == PFL_OK) || (status < PFL_OK)) ? status : *kept;
}

static void fuse(uint16_t sensor, const instant_t *instant, cycle_t *out)
{
    float z[2] = {instant->sample.z[sensor][0], instant->sample.z[sensor][1]};
    uint64_t t_us = plane.now_us;
    const uint32_t live = (plane.sensors_live >> sensor) & 1u;
    const uint32_t twice = (plane.first_twice && (sensor == 0u)) ? 2u : 1u;
    const uint32_t times = live * twice * fault_sample(sensor, z, &t_us);
    for (uint32_t k = 0u; (k < times) && (plane.f != NULL); k++) {
        keep(&out->status[1u + sensor], update(sensor, t_us, z));
    }
}

static void fly_second(const instant_t *instant, uint64_t t_us)
{
    float mean[STATES] = {0.0f};
    float cov[STATES * STATES] = {0.0f};
    (void)pfl_predict(plane.b, t_us, NULL);
    (void)pfl_update(plane.b, 0u, t_us, instant->sample.z[1]);
    (void)pfl_estimate(plane.b, mean, cov);
    plane.hash_b = mix(mix(plane.hash_b, mean, STATES), cov, STATES * STATES);
}

/* Once a second: repair in idle time, and a snapshot if one is to be damaged, which then comes back. */
static void idle(cycle_t *out)
{
    (void)pfl_scrub(plane.f, NULL);
    look_further(plane.f, out);
    if (!fault_wants_blob()) {
        return;
    }
    plane.blob_bytes = pfl_snapshot_bytes(plane.f);
    if ((plane.blob_bytes <= sizeof plane.blob) && (plane.blob_bytes != 0u) &&
        (pfl_snapshot(plane.f, plane.blob, plane.blob_bytes) == PFL_OK)) {
        size_t bytes = plane.blob_bytes;
        fault_blob(plane.blob, &bytes);
        keep(&out->status[2u + SENSORS], pfl_restore(plane.f, plane.blob, bytes));
    }
}

static void fly(uint32_t number, const instant_t *instant, cycle_t *out)
{
    fault_between_calls(0u);
    out->status[0] = predict(instant);
    heed_time(out->status[0]);
    for (uint16_t k = 0u; (k < SENSORS) && (plane.f != NULL); k++) {
        fault_between_calls(1u + k);
        fuse(k, instant, out);
    }
    fault_between_calls(1u + SENSORS);
    if (plane.f == NULL) {
        return;
    }
    out->status[1u + SENSORS] = estimate(out);
    fault_between_calls(2u + SENSORS);
    if (plane.f == NULL) {
        return;
    }
    look_at_answers(plane.f, out);
    out->healthy = pfl_health(plane.f, &out->health) == PFL_OK;
    const float numbers[3] = {out->health.ess, out->health.test_ratio, out->health.best_loglik};
    look(out, numbers, 3u);
    heed_phase(out);
    if ((number % SCRUB_CYCLES) == 0u) {
        idle(out);
    }
}

void plane_cycle(uint32_t number, const instant_t *instant, cycle_t *out)
{
    const uint32_t dt_us = (uint32_t)(1.0e6 / plane.plan.rate_hz);
    memset(out, 0, sizeof *out);
    for (uint32_t k = 0u; k < STATUSES; k++) {
        out->status[k] = PFL_OK;
    }
    plane.clock_us += dt_us;
    plane.second_us += dt_us;
    fly_second(instant, plane.second_us);
    fault_begin_cycle(number, instant);
    if (fault_asleep()) {
        return;
    }
    plane.now_us = pfl_clock_extend(plane.now_us, fault_clock(plane.clock_us));
    if (plane.f == NULL) {
        plane.settings = plane.rom;
        (void)start_filter();
    }
    if (plane.f != NULL) {
        fly(number, instant, out);
    } else {
        out->status[0] = PFL_ERR_CORRUPT;
    }
    const bool answered = out->status[1u + SENSORS] == PFL_OK;
    plane.hash_a = mix(plane.hash_a, answered ? out->mean : nothing, answered ? STATES : 1u);
    plane.hash_a = mix(plane.hash_a, out->cov, answered ? (STATES * STATES) : 0u);
    look(out, out->mean, STATES);
    look(out, out->cov, STATES * STATES);
}

bool plane_complains(const cycle_t *cycle)
{
    bool complains = !cycle->healthy || (cycle->health.phase != PFL_PHASE_TRACKING) || (cycle->health.fault != 0u) ||
                     (cycle->health.reject != 0u);
    for (uint32_t k = 0u; k < STATUSES; k++) {
        complains = complains || (cycle->status[k] < PFL_OK);
    }
    return complains;
}
