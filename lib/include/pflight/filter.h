/* The particle filter: configuration, callbacks and every call on a filter. This header is the manual.
 *
 *     x_k = f(x_{k-1}, u_k, w_k)      your predict callback, w_k standard normal and supplied by the library
 *     log p(z_k | x_k)                your sensors' log-likelihood callbacks
 *
 * A filter cycle is one pfl_predict to the time of the measurements and one pfl_update for each of them. All memory
 * is one arena that the caller owns. Nothing here allocates, locks, waits, recurses or keeps state outside the
 * arena. A filter belongs to one thread at a time; two filters never share anything. With the same configuration,
 * seed and calls, every build computes the same bits (strict IEEE single precision; pfl_self_test checks it).
 *
 * N particles, D states, Q noises below; PFL_BATCH is the batch length. */
#ifndef PFLIGHT_FILTER_H
#define PFLIGHT_FILTER_H

#include "pflight/health.h"
#include "pflight/status.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define PFL_ABI 0x70660003u          /* write it into pfl_config_t.abi */
#define PFL_BATCH 128u               /* particles in one callback, at most */
#define PFL_PARTICLES_MAX 1048576u   /* N */
#define PFL_STATES_MAX 16u           /* D */
#define PFL_NOISES_MAX 16u           /* Q */
#define PFL_SENSORS_MAX 32u          /* sensors of one filter */
#define PFL_SUBSTEPS_MAX 16u         /* pieces into which pfl_predict cuts a long step */
#define PFL_LOGLIK_MAX 0.0009765625f /* rounding slack above zero that a log-likelihood may have */

/* ---- Memory ------------------------------------------------------------------------------------------------- */

/* Parts of PFL_ARENA_BYTES. */
#define PFL_CEIL8(n) ((((size_t)(n)) + 7u) & ~(size_t)7u)
#define PFL_MAX(a, b) (((a) > (b)) ? (a) : (b))
#define PFL_CONTROL_BYTES 1088u /* room for the control block and its copy, checked when the library is compiled */
#define PFL_CANARY_FLOATS 8u
#define PFL_STRIDE(n) PFL_CEIL8((size_t)(n) + 1u) /* floats of a column: one canary at least */
#define PFL_MOMENT_FLOATS(d) (PFL_CEIL8((5u * (size_t)(d)) + ((size_t)(d) * ((size_t)(d) + 1u))))
#define PFL_LANE_FLOATS(d) (8u * (2u + (3u * (size_t)(d)) + (((size_t)(d) * ((size_t)(d) + 1u)) / 2u)))
#define PFL_WORK_FLOATS(d, q) ((size_t)PFL_BATCH * ((size_t)PFL_MAX(d, q) + 1u))

/* Bytes of arena for N particles, D states and Q noises: an integer constant expression, exact.
 * About 4 (D + 2) bytes a particle, and 256 (max(D, Q) + 1) of workspace. */
#define PFL_ARENA_BYTES(n, d, q)                                                                                       \
    ((size_t)PFL_CONTROL_BYTES + (4u * (PFL_MOMENT_FLOATS(d) + PFL_LANE_FLOATS(d) + PFL_WORK_FLOATS(d, q) +            \
                                        (PFL_STRIDE(n) * ((size_t)(d) + 2u)) + (3u * PFL_CANARY_FLOATS))))

/* Defines a static arena: PFL_ARENA(name, N, D, Q); pass `&name` and `sizeof name` to pfl_init. */
#define PFL_ARENA(name, n, d, q)                                                                                       \
    static union {                                                                                                     \
        uint64_t align;                                                                                                \
        unsigned char bytes[PFL_ARENA_BYTES(n, d, q)];                                                                 \
    } name

/* ---- Callbacks ---------------------------------------------------------------------------------------------- */

/* Particles first .. first+n-1, to be changed. State d of particle i (0 <= i < n) is x[d * stride + i]; its noise
 * column q is noise[q * PFL_BATCH + i], independent standard normals. Valid during the call only. */
typedef struct {
    float *x;
    size_t stride;
    const float *noise;
    uint32_t first;
    uint32_t n;
} pfl_batch_t;

/* The same particles, to be read. */
typedef struct {
    const float *x;
    size_t stride;
    uint32_t first;
    uint32_t n;
} pfl_view_t;

/* Column d of a batch or view; noise column q of a batch. */
#define PFL_STATE(batch, d) ((batch)->x + ((size_t)(d) * (batch)->stride))
#define PFL_NOISE(batch, q) ((batch)->noise + ((size_t)(q)*PFL_BATCH))

/* x <- f(x, u, w, dt). Pure: the result depends on its arguments and *user only, for each particle by itself. `u` is
 * the caller's pointer from pfl_predict. Q noise columns. Called about N / PFL_BATCH times a step. */
typedef void (*pfl_predict_fn)(void *user, const void *u, float dt_s, const pfl_batch_t *particles);

/* ll[i] <- log p(z | x_i), less its largest possible value: 0 is a perfect match, -INFINITY is impossible, a value
 * above PFL_LOGLIK_MAX a fault. Pure, as above; writes ll[0 .. n-1] only. `z` is the caller's pointer from
 * pfl_update, `user` the sensor's. */
typedef void (*pfl_loglik_fn)(void *user, const void *z, const pfl_view_t *particles, float *ll);

/* Draws particles from the prior: sets every state, from D noise columns. Used by pfl_init and pfl_reset. */
typedef void (*pfl_draw_fn)(void *user, const pfl_batch_t *particles);

/* Draws particles that agree with a measurement (position from a fix, speed from the prior): sets every state, from D
 * noise columns. */
typedef void (*pfl_redraw_fn)(void *user, const void *z, const pfl_batch_t *particles);

/* ---- Configuration ------------------------------------------------------------------------------------------ */

/* One kind of measurement. */
typedef struct {
    pfl_loglik_fn loglik;  /* not null */
    void *user;            /* handed to loglik; null: the configuration's */
    pfl_redraw_fn redraw;  /* draws particles that agree with z, for reinjection; null: the configuration's draw */
    float gate;            /* refuse when -2 max_i ll_i > gate (a chi-square quantile for the measurement's dimension:
                             11.3 for 3 at 99 %); 0: no gate. Finite, >= 0 */
    uint32_t timeout_us;   /* with a watch: not fused for longer than this is stale, and degrades; 0: never */
    uint16_t z_bytes;      /* with a watch: size of *z, so that a measurement whose content stands still or comes twice
                              is seen; 0: not looked at */
    uint16_t frozen_after; /* refuse the same content from this repetition on; 0: never */
    uint32_t unused;       /* 0: the guards look at every byte, so every byte has a name */
} pfl_sensor_t;

/* Which moments are computed after each update. */
typedef enum {
    PFL_MOMENTS_FULL = 0, /* weighted mean and covariance */
    PFL_MOMENTS_MEAN = 1  /* weighted mean only: cheaper */
} pfl_moments_t;

/* A filter; it lives at the front of its arena. */
typedef struct pfl pfl_t;

/* How offspring are chosen; all four are unbiased and exact in integers. Systematic is the cheapest and as accurate as
 * any; with multinomial the same error costs up to half as much again (measured: docs/tuning.md). */
typedef void (*pfl_scheme_fn)(pfl_t *f);

/* Not to be called, but to be named in pfl_config_t.resampling: so the linker takes along only what a filter uses. */
void pfl_systematic(pfl_t *f);  /* one random number, evenly spaced points (Kitagawa 1996); O(N) */
void pfl_stratified(pfl_t *f);  /* one random number in each of N strata (Kitagawa 1996); O(N) */
void pfl_residual(pfl_t *f);    /* floor(N w) copies, the rest multinomial (Liu and Chen 1998); O(N log N) */
void pfl_multinomial(pfl_t *f); /* N independent draws (Gordon, Salmond and Smith 1993); O(N log N) */

/* Averages angles on the circle. To be named in pfl_config_t.circular, as above. */
void pfl_circular_means(pfl_t *f, uint32_t first, uint32_t n);

/* inside[i] <- 1 where particle i is allowed, 0 where not. Pure; writes inside[0 .. n-1] only. */
typedef void (*pfl_inside_fn)(void *user, const pfl_view_t *particles, uint32_t *inside);

/* Brings particles that are outside to an allowed state, and leaves the others as they are. */
typedef void (*pfl_project_fn)(void *user, const pfl_batch_t *particles);

/* Keeps particles where the target can be (a road, above ground) by acceptance-rejection with a bound: a particle that
 * a predict moved outside gets its noise drawn anew, `tries` draws in all; what is outside then is projected. A loop
 * until everything is inside, as in the literature, need not end. */
typedef struct {
    pfl_inside_fn inside;   /* not null */
    pfl_project_fn project; /* not null */
    void *user;             /* handed to both; null: the configuration's */
    uint32_t tries;  /* 1 .. PFL_TRIES_MAX; 1 is constant time. More than 1 needs PFL_RETRY_BYTES(D) more arena */
    uint32_t unused; /* 0 */
    void (*keep)(pfl_t *f, const void *u, float dt_s, uint32_t first, uint32_t n); /* pfl_constraint_keep */
} pfl_constraint_t;

/* What does it. Not to be called, but to be named in pfl_constraint_t.keep: so the linker takes it along only for
 * filters that have a constraint. */
void pfl_constraint_keep(pfl_t *f, const void *u, float dt_s, uint32_t first, uint32_t n);

#define PFL_TRIES_MAX 256u
/* More arena for a constraint with tries > 1. */
#define PFL_RETRY_BYTES(d) (8u * (size_t)PFL_BATCH * (size_t)(d))

/* After each resampling, moves the copies apart without changing mean and covariance of the cloud (West 1993; Liu and
 * West 2001): x <- a x + (1 - a) mean + b L n, a^2 + b^2 = 1, L L' the covariance of the resampled particles. For
 * models whose own noise does not separate copies: parameters, biases, no noise at all. Needs PFL_MOMENTS_FULL. A cloud
 * whose covariance overflows stays as it is.
 * O(N D^2) in a step that resamples. */
typedef struct {
    float width;            /* b, 0 < b < 1; 0.1 .. 0.5 usual */
    uint32_t states_mask;   /* bit d set: state d takes part; 0: all do */
    void (*move)(pfl_t *f); /* pfl_kernel_move */
} pfl_kernel_t;

/* What does it. Not to be called, but to be named in pfl_kernel_t.move, as above. */
void pfl_kernel_move(pfl_t *f);

/* Judges the filter's phase (health.h). A zero takes the value in brackets. Needs PFL_WATCH_BYTES(sensors) more arena. */
typedef struct {
    const float *ok_sigma;   /* D standard deviations, in the states' units, that TRACKING stays below; infinity: any.
                                Needs PFL_MOMENTS_FULL. null: none is judged */
    uint32_t confirm_us;     /* how long TRACKING's conditions hold before it begins [1 s] */
    uint32_t lost_us;        /* nothing fused for that long: LOST [5 s] */
    uint16_t lost_rejects;   /* measurements refused in a row: LOST [3] */
    uint16_t settle_updates; /* fused measurements that end SETTLING, or 1 s [10] */
    float lean_ratio;        /* an effective sample size below this share of N, twice running, degrades [0.05] */
    float reinject;          /* when LOST, and a measurement is refused again: the share of the particles that is drawn
                                anew, by the sensor's redraw or the configuration's draw, 0 .. 1; 0: never. It then
                                waits for lost_rejects refusals more */
    uint32_t unused;         /* 0 */
    pfl_status_t (*keep)(pfl_t *f, uint32_t what, uint32_t number, const void *z); /* pfl_watch_keep */
} pfl_watch_t;

/* What does it. Not to be called, but to be named in pfl_watch_t.keep, as above. */
pfl_status_t pfl_watch_keep(pfl_t *f, uint32_t what, uint32_t number, const void *z);

/* More arena for a watch. */
#define PFL_WATCH_BYTES(sensors) (32u * (size_t)(sensors))

/* What is worth choosing, measured: docs/tuning.md. An ess_ratio of 0.5 is best or near it nearly everywhere;
 * pflight/antithetic.h and pflight/proposal.h reach the same error for fewer instructions.
 *
 * Constant while the filter lives; may be in flash. A zeroed field means what its comment says. */
typedef struct {
    uint32_t abi;           /* PFL_ABI */
    uint32_t particles;     /* N, 1 .. PFL_PARTICLES_MAX */
    uint16_t states;        /* D, 1 .. PFL_STATES_MAX */
    uint16_t noises;        /* Q, 0 .. PFL_NOISES_MAX */
    uint16_t sensor_count;  /* 0 .. PFL_SENSORS_MAX */
    uint16_t moments;       /* pfl_moments_t */
    uint32_t circular_mask; /* bit d set: state d is an angle in rad, averaged on the circle: needs `circular`. Wrapped
                                in estimates, never in the particles */
    float ess_ratio;        /* resample when the effective sample size < ess_ratio N; 0: never, 1: always; 0.5 usual */
    uint64_t seed;          /* any value; the same seed replays the same run */
    uint32_t
        dt_max_us; /* longest model step; a longer one is cut into up to PFL_SUBSTEPS_MAX; 0: no limit but 2^32 us, 71 minutes */
    uint32_t budget_cycles;   /* of the port's counter, for one filter cycle; 0: no budget */
    const float *lo, *hi;     /* state box: D floats each, lo < hi, infinities allowed; both null: no box. Particles are
                                clipped to it after each predict */
    pfl_scheme_fn resampling; /* null: pfl_systematic */
    void (*circular)(pfl_t *f, uint32_t first, uint32_t n); /* pfl_circular_means; may be null without angles */
    const pfl_sensor_t *sensors;                            /* sensor_count of them */
    const pfl_constraint_t *constraint;                     /* null: none */
    const pfl_kernel_t *kernel;                             /* null: none */
    const pfl_watch_t *watch;                               /* null: no phase is judged */
    pfl_predict_fn predict;                                 /* not null */
    pfl_draw_fn draw; /* null: pfl_init starts all particles at zero, and pfl_reset answers
                                    PFL_ERR_NO_DRAW */
    void *user;       /* handed to predict and draw */
} pfl_config_t;

/* ---- A filter's life ---------------------------------------------------------------------------------------- */

/* Bytes of arena that a configuration needs: PFL_ARENA_BYTES, and what its constraint adds. 0 for null or a
 * configuration that pfl_init would refuse. O(D + sensors). */
size_t pfl_arena_bytes(const pfl_config_t *config);

/* Builds a filter in the caller's arena and draws its particles.
 * arena: aligned to 8, at least pfl_arena_bytes(config); owned by the caller, untouched by him while the filter
 * lives. config, its arrays and user data outlive the filter. t_us: time of the prior. *out: the filter, or null.
 * PFL_OK, PFL_ERR_ARG, PFL_ERR_MEMORY, PFL_ERR_CONFIG, PFL_ERR_ABI, PFL_ERR_NONFINITE (from draw). On an error no
 * filter is there, and nothing outside the arena was written; before the arena is known to be good nothing inside
 * either. O(N D). */
pfl_status_t pfl_init(void *arena, size_t arena_bytes, const pfl_config_t *config, uint64_t t_us, pfl_t **out);

/* Draws all particles anew from the prior and gives them equal weights; counts it and keeps the jump of the mean.
 * Time becomes t_us, which may lie before the filter's. PFL_OK, PFL_ERR_NO_DRAW, PFL_ERR_NONFINITE (draw: the old
 * particles are lost, all sit at the last mean), PFL_ERR_BUSY, PFL_ERR_ARG, PFL_ERR_CORRUPT. O(N D^2). */
pfl_status_t pfl_reset(pfl_t *f, uint64_t t_us);

/* How often the filter was reset, when last, and by how much the mean jumped then (D floats, finite; angles wrapped).
 * Null outputs are skipped; zeros before the first reset. PFL_OK, PFL_ERR_ARG, PFL_ERR_CORRUPT. O(D). */
pfl_status_t pfl_last_reset(const pfl_t *f, uint32_t *count, uint64_t *t_us, float *delta);

/* Every call below looks at the guards first (docs/health.md) and then may answer, besides what stands there,
 * PFL_ERR_CONFIG: bytes of the configuration changed since pfl_init, nothing was done; or PFL_ERR_CORRUPT: no live filter,
 * or one beyond repair, nothing was done. PFL_ERR_CORRUPT also ends a call in which something, a callback most likely,
 * wrote outside its place; what the call did then stands. */

/* ---- A filter cycle ----------------------------------------------------------------------------------------- */

/* Moves every particle to t_us through the predict callback; begins a filter cycle for the budget.
 * u: the caller's input to the model, may be null; not kept. Equal times are a no-op; the step is exact in
 * microseconds. Always runs to its end: the budget does not govern it.
 * PFL_OK; PFL_QUARANTINED when some particles came out non-finite: they take the state of a finite one, without
 * weight; PFL_ERR_NONFINITE when none of the first 16 came out finite: undone, nothing changed. PFL_ERR_TIME,
 * PFL_ERR_GAP, PFL_ERR_BUSY, PFL_ERR_ARG, PFL_ERR_CORRUPT: nothing changed. O(N (D + Q)). */
pfl_status_t pfl_predict(pfl_t *f, uint64_t t_us, const void *u);

/* Fuses one measurement of a sensor at the filter's time: weights, moments, and resampling when the effective sample
 * size is low. Several sensors at one time are several calls. z: the caller's, not null, not kept.
 * PFL_OK; PFL_DEFERRED: fused, the rest put off. PFL_REJECTED, PFL_ERR_NONFINITE, PFL_ERR_LOGLIK, PFL_ERR_BUDGET,
 * PFL_ERR_TIME, PFL_ERR_SENSOR, PFL_ERR_BUSY, PFL_ERR_ARG, PFL_ERR_CORRUPT: not fused, the posterior is the one
 * before, to the bit. O(N D^2), with PFL_MOMENTS_MEAN O(N D). */
pfl_status_t pfl_update(pfl_t *f, uint16_t sensor, uint64_t t_us, const void *z);

/* Resamples now, whatever the effective sample size, by the configured scheme: equal weights afterwards. The cached
 * estimate stays the one before. PFL_OK, PFL_ERR_BUSY, PFL_ERR_ARG, PFL_ERR_CORRUPT. O(N D), see pfl_scheme_fn. */
pfl_status_t pfl_resample(pfl_t *f);

/* ---- Answers ------------------------------------------------------------------------------------------------ */

/* Weighted mean (D floats) and covariance (D x D floats, row by row; null: not wanted) of the posterior, finite.
 * After an update O(D^2): a copy of what was cached before resampling. The first call after a predict computes them:
 * O(N D^2). Angles: circular mean in [-pi, pi), covariance of the wrapped deviations.
 * PFL_OK, PFL_ERR_CONFIG (covariance wanted with PFL_MOMENTS_MEAN), PFL_ERR_BUSY, PFL_ERR_ARG, PFL_ERR_CORRUPT,
 * PFL_ERR_NONFINITE (moments beyond single precision; outputs untouched). */
pfl_status_t pfl_estimate(pfl_t *f, float *mean, float *cov);

/* The particle of the largest weight at the last update (D floats): the maximum a posteriori particle. PFL_OK,
 * PFL_ERR_ARG, PFL_ERR_CORRUPT. O(D). */
pfl_status_t pfl_most_likely(const pfl_t *f, float *state);

/* Smallest value v of a state for which the weight of particles <= v reaches the share p of all. state: 0 .. D-1;
 * p: 0 < p <= 1. Angles are taken as they stand in the particles. PFL_OK, PFL_ERR_BUSY, PFL_ERR_ARG, PFL_ERR_CORRUPT,
 * PFL_ERR_NONFINITE (a particle damaged since the last predict). O(33 N), no memory. */
pfl_status_t pfl_quantile(pfl_t *f, uint16_t state, float p, float *value);

/* Effective sample size 1 / sum w_i^2 of the last update, before its resampling: 1 .. N; N before the first update.
 * 0 for a null filter. O(1). */
float pfl_effective_sample_size(const pfl_t *f);

/* The particles, to read: *view spans all N until the next call that changes the filter; log_weights (N floats, null:
 * not wanted) are copied out, the largest near 0, -INFINITY for a particle without weight. PFL_OK, PFL_ERR_ARG,
 * PFL_ERR_CORRUPT. O(1), O(N) with weights. */
pfl_status_t pfl_particles(const pfl_t *f, pfl_view_t *view, float *log_weights);

/* Largest distance of a particle from the point (x, y), in the plane of two states: the reach of the cloud; FLT_MAX from
 * 1.8e19 on, where squares overflow. PFL_OK, PFL_ERR_ARG, PFL_ERR_CORRUPT. O(N). */
pfl_status_t pfl_farthest(const pfl_t *f, uint16_t x_state, uint16_t y_state, float x, float y, float *distance);

/* Phase, masks, counters: health.h tells what each means. PFL_OK, PFL_ERR_ARG, PFL_ERR_CORRUPT. O(sensors). */
pfl_status_t pfl_health(const pfl_t *f, pfl_health_t *out);

/* One sensor's health. PFL_OK, PFL_ERR_ARG, PFL_ERR_SENSOR, PFL_ERR_CONFIG (no watch), PFL_ERR_CORRUPT. O(1). */
pfl_status_t pfl_sensor_health(const pfl_t *f, uint16_t sensor, pfl_sensor_health_t *out);

/* The record of the filter cycle so far; taken once, after its last update. PFL_OK, PFL_ERR_ARG, PFL_ERR_CORRUPT.
 * O(sensors). */
pfl_status_t pfl_record(const pfl_t *f, pfl_record_t *out);

/* Looks for what memory errors leave behind and mends it: non-finite particles and such outside their box take the
 * state of the most likely one without weight, impossible log-weights count as zero weight, dead random streams are
 * seeded anew, canaries are set again. For idle time. *mended, if wanted: repairs made. PFL_OK, PFL_ERR_CONFIG (the
 * configuration changed: it is the caller's to mend), PFL_ERR_BUSY, PFL_ERR_ARG, PFL_ERR_CORRUPT. O(N D). */
pfl_status_t pfl_scrub(pfl_t *f, uint32_t *mended);

/* Checks what must always hold: sane control block, finite particles, no NaN or positive weight, one of the largest
 * weight, random generator not in its dead state. O(N D). */
bool pfl_invariants_hold(const pfl_t *f);

/* ---- Looking ahead, keeping, bringing back ------------------------------------------------------------------- */

/* Copies a filter into another arena (same size rules). The copy shares only the configuration; its random numbers
 * are 2^96 steps ahead of the original's. PFL_OK, PFL_ERR_MEMORY, PFL_ERR_BUSY, PFL_ERR_ARG, PFL_ERR_CORRUPT. O(N D). */
pfl_status_t pfl_fork(const pfl_t *f, void *arena, size_t arena_bytes, pfl_t **out);

/* Input to the model for forecast step k = 0 .. steps-1, which begins at t_us. */
typedef const void *(*pfl_control_fn)(void *user, uint32_t step, uint64_t t_us);

/* A look at the fork after forecast step k: quantiles, reach, cloud. Whatever it changes there goes on being predicted.
 * Answering below PFL_OK ends the forecast with that status. */
typedef pfl_status_t (*pfl_visit_fn)(void *user, uint32_t step, pfl_t *fork);

typedef struct {
    uint32_t step_us;       /* length of a step, > 0 */
    uint32_t steps;         /* number of steps, >= 1 */
    pfl_control_fn control; /* null: the model gets u = null */
    void *control_user;
    pfl_visit_fn visit; /* called after each step; null: not */
    void *visit_user;
} pfl_horizon_t;

/* Pure prediction to a horizon; `f` is not touched. Forks it into `arena` (as pfl_fork), resamples the copy once, so
 * that its cloud has equal weights, and predicts. mean: steps x D floats; cov: steps x D x D floats or null. *out, if
 * wanted, is the fork at the horizon; horizon->visit sees it after every step. PFL_OK, PFL_QUARANTINED, those of pfl_fork,
 * pfl_predict and pfl_estimate. O(steps N (D^2 + Q)). */
pfl_status_t pfl_forecast(const pfl_t *f, void *arena, size_t arena_bytes, const pfl_horizon_t *horizon, float *mean,
                          float *cov, pfl_t **out);

/* Bytes of a snapshot of this filter; the same for every filter with its N and D. 0 for a null filter. O(1). */
size_t pfl_snapshot_bytes(const pfl_t *f);

/* Writes everything that a later run needs to continue with the same bits: little-endian, versioned, with a CRC-32.
 * PFL_OK, PFL_ERR_MEMORY (buffer too small), PFL_ERR_BUSY, PFL_ERR_ARG, PFL_ERR_CORRUPT. O(N D). */
pfl_status_t pfl_snapshot(const pfl_t *f, void *buffer, size_t buffer_bytes);

/* Brings a filter, built with the same N, D, Q and moments, to a snapshot's state, on this or another machine.
 * PFL_OK, PFL_ERR_CORRUPT (truncated, damaged, another version or shape), PFL_ERR_BUSY, PFL_ERR_ARG: unchanged.
 * O(N D). */
pfl_status_t pfl_restore(pfl_t *f, const void *buffer, size_t buffer_bytes);

/* ---- Trust -------------------------------------------------------------------------------------------------- */

/* Larger where a filter holds a copy of its configuration (docs/health.md). */
#if defined(PFL_GUARD_CONFIG) && (PFL_GUARD_CONFIG == 2)
#define PFL_SELF_TEST_BYTES (PFL_ARENA_BYTES(48, 2, 2) + 512u + sizeof(pfl_config_t))
#else
#define PFL_SELF_TEST_BYTES (PFL_ARENA_BYTES(48, 2, 2) + sizeof(pfl_config_t))
#endif

/* Known answers of random numbers, math, resampling and a short filter run: catches fast-math, contraction to fused
 * multiply-add, flush-to-zero and a wrong rounding mode. arena: PFL_SELF_TEST_BYTES aligned to 8, overwritten (the
 * arena of a filter to be built will do). PFL_OK, PFL_ERR_SELF_TEST, PFL_ERR_MEMORY. About 2e5 instructions. */
pfl_status_t pfl_self_test(void *arena, size_t arena_bytes);

#ifdef __cplusplus
}
#endif

#endif
