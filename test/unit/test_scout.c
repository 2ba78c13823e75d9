/* What tempered and auxiliary filters find out beforehand, when the clock or the sensor goes wrong: the answer is that of
 * an ordinary update, the posterior stays whole, and no measurement counts for more or less than once. The test is the
 * port, whose counter jumps at a read of the test's choice. */
#include "support.h"

#include "pflight/auxiliary.h"
#include "pflight/port.h"
#include "pflight/tempered.h"

#include "unity.h"

#include <math.h>
#include <string.h>

#define N 1000u
#define BUDGET 1000000u
#define GAP 3.0f /* of the places' log-likelihoods */

enum { PLACE, FAVOUR, STATES };

static uint32_t cycles;
static uint32_t reads;
static uint32_t jump_at; /* the read by which the budget is spent; 0: none */

uint32_t pfl_port_cycles(void)
{
    reads++;
    cycles += (reads == jump_at) ? (2u * BUDGET) : 1u;
    return cycles;
}

uint32_t pfl_port_cycles_mask(void)
{
    return 0xFFFFFFFFu;
}

uint32_t pfl_port_cycles_hz(void)
{
    return 0u;
}

void pfl_port_fault(int32_t status)
{
    (void)status;
}

bool pfl_port_self_test(void)
{
    return true;
}

/* ---- Two places, and a measurement that tells them apart ------------------------------------------------------------- */

static pfl_config_t config;
static pfl_sensor_t sensor;
static pfl_tempered_t tempered;
static pfl_auxiliary_t auxiliary;
static float best;      /* log-likelihood of place 1; place 0 is less likely by e^-GAP */
static uint32_t scouts; /* calls with the first batch */
static uint32_t last;   /* so many do as they should */
static const float z = 0.0f;

typedef void (*mischief_fn)(const pfl_view_t *p, float *ll);
static mischief_fn mischief;

static void see(void *user, const void *measured, const pfl_view_t *p, float *ll)
{
    (void)user;
    (void)measured;
    scouts += (p->first == 0u) ? 1u : 0u;
    for (uint32_t i = 0u; i < p->n; i++) {
        ll[i] = best - ((p->x[i] > 0.5f) ? 0.0f : GAP);
    }
    if ((mischief != NULL) && (scouts > last)) {
        mischief(p, ll);
    }
}

/* Half of them in either place, in an order without a rhythm, to which combs of a resampling might keep time. */
static void draw(void *user, const pfl_batch_t *p)
{
    (void)user;
    for (uint32_t i = 0u; i < p->n; i++) {
        PFL_STATE(p, PLACE)[i] = (float)(int32_t)((((p->first + i) * 387u) % config.particles) & 1u);
        PFL_STATE(p, FAVOUR)[i] = 0.0f;
    }
}

void setUp(void)
{
    cycles = 0u;
    reads = 0u;
    jump_at = 0u;
    best = 0.0f;
    scouts = 0u;
    last = 0u;
    mischief = NULL;
    tempered = (pfl_tempered_t){.loglik = see, .ess_share = 0.9f, .steps = PFL_TEMPERED_STEPS_MAX};
    auxiliary = (pfl_auxiliary_t){see, NULL, 0.0f, 1.0f, FAVOUR};
    memset(&sensor, 0, sizeof sensor);
    sensor.loglik = pfl_tempered_loglik;
    sensor.user = &tempered;
    config = ut_dictated_config(N, STATES);
    config.sensors = &sensor;
    config.draw = draw;
    config.ess_ratio = 0.95f; /* more than a step leaves: each is followed by a resampling */
}

void tearDown(void)
{
    ut_arenas_end();
}

static float odds_of(pfl_t *f)
{
    float mean[STATES];
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(f, mean, NULL));
    TEST_ASSERT_TRUE(pfl_invariants_hold(f));
    return mean[PLACE];
}

static float odds_by_bayes(void)
{
    return (float)(1.0 / (1.0 + exp(-(double)GAP)));
}

/* A quarter more or less of the measurement, or a resampling gone wrong, is further off: 0.02 are three standard deviations
 * and more of what five resamplings of 1000 particles do to the odds. */
static void check_odds(pfl_t *f)
{
    TEST_ASSERT_FLOAT_WITHIN(0.02f, odds_by_bayes(), odds_of(f));
}

/* ---- Every way through ------------------------------------------------------------------------------------------------- */

/* Copies stay copies, and the odds of the places are right all the same: over 100 seeds, within five standard errors, which
 * are the runs' own. With a resampling after each step by configuration, and by need. */
void test_without_a_kernel_step_too_a_measurement_counts_once(void)
{
    for (uint32_t k = 0u; k < 2u; k++) {
        double bias = 0.0;
        double square = 0.0;
        config.ess_ratio = (k == 0u) ? 0.0f : 0.95f;
        for (uint64_t seed = 1u; seed <= 100u; seed++) {
            config.seed = seed;
            pfl_t *f = ut_filter(&config);
            TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_tempered_update(f, 0u, 0u, &z));
            TEST_ASSERT_TRUE(tempered.taken > 2u);
            const double off = (double)odds_of(f) - (double)odds_by_bayes();
            bias += off / 100.0;
            square += off * off / 100.0;
            ut_arenas_end();
        }
        TEST_ASSERT_TRUE(square < (0.01 * 0.01));
        TEST_ASSERT_DOUBLE_WITHIN(5.0 * sqrt(square / 100.0), 0.0, bias);
    }
}

void test_a_budget_may_run_out_anywhere(void)
{
    uint32_t refused = 0u;
    uint32_t deferred = 0u;
    uint32_t resampled_late = 0u;
    config.budget_cycles = BUDGET;
    config.ess_ratio = 1.0f; /* always due: in the end there is a resampling to put off */
    pfl_t *clean = ut_filter(&config);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_tempered_update(clean, 0u, 0u, &z));
    const uint32_t all = reads;
    const uint32_t steps = tempered.taken;
    TEST_ASSERT_TRUE(all > 20u);
    for (uint32_t at = 1u; at <= all; at++) {
        pfl_health_t health;
        jump_at = 0u;
        pfl_t *f = ut_filter(&config);
        unsigned char *before = ut_snapshot(f);
        reads = 0u;
        jump_at = at;
        const pfl_status_t status = pfl_tempered_update(f, 0u, 0u, &z);
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_health(f, &health));
        TEST_ASSERT_NULL(tempered.held);
        if (status == PFL_ERR_BUDGET) {
            refused++;
            TEST_ASSERT_EQUAL_UINT32(0u, tempered.taken);
            TEST_ASSERT_TRUE(ut_same_posterior(before, ut_snapshot(f), pfl_snapshot_bytes(f)));
        } else {
            TEST_ASSERT_TRUE((status == PFL_OK) || (status == PFL_DEFERRED));
            deferred += (status == PFL_DEFERRED) ? 1u : 0u;
            resampled_late += ((status == PFL_DEFERRED) && (tempered.taken == steps)) ? 1u : 0u;
            TEST_ASSERT_TRUE(tempered.taken <= (steps + 1u)); /* one step may go without its resampling */
            check_odds(f);
        }
        ut_arenas_end();
    }
    TEST_ASSERT_TRUE(refused > 2u);
    TEST_ASSERT_TRUE(deferred > 2u);
    TEST_ASSERT_TRUE(resampled_late > 0u);
}

/* The best that a log-likelihood may be is a little above zero; a gate makes no less than nothing of it. */
void test_health_is_that_of_the_whole(void)
{
    const pfl_watch_t watch = {.keep = pfl_watch_keep};
    pfl_health_t health;
    sensor.gate = 100.0f;
    best = 0.0005f;
    pfl_t *f = ut_filter(&config);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_tempered_update(f, 0u, 0u, &z));
    TEST_ASSERT_TRUE(tempered.taken > 1u);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_health(f, &health));
    TEST_ASSERT_EQUAL_FLOAT(0.0f, health.test_ratio);
    TEST_ASSERT_EQUAL_FLOAT(0.0005f, health.best_loglik);
    sensor.gate = 0.0f;
    best = -3.0f;
    config.watch = &watch; /* who asks, without a gate */
    f = ut_filter(&config);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_tempered_update(f, 0u, 0u, &z));
    TEST_ASSERT_TRUE(tempered.taken > 1u);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_health(f, &health));
    TEST_ASSERT_EQUAL_FLOAT(-3.0f, health.best_loglik);
}

/* ---- Sensors that do what they must not ------------------------------------------------------------------------------- */

static void write_behind(const pfl_view_t *p, float *ll)
{
    if (p->n < PFL_BATCH) {
        ll[p->n] = -1.0f;
    }
}

static void kill_canary(const pfl_view_t *p, float *ll)
{
    (void)ll;
    if (p->first == 0u) {
        ((float *)(uintptr_t)p->x)[-1] = 1.0f;
    }
}

static void change_settings(const pfl_view_t *p, float *ll)
{
    (void)p;
    (void)ll;
    config.seed = 1234u;
}

static float said; /* by all */

static void say(const pfl_view_t *p, float *ll)
{
    for (uint32_t i = 0u; i < p->n; i++) {
        ll[i] = said;
    }
}

static pfl_status_t look(pfl_t *f)
{
    return pfl_auxiliary_look(f, &auxiliary, 1000u, NULL, &z);
}

static void check_refused(pfl_t *f, pfl_status_t expected, bool tempers)
{
    unsigned char *before = ut_snapshot(f);
    TEST_ASSERT_EQUAL_INT(expected, tempers ? pfl_tempered_update(f, 0u, 0u, &z) : look(f));
    TEST_ASSERT_TRUE(ut_same_posterior(before, ut_snapshot(f), pfl_snapshot_bytes(f)));
    TEST_ASSERT_TRUE(pfl_invariants_hold(f));
    TEST_ASSERT_EQUAL_UINT32(0u, tempered.taken);
    TEST_ASSERT_NULL(tempered.held);
}

void test_who_writes_where_he_must_not_is_refused(void)
{
    pfl_t *f = ut_filter(&config);
    mischief = write_behind;
    check_refused(f, PFL_ERR_CORRUPT, true);
    check_refused(f, PFL_ERR_CORRUPT, false);
    mischief = kill_canary;
    check_refused(f, PFL_ERR_CORRUPT, true);
}

void test_what_no_sensor_may_say_is_refused(void)
{
    static const struct {
        uint32_t bits;
        pfl_status_t status;
    } sayings[] = {{0x3F800000u, PFL_ERR_LOGLIK},
                   {0x7F800000u, PFL_ERR_NONFINITE},
                   {0x7FC00000u, PFL_ERR_NONFINITE},
                   {0xFFC00000u, PFL_ERR_NONFINITE},
                   {0xFF800000u, PFL_REJECTED}};
    pfl_t *f = ut_filter(&config);
    mischief = say;
    for (uint32_t k = 0u; k < sizeof sayings / sizeof sayings[0]; k++) {
        said = ut_float(sayings[k].bits);
        check_refused(f, sayings[k].status, true);
        check_refused(f, sayings[k].status, false);
    }
}

/* The steps before stand. */
void test_a_later_step_may_be_the_end(void)
{
    mischief = say;
    said = -ut_infinity();
    last = 2u;
    pfl_t *f = ut_filter(&config);
    TEST_ASSERT_EQUAL_INT(PFL_REJECTED, pfl_tempered_update(f, 0u, 0u, &z));
    TEST_ASSERT_EQUAL_UINT32(2u, tempered.taken);
    TEST_ASSERT_TRUE(pfl_invariants_hold(f));
    mischief = write_behind;
    scouts = 0u;
    f = ut_filter(&config);
    TEST_ASSERT_EQUAL_INT(PFL_ERR_CORRUPT, pfl_tempered_update(f, 0u, 0u, &z));
    TEST_ASSERT_EQUAL_UINT32(2u, tempered.taken);
    TEST_ASSERT_TRUE(pfl_invariants_hold(f));
    mischief = change_settings;
    scouts = 0u;
    f = ut_filter(&config);
    TEST_ASSERT_EQUAL_INT(PFL_ERR_CONFIG, pfl_tempered_update(f, 0u, 0u, &z));
    TEST_ASSERT_EQUAL_UINT32(3u, tempered.taken); /* the third had been begun, no fourth */
}

void test_a_tempered_sensor_needs_its_settings(void)
{
    sensor.user = NULL;
    pfl_t *f = ut_filter(&config);
    TEST_ASSERT_EQUAL_INT(PFL_ERR_SENSOR, pfl_tempered_update(f, 0u, 0u, &z));
    TEST_ASSERT_EQUAL_UINT32(0u, scouts);
}

/* Between two calls a bit of the control block flips: mended, as by any other update. */
void test_a_struck_control_block_is_mended(void)
{
    pfl_health_t health;
    pfl_t *f = ut_filter(&config);
    ((unsigned char *)f)[9] ^= 4u;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_tempered_update(f, 0u, 0u, &z));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_health(f, &health));
    TEST_ASSERT_EQUAL_UINT32(1u, health.mended);
    check_odds(f);
}

/* ---- The look ahead ------------------------------------------------------------------------------------------------------ */

void test_no_look_further_ahead_than_a_predict_goes(void)
{
    pfl_t *f = ut_filter(&config);
    TEST_ASSERT_EQUAL_INT(PFL_ERR_GAP, pfl_auxiliary_look(f, &auxiliary, 0x100000000ull, NULL, &z));
    TEST_ASSERT_EQUAL_UINT32(0u, scouts);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_auxiliary_look(f, &auxiliary, 0xFFFFFFFFull, NULL, &z));
}

/* Thirteen particles, which fill no whole group, and a gate that all pass: what a particle was favoured by is just what its
 * weight lacks. */
void test_what_was_favoured_is_taken_off(void)
{
    float log_weight[13];
    pfl_view_t view;
    config.particles = 13u;
    auxiliary.gate = 20.0f;
    best = -9.0f;
    pfl_t *f = ut_filter(&config);
    TEST_ASSERT_EQUAL_INT(PFL_OK, look(f));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_particles(f, &view, log_weight));
    TEST_ASSERT_TRUE(pfl_invariants_hold(f));
    for (uint32_t i = 0u; i < 13u; i++) {
        const float favour = view.x[(FAVOUR * view.stride) + i];
        TEST_ASSERT_EQUAL_FLOAT((view.x[i] > 0.5f) ? -9.0f : (-9.0f - GAP), favour);
        TEST_ASSERT_FLOAT_WITHIN(1e-5f, log_weight[0] + view.x[FAVOUR * view.stride], log_weight[i] + favour);
    }
    auxiliary.gate = 17.9f;
    TEST_ASSERT_EQUAL_INT(PFL_REJECTED, look(f));
}
