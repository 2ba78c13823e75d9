/* What a supervisor wants to know of a filter: its phase, four masks, counters, and one record a filter cycle.
 *
 *     INIT -> CONVERGING -> TRACKING <-> DEGRADED -> LOST -> (reset) -> SETTLING -> TRACKING
 *
 * The phase has one owner, the library, and it is judged only where the configuration has a watch (filter.h):
 *   INIT        nothing was fused yet
 *   CONVERGING  measurements are fused, but TRACKING's conditions have not held for confirm_us
 *   TRACKING    every standard deviation below ok_sigma, every sensor with a timeout fresh, no complaint
 *   DEGRADED    still usable, with a complaint: a test ratio > 1, a stale sensor, a lean or wide cloud, more than 1 % of the
 *               particles quarantined, a budget overrun, a fault, or a guard that had to mend something
 *   LOST        lost_rejects measurements in a row refused, or nothing fused for lost_us
 *   SETTLING    after a reset or reinjection, or when a lost filter fuses again: settle_updates fused, or 1 s
 * Test ratios have the meaning and range of MAVLink's ESTIMATOR_STATUS: < 0.5 normal, > 1 rejected. */
#ifndef PFLIGHT_HEALTH_H
#define PFLIGHT_HEALTH_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* The phases, as told above. */
typedef enum {
    PFL_PHASE_INIT = 0,
    PFL_PHASE_CONVERGING = 1,
    PFL_PHASE_TRACKING = 2,
    PFL_PHASE_DEGRADED = 3,
    PFL_PHASE_LOST = 4,
    PFL_PHASE_SETTLING = 5
} pfl_phase_t;

/* FAULT: what went wrong since the filter cycle began (pfl_predict begins it). */
#define PFL_FAULT_CONFIG 0x0001u    /* the configuration's bytes changed: every call answers PFL_ERR_CONFIG */
#define PFL_FAULT_CONTROL 0x0002u   /* the control block was damaged; mended, see EVENT */
#define PFL_FAULT_CANARY 0x0004u    /* something wrote outside its place in the arena */
#define PFL_FAULT_NONFINITE 0x0008u /* a callback gave NaN or infinity */
#define PFL_FAULT_LOGLIK 0x0010u    /* a log-likelihood above zero */
#define PFL_FAULT_BUDGET 0x0020u    /* the cycle budget was spent before a measurement was in */
#define PFL_FAULT_BUSY 0x0040u      /* a callback called its own filter */
#define PFL_FAULT_TIME 0x0080u      /* a time stamp that does not fit, a step too long, a measurement fused before */
#define PFL_FAULT_PORT 0x0100u      /* a budget is set, and the port has no counter that counts */
#define PFL_FAULT_RANDOM 0x0200u    /* a random stream had died; seeded anew */

/* REJECT: bit k is set while the last measurement of sensor k was refused. */

/* MODE: what holds now. */
#define PFL_MODE_USABLE 0x0001u  /* TRACKING or DEGRADED: the estimate may be used */
#define PFL_MODE_STALE 0x0002u   /* a sensor with a timeout has not been fused for that long */
#define PFL_MODE_WIDE 0x0004u    /* a standard deviation is at or above ok_sigma */
#define PFL_MODE_LEAN 0x0008u    /* effective sample size below lean_ratio N, twice running */
#define PFL_MODE_PENDING 0x0010u /* moments and resampling of the last update are put off by the budget */

/* EVENT: what happened since the filter cycle began. */
#define PFL_EVENT_RESAMPLED 0x0001u
#define PFL_EVENT_RESET 0x0002u
#define PFL_EVENT_REINJECTED 0x0004u  /* lost: part of the cloud was drawn anew */
#define PFL_EVENT_QUARANTINED 0x0008u /* particles came out non-finite */
#define PFL_EVENT_OVERRUN 0x0010u     /* the budget of the cycle was spent */
#define PFL_EVENT_DEFERRED 0x0020u    /* moments or resampling put off */
#define PFL_EVENT_MENDED 0x0040u      /* a guard mended something */
#define PFL_EVENT_FROZEN 0x0080u      /* a measurement refused because its content stands still */
#define PFL_EVENT_LOST 0x0100u        /* the phase became LOST */

/* Everything. Counters saturate. */
typedef struct {
    uint64_t t_us;            /* the filter's time */
    uint64_t t_fused_us;      /* time of the last fused measurement */
    float ess;                /* effective sample size at the last update */
    float test_ratio;         /* the worst of the sensors' last ones; -2 max ll / gate; > 1 rejected, < 0.5 normal; 0
                                 without gates. While SETTLING never below what it was before */
    float best_loglik;        /* best log-likelihood of any particle at the last update of a sensor with a gate, or
                                 of any with a watch */
    pfl_phase_t phase;        /* INIT always without a watch */
    uint32_t fault;           /* PFL_FAULT_ */
    uint32_t reject;          /* bit k: sensor k */
    uint32_t mode;            /* PFL_MODE_ */
    uint32_t event;           /* PFL_EVENT_ */
    uint32_t fused;           /* measurements fused */
    uint32_t rejected;        /* measurements answered PFL_REJECTED */
    uint32_t faulted;         /* calls that ended in a fault: non-finite, log-likelihood > 0, budget, self-call */
    uint32_t resampled;       /* resamplings */
    uint32_t quarantined;     /* particles that lost their weight to a non-finite state */
    uint32_t redrawn;         /* draws beyond each particle's first, for the constraint */
    uint32_t projected;       /* particles that the constraint had to project */
    uint32_t resets;          /* resets, reinjections included */
    uint32_t mended;          /* repairs by the guards and by pfl_scrub */
    uint32_t overruns;        /* filter cycles that spent their budget */
    uint32_t cycles_last;     /* counter cycles of the last or current filter cycle; 0 without a counter */
    uint32_t cycles_max;      /* largest cycles_last so far */
    uint32_t cycles_resample; /* part of cycles_last that was resampling */
    bool counter_usable;      /* the port has a cycle counter that counts */
} pfl_health_t;

/* The health of one sensor. Only kept with a watch. */
typedef struct {
    uint64_t t_fused_us; /* last fused; the time of the prior before */
    float test_ratio;    /* of its last measurement */
    uint32_t refused;    /* measurements refused in a row */
    uint32_t same;       /* measurements in a row whose content stood still; 0 without z_bytes */
} pfl_sensor_health_t;

/* One filter cycle in 32 bytes: telemetry, the check of a replay, and the source of a plot. In host byte order. */
typedef struct {
    uint64_t t_us;
    float ess;
    float best_loglik;
    uint32_t active; /* particles */
    uint32_t cycles; /* counter cycles of the cycle */
    uint16_t fault;
    uint16_t event;
    uint16_t reject; /* sensors 0 .. 15 */
    uint8_t state;   /* phase in the low four bits, the four low bits of MODE above */
    uint8_t ratio;   /* worst test ratio in 1/32, 255 for 7.97 and more */
} pfl_record_t;

#ifdef __cplusplus
}
#endif

#endif
