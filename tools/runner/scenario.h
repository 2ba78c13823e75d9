/* What a scenario is to the runner: a name, the settings it takes, and four functions. Everything that the runner
 * does with one (command line, threads, tables, files) needs nothing else. */
#ifndef RUNNER_SCENARIO_H
#define RUNNER_SCENARIO_H

#include "failure.h"
#include "look.h"
#include "stats.h"
#include "text.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define SETTINGS_MAX 16
#define METRICS_MAX 32
#define STUDY_SETS_MAX 4

typedef struct scenario scenario_t;

/* A key of --set. */
typedef struct {
    const char *key;
    const char *choices; /* legal values with | between them, where # stands for a number in lo .. hi ("auto|#,#");
                            a last choice "..." allows several of them, with commas;
                            and a last choice "..." allows several of them, with commas;
                            null: a number in lo .. hi */
    double lo, hi;
    const char *fallback; /* the value without --set */
    const char *meaning;
} setting_t;

/* Everything that decides about the results of one execution of a scenario. */
typedef struct {
    const scenario_t *scenario;
    char filter[32];
    uint32_t particles;
    uint32_t runs;
    uint64_t seed;
    double budget_us;                /* 0: the plan's */
    const char *data;                /* folder of the recordings */
    const char *value[SETTINGS_MAX]; /* of the scenario's settings, in their order; legal */
} study_t;

/* The value of a setting; the key must be one of the scenario's. */
const char *study_value(const study_t *study, const char *key);
bool study_is(const study_t *study, const char *key, const char *value);
double study_number(const study_t *study, const char *key);
/* Position of the value among the setting's choices: they stand in the order of an enumeration of the scenario's. */
unsigned study_choice(const study_t *study, const char *key);

/* A name for the study among those of a campaign, fit for a file: scenario, filter, and what is not as by default but
 * runs and seed. */
#define STUDY_ID_MAX 256
void study_id(const study_t *study, char *id);

/* What `open` makes of a study: constant during the runs, shared by all threads. */
typedef struct {
    void *own;                 /* the scenario's */
    size_t values;             /* figures that each run hands to `judge` */
    size_t cycles;             /* filter cycles of a run; cycle i belongs to row i + 1 of the time series */
    size_t steps;              /* rows of the time series */
    size_t columns;            /* and its columns */
    const char *const *column; /* their names */
    size_t trace_columns;      /* more of them, for the trace of a single run only: truth, measurements, estimates */
    const char *const *trace_column;
    double period_s;           /* time between two rows; row k is at k * period_s, k from 1; 0: they have no period */
    double budget_us;          /* for one filter cycle */
    const char *budget_reason; /* how that comes about: update rate and share of it */
} plan_t;

/* What a particle filter did in a cycle, out of its health; zeros where a scenario does not tell. */
typedef struct {
    float ess;            /* effective sample size of the last update */
    uint32_t resampled;   /* resamplings of this run, so far */
    uint32_t resample_ns; /* part of the cycle's time that was resampling */
} cycle_t;

/* Where a run leaves its results. All arrays are zeroed before. What does not exist in a series is MISSING. */
typedef struct {
    double *value;       /* plan.values */
    double *series;      /* plan.steps x plan.columns, row by row */
    uint32_t *cycles_ns; /* plan.cycles */
    cycle_t *cycle;      /* plan.cycles */
    uint64_t hash;       /* over the filter's estimates, from HASH_START on */
    double *trace;       /* plan.steps x plan.trace_columns, row by row; null unless this run is traced */
    text_t *cloud;       /* for cloud_take (cloud.h); null unless this run is traced */
    look_t *look;        /* for look_take; likewise */
} run_output_t;

/* A line of the table. What does not exist is MISSING. */
typedef struct {
    const char *name;
    figure_t ours;
    double paper;     /* the paper's figure */
    double reference; /* the scenario page's figure for these very settings */
    double lo, hi;    /* the acceptance, both ends included */
} metric_t;

typedef struct {
    metric_t metric[METRICS_MAX];
    char name[METRICS_MAX][32]; /* of those whose name is put together */
    size_t count;
    text_t notes; /* what the reader should know beside the figures: plain lines */
} verdict_t;

/* Adds a metric without paper, reference and acceptance, to be filled in. */
metric_t *verdict_add(verdict_t *verdict, const char *name, figure_t ours);

/* The same, as WHAT_WHOSE: one figure of many filters. */
metric_t *verdict_add_of(verdict_t *verdict, const char *what, const char *whose, figure_t ours);

/* The median of several runs, or the value of a single one. */
metric_t *verdict_add_typical(verdict_t *verdict, const char *name, table_t runs, size_t column);

/* What is accepted of it, both ends included. */
void metric_accept(metric_t *metric, double lo, double hi);

/* One of the studies that `tools/run` alone makes. */
typedef struct {
    const char *filter;
    uint32_t runs;
    const char *set[STUDY_SETS_MAX]; /* "key=value" */
    uint32_t particles;              /* 0: the scenario's */
} campaign_t;

struct scenario {
    const char *name;
    const char *summary;
    const char *filters; /* with | between them; the first is the default */
    uint32_t particles;  /* default number */
    uint32_t runs;       /* default number */
    const setting_t *settings;
    size_t settings_count;
    const campaign_t *campaign;
    size_t campaign_count;
    const char *recordings; /* where they are published; null: needs none */

    /* Reads what the study needs. On failure nothing is left open. */
    bool (*open)(const study_t *study, plan_t *plan, failure_t *failure);
    void (*close)(plan_t *plan);
    /* One Monte Carlo run: a pure function of plan and run number (but for the cycle times). Called by many threads. */
    bool (*run)(const plan_t *plan, uint32_t run, run_output_t *out, failure_t *failure);
    /* Turns the runs' values (plan.values wide) into metrics with references and acceptance. */
    void (*judge)(const plan_t *plan, table_t runs, verdict_t *verdict);
};

/* All scenarios, in the order in which they run. */
extern const scenario_t *const all_scenarios[];
extern const size_t all_scenarios_count;

/* Null when there is none of this name. */
const scenario_t *scenario_find(const char *name);

#endif
