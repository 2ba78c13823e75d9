/* What the files of the filter share: the control block at the front of the arena, and the steps of a cycle. Private
 * to lib/.
 *
 * Weights. A column of the arena holds log-weights s_i; particle i weighs exp(s_i - s_top), s_top the largest s_i. An
 * update writes the new log-weights to the other weight column ("scratch") and commits by exchanging the two pointers,
 * so a refused update leaves no trace. Every log-likelihood is taken less a little more than PFL_LOGLIK_MAX first: a
 * legal one is then strictly negative, NaN and positive ones stand out in a single integer comparison, and the order of
 * negative floats is the reverse order of their bits. Equal weights, which every resampling leaves, are a flag: an
 * update need not read a column of zeros. The columns are padded to a multiple of eight with particles that weigh
 * nothing: log-weights of minus infinity. */
#ifndef PFL_CORE_H
#define PFL_CORE_H

#include "pflight/filter.h"
#include "pflight/rng.h"

#include "bits.h"

/* The guards' switches: guard.h. */
#ifndef PFL_GUARD_CONFIG
#define PFL_GUARD_CONFIG 1
#endif

#define PFL_COPY_WORDS 112u   /* room for the sealed part of the control block on 64-bit machines */
#define PFL_ALIVE 0x70666C79u /* "pfly": the arena holds a filter */
#define PFL_GROUP 16u         /* particles in the first batch of a predict, which decides whether to go on */

/* A little more than PFL_LOGLIK_MAX, which itself is legal: what remains of a legal log-likelihood is below zero. */
#define PFL_LOGLIK_SHIFT 0.00097656262f

/* Of pfl.moments_current. */
#define MOMENTS_STALE 0u
#define MOMENTS_CURRENT 1u
#define MOMENTS_OVERFLOWED 2u /* beyond single precision; mean and cov hold finite stand-ins */

/* Cycle counting of one filter cycle: differences are taken at every batch, so that a narrow counter may wrap. */
typedef struct {
    uint32_t mask;  /* of the port's counter; 0: none */
    uint32_t since; /* counter at the last difference */
    uint32_t used;  /* counted in this filter cycle */
} pfl_meter_t;

/* What the watch knows of the filter, and the four masks. */
typedef struct {
    uint64_t since_us; /* start of the phase, or of the calm that will end it */
    uint32_t phase;    /* pfl_phase_t */
    uint32_t fault, reject, mode, event;
    uint32_t refused;     /* measurements refused in a row */
    uint32_t lean;        /* updates in a row with a low effective sample size */
    uint32_t settled;     /* measurements fused since the last reset */
    uint32_t quarantined; /* particles, in this filter cycle */
    float best_loglik;
    float ratio_before; /* worst test ratio when the filter was lost or reset */
} pfl_watched_t;

/* What the watch knows of one sensor. */
typedef struct {
    uint64_t t_fused_us;
    float test_ratio;
    uint32_t refused; /* in a row */
    uint32_t content; /* hash of the last measurement */
    uint32_t same;    /* in a row with that content */
    uint32_t seen;    /* content is one of a measurement */
    uint32_t unused;
} pfl_sensor_track_t;

/* In parts, as guard.c looks at them: what the loops over batches live on, what else no callback lives to see changed,
 * what a call changes, and the guard's own. */
struct pfl {
    uint32_t alive;
    uint32_t stride;
    const pfl_config_t *config;
    float *lanes;      /* eight partial sums of each moment; saved particles during a predict */
    float *work;       /* PFL_BATCH x (max(D, Q) + 1) */
    float *x;          /* D columns of `stride` */
    float *log_weight; /* column */
    float *scratch;    /* column */
    float *best;       /* D: state of the most likely particle */
    float *retry;      /* PFL_BATCH x 2 D: a batch before its move, and a new attempt; null without retries */
#if PFL_GUARD_CONFIG == 2
    const pfl_config_t *original; /* the caller's; `config` is the filter's own copy of it */
#endif

    float *mean;                /* D */
    float *centre;              /* D: what moments are taken about */
    float *delta;               /* D: jump of the mean at the last reset */
    float *cov;                 /* D (D + 1) / 2, upper triangle row by row */
    float *kernel_mean;         /* D: mean of the resampled cloud */
    float *kernel_cov;          /* D (D + 1) / 2: its covariance, then the root of it */
    pfl_sensor_track_t *sensor; /* sensor_count; null without a watch */
    uint32_t config_hash, parts_hash, limits_hash;
#if PFL_GUARD_CONFIG == 2
    uint32_t copy_hash;
#endif
    uint64_t t_us;

    uint64_t reset_t_us;
    uint64_t t_fused_us;
    uint32_t busy;       /* 1 inside a callback */
    uint32_t best_index; /* the most likely particle's */
    float log_weight_top;
    float weight_sum; /* of the weights that `scratch` holds, if it does */
    float test_ratio;
    float ess;
    uint32_t weights_equal;      /* every log-weight is 0, whatever the column holds */
    uint32_t scratch_is_weights; /* scratch[i] = weight i, current */
    uint32_t moments_current;    /* mean, cov belong to the filter's time: MOMENTS_ */
    uint32_t resample_pending;   /* put off by the budget */
    pfl_meter_t meter;
    uint32_t fused, rejected, faulted, resampled, quarantined, resets, overruns, mended;
    uint32_t overrun_counted; /* this cycle's overrun is in `overruns` */
    uint32_t cycles_max, cycles_resample;
    uint32_t redrawn, projected;
    pfl_watched_t watched;

    uint32_t seal;                 /* hash of all above, between calls */
    uint32_t open;                 /* during a call */
    uint32_t copy[PFL_COPY_WORDS]; /* of all above, between calls */
    pfl_rng_t rng;                 /* unguarded: any state but zero is as good as any other */
};

/* For the proofs: what pfl_lay_out builds and every later step relies on. */
/*@ logic integer padded{L}(pfl_t *f) = ((f->config->particles + 7) / 8) * 8;
    predicate sized{L}(pfl_t *f) =
      \valid_read(f) && \valid_read(f->config) && \separated(f, f->config) && 1 <= f->config->particles <= PFL_PARTICLES_MAX &&
      padded(f) <= f->stride <= f->config->particles + 8;
    predicate column{L}(float *p, pfl_t *f) = \valid(p + (0 .. f->stride - 1)); */
/* Rows d .. d + more - 1 lie within `all` rows. */
/*@ predicate fits(integer d, integer more, integer all, integer stride) =
      0 <= d * stride && d * stride + more * stride <= all * stride;
    lemma rows: \forall integer d, more, all, stride;
      0 <= d && 0 <= more && d + more <= all && 0 <= stride ==> fits(d, more, all, stride); */

/* Length of a column in whole groups of eight; the rest of its stride is a canary. Proofs take this contract on trust, as
 * they know little of the mask: test/proof/layout.c tries every N. */
/*@ requires sized(f);
    assigns \nothing;
    ensures \result == padded(f) && \result % 8 == 0 && f->config->particles <= \result; */
static inline uint32_t pfl_padded(const pfl_t *f)
{
    return (uint32_t)PFL_CEIL8(f->config->particles);
}

/* arena.c */
bool pfl_config_is_good(const pfl_config_t *c);
pfl_status_t pfl_lay_out(void *arena, size_t arena_bytes, const pfl_config_t *c, pfl_t **out);
pfl_status_t pfl_look(const pfl_t *f);  /* PFL_OK, or why nothing in f may be followed */
pfl_status_t pfl_enter(const pfl_t *f); /* the same for a call that only reads f, but not from within a callback */
pfl_status_t pfl_begin(pfl_t *f);       /* the same for a call that changes f: it ends with pfl_end */
pfl_status_t pfl_end(pfl_t *f, pfl_status_t status);
/* Counts a fault, tells the port, returns the status. */
/*@ requires \valid(f);
    assigns f->faulted, f->watched.fault;
    ensures \result == status && f->faulted >= \old(f->faulted); */
pfl_status_t pfl_fault(pfl_t *f, pfl_status_t status);

/* Adds, and stays at the end of its range. */
/*@ requires \valid(counter);
    assigns *counter;
    ensures *counter == \min(\old(*counter) + more, 0xFFFFFFFF); */
void pfl_count(uint32_t *counter, uint32_t more);

/* config_copy.c: a copy of a configuration and of all that it points to, but for user data; only with PFL_GUARD_CONFIG 2 */
size_t pfl_config_copy_bytes(const pfl_config_t *c);
const pfl_config_t *pfl_config_copy(const pfl_config_t *c, void *at);

/* predict.c */
uint32_t pfl_quarantine(pfl_t *f, uint32_t first, uint32_t n);
void pfl_make_noise(pfl_t *f, uint32_t columns, uint32_t n);
void pfl_clip_to_box(pfl_t *f, uint32_t first, uint32_t n);
pfl_batch_t pfl_batch_at(pfl_t *f, uint32_t first, uint32_t n);
uint32_t pfl_count_nonfinite(const pfl_t *f, uint32_t first, uint32_t n);
pfl_status_t pfl_propagate(pfl_t *f, uint32_t dt_us, const void *u);

/* filter.c */
pfl_status_t pfl_draw_prior(pfl_t *f);

/* weights.c: the two passes of an update */
typedef struct {
    uint32_t gated;     /* the best log-likelihood is wanted */
    int32_t worst_bits; /* largest bits of any log-likelihood: tells a NaN or a positive one */
    int32_t best_bits;  /* smallest: the best log-likelihood */
    int32_t top_bits;   /* smallest bits of the new log-weights: the largest log-weight */
    uint32_t top_first; /* batch that holds it */
} pfl_weigh_t;
void pfl_weigh_start(pfl_weigh_t *w, bool gated);
void pfl_weigh_batch(const pfl_t *f, uint32_t first, uint32_t n, const float *ll, pfl_weigh_t *w); /* into scratch */
void pfl_weights_equal(pfl_t *f);
/* Before the column of log-weights is read or changed: it holds them from now on. */
/*@ requires sized(f) && column(f->log_weight, f) && \valid(f);
    assigns f->log_weight[0 .. f->stride - 1], f->weights_equal; */
void pfl_weights_settle(pfl_t *f);
void pfl_weights_after_loss(pfl_t *f); /* some particles lost theirs: a new top, or equal ones if none is left */

/* moments.c */
void pfl_set_best(pfl_t *f, uint32_t first);
bool pfl_moments(pfl_t *f, bool budgeted);                 /* false: the budget ran out first */
void pfl_cloud_moments(pfl_t *f, float *mean, float *cov); /* elsewhere than into the cache */
void pfl_refresh(pfl_t *f); /* moments for the filter's time, where the cached ones are older */
void pfl_weights(pfl_t *f); /* only the weights, into the scratch column, where they are not there */

/* resample.c */
void pfl_resample_now(pfl_t *f);
bool pfl_resample_is_due(const pfl_t *f);

/* watch.c, by way of the configuration: what it is told */
typedef enum {
    WATCH_ADMIT,   /* is measurement z of sensor `number` news? PFL_OK, PFL_ERR_TIME, PFL_REJECTED */
    WATCH_MOVED,   /* a predict ended, `number` particles quarantined */
    WATCH_FUSED,   /* a measurement of sensor `number` */
    WATCH_REFUSED, /* z of sensor `number` */
    WATCH_RESET
} pfl_watch_call_t;

static inline pfl_status_t pfl_watch_tell(pfl_t *f, pfl_watch_call_t what, uint32_t number, const void *z)
{
    return (f->config->watch != NULL) ? f->config->watch->keep(f, (uint32_t)what, number, z) : PFL_OK;
}

/* health.c */
float pfl_worst_ratio(const pfl_t *f); /* of the sensors' test ratios */

/* scrub.c */
uint32_t pfl_mend_log_weights(pfl_t *f); /* such as no update can have written count as no weight; how many */
bool pfl_revive_random(pfl_t *f);        /* seeds dead streams anew; true when there were such */

/* reset.c */
bool pfl_reinject(pfl_t *f, uint32_t sensor, const void *z);

/* meter.c */
void pfl_meter_begin(pfl_t *f);    /* of a filter cycle */
void pfl_meter_resume(pfl_t *f);   /* at the start of a call */
void pfl_meter_pause(pfl_t *f);    /* at its end: brings the health up to date */
uint32_t pfl_meter_read(pfl_t *f); /* cycles used so far */
/* With a budget: has it run out? Counts an overrun once a cycle, and only then. */
/*@ requires \valid(f) && \valid_read(f->config) && \separated(f, f->config);
    assigns f->meter.used, f->meter.since, f->overruns, f->overrun_counted, f->watched.event;
    ensures \result ==> f->meter.used > f->config->budget_cycles && f->overrun_counted != 0;
    ensures \old(f->overruns) <= f->overruns <= \old(f->overruns) + 1;
    ensures \old(f->overrun_counted) != 0 || !\result ==> f->overruns == \old(f->overruns); */
bool pfl_meter_is_over(pfl_t *f);

/*@ requires \valid(f) && \valid_read(f->config) && \separated(f, f->config);
    assigns f->meter.used, f->meter.since, f->overruns, f->overrun_counted, f->watched.event;
    ensures \old(f->overruns) <= f->overruns <= \old(f->overruns) + 1; */
static inline bool pfl_meter_spent(pfl_t *f)
{
    return (f->config->budget_cycles != 0u) && pfl_meter_is_over(f);
}

#endif
