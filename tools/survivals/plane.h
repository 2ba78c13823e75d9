/* The aircraft: a filter, a second one behind it in memory that nothing may reach, and an application round both that
 * does what docs/guide/flags.md says. All that a run can change is one block of memory, so that a run begins by copying
 * an image of it. */
#ifndef SURVIVAL_PLANE_H
#define SURVIVAL_PLANE_H

#include "world.h"

#include "core.h"

#define STATUSES (3u + SENSORS)
#define PARTICLES 100u
#define PARTICLES_MOST 104u
#define COPY_ROOM ((PFL_GUARD_CONFIG == 2) ? 1024u : 0u) /* for the filters' copies of their configurations */
#define ARENA_BYTES (PFL_ARENA_BYTES(PARTICLES_MOST, STATES, 4) + PFL_WATCH_BYTES(SENSORS) + COPY_ROOM)
#define SECOND_PARTICLES 16u
#define SECOND_BYTES (PFL_ARENA_BYTES(SECOND_PARTICLES, 4, 4) + COPY_ROOM)
#define FENCE_BYTES 2048u

/* How the filter is set up. */
typedef struct {
    world_kind_t kind;
    double rate_hz;
    bool gates;           /* gates, watch and redraw; without: a plain filter */
    bool resample_always; /* the dearest flight that is possible without a fault */
} plan_t;

/* The configuration as it lies in RAM; its pointers point into it. */
typedef struct {
    pfl_config_t config;
    pfl_sensor_t sensors[SENSORS];
    pfl_watch_t watch;
    float lo[STATES], hi[STATES], ok_sigma[STATES];
} settings_t;

/* The port's counter. */
typedef struct {
    uint32_t count;
    uint32_t mask;         /* of what a read gives */
    uint32_t step;         /* a read adds this many */
    uint32_t per_particle; /* and a callback that many for each particle */
} counter_t;

/* What one cycle came to. */
typedef struct {
    pfl_status_t status[STATUSES]; /* predict, updates, estimate, restore */
    float mean[STATES];
    float cov[STATES * STATES];
    pfl_health_t health;
    bool healthy;   /* pfl_health answered */
    bool nonfinite; /* some number out of some call was not finite */
} cycle_t;

typedef struct {
    unsigned char fence_before[FENCE_BYTES];
    uint64_t arena[ARENA_BYTES / 8u];
    uint64_t second[SECOND_BYTES / 8u];
    unsigned char fence_behind[FENCE_BYTES];
    settings_t settings;
    settings_t rom; /* nothing damages this one */
    plan_t plan;
    pfl_t *f;
    pfl_t *b;
    counter_t counter;
    uint32_t clock_us;     /* the hardware's clock, 32 bits */
    uint64_t now_us;       /* and what the application makes of it */
    uint64_t second_us;    /* time of the second filter, which no fault touches */
    uint32_t sensors_live; /* bit k: sensor k hands its samples over */
    bool first_twice;      /* sensor 0 hands over each of them twice */
    uint64_t flown_us;     /* time of the last predict */
    uint32_t misfits;      /* predicts in a row that answered a wrong time */
    uint64_t lost_since;   /* 0: not lost */
    uint64_t hash_a;       /* of every estimate so far */
    uint64_t hash_b;
    uint32_t restarts, resets; /* that the application made */
    unsigned char blob[16384]; /* the last snapshot */
    size_t blob_bytes;
} plane_t;

extern plane_t plane;

/* Builds both filters. False when one is refused. */
bool plane_start(const plan_t *plan);

/* One cycle with what the sensors saw. number: of the cycle. */
void plane_cycle(uint32_t number, const instant_t *instant, cycle_t *out);

/* Nobody wrote outside the arenas. */
bool plane_fences_stand(void);

/* Is any complaint to be seen in this cycle? */
bool plane_complains(const cycle_t *cycle);

#endif
