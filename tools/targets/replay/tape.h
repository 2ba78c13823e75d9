/* The tape: the calls that a scenario makes to the library, in order, with everything that goes in. The host records
 * one while the runner flies a scenario (record/), and an image on another machine plays it to its own library
 * (replay.c), so that every scenario runs there without a line of its own. Nothing but 32-bit words, little-endian:
 * floats as their bits, 16-bit fields widened, 64-bit ones low word first, structures field by field after the tables
 * of types.c, the prior as the particles themselves.
 *
 * What comes out goes to a second file of words, for each call its status and its outputs: equal files, equal bits. */
#ifndef TARGETS_TAPE_H
#define TARGETS_TAPE_H

#include "pflight/pflight.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define TAPE_MAGIC 0x31544650u /* "PFT1" */

/* Words of the header. The host may change all but the magic before a play. */
enum {
    TAPE_HEAD_MAGIC,
    TAPE_HEAD_STEPS,     /* stop before the pfl_predict after this many; 0: play all */
    TAPE_HEAD_ESS_RATIO, /* float: instead of the configuration's; negative: keep it */
    TAPE_HEAD_SHARPEN,   /* float: factor on every sensor's 1/sigma; 1: keep */
    TAPE_HEAD_MIRROR,    /* 1: antithetic noise around the model, instead of normals of its own for every particle */
    TAPE_HEAD_WORDS
};

typedef enum {
    TAPE_END = 0,
    TAPE_INIT,     /* configuration; the particles of the prior follow in batches; -> status */
    TAPE_PREDICT,  /* t_us, u -> status */
    TAPE_UPDATE,   /* sensor, t_us, z -> status */
    TAPE_ESTIMATE, /* 1 with covariance -> status, mean, covariance */
    TAPE_RESAMPLE, /* -> status */
    TAPE_FARTHEST, /* filter (1: the forecast's), x state, y state, x, y -> status, distance */
    TAPE_ESS,      /* -> effective sample size */
    TAPE_FORECAST, /* 1 with covariance, step_us, steps, and for each step as asked for u -> status, means, covs */
    TAPE_STANDOFF, /* guidance, each: its arguments -> status, outputs; see calls.c */
    TAPE_LVFG,
    TAPE_NMPC_SOLVE,
    TAPE_RESET, /* t_us; the particles of the prior follow in batches; -> status */
    TAPE_OPS
} tape_op_t;

/* ---- Structures as fields (types.c) -------------------------------------------------------------------------------- */

typedef enum { FIELD_WORD, FIELD_HALF, FIELD_BOOL, FIELD_INV_SIGMA, FIELD_ROUTE } field_kind_t;

typedef struct {
    uint16_t offset;
    uint8_t kind; /* field_kind_t */
    uint8_t count;
} field_t;

typedef struct {
    const field_t *field;
    uint16_t fields;
    uint16_t size;
} type_t;

#define TAPE_TYPE_MAX 128u /* bytes of the largest structure */
#define TAPE_WAYPOINTS_MAX 16u

/* A callback of the library, with the types of what it gets. Number 0 of each table stands for "none or unknown". */
typedef struct {
    pfl_predict_fn predict;
    const type_t *user;
    const type_t *u; /* null: not used */
} tape_model_t;

typedef struct {
    pfl_loglik_fn loglik;
    const type_t *user;
    const type_t *z; /* null: as many floats as pfl_position_t.count says */
} tape_sensor_t;

typedef struct {
    pfl_project_fn project; /* `inside` is pfl_ring_inside for all */
} tape_project_t;

extern const tape_model_t tape_models[];
extern const uint32_t tape_models_count;
extern const tape_sensor_t tape_sensors[];
extern const uint32_t tape_sensors_count;
extern const tape_project_t tape_projects[];
extern const uint32_t tape_projects_count;

extern const type_t tape_ring, tape_uav, tape_target, tape_standoff, tape_standoff_state, tape_lvfg, tape_command,
    tape_nmpc, tape_nmpc_plan, tape_nmpc_path, tape_nmpc_report;

#endif
