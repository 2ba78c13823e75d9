/* What became of a run: flown with its fault beside the same flight without one. */
#ifndef SURVIVAL_JUDGE_H
#define SURVIVAL_JUDGE_H

#include "fault.h"
#include "plane.h"

#define RATE_HZ 10.0
#define CYCLES 280u
#define WARM 50u        /* cycles before a fault may begin: flown once */
#define FAULT_FIRST 55u /* first cycle that a fault may begin in */
#define FAULT_LAST 85u  /* and the last */
#define RECOVERY 100u   /* cycles that a filter has to recover */
#define WINDOW 50u      /* cycles after them that its error is judged by */
#define LIE_CYCLES 10u  /* a lie lasts for longer */
#define FLIGHTS 16u     /* of each kind, over and over */

typedef enum { CLASS_MASKED, CLASS_RECOVERED, CLASS_FLAGGED, CLASS_SILENT, CLASS_FATAL, CLASSES } class_t;

typedef struct {
    class_t verdict;
    world_kind_t kind;
    bool nonfinite, fence, second; /* why it is fatal: G2, G1, G7 */
    bool lie;                      /* G3 */
    bool late;                     /* no more than 1.5 times the clean error within 10 s: G4 */
    bool usable;                   /* in the last cycle */
    double ratio;                  /* of the error after recovery to the clean one */
} judgement_t;

/* All flights without a fault. False when a filter cannot be built or a clean flight lies. */
bool judge_prepare(void);

double judge_clean_rmse(world_kind_t kind);

/* Draws the fault of a run, and says in which world it strikes. */
world_kind_t judge_draw(uint64_t run_seed);

/* Flies one run; with `trace` tells every cycle. */
judgement_t judge_run(uint64_t run_seed, FILE *trace);

const char *class_name(class_t c);

/* Is some state off by more than five standard deviations, without a complaint? */
bool judge_lies(const cycle_t *cycle, const instant_t *instant);

/* The same of a filter that can make no complaint but by its status. */
bool judge_lies_plainly(const cycle_t *cycle, const instant_t *instant);

/* Square of the distance from the true position; infinity where there was no estimate. */
double judge_square(const cycle_t *cycle, const instant_t *instant);

#endif
