/* The marginalised filter against the Kalman filter in double, its two forms against each other, and against the
 * bootstrap filter with fifteen times the particles and more. */
#include "support.h"

#include "pflight/marginal.h"
#include "pflight/math.h"

#include "unity.h"

#include <math.h>
#include <string.h>

#define SECOND_US 1000000ull

static float work[PFL_MARGINAL_WORK(PFL_MARGINAL_MAX, PFL_MARGINAL_MAX)];

void setUp(void)
{
}

void tearDown(void)
{
    ut_arenas_end();
}

/* ---- All states linear: x, y and their speeds, positions seen ----------------------------------------------------- */

#define ALL 4u
enum { ALL_COV = ALL, ALL_LOGLIK = ALL + PFL_MARGINAL_COV(ALL), ALL_STATES };

static const float prior_variance[ALL] = {25.0f, 25.0f, 4.0f, 4.0f};

static void draw_all_linear(void *user, const pfl_batch_t *p)
{
    (void)user;
    for (uint32_t d = 0u; d < ALL_STATES; d++) {
        for (uint32_t i = 0u; i < p->n; i++) {
            PFL_STATE(p, d)[i] = 0.0f;
        }
    }
    for (uint32_t d = 0u, at = ALL_COV; d < ALL; at += ALL - d, d++) {
        for (uint32_t i = 0u; i < p->n; i++) {
            PFL_STATE(p, at)[i] = prior_variance[d];
        }
    }
}

static pfl_marginal_t all_linear(void)
{
    return (pfl_marginal_t){
        .linear = ALL,
        .measured = 2u,
        .loglik_state = ALL_LOGLIK,
        .transition = {{1.0f, 0.0f, 0.5f, 0.0f},
                       {0.0f, 1.0f, 0.0f, 0.5f},
                       {0.0f, 0.0f, 0.9f, 0.1f},
                       {0.0f, 0.0f, -0.1f, 0.9f}},
        .drift = {0.1f, -0.2f, 0.0f, 0.3f},
        .process_cov = {0.1f, 0.0f, 0.05f, 0.0f, 0.1f, 0.0f, 0.05f, 0.2f, 0.0f, 0.2f},
        .see = {{1.0f, 0.0f, 0.0f, 0.0f}, {0.2f, 1.0f, 0.0f, 0.1f}},
        .see_variance = {1.0f, 2.0f},
    };
}

typedef struct {
    double mean[ALL], cov[ALL][ALL], loglik;
} kalman_t;

static double process_cov(const pfl_marginal_t *m, uint32_t r, uint32_t c)
{
    const uint32_t low = r < c ? r : c;
    const uint32_t high = r < c ? c : r;
    return (double)m->process_cov[low * (2u * ALL - low + 1u) / 2u + high - low];
}

static void kalman_move(kalman_t *k, const pfl_marginal_t *m)
{
    kalman_t after = {.loglik = 0.0};
    for (uint32_t r = 0u; r < ALL; r++) {
        after.mean[r] = (double)m->drift[r];
        for (uint32_t i = 0u; i < ALL; i++) {
            after.mean[r] += (double)m->transition[r][i] * k->mean[i];
        }
        for (uint32_t c = 0u; c < ALL; c++) {
            after.cov[r][c] = process_cov(m, r, c);
            for (uint32_t i = 0u; i < ALL * ALL; i++) {
                after.cov[r][c] +=
                    (double)m->transition[r][i / ALL] * k->cov[i / ALL][i % ALL] * (double)m->transition[c][i % ALL];
            }
        }
    }
    *k = after;
}

static void kalman_see(kalman_t *k, const float *row, double variance, double z)
{
    double g[ALL] = {0.0};
    double s = variance;
    double e = z;
    for (uint32_t r = 0u; r < ALL; r++) {
        for (uint32_t c = 0u; c < ALL; c++) {
            g[r] += k->cov[r][c] * (double)row[c];
        }
        s += (double)row[r] * g[r];
        e -= (double)row[r] * k->mean[r];
    }
    k->loglik -= 0.5 * (e * e / s + log(s / variance));
    for (uint32_t r = 0u; r < ALL; r++) {
        k->mean[r] += g[r] / s * e;
        for (uint32_t c = 0u; c < ALL; c++) {
            k->cov[r][c] -= g[r] * g[c] / s;
        }
    }
}

/* Flies the filter beside the Kalman filter; largest distance of the means. With `each`, covariances and
 * log-likelihoods too. */
static double distance_to_kalman(pfl_marginal_shared_t *shared, pfl_marginal_each_t *each)
{
    const pfl_marginal_t *m = shared != NULL ? &shared->model : &each->model;
    const pfl_sensor_t sensor = {.loglik = pfl_marginal_loglik, .user = shared != NULL ? (void *)shared : (void *)each};
    const pfl_config_t config = {
        .abi = PFL_ABI,
        .particles = 21u, /* more than a strip, and a short one */
        .states = ALL_STATES,
        .sensor_count = 1u,
        .moments = PFL_MOMENTS_MEAN,
        .ess_ratio = 0.5f,
        .sensors = &sensor,
        .predict = shared != NULL ? pfl_marginal_shared_predict : pfl_marginal_each_predict,
        .draw = draw_all_linear,
        .user = sensor.user,
    };
    pfl_t *f = ut_filter(&config);
    kalman_t kalman = {.loglik = 0.0};
    uint64_t dice = 77u;
    double worst = 0.0;

    for (uint32_t d = 0u; d < ALL; d++) {
        kalman.cov[d][d] = (double)prior_variance[d];
    }
    for (uint32_t step = 1u; step <= 300u; step++) {
        const bool measured = step % 7u != 0u;
        const float z[2] = {(float)(3.0 * ut_gaussian(&dice)), (float)(3.0 * ut_gaussian(&dice))};
        const pfl_marginal_input_t in = {NULL, measured ? z : NULL};
        float mean[ALL_STATES];
        kalman_move(&kalman, m);
        for (uint32_t k = 0u; measured && k < 2u; k++) {
            kalman_see(&kalman, m->see[k], (double)m->see_variance[k], (double)z[k]);
        }
        if (shared != NULL) {
            pfl_marginal_shared_step(shared, measured);
        }
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(f, step * SECOND_US, &in));
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(f, 0u, step * SECOND_US, z));
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(f, mean, NULL));
        for (uint32_t d = 0u; d < ALL; d++) {
            worst = fmax(worst, fabs((double)mean[d] - kalman.mean[d]));
        }
        for (uint32_t r = 0u, at = 0u; r < ALL; r++) {
            for (uint32_t c = r; c < ALL; c++, at++) {
                const float cov = shared != NULL ? shared->cov[at] : mean[ALL_COV + at];
                worst = fmax(worst, fabs((double)cov - kalman.cov[r][c]));
            }
        }
        if (each != NULL) {
            worst = fmax(worst, fabs((double)mean[ALL_LOGLIK] - kalman.loglik) / (1.0 + fabs(kalman.loglik)));
        }
    }
    return worst;
}

void test_with_all_states_linear_the_shared_form_is_the_kalman_filter(void)
{
    pfl_marginal_shared_t s = {.model = all_linear(),
                               .cov = {25.0f, 0.0f, 0.0f, 0.0f, 25.0f, 0.0f, 0.0f, 4.0f, 0.0f, 4.0f}};
    const double worst = distance_to_kalman(&s, NULL);
    TEST_ASSERT_TRUE(worst > 0.0);
    TEST_ASSERT_TRUE(worst < 1e-4);
}

void test_with_all_states_linear_each_particle_is_the_kalman_filter(void)
{
    pfl_marginal_each_t s = {.model = all_linear(), .cov = ALL_COV, .work = work};
    const double worst = distance_to_kalman(NULL, &s);
    TEST_ASSERT_TRUE(worst > 0.0);
    TEST_ASSERT_TRUE(worst < 1e-4);
}

/* ---- A mixed model with constant matrices ------------------------------------------------------------------------- */

/* n <- atan n + l0 + v, l turning slowly; n seen through a square, l as a sum. Four columns of the bootstrap filter: n
 * and l; of the marginalised one: n, the means, the covariance of the `each` form, the log-likelihood. */
enum { MIX_L = 3, MIX_COV = 1 + MIX_L, MIX_LOGLIK = MIX_COV + 6, MIX_STATES };

static const float turn[MIX_L][MIX_L] = {{1.0f, 0.3f, 0.0f}, {0.0f, 0.92f, -0.3f}, {0.0f, 0.3f, 0.92f}};
static const float sum_of[MIX_L] = {1.0f, -1.0f, 1.0f};

#define MIX_SIGMA 0.1f
#define MIX_SEEN_VARIANCE 0.02f

static float seen_square(float n)
{
    return 0.1f * n * fabsf(n);
}

static void mix_move_n(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    (void)user;
    (void)u;
    (void)dt_s;
    for (uint32_t i = 0u; i < p->n; i++) {
        p->x[i] = atanf(p->x[i]);
    }
}

static void mix_move(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    mix_move_n(user, u, dt_s, p);
    for (uint32_t i = 0u; i < p->n; i++) {
        const float l[MIX_L] = {PFL_STATE(p, 1)[i], PFL_STATE(p, 2)[i], PFL_STATE(p, 3)[i]};
        p->x[i] += l[0] + MIX_SIGMA * PFL_NOISE(p, 0)[i];
        for (uint32_t r = 0u; r < MIX_L; r++) {
            PFL_STATE(p, 1u + r)
            [i] = turn[r][0] * l[0] + turn[r][1] * l[1] + turn[r][2] * l[2] + MIX_SIGMA * PFL_NOISE(p, 1u + r)[i];
        }
    }
}

static void mix_draw(void *user, const pfl_batch_t *p)
{
    const uint32_t states = *(const uint32_t *)user;
    for (uint32_t d = 0u; d < states; d++) {
        for (uint32_t i = 0u; i < p->n; i++) {
            PFL_STATE(p, d)[i] = d == 0u ? PFL_NOISE(p, 0)[i] : 0.0f;
        }
    }
}

/* The forms' structures begin with the model, whose user tells the number of states. */
static void mix_draw_marginal(void *user, const pfl_batch_t *p)
{
    mix_draw(((pfl_marginal_t *)user)->user, p);
}

static void mix_square(void *user, const void *z, const pfl_view_t *p, float *ll)
{
    (void)user;
    for (uint32_t i = 0u; i < p->n; i++) {
        const float e = ((const float *)z)[0] - seen_square(p->x[i]);
        ll[i] = -0.5f * e * e / MIX_SEEN_VARIANCE;
    }
}

static void mix_sum(void *user, const void *z, const pfl_view_t *p, float *ll)
{
    (void)user;
    for (uint32_t i = 0u; i < p->n; i++) {
        const float *l = p->x + i;
        const float e = ((const float *)z)[1] - (l[p->stride] - l[2u * p->stride] + l[3u * p->stride]);
        ll[i] = -0.5f * e * e / MIX_SEEN_VARIANCE;
    }
}

static pfl_marginal_t mix_model(uint32_t *states)
{
    pfl_marginal_t m = {
        .predict = mix_move_n,
        .user = states,
        .linear = MIX_L,
        .mean = 1u,
        .driven = 1u,
        .measured = 1u,
        .loglik_state = MIX_LOGLIK,
        .drive = {{1.0f}},
        .drive_variance = {MIX_SIGMA * MIX_SIGMA},
        .process_cov = {MIX_SIGMA * MIX_SIGMA, 0.0f, 0.0f, MIX_SIGMA * MIX_SIGMA, 0.0f, MIX_SIGMA * MIX_SIGMA},
        .see_variance = {MIX_SEEN_VARIANCE},
    };
    for (uint32_t r = 0u; r < MIX_L; r++) {
        (void)memcpy(m.transition[r], turn[r], sizeof turn[r]);
    }
    (void)memcpy(m.see[0], sum_of, sizeof sum_of);
    return m;
}

typedef struct {
    pfl_marginal_shared_t *shared; /* null: not this form */
    bool marginal;
    double n_squares, l_squares; /* of the errors */
    uint64_t hash;               /* of n, rounded to 1e-3 */
} mix_t;

#define MIX_STEPS 100u

static void mix_fly(const pfl_config_t *config, uint64_t dice, mix_t *m)
{
    pfl_t *f = ut_filter(config);
    double n = ut_gaussian(&dice);
    double l[MIX_L] = {0.0};
    for (uint32_t step = 1u; step <= MIX_STEPS; step++) {
        double after[MIX_L];
        float mean[PFL_STATES_MAX];
        n = atan(n) + l[0] + (double)MIX_SIGMA * ut_gaussian(&dice);
        for (uint32_t r = 0u; r < MIX_L; r++) {
            after[r] = (double)MIX_SIGMA * ut_gaussian(&dice);
            for (uint32_t c = 0u; c < MIX_L; c++) {
                after[r] += (double)turn[r][c] * l[c];
            }
        }
        (void)memcpy(l, after, sizeof l);
        const double sigma = sqrt((double)MIX_SEEN_VARIANCE);
        const float z[2] = {(float)(0.1 * n * fabs(n) + sigma * ut_gaussian(&dice)),
                            (float)(l[0] - l[1] + l[2] + sigma * ut_gaussian(&dice))};
        const pfl_marginal_input_t in = {NULL, &z[1]};
        if (m->shared != NULL) {
            pfl_marginal_shared_step(m->shared, true);
        }
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(f, step * SECOND_US, m->marginal ? (const void *)&in : NULL));
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(f, 0u, step * SECOND_US, z));
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(f, 1u, step * SECOND_US, z));
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(f, mean, NULL));
        m->n_squares += ((double)mean[0] - n) * ((double)mean[0] - n);
        for (uint32_t r = 0u; r < MIX_L; r++) {
            m->l_squares += ((double)mean[1u + r] - l[r]) * ((double)mean[1u + r] - l[r]);
        }
        const int32_t rounded = (int32_t)lround((double)mean[0] * 1e3);
        m->hash = ut_fnv(m->hash, &rounded, sizeof rounded);
    }
}

static pfl_config_t mix_config(uint32_t particles, const pfl_sensor_t *sensors)
{
    return (pfl_config_t){
        .abi = PFL_ABI,
        .particles = particles,
        .sensor_count = 2u,
        .moments = PFL_MOMENTS_MEAN,
        .ess_ratio = 0.5f,
        .sensors = sensors,
    };
}

#define MIX_RUNS 12u

static mix_t mix_bootstrap(uint32_t particles)
{
    uint32_t states = 4u;
    const pfl_sensor_t sensors[] = {{.loglik = mix_square}, {.loglik = mix_sum}};
    pfl_config_t config = mix_config(particles, sensors);
    mix_t m = {.hash = UT_FNV_SEED};
    config.states = 4u;
    config.noises = 4u;
    config.predict = mix_move;
    config.draw = mix_draw;
    config.user = &states;
    for (uint32_t run = 0u; run < MIX_RUNS; run++) {
        config.seed = run;
        mix_fly(&config, 1000u + run, &m);
    }
    return m;
}

static mix_t mix_marginal(uint32_t particles, bool each_form)
{
    uint32_t states = MIX_STATES;
    const pfl_marginal_t model = mix_model(&states);
    pfl_marginal_shared_t shared = {.model = model};
    pfl_marginal_each_t each = {.model = model, .cov = MIX_COV, .work = work};
    void *user = each_form ? (void *)&each : (void *)&shared;
    const pfl_sensor_t sensors[] = {{.loglik = mix_square}, {.loglik = pfl_marginal_loglik, .user = user}};
    pfl_config_t config = mix_config(particles, sensors);
    mix_t m = {.shared = each_form ? NULL : &shared, .marginal = true, .hash = UT_FNV_SEED};
    config.states = MIX_STATES;
    config.noises = 1u;
    config.predict = each_form ? pfl_marginal_each_predict : pfl_marginal_shared_predict;
    config.draw = mix_draw_marginal;
    config.user = user;
    for (uint32_t run = 0u; run < MIX_RUNS; run++) {
        shared = (pfl_marginal_shared_t){.model = model};
        config.seed = run;
        mix_fly(&config, 1000u + run, &m);
    }
    return m;
}

void test_on_a_mixed_model_200_particles_reach_the_bootstrap_filter_at_3000(void)
{
    const mix_t plain = mix_bootstrap(3000u);
    const mix_t marginal = mix_marginal(200u, false);
    const mix_t few = mix_bootstrap(200u); /* or the comparison would say nothing */
    TEST_ASSERT_TRUE(marginal.n_squares <= 1.02 * plain.n_squares);
    TEST_ASSERT_TRUE(marginal.l_squares <= 1.02 * plain.l_squares);
    TEST_ASSERT_TRUE(marginal.l_squares < few.l_squares);
}

void test_with_constant_matrices_both_forms_are_the_same_filter(void)
{
    const mix_t shared = mix_marginal(40u, false);
    const mix_t each = mix_marginal(40u, true);
    TEST_ASSERT_DOUBLE_WITHIN(0.01 * shared.n_squares, shared.n_squares, each.n_squares);
    TEST_ASSERT_DOUBLE_WITHIN(0.01 * shared.l_squares, shared.l_squares, each.l_squares);
}

/* One step of both forms, no element of any matrix zero: the same means, driven states and covariance, over two strips
 * and a part of one. */
void test_with_full_matrices_both_forms_make_the_same_step(void)
{
    enum { TWO_N = 40, TWO_COV = 4, TWO_LOGLIK = 7, TWO_STATES };
    const pfl_marginal_t model = {
        .linear = 2u,
        .mean = 2u,
        .driven = 2u,
        .measured = 1u,
        .state = {0u, 1u},
        .noise = {0u, 1u},
        .loglik_state = TWO_LOGLIK,
        .drive = {{1.0f, -0.5f}, {0.75f, 2.0f}},
        .drive_variance = {0.25f, 0.5f},
        .transition = {{0.9f, 0.3f}, {-0.2f, 0.8f}},
        .drift = {0.1f, -0.4f},
        .process_cov = {0.2f, 0.05f, 0.3f},
        .see = {{1.0f, 0.5f}},
        .see_variance = {0.4f},
    };
    pfl_marginal_shared_t shared = {.model = model, .cov = {1.5f, 0.25f, 0.75f}};
    pfl_marginal_each_t each = {.model = model, .cov = TWO_COV, .work = work};
    static float x[2][TWO_STATES * TWO_N];
    static float noise[2u * PFL_BATCH];
    uint64_t dice = 31u;
    const float z = 0.3f;
    const pfl_marginal_input_t in = {NULL, &z};
    for (uint32_t k = 0u; k < 2u * PFL_BATCH; k++) {
        noise[k] = (float)ut_gaussian(&dice);
    }
    for (uint32_t k = 0u; k < TWO_STATES * TWO_N; k++) {
        const uint32_t d = k / TWO_N;
        x[0][k] = ((d >= TWO_COV) && (d < TWO_LOGLIK)) ? shared.cov[d - TWO_COV] : (float)ut_gaussian(&dice);
    }
    (void)memcpy(x[1], x[0], sizeof x[0]);
    const pfl_batch_t for_shared = {x[0], TWO_N, noise, 0u, TWO_N};
    const pfl_batch_t for_each = {x[1], TWO_N, noise, 0u, TWO_N};
    pfl_marginal_shared_step(&shared, true);
    pfl_marginal_shared_predict(&shared, &in, 1.0f, &for_shared);
    pfl_marginal_each_predict(&each, &in, 1.0f, &for_each);
    for (uint32_t k = 0u; k < TWO_COV * TWO_N; k++) {
        TEST_ASSERT_FLOAT_WITHIN(1e-5f, x[0][k], x[1][k]);
    }
    for (uint32_t k = TWO_COV * TWO_N; k < TWO_LOGLIK * TWO_N; k++) {
        TEST_ASSERT_FLOAT_WITHIN(1e-6f, shared.cov[(k / TWO_N) - TWO_COV], x[1][k]);
    }
}

/* ---- A mixed model whose matrices depend on the particle: an unknown rate of turn ---------------------------------- */

enum { CT_RATE, CT_X, CT_Y, CT_VX, CT_VY, CT_BOOTSTRAP_STATES, CT_COV = 5, CT_LOGLIK = 15, CT_STATES };

#define CT_RATE_STEP 0.03f
#define CT_ACCEL 0.3f
#define CT_SEEN_VARIANCE 9.0f
static const float ct_start[5] = {0.1f, 0.0f, 0.0f, 15.0f, 0.0f};      /* mean */
static const float ct_variance[5] = {0.04f, 25.0f, 25.0f, 9.0f, 9.0f}; /* and variance at the start */

/* Speed turns by the rate; the way is that of the mean of both speeds. */
static void ct_matrices(void *user, const void *u, float dt_s, const pfl_view_t *p, float *drive, float *transition)
{
    (void)user;
    (void)u;
    (void)drive;
    for (uint32_t i = 0u; i < p->n; i++) {
        float s, c;
        pfl_sincosf(dt_s * p->x[i], &s, &c);
        const float way = 0.5f * dt_s;
        const float rows[4][4] = {{1.0f, 0.0f, way * (1.0f + c), -way * s},
                                  {0.0f, 1.0f, way * s, way * (1.0f + c)},
                                  {0.0f, 0.0f, c, -s},
                                  {0.0f, 0.0f, s, c}};
        for (uint32_t k = 0u; k < 16u; k++) {
            transition[k * PFL_MARGINAL_STRIP + i] = rows[k / 4u][k % 4u];
        }
    }
}

static void ct_turn(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    (void)user;
    (void)u;
    (void)dt_s;
    for (uint32_t i = 0u; i < p->n; i++) {
        p->x[i] += CT_RATE_STEP * PFL_NOISE(p, 0)[i];
    }
}

static void ct_move(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    for (uint32_t i = 0u; i < p->n; i++) {
        float s, c;
        float *vx = &PFL_STATE(p, CT_VX)[i];
        float *vy = &PFL_STATE(p, CT_VY)[i];
        pfl_sincosf(dt_s * p->x[i], &s, &c);
        const float after_x = c * *vx - s * *vy;
        const float after_y = s * *vx + c * *vy;
        PFL_STATE(p, CT_X)[i] += 0.5f * dt_s * (*vx + after_x) + CT_ACCEL * PFL_NOISE(p, 1)[i];
        PFL_STATE(p, CT_Y)[i] += 0.5f * dt_s * (*vy + after_y) + CT_ACCEL * PFL_NOISE(p, 2)[i];
        *vx = after_x + CT_ACCEL * PFL_NOISE(p, 3)[i];
        *vy = after_y + CT_ACCEL * PFL_NOISE(p, 4)[i];
    }
    ct_turn(user, u, dt_s, p);
}

static void ct_draw(void *user, const pfl_batch_t *p)
{
    (void)user;
    for (uint32_t d = 0u; d < 5u; d++) {
        for (uint32_t i = 0u; i < p->n; i++) {
            PFL_STATE(p, d)[i] = ct_start[d] + sqrtf(ct_variance[d]) * PFL_NOISE(p, d)[i];
        }
    }
}

static void ct_draw_marginal(void *user, const pfl_batch_t *p)
{
    ct_draw(user, p);
    for (uint32_t d = 1u; d < CT_STATES; d++) {
        for (uint32_t i = 0u; i < p->n; i++) {
            PFL_STATE(p, d)[i] = d < 5u ? ct_start[d] : 0.0f;
        }
    }
    for (uint32_t d = 0u, at = CT_COV; d < 4u; at += 4u - d, d++) {
        for (uint32_t i = 0u; i < p->n; i++) {
            PFL_STATE(p, at)[i] = ct_variance[1u + d];
        }
    }
}

static void ct_position(void *user, const void *z, const pfl_view_t *p, float *ll)
{
    const float *at = (const float *)z;
    (void)user;
    for (uint32_t i = 0u; i < p->n; i++) {
        const float ex = at[0] - p->x[CT_X * p->stride + i];
        const float ey = at[1] - p->x[CT_Y * p->stride + i];
        ll[i] = -0.5f * (ex * ex + ey * ey) / CT_SEEN_VARIANCE;
    }
}

/* Squares of the errors in position over 100 steps of 12 flights. */
static double ct_fly(const pfl_config_t *given, bool marginal)
{
    pfl_config_t config = *given;
    double squares = 0.0;
    for (uint32_t run = 0u; run < 12u; run++) {
        uint64_t dice = 50u + run;
        double rate = 0.1, x = 0.0, y = 0.0, vx = 15.0, vy = 0.0;
        config.seed = run;
        pfl_t *f = ut_filter(&config);
        for (uint32_t step = 1u; step <= 100u; step++) {
            const double ax = cos(rate) * vx - sin(rate) * vy;
            const double ay = sin(rate) * vx + cos(rate) * vy;
            x += 0.5 * (vx + ax) + (double)CT_ACCEL * ut_gaussian(&dice);
            y += 0.5 * (vy + ay) + (double)CT_ACCEL * ut_gaussian(&dice);
            vx = ax + (double)CT_ACCEL * ut_gaussian(&dice);
            vy = ay + (double)CT_ACCEL * ut_gaussian(&dice);
            rate += (double)CT_RATE_STEP * ut_gaussian(&dice);
            const float z[2] = {(float)(x + 3.0 * ut_gaussian(&dice)), (float)(y + 3.0 * ut_gaussian(&dice))};
            const pfl_marginal_input_t in = {NULL, z};
            float mean[PFL_STATES_MAX];
            TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(f, step * SECOND_US, marginal ? (const void *)&in : NULL));
            TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(f, 0u, step * SECOND_US, z));
            TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(f, mean, NULL));
            squares += ((double)mean[CT_X] - x) * ((double)mean[CT_X] - x) +
                       ((double)mean[CT_Y] - y) * ((double)mean[CT_Y] - y);
        }
    }
    return squares;
}

static double ct_bootstrap(uint32_t particles)
{
    const pfl_sensor_t sensor = {.loglik = ct_position};
    const pfl_config_t config = {.abi = PFL_ABI,
                                 .particles = particles,
                                 .states = CT_BOOTSTRAP_STATES,
                                 .noises = 5u,
                                 .sensor_count = 1u,
                                 .moments = PFL_MOMENTS_MEAN,
                                 .ess_ratio = 0.5f,
                                 .sensors = &sensor,
                                 .predict = ct_move,
                                 .draw = ct_draw};
    return ct_fly(&config, false);
}

static double ct_marginal(uint32_t particles)
{
    const float q = CT_ACCEL * CT_ACCEL;
    pfl_marginal_each_t each = {
        .model = {.predict = ct_turn,
                  .linear = 4u,
                  .mean = CT_X,
                  .measured = 2u,
                  .loglik_state = CT_LOGLIK,
                  .transition = {{1.0f, 0.0f, 1.0f, 1.0f},
                                 {0.0f, 1.0f, 1.0f, 1.0f},
                                 {0.0f, 0.0f, 1.0f, 1.0f},
                                 {0.0f, 0.0f, 1.0f, 1.0f}},
                  .process_cov = {q, 0.0f, 0.0f, 0.0f, q, 0.0f, 0.0f, q, 0.0f, q},
                  .see = {{1.0f}, {0.0f, 1.0f}},
                  .see_variance = {CT_SEEN_VARIANCE, CT_SEEN_VARIANCE}},
        .matrices = ct_matrices,
        .cov = CT_COV,
        .work = work,
    };
    const pfl_sensor_t sensor = {.loglik = pfl_marginal_loglik, .user = &each};
    const pfl_config_t config = {.abi = PFL_ABI,
                                 .particles = particles,
                                 .states = CT_STATES,
                                 .noises = 1u,
                                 .sensor_count = 1u,
                                 .moments = PFL_MOMENTS_MEAN,
                                 .ess_ratio = 0.5f,
                                 .sensors = &sensor,
                                 .predict = pfl_marginal_each_predict,
                                 .draw = ct_draw_marginal,
                                 .user = &each};
    return ct_fly(&config, true);
}

void test_with_a_covariance_each_200_particles_reach_the_bootstrap_filter_at_3000(void)
{
    const double plain = ct_bootstrap(3000u);
    const double marginal = ct_marginal(200u);
    const double few = ct_bootstrap(200u);
    TEST_ASSERT_TRUE(marginal <= 1.02 * plain);
    TEST_ASSERT_TRUE(marginal < few);
}

/* ---- Keeping and bringing back ------------------------------------------------------------------------------------ */

/* The shared covariance is the caller's: put back with the snapshot, the flight goes on with the same bits. */
void test_snapshot_and_covariance_together_continue_the_flight(void)
{
    uint32_t states = MIX_STATES;
    pfl_marginal_shared_t s = {.model = mix_model(&states)};
    const pfl_sensor_t sensors[] = {{.loglik = mix_square}, {.loglik = pfl_marginal_loglik, .user = &s}};
    pfl_config_t config = mix_config(50u, sensors);
    float first[MIX_STATES];
    float again[MIX_STATES];
    const float z[2] = {0.2f, -0.3f};
    const pfl_marginal_input_t in = {NULL, &z[1]};
    config.states = MIX_STATES;
    config.noises = 1u;
    config.predict = pfl_marginal_shared_predict;
    config.draw = mix_draw_marginal;
    config.user = &s;
    pfl_t *f = ut_filter(&config);
    unsigned char *kept = NULL;
    pfl_marginal_shared_t kept_covariance = s;
    for (uint32_t step = 1u; step <= 12u; step++) {
        if (step == 7u) {
            kept = ut_snapshot(f);
            kept_covariance = s;
        }
        pfl_marginal_shared_step(&s, true);
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(f, step * SECOND_US, &in));
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(f, 1u, step * SECOND_US, z));
    }
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(f, first, NULL));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_restore(f, kept, pfl_snapshot_bytes(f)));
    s = kept_covariance;
    for (uint32_t step = 7u; step <= 12u; step++) {
        pfl_marginal_shared_step(&s, true);
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(f, step * SECOND_US, &in));
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(f, 1u, step * SECOND_US, z));
    }
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(f, again, NULL));
    for (uint32_t d = 0u; d < MIX_STATES; d++) {
        TEST_ASSERT_EQUAL_UINT32(ut_bits(first[d]), ut_bits(again[d]));
    }
}

/* ---- One step by hand: one linear state, what is measured depends on the particle ------------------------------------ */

#define HAND 21u
enum { HAND_N, HAND_L, HAND_COV, HAND_LOGLIK, HAND_STATES };

static float hand[HAND_STATES * HAND];

/* z = n^2 + see l; `see` is 2, or 1 + n where it may depend on the particle. */
static void hand_measure(void *user, uint32_t k, const pfl_view_t *p, float *h, float *see)
{
    (void)user;
    (void)k;
    for (uint32_t i = 0u; i < p->n; i++) {
        const float n = PFL_STATE(p, HAND_N)[i];
        h[i] = n * n;
        if (see != NULL) {
            see[i] = 1.0f + n;
        }
    }
}

static pfl_marginal_t hand_model(uint16_t measured)
{
    for (uint32_t i = 0u; i < HAND; i++) {
        hand[HAND_N * HAND + i] = 0.1f * (float)(int32_t)i;
        hand[HAND_L * HAND + i] = 0.5f - 0.02f * (float)(int32_t)i;
        hand[HAND_COV * HAND + i] = 1.0f;
        hand[HAND_LOGLIK * HAND + i] = 77.0f;
    }
    return (pfl_marginal_t){.measure = hand_measure,
                            .linear = 1u,
                            .mean = HAND_L,
                            .measured = measured,
                            .loglik_state = HAND_LOGLIK,
                            .transition = {{0.8f}},
                            .drift = {0.1f},
                            .process_cov = {0.36f}, /* 0.64 + 0.36: the covariance is 1 again */
                            .see = {{2.0f}},
                            .see_variance = {0.25f}};
}

static void check_hand(bool each)
{
    for (uint32_t i = 0u; i < HAND; i++) {
        const double n = 0.1 * (double)i;
        const double before = 0.8 * (0.5 - 0.02 * (double)i) + 0.1;
        const double see = each ? 1.0 + n : 2.0;
        const double s = see * see + 0.25;
        const double e = 1.5 - n * n - see * before;
        const double loglik = -0.5 * (e * e / s + (each ? log(s / 0.25) : 0.0));
        TEST_ASSERT_DOUBLE_WITHIN(1e-5, before + see / s * e, (double)hand[HAND_L * HAND + i]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-5 * (1.0 - loglik), loglik, (double)hand[HAND_LOGLIK * HAND + i]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-5, each ? 1.0 - see * see / s : 1.0, (double)hand[HAND_COV * HAND + i]);
    }
}

void test_a_measurement_that_depends_on_the_particle(void)
{
    const float z[1] = {1.5f};
    const pfl_marginal_input_t in = {NULL, z};
    const pfl_batch_t batch = {hand, HAND, NULL, 0u, HAND};
    pfl_marginal_shared_t shared = {.model = hand_model(1u), .cov = {1.0f}};
    pfl_marginal_shared_step(&shared, true);
    pfl_marginal_shared_predict(&shared, &in, 1.0f, &batch);
    check_hand(false);
    pfl_marginal_each_t each = {.model = hand_model(1u), .cov = HAND_COV, .work = work};
    pfl_marginal_each_predict(&each, &in, 1.0f, &batch);
    check_hand(true);
}

static void check_only_carried(float cov)
{
    for (uint32_t i = 0u; i < HAND; i++) {
        const double carried = 0.8 * (0.5 - 0.02 * (double)i) + 0.1;
        TEST_ASSERT_DOUBLE_WITHIN(1e-6, carried, (double)hand[HAND_L * HAND + i]);
        TEST_ASSERT_EQUAL_FLOAT(cov, hand[HAND_COV * HAND + i]);
        TEST_ASSERT_EQUAL_FLOAT(77.0f, hand[HAND_LOGLIK * HAND + i]); /* no state of that kind is asked for */
    }
}

void test_a_model_that_measures_nothing_is_only_carried_on(void)
{
    const pfl_marginal_input_t in = {NULL, NULL};
    const pfl_batch_t batch = {hand, HAND, NULL, 0u, HAND};
    pfl_marginal_shared_t shared = {.model = hand_model(0u), .cov = {2.0f}};
    pfl_marginal_shared_step(&shared, false);
    TEST_ASSERT_FLOAT_WITHIN(1e-6f, 0.64f * 2.0f + 0.36f, shared.cov[0]);
    pfl_marginal_shared_predict(&shared, &in, 1.0f, &batch);
    check_only_carried(1.0f);
    pfl_marginal_each_t each = {.model = hand_model(0u), .cov = HAND_COV, .work = work};
    each.model.process_cov[0] = 0.11f;
    pfl_marginal_each_predict(&each, &in, 1.0f, &batch);
    check_only_carried(0.8f * 0.8f + 0.11f);
}
