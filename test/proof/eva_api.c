/* Every public call on a filter at N = 4, D = 2, for Frama-C's Eva: callbacks, clocks, measurements and snapshots hold
 * any bits, so that what Eva finds no alarm for holds whatever a model, a sensor or a recorder does. Configured by
 * SCHEME (a function of pfl_config_t.resampling), ESS (ess_ratio), ANGLES (circular_mask), MOMENTS, EXTRAS (constraint with
 * retries, kernel, box) and WATCH. */
#include "pflight/pflight.h"

#include "core.h"

#include "pflight/port.h"

#define N 4u
#define D 2u
#define Q 1u
#define SENSORS 2u

extern volatile float any_float;
extern volatile uint16_t any_u16;
extern volatile uint32_t any_u32;
extern volatile uint64_t any_u64;
extern volatile unsigned char any_byte;
extern volatile int any_int;

/* ---- The machine ---------------------------------------------------------------------------------------------- */

uint32_t pfl_port_cycles(void)
{
    return any_u32;
}

uint32_t pfl_port_cycles_mask(void)
{
    return any_u32;
}

uint32_t pfl_port_cycles_hz(void)
{
    return any_u32;
}

void pfl_port_fault(int32_t status)
{
    (void)status;
}

bool pfl_port_self_test(void)
{
    return any_int != 0;
}

/* ---- A model and a sensor that answer anything ---------------------------------------------------------------- */

static void scatter(const pfl_batch_t *p, const float *noise)
{
    for (uint32_t d = 0u; d < D; d++) {
        for (uint32_t i = 0u; i < p->n; i++) {
            PFL_STATE(p, d)[i] = (any_int != 0) ? any_float : noise[i];
        }
    }
}

static void predict(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    (void)user;
    (void)u;
    (void)dt_s;
    scatter(p, PFL_NOISE(p, Q - 1u));
}

static void draw(void *user, const pfl_batch_t *p)
{
    (void)user;
    scatter(p, PFL_NOISE(p, D - 1u));
}

static void redraw(void *user, const void *z, const pfl_batch_t *p)
{
    (void)user;
    (void)z;
    scatter(p, PFL_NOISE(p, D - 1u));
}

static void loglik(void *user, const void *z, const pfl_view_t *p, float *ll)
{
    (void)user;
    for (uint32_t i = 0u; i < p->n; i++) {
        ll[i] = (any_int != 0) ? any_float : (p->x[i] - *(const float *)z);
    }
}

static void inside(void *user, const pfl_view_t *p, uint32_t *flags)
{
    (void)user;
    for (uint32_t i = 0u; i < p->n; i++) {
        flags[i] = any_u32 % 2u; /* what others do, the job `constraint` proves */
    }
}

static void project(void *user, const pfl_batch_t *p)
{
    (void)user;
    scatter(p, p->x);
}

static const void *control(void *user, uint32_t step, uint64_t t_us)
{
    (void)user;
    (void)step;
    (void)t_us;
    return NULL;
}

static pfl_status_t visit(void *user, uint32_t step, pfl_t *fork)
{
    (void)user;
    (void)step;
    (void)fork;
    return (any_int != 0) ? PFL_OK : PFL_ERR_GAP;
}

/* ---- The calls ------------------------------------------------------------------------------------------------ */

static const pfl_sensor_t sensors[SENSORS] = {
    {.loglik = loglik, .redraw = redraw, .gate = 9.0f, .timeout_us = 1000000u, .z_bytes = 4u, .frozen_after = 3u},
    {.loglik = loglik}};
#if EXTRAS
static const float lo[D] = {-1.0f, -2.0f};
static const float hi[D] = {1.0f, 2.0f};
static const pfl_constraint_t constraint = {inside, project, NULL, 3u, 0u, pfl_constraint_keep};
static const pfl_kernel_t kernel = {0.3f, 0u, pfl_kernel_move};
#endif
#if WATCH
static const float ok_sigma[D] = {1.0f, 2.0f};
static const pfl_watch_t watch = {
    .ok_sigma = (MOMENTS == 0) ? ok_sigma : NULL, .reinject = 0.5f, .keep = pfl_watch_keep};
#endif
static pfl_config_t config = {.abi = PFL_ABI,
                              .particles = N,
                              .states = D,
                              .noises = Q,
                              .sensor_count = SENSORS,
                              .resampling = SCHEME,
                              .moments = MOMENTS,
                              .circular_mask = ANGLES,
                              .circular = pfl_circular_means,
                              .ess_ratio = ESS,
#if EXTRAS
                              .lo = lo,
                              .hi = hi,
                              .constraint = &constraint,
                              .kernel = &kernel,
#endif
#if WATCH
                              .watch = &watch,
#endif
                              .sensors = sensors,
                              .predict = predict,
                              .draw = draw};

static union {
    uint64_t align;
    unsigned char bytes[PFL_ARENA_BYTES(N, D, Q) + PFL_RETRY_BYTES(D) + PFL_WATCH_BYTES(SENSORS)];
} arena, second;

static unsigned char blob[4096];
static unsigned char too_short[100];

static void ask(pfl_t *f)
{
    float mean[D];
    float cov[D * D];
    float log_weights[N];
    pfl_view_t view;
    uint32_t count;
    uint64_t t_us;
    (void)pfl_estimate(f, mean, (any_int != 0) ? cov : NULL);
    (void)pfl_quantile(f, any_u16, any_float, mean);
    (void)pfl_most_likely(f, mean);
    (void)pfl_effective_sample_size(f);
    (void)pfl_particles(f, &view, (any_int != 0) ? log_weights : NULL);
    (void)pfl_farthest(f, any_u16, any_u16, any_float, any_float, mean);
    (void)pfl_last_reset(f, &count, &t_us, mean);
    (void)pfl_invariants_hold(f);
}

static void ask_for_health(pfl_t *f)
{
    pfl_health_t health;
    pfl_sensor_health_t sensor_health;
    pfl_record_t record;
    uint32_t mended;
    (void)pfl_health(f, &health);
    (void)pfl_sensor_health(f, any_u16, &sensor_health);
    (void)pfl_record(f, &record);
    (void)pfl_scrub(f, (any_int != 0) ? &mended : NULL);
}

static void foresee(const pfl_t *f)
{
    float mean[2u * D];
    float cov[2u * D * D];
    pfl_t *fork;
    const pfl_horizon_t horizon = {any_u32, 2u, control, NULL, visit, NULL};
    (void)pfl_fork(f, &second, (any_int != 0) ? sizeof second : any_u32, &fork);
    (void)pfl_forecast(f, &second, sizeof second, &horizon, mean, (any_int != 0) ? cov : NULL, &fork);
}

static void scribble(unsigned char *bytes, size_t n)
{
    for (size_t i = 0u; i < n; i++) {
        bytes[i] = any_byte;
    }
}

/* The one word that is not any: Eva forgets that it was looked at before it is taken. That a restore takes no index of a
 * best particle beyond N is a goal of the job `snapshot`. */
#define BEST_INDEX_AT (4u * 27u)

static void keep(pfl_t *f)
{
    const size_t bytes = (any_int != 0) ? sizeof blob : any_u32 % sizeof blob;
    (void)pfl_snapshot(f, blob, bytes);
    scribble(blob, sizeof blob);
    blob[BEST_INDEX_AT] = (unsigned char)(any_byte % N);
    blob[BEST_INDEX_AT + 1u] = 0u;
    blob[BEST_INDEX_AT + 2u] = 0u;
    blob[BEST_INDEX_AT + 3u] = 0u;
    (void)pfl_restore(f, blob, bytes);
    (void)pfl_snapshot(f, too_short, sizeof too_short);
    scribble(too_short, sizeof too_short);
    (void)pfl_restore(f, too_short, sizeof too_short);
}

static void use(pfl_t *f)
{
    for (uint32_t call = 0u; call < 1000u; call++) {
        const float z = any_float;
        switch (any_int) {
        case 0:
            (void)pfl_predict(f, any_u64, &z);
            break;
        case 1:
            (void)pfl_update(f, any_u16, any_u64, &z);
            break;
        case 2:
            (void)pfl_resample(f);
            break;
        case 3:
            (void)pfl_reset(f, any_u64);
            break;
        case 4:
            ask(f);
            break;
        case 5:
            ask_for_health(f);
            break;
        case 6:
            keep(f);
            break;
        default:
            foresee(f);
            break;
        }
    }
}

int main(void)
{
    pfl_t *f;
    config.seed = any_u64;
    config.dt_max_us = any_u32;
    config.budget_cycles = any_u32;
    (void)pfl_init(&second, any_u32 % sizeof second, &config, any_u64, &f);
    if (pfl_init(&arena, sizeof arena, &config, any_u64, &f) == PFL_OK) {
        use(f);
    }
    return 0;
}
