/* Short flights of each kind of filter: flights.h tells what for. A target in the plane with random accelerations, its
 * position seen far more sharply than one step of the model spreads a particle. */
#include "flights.h"

#include "pflight/pflight.h"

#include <string.h>

#define STEP_US 500000u
#define SEEN_M 0.05f
#define ACCEL 1.0f      /* of the constant-velocity model */
#define SPREAD_M 0.177f /* of a position in a step: dt^2/2 accel / sqrt(dt) */
#define KICK_MPS 0.707f
#define LONG_MOST 1000u /* particles of the adaptive filter at most */
#define TURN_WALK 0.02f /* of the marginalised filter with a covariance for each particle */
#define NOISES_MAX 3u
#define STATES_MAX 8u

enum { EXTRA = PFL_CV_STATES, FAVOUR };
enum { TURN = PFL_CV_STATES, COVARIANCE }; /* of that filter: its rate of turn, and the covariance of its velocity */
typedef enum { PLAIN, IN_STEPS, LOOKING, LOOKING_AND_GIVEN, GIVEN, COUNTING, JUMPING, MARGINAL, MARGINAL_EACH } way_t;

static union {
    uint64_t align;
    unsigned char bytes[PFL_ARENA_BYTES(LONG_MOST, STATES_MAX, NOISES_MAX)];
} arena;
static uint32_t bins[128];
static float room[PFL_JUMP_FLOATS(5, 2)];

/* ---- Models and sensors ----------------------------------------------------------------------------------------------- */

static pfl_constant_velocity_t moving = {ACCEL, 0.0f};
static pfl_constant_velocity_t still = {0.0f, 0.0f};
static pfl_constant_velocity_t calm = {0.2f, 0.0f};
static pfl_constant_velocity_t wild = {2.0f, 0.0f};
static pfl_position_t seen = {2u, {PFL_CV_X, PFL_CV_Y, 0u, 0u}, {1.0f / SEEN_M, 1.0f / SEEN_M, 0.0f, 0.0f}};
static pfl_position_t looked = {2u, {PFL_CV_X, PFL_CV_Y, 0u, 0u}, {5.44f, 5.44f, 0.0f, 0.0f}}; /* both variances */
static const pfl_student_law_t student = {1.0f / SEEN_M, 4.0f};
static const pfl_mixture_law_t mixture = {1.0f / SEEN_M, {0.01f, 0.02f}, 0.0f};
static const pfl_split_law_t split = {{1.0f / SEEN_M, 0.5f / SEEN_M}, {0.0f, 3.0f}};
static pfl_scalar_t along_x = {PFL_CV_X, EXTRA, pfl_student_law, &student};
static pfl_scalar_t along_y = {PFL_CV_Y, PFL_NO_BIAS, pfl_mixture_law, &mixture};
static pfl_ranging_t ranging = {PFL_CV_X, PFL_CV_Y, EXTRA, 0u, pfl_split_law, &split};
static pfl_drift_t drifting = {pfl_constant_velocity_predict, &moving, 1u, {EXTRA}, {2u}, {0.05f}, {20.0f}};
static pfl_tempered_t tempered;
static pfl_proposal_t proposal = {pfl_constant_velocity_predict,
                                  &still,
                                  EXTRA,
                                  2u,
                                  {PFL_CV_X, PFL_CV_Y, 0u, 0u},
                                  {0u, 1u, 0u, 0u},
                                  {PFL_CV_VX, PFL_CV_VY, 0u, 0u},
                                  {SPREAD_M, SPREAD_M, 0.0f, 0.0f},
                                  {KICK_MPS, KICK_MPS, 0.0f, 0.0f},
                                  {SEEN_M, SEEN_M, 0.0f, 0.0f}};
static const pfl_auxiliary_t auxiliary = {pfl_position_loglik, &looked, 0.0f, 0.7f, FAVOUR};
static pfl_jump_t jump = {2u,
                          {{pfl_constant_velocity_predict, &calm}, {pfl_constant_velocity_predict, &wild}},
                          {{0.0f, 0.1f}, {0.3f, 0.0f}},
                          5u,
                          2u,
                          EXTRA,
                          40u,
                          0.5f,
                          room};
static const pfl_kernel_t kernels[] = {
    {0.3f, 0u, pfl_kernel_move}, {0.2f, 0u, pfl_kernel_gaussian}, {0.2f, 0u, pfl_kernel_epanechnikov}};

/* The velocity is linear once the position is known; position and velocity are moved by noises of their own. */
#define VELOCITY_IS_LINEAR                                                                                             \
    .linear = 2u, .mean = PFL_CV_VX, .driven = 2u, .state = {PFL_CV_X, PFL_CV_Y}, .noise = {0u, 1u},                   \
    .drive = {{0.5f, 0.0f}, {0.0f, 0.5f}}, .drive_variance = {SPREAD_M * SPREAD_M, SPREAD_M * SPREAD_M},               \
    .transition = {{1.0f, 0.0f}, {0.0f, 1.0f}}, .process_cov = {KICK_MPS * KICK_MPS, 0.0f, KICK_MPS * KICK_MPS}
static const pfl_marginal_shared_t shared_at_start = {.model = {VELOCITY_IS_LINEAR}, .cov = {1.0f, 0.0f, 1.0f}};
static pfl_marginal_shared_t shared;
static float work[PFL_MARGINAL_WORK(2u, 2u)];

static void walk_turn(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    const float walk = TURN_WALK * pfl_sqrtf(dt_s);
    (void)user;
    (void)u;
    for (uint32_t i = 0u; i < p->n; i++) {
        PFL_STATE(p, TURN)[i] += walk * PFL_NOISE(p, 2)[i];
    }
}

/* The velocity turns by what the particle believes: each has a matrix of its own. */
static void turn_velocity(void *user, const void *u, float dt_s, const pfl_view_t *p, float *drive, float *transition)
{
    (void)user;
    (void)u;
    (void)drive;
    for (uint32_t i = 0u; i < p->n; i++) {
        const float angle = dt_s * p->x[(TURN * p->stride) + i];
        const float cosine = 1.0f - (0.5f * (angle * angle));
        transition[i] = cosine;
        transition[PFL_MARGINAL_STRIP + i] = -angle;
        transition[(2u * PFL_MARGINAL_STRIP) + i] = angle;
        transition[(3u * PFL_MARGINAL_STRIP) + i] = cosine;
    }
}

static pfl_marginal_each_t each = {
    .model = {VELOCITY_IS_LINEAR, .predict = walk_turn}, .matrices = turn_velocity, .cov = COVARIANCE, .work = work};

static void see_both(void *user, const void *z, const pfl_view_t *p, float *ll)
{
    const float *measured = (const float *)z;
    float other[PFL_BATCH];
    const pfl_range_z_t range = {-40.0f, -30.0f, 0.0f, measured[2], 1.0f};
    (void)user;
    pfl_scalar_loglik(&along_x, &measured[0], p, ll);
    pfl_scalar_loglik(&along_y, &measured[1], p, other);
    for (uint32_t i = 0u; i < p->n; i++) {
        ll[i] += other[i];
    }
    pfl_ranging_loglik(&ranging, &range, p, other);
    for (uint32_t i = 0u; i < p->n; i++) {
        ll[i] += other[i];
    }
}

/* drawn: states from normals; the others are 0. */
static void draw(uint32_t states, uint32_t drawn, const pfl_batch_t *p)
{
    for (uint32_t d = 0u; d < states; d++) {
        for (uint32_t i = 0u; i < p->n; i++) {
            PFL_STATE(p, d)[i] = (d < drawn) ? PFL_NOISE(p, d)[i] : 0.0f;
        }
    }
}

/* ---- The filters ------------------------------------------------------------------------------------------------------ */

typedef struct {
    way_t way;
    uint32_t states;
    uint16_t noises;
    pfl_predict_fn predict;
    void *model;
    pfl_loglik_fn loglik;
    void *sensor;
    const pfl_kernel_t *kernel;
} kind_t;

const char *const flight_names[FLIGHTS] = {"bootstrap", "regularised",     "epanechnikov", "tempered", "auxiliary",
                                           "optimal",   "adapted",         "adaptive",     "jump",     "errors",
                                           "liu-west",  "marginal-shared", "marginal-each"};

static const kind_t kinds[FLIGHTS] = {
    {PLAIN, 4u, 2u, pfl_constant_velocity_predict, &moving, pfl_position_loglik, &seen, NULL},
    {PLAIN, 4u, 2u, pfl_constant_velocity_predict, &moving, pfl_position_loglik, &seen, &kernels[1]},
    {PLAIN, 4u, 2u, pfl_constant_velocity_predict, &moving, pfl_position_loglik, &seen, &kernels[2]},
    {IN_STEPS, 4u, 2u, pfl_constant_velocity_predict, &moving, pfl_tempered_loglik, &tempered, &kernels[0]},
    {LOOKING, 6u, 2u, pfl_constant_velocity_predict, &moving, pfl_position_loglik, &seen, NULL},
    {GIVEN, 5u, 2u, pfl_proposal_predict, &proposal, pfl_proposal_loglik, &proposal, NULL},
    {LOOKING_AND_GIVEN, 6u, 2u, pfl_proposal_predict, &proposal, pfl_proposal_loglik, &proposal, NULL},
    {COUNTING, 4u, 2u, pfl_constant_velocity_predict, &moving, pfl_position_loglik, &seen, NULL},
    {JUMPING, 5u, 3u, pfl_jump_predict, &jump, pfl_position_loglik, &seen, NULL},
    {PLAIN, 5u, 3u, pfl_drift_predict, &drifting, see_both, &seen, NULL},
    {PLAIN, 4u, 2u, pfl_constant_velocity_predict, &moving, pfl_position_loglik, &seen, &kernels[0]},
    {MARGINAL, 4u, 2u, pfl_marginal_shared_predict, &shared, pfl_position_loglik, &seen, NULL},
    {MARGINAL_EACH, 8u, 3u, pfl_marginal_each_predict, &each, pfl_position_loglik, &seen, NULL},
};

/* Structure and workspace of the module, by way_t. */
static const uint32_t beside_bytes[] = {
    [IN_STEPS] = sizeof tempered,
    [LOOKING] = sizeof auxiliary,
    [LOOKING_AND_GIVEN] = sizeof auxiliary + sizeof proposal,
    [GIVEN] = sizeof proposal,
    [COUNTING] = sizeof(pfl_adaptive_t) + sizeof bins,
    [JUMPING] = sizeof jump + sizeof room,
    [MARGINAL] = sizeof shared,
    [MARGINAL_EACH] = sizeof each + sizeof work,
};

/* Everything that one flight is made of. */
typedef struct {
    const kind_t *kind;
    pfl_sensor_t sensor;
    pfl_adaptive_t adaptive; /* its configuration is that of all */
    pfl_t *f;
    pfl_rng_t dice;
    float truth[4];
    float z[3];
} flight_t;

static void moved(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    const kind_t *kind = (const kind_t *)user;
    kind->predict(kind->model, u, dt_s, p);
}

/* The marginalised filters carry the velocity's mean and covariance, the prior's at first. */
static void drawn(void *user, const pfl_batch_t *p)
{
    const kind_t *kind = (const kind_t *)user;
    const bool marginal = (kind->way == MARGINAL) || (kind->way == MARGINAL_EACH);
    draw(kind->states, marginal ? 2u : PFL_CV_STATES, p);
    for (uint32_t i = 0u; (kind->way == MARGINAL_EACH) && (i < p->n); i++) {
        PFL_STATE(p, COVARIANCE)[i] = 1.0f;
        PFL_STATE(p, COVARIANCE + 2u)[i] = 1.0f;
    }
}

static bool start(flight_t *w, uint32_t number, uint32_t budget_cycles)
{
    memset(w, 0, sizeof *w);
    w->kind = &kinds[number];
    w->sensor.loglik = w->kind->loglik;
    w->sensor.user = w->kind->sensor;
    tempered = (pfl_tempered_t){pfl_position_loglik, &seen, 0.5f, 6u, NULL, 0.0f, 0u};
    pfl_config_t *c = &w->adaptive.config;
    c->abi = PFL_ABI;
    c->particles = (w->kind->way == COUNTING) ? LONG_MOST : FLIGHT_PARTICLES;
    c->states = (uint16_t)w->kind->states;
    c->noises = w->kind->noises;
    c->sensor_count = 1u;
    c->ess_ratio = ((w->kind->way == COUNTING) || (w->kind->way == JUMPING)) ? 0.0f : 0.5f;
    c->seed = 7u;
    c->budget_cycles = budget_cycles;
    c->sensors = &w->sensor;
    c->kernel = w->kind->kernel;
    c->predict = moved;
    c->draw = drawn;
    c->user = (void *)(uintptr_t)w->kind;
    shared = shared_at_start;
    pfl_rng_seed(&w->dice, 12u);
    if (w->kind->way != COUNTING) {
        return pfl_init(&arena, sizeof arena, c, 0u, &w->f) == PFL_OK;
    }
    pfl_adaptive_t *a = &w->adaptive;
    a->most = LONG_MOST;
    a->least = 50u;
    a->ess_ratio = 0.5f;
    a->error = (budget_cycles > 0u) ? 0.0f : 0.05f;
    a->quantile = 2.33f;
    a->bins = bins;
    a->bits = 4096u;
    a->dimensions = 2u;
    a->state[1] = PFL_CV_VX;
    a->inv_width[0] = 20.0f;
    a->inv_width[1] = 5.0f;
    a->budget_share = 0.9f;
    return pfl_adaptive_init(&arena, sizeof arena, a, 0u, &w->f) == PFL_OK;
}

static void move_truth(flight_t *w)
{
    float noise[16];
    pfl_rng_normals(&w->dice, noise, 1u);
    for (uint32_t d = 0u; d < 2u; d++) {
        w->truth[d] += (0.5f * w->truth[2u + d]) + (SPREAD_M * noise[d]);
        w->truth[2u + d] += KICK_MPS * noise[d];
        w->z[d] = w->truth[d] + (SEEN_M * noise[2u + d]);
    }
    const float x = w->truth[0] + 40.0f;
    const float y = w->truth[1] + 30.0f;
    w->z[2] = pfl_sqrtf((x * x) + (y * y)) + (SEEN_M * noise[4]);
}

static pfl_status_t cycle(flight_t *w, uint64_t t_us)
{
    const way_t way = w->kind->way;
    const pfl_proposal_input_t blind = {NULL, NULL};
    const pfl_proposal_input_t given = {NULL, w->z};
    const bool looks = (way == LOOKING) || (way == LOOKING_AND_GIVEN);
    const pfl_marginal_input_t unseen = {NULL, NULL}; /* nothing linear is measured */
    const bool marginal = (way == MARGINAL) || (way == MARGINAL_EACH);
    pfl_status_t s = looks ? pfl_auxiliary_look(w->f, &auxiliary, t_us, &blind, w->z) : PFL_OK;
    if (way == MARGINAL) {
        pfl_marginal_shared_step(&shared, false);
    }
    s = (s == PFL_OK) ? pfl_predict(w->f, t_us, marginal ? (const void *)&unseen : (const void *)&given) : s;
    if (s == PFL_OK) {
        s = (way == IN_STEPS) ? pfl_tempered_update(w->f, 0u, t_us, w->z) : pfl_update(w->f, 0u, t_us, w->z);
    }
    if ((s == PFL_OK) && (way == COUNTING)) {
        s = pfl_adapt(w->f, &w->adaptive);
    }
    if ((s == PFL_OK) && (way == JUMPING)) {
        s = pfl_jump_resample(w->f, &jump);
    }
    return s;
}

static bool note(flight_t *w, flown_t *flown)
{
    pfl_health_t health;
    float mean[STATES_MAX];
    float cov[STATES_MAX * STATES_MAX];
    if ((pfl_estimate(w->f, mean, cov) != PFL_OK) || (pfl_health(w->f, &health) != PFL_OK)) {
        return false;
    }
    for (uint32_t d = 0u; d < PFL_CV_STATES; d++) {
        mix(mean[d]);
        mix(cov[d * (w->kind->states + 1u)]);
    }
    mix(health.ess);
    const float x = mean[0] - w->truth[0];
    const float y = mean[1] - w->truth[1];
    flown->square += (x * x) + (y * y);
    flown->cycles_max = health.cycles_max;
    flown->overruns = health.overruns;
    return true;
}

bool flight_fly(uint32_t number, uint32_t budget_cycles, flown_t *flown)
{
    static flight_t w;
    memset(flown, 0, sizeof *flown);
    if (!start(&w, number, budget_cycles)) {
        return false;
    }
    pfl_config_t laid = w.adaptive.config; /* for the most, whatever it begins with */
    laid.particles = (w.kind->way == COUNTING) ? LONG_MOST : laid.particles;
    flown->arena_bytes = (uint32_t)pfl_arena_bytes(&laid);
    flown->beside_bytes = beside_bytes[w.kind->way];
    for (uint32_t k = 1u; k <= FLIGHT_STEPS; k++) {
        move_truth(&w);
        flown->particles[k - 1u] = w.adaptive.config.particles;
        flown->particle_steps += w.adaptive.config.particles;
        const uint32_t begun = pfl_port_cycles();
        const pfl_status_t status = cycle(&w, (uint64_t)k * STEP_US);
        flown->cycles += (pfl_port_cycles() - begun) & pfl_port_cycles_mask();
        if ((status != PFL_OK) || !note(&w, flown)) {
            return false;
        }
    }
    return pfl_invariants_hold(w.f);
}
