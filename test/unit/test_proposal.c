/* The optimal proposal against Bayes' rule in double, against the Kalman filter, and against the bootstrap filter where
 * the measurement is sharp. */
#include "support.h"

#include "pflight/models.h"
#include "pflight/proposal.h"

#include "unity.h"

#include <math.h>
#include <string.h>

#define N 64u
#define DT_S 0.5f
#define ACCEL 1.5f

enum { LOGLIK = PFL_CV_STATES, STATES };

static float x[STATES * N];
static float noise[2u * PFL_BATCH];
static pfl_constant_velocity_t still; /* without its noise */
static pfl_proposal_t proposal;

/* Constant velocity, position seen: each noise drives position and speed. */
void setUp(void)
{
    uint64_t dice = 99u;
    const float kick = ACCEL * sqrtf(DT_S);

    for (uint32_t k = 0u; k < STATES * N; k++) {
        x[k] = (float)ut_gaussian(&dice);
    }
    for (uint32_t k = 0u; k < 2u * PFL_BATCH; k++) {
        noise[k] = (float)ut_gaussian(&dice);
    }
    proposal = (pfl_proposal_t){
        .predict = pfl_constant_velocity_predict,
        .user = &still,
        .loglik_state = LOGLIK,
        .count = 2u,
        .state = {PFL_CV_X, PFL_CV_Y},
        .noise = {0u, 1u},
        .other = {PFL_CV_VX, PFL_CV_VY},
        .sigma_noise = {0.5f * DT_S * kick, 0.5f * DT_S * kick},
        .sigma_other = {kick, kick},
        .sigma_measured = {0.3f, 0.7f},
    };
}

void tearDown(void)
{
    ut_arenas_end();
}

static void move(const float *z)
{
    const pfl_batch_t batch = {x, N, noise, 0u, N};
    const pfl_proposal_input_t in = {NULL, z};
    pfl_proposal_predict(&proposal, &in, DT_S, &batch);
}

/* The joint density of state and measurement is the same both ways: p(x|x') p(z|x) = p(x|x',z) p(z|x'), up to the
 * constants that log-likelihoods leave out. */
void test_proposal_times_weight_is_model_times_likelihood(void)
{
    const float z[2] = {0.4f, -1.1f};
    float before[STATES * N];
    float ll[N];
    const pfl_view_t view = {x, N, 0u, N};
    memcpy(before, x, sizeof x);
    move(z);
    pfl_proposal_loglik(&proposal, z, &view, ll);
    for (uint32_t i = 0u; i < N; i++) {
        double given = (double)ll[i];
        double plain = 0.0;
        for (uint32_t k = 0u; k < 2u; k++) {
            const double s = (double)proposal.sigma_noise[k];
            const double r = (double)proposal.sigma_measured[k];
            const double f = (double)before[k * N + i] + (double)DT_S * (double)before[(k + 2u) * N + i];
            const double w = ((double)x[k * N + i] - f) / s;
            const double v = ((double)z[k] - (double)x[k * N + i]) / r;
            const double n = (double)noise[k * PFL_BATCH + i];
            given -= 0.5 * n * n;
            plain -= 0.5 * (w * w + v * v);
            TEST_ASSERT_DOUBLE_WITHIN(2e-5, (double)before[(k + 2u) * N + i] + (double)proposal.sigma_other[k] * w,
                                      (double)x[(k + 2u) * N + i]);
        }
        TEST_ASSERT_DOUBLE_WITHIN(2e-4 * (1.0 + fabs(plain)), plain, given);
        TEST_ASSERT_TRUE(ll[i] <= 0.0f);
    }
}

void test_without_a_measurement_it_is_the_model(void)
{
    pfl_constant_velocity_t moving = {.sigma_accel = ACCEL};
    float expected[STATES * N];
    const pfl_batch_t other = {expected, N, noise, 0u, N};
    memcpy(expected, x, sizeof x);
    pfl_constant_velocity_predict(&moving, NULL, DT_S, &other);
    move(NULL);
    for (uint32_t i = 0u; i < PFL_CV_STATES * N; i++) {
        TEST_ASSERT_FLOAT_WITHIN(2e-6f, expected[i], x[i]);
    }
    for (uint32_t i = 0u; i < N; i++) {
        TEST_ASSERT_EQUAL_UINT32(0u, ut_bits(x[LOGLIK * N + i]));
    }
}

/* A component whose noise drives no other state leaves all others where the model puts them. */
void test_without_a_measurement_only_the_driven_states_move(void)
{
    float expected[STATES * N];
    const pfl_batch_t other = {expected, N, noise, 0u, N};
    memcpy(expected, x, sizeof x);
    pfl_constant_velocity_predict(&still, NULL, DT_S, &other);
    proposal.sigma_other[0] = 0.25f;
    proposal.sigma_other[1] = 0.0f;
    move(NULL);
    for (uint32_t i = 0u; i < N; i++) {
        TEST_ASSERT_EQUAL_UINT32(ut_bits(expected[PFL_CV_VY * N + i]), ut_bits(x[PFL_CV_VY * N + i]));
        TEST_ASSERT_TRUE(ut_bits(x[PFL_CV_VX * N + i]) != ut_bits(expected[PFL_CV_VX * N + i]));
    }
}

/* What has no noise is weighed only. */
void test_a_component_without_noise_is_only_weighed(void)
{
    const float z[1] = {0.5f};
    float before[STATES * N];
    proposal.count = 1u;
    proposal.sigma_noise[0] = 0.0f;
    proposal.sigma_other[0] = 0.0f;
    memcpy(before, x, sizeof x);
    move(z);
    for (uint32_t i = 0u; i < N; i++) {
        const double f = (double)before[i] + (double)DT_S * (double)before[2u * N + i];
        const double e = (0.5 - f) / (double)proposal.sigma_measured[0];
        TEST_ASSERT_FLOAT_WITHIN(1e-6f, (float)f, x[i]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-4 * (1.0 + e * e), -0.5 * e * e, (double)x[LOGLIK * N + i]);
        TEST_ASSERT_EQUAL_FLOAT(before[2u * N + i], x[2u * N + i]);
    }
}

/* Nor does such a component touch what it does not drive, however far off the measurement is. */
void test_a_component_that_drives_no_other_leaves_it_alone(void)
{
    const float z[2] = {3.0e38f, 3.0e38f};
    float expected[STATES * N];
    const pfl_batch_t other = {expected, N, noise, 0u, N};
    for (uint32_t i = 0u; i < N; i++) {
        x[i] = -3.0e38f;
    }
    memcpy(expected, x, sizeof x);
    pfl_constant_velocity_predict(&still, NULL, DT_S, &other);
    proposal.count = 1u;
    proposal.sigma_other[0] = 0.0f;
    move(z);
    TEST_ASSERT_EQUAL_MEMORY(&expected[PFL_CV_VX * N], &x[PFL_CV_VX * N], sizeof(float) * N);
}

/* ---- A sharp measurement: a random walk with steps of 1, seen to 0.02 --------------------------------------------- */

#define STEPS 200u
#define SHARP 0.02f

static void stay(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    (void)user;
    (void)u;
    (void)dt_s;
    (void)p;
}

static void walk(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    (void)user;
    (void)u;
    (void)dt_s;
    for (uint32_t i = 0u; i < p->n; i++) {
        p->x[i] += PFL_NOISE(p, 0)[i];
    }
}

/* Mean square distance of a filter's estimates from the Kalman filter's, over its variance. */
static double distance_to_kalman(const pfl_config_t *config)
{
    const double r = (double)SHARP * (double)SHARP;
    uint64_t dice = 5u;
    double truth = 0.0, kalman = 0.0, variance = 0.0, squares = 0.0;
    pfl_t *f = ut_filter(config);
    for (uint32_t k = 1u; k <= STEPS; k++) {
        truth += ut_gaussian(&dice);
        const float z = (float)(truth + (double)SHARP * ut_gaussian(&dice));
        const pfl_proposal_input_t in = {NULL, &z};
        float mean[2];
        variance = (variance + 1.0) * r / (variance + 1.0 + r);
        kalman += variance / r * ((double)z - kalman);
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_predict(f, k * 1000000ull, &in));
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_update(f, 0u, k * 1000000ull, &z));
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(f, mean, NULL));
        squares += ((double)mean[0] - kalman) * ((double)mean[0] - kalman) / variance;
    }
    return squares / (double)STEPS;
}

void test_where_the_measurement_is_sharp_a_tenth_of_the_particles_does_better(void)
{
    pfl_position_t position = {1u, {0u}, {1.0f / SHARP}};
    const pfl_sensor_t plain = {.loglik = pfl_position_loglik, .user = &position};
    pfl_proposal_t sharp = {.predict = stay, .loglik_state = 1u, .count = 1u, .sigma_noise = {1.0f}};
    const pfl_sensor_t given = {.loglik = pfl_proposal_loglik, .user = &sharp};
    pfl_config_t config = {.abi = PFL_ABI,
                           .particles = 1000u,
                           .states = 1u,
                           .noises = 1u,
                           .sensor_count = 1u,
                           .ess_ratio = 0.5f,
                           .seed = 3u,
                           .sensors = &plain,
                           .predict = walk};
    sharp.sigma_measured[0] = SHARP;
    const double bootstrap = distance_to_kalman(&config);
    config.particles = 100u;
    config.states = 2u;
    config.sensors = &given;
    config.predict = pfl_proposal_predict;
    config.user = &sharp;
    const double optimal = distance_to_kalman(&config);
    TEST_ASSERT_TRUE(optimal > 0.0);
    TEST_ASSERT_TRUE(optimal < bootstrap);
    TEST_ASSERT_TRUE(optimal < 1.5 / 100.0); /* as good as 100 independent draws from the posterior, or nearly */
}
