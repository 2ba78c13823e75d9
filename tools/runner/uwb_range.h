/* What the files of the scenario `uwb-range` share: the recordings as one list of ranges, and the filters' results. */
#ifndef RUNNER_UWB_RANGE_H
#define RUNNER_UWB_RANGE_H

#include "scenario.h"

#include "pflight/pflight.h"

#define UWB_ANCHORS_MAX 8u
#define UWB_INDOOR_SETTLING 60u /* ranges that are not scored after a global start */

typedef struct {
    float x_m, y_m;
    float height_m; /* over the tag's plane */
    float bias_m;   /* ranges read long by this */
} uwb_anchor_t;

/* A range, with what is known at its time. */
typedef struct {
    uint64_t t_us; /* from the first range */
    double t_s;    /* the recording's */
    uint32_t anchor;
    float range_m;
    pfl_odometry_input_t odometry; /* indoors */
    double truth_x_m, truth_y_m;   /* for the score only */
} uwb_range_t;

typedef struct {
    bool indoor;
    bool los;         /* outdoors: the line-of-sight recording */
    bool common_bias; /* outdoors: one range bias for all anchors, rather than one each */
    bool online;      /* the biases of the anchors and the wheels are states: nothing is calibrated */
    bool blind;       /* and not even the size of the biases is known */
    bool gaussian;    /* likelihood without tails, to see what they are for */
    uwb_anchor_t anchor[UWB_ANCHORS_MAX];
    uint32_t anchors;
    uwb_range_t *range;
    size_t ranges;
    uint32_t particles;
    uint64_t seed;
} uwb_study_t;

extern const scenario_t uwb_range_scenario;

/* Reads a set of the recordings into ranges and anchors. */
bool uwb_load(uwb_study_t *s, const char *data, const char *set, failure_t *failure);

/* Flies the filter over the ranges: estimates (x, y) after each of them, and the cycles. */
bool uwb_filter(const uwb_study_t *s, uint32_t run, float *estimate, run_output_t *out, failure_t *failure);

/* The same with biases as states. */
bool uwb_online(const uwb_study_t *s, uint32_t run, float *estimate, run_output_t *out, failure_t *failure);

/* Particles anywhere in the ring of the first range, and in the box of the anchors: x, y out of two normals each. */
void uwb_draw_ring(const uwb_study_t *s, float bias_m, const pfl_batch_t *p);
void uwb_draw_box(const uwb_study_t *s, const pfl_batch_t *p);

/* A step of either filter, to be looked at. */
void uwb_show(const uwb_range_t *range, const float *mean, const pfl_t *filter, look_t *look);

/* Metrics of the runs' rmse, p95, max and resampled share. */
enum { UWB_RMSE, UWB_P95, UWB_MAX, UWB_RESAMPLED, UWB_VALUES };
void uwb_judge(const plan_t *plan, table_t runs, verdict_t *verdict);

#endif
