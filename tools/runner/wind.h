/* What the files of the scenario `wind` share: a recorded flight as one list of GPS fixes with their air data. */
#ifndef RUNNER_WIND_H
#define RUNNER_WIND_H

#include "scenario.h"

#include "pflight/pflight.h"

/* A GPS fix and what was measured in the air at its time. */
typedef struct {
    double t_s;
    uint64_t t_us; /* from the first fix */
    pfl_wind_fix_t fix;
    float climb_mps;   /* for the batch fit */
    float turn_radps;  /* mean turn rate of the last second that is known */
    float yaw_now_rad; /* yaw at this time; that of the fix is older, as the fix is */
} wind_epoch_t;

typedef struct {
    bool px4;
    bool bootstrap; /* the plain particle filter on all eight states, for comparison */
    wind_epoch_t *epoch;
    size_t epochs;
    double batch_wind_mps[2]; /* least squares over the whole flight */
    double batch_scale;
    uint32_t particles;
    uint64_t seed;
} wind_study_t;

#define WIND_LAG_S 0.4         /* air data are older than a fix by this: wind_load.c */
#define WIND_LOITER_FROM_S 306 /* the part of the flight around a waypoint: wind_ahead.c */
#define WIND_LOITER_TO_S 474
#define WIND_SETTLING_S 60.0
#define WIND_CHI2_95 5.991 /* of two degrees of freedom */

extern const scenario_t wind_scenario;

bool wind_load(wind_study_t *s, const char *data, failure_t *failure);

/* Everything that one filter needs, here and on looking ahead. */
typedef struct {
    const wind_study_t *study;
    pfl_wind_t wind;
    pfl_config_t config;
    pfl_sensor_t sensor;
    pfl_t *filter;
    void *arena;
    void *spare; /* for looking ahead */
    size_t bytes;
    const pfl_wind_fix_t *fused; /* not moved in yet */
    float mean[PFL_WIND_STATES];
} wind_filter_t;

bool wind_filter_open(wind_filter_t *f, const wind_study_t *s, uint32_t run, failure_t *failure);
void wind_filter_close(wind_filter_t *f);
bool wind_filter_cycle(wind_filter_t *f, size_t i, failure_t *failure);

/* Sums over the looks ahead of a run. */
typedef struct {
    double sum[3]; /* of the errors after 30 and 60 s without GPS; of fixes within the 95 % region */
    double starts;
    double fixes;
    double ahead[2][3]; /* 5 and 10 s ahead: of the errors by straight flight, held turn, waypoint controller */
    double orbit[2][2]; /* straight flight and held turn where the controller is judged */
    double aheads, orbits;
} wind_ahead_t;

/* 60 s without GPS from epoch i on; and 5 and 10 s ahead without any measurement. */
bool wind_outage(wind_filter_t *f, size_t i, wind_ahead_t *ahead, failure_t *failure);
bool wind_ahead(wind_filter_t *f, size_t i, wind_ahead_t *ahead, failure_t *failure);
/* Where the waypoint controller would be after 5 and 10 s: x, y, x, y. */
bool wind_orbit(wind_filter_t *f, size_t i, float *place, failure_t *failure);

enum {
    WIND_RMS,
    WIND_SCALE,
    WIND_END_30,
    WIND_END_60,
    WIND_COVERED,
    WIND_AHEAD,                  /* 5 s: straight, turn; 10 s: the same */
    WIND_ORBIT = WIND_AHEAD + 4, /* 5 s: straight, turn, controller; 10 s: the same */
    WIND_VALUES = WIND_ORBIT + 6
};
void wind_judge(const plan_t *plan, table_t runs, verdict_t *verdict);

#endif
