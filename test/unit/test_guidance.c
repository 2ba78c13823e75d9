/* Guidance laws, the ring road and the models of the standoff scenario: the check values of its page, the gradient
 * against differences, bounds, and what happens to bad input. */
#include "support.h"

#include "pflight/pflight.h"

#include "unity.h"

#include <math.h>
#include <string.h>

#define RUNS 2000u

static const pfl_uav_limits_t limits = {15.0f, 7.0f, 0.7f};
static const pfl_uav_t pair[2] = {{140.0f, 10.0f, 1.9f, 15.0f, 0.5f}, {60.0f, -5.0f, 4.6f, 14.0f, 0.4f}};
static const pfl_target_t estimate = {98.0f, 3.0f, -0.2f, 5.0f};
static const pfl_standoff_state_t standoff = {36.0f, 2.0f, 36.0f, 1u};
static uint64_t dice;

void setUp(void)
{
    dice = 4711u;
}

void tearDown(void)
{
}

static float between(double lo, double hi)
{
    return (float)(lo + (hi - lo) * ut_uniform(&dice));
}

/* ---- Standoff distance --------------------------------------------------------------------------------------------- */

void test_standoff_distance_is_limited_in_size_and_rate(void)
{
    const pfl_standoff_t rule = {2.0f, 30.0f, 100.0f, 5.0f};
    pfl_standoff_state_t state = {0};

    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_standoff_step(&rule, 40.0f, 0.5f, &state));
    TEST_ASSERT_EQUAL_FLOAT(80.0f, state.distance_m);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, state.rate_mps);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_standoff_step(&rule, 1.0f, 0.5f, &state));
    TEST_ASSERT_EQUAL_FLOAT(77.5f, state.distance_m);
    TEST_ASSERT_EQUAL_FLOAT(-5.0f, state.rate_mps);
    TEST_ASSERT_EQUAL_FLOAT(30.0f, state.wanted_m);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_standoff_step(&rule, 39.5f, 0.5f, &state));
    TEST_ASSERT_EQUAL_FLOAT(79.0f, state.distance_m);
    TEST_ASSERT_EQUAL_FLOAT(3.0f, state.rate_mps);
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_standoff_step(&rule, -1.0f, 0.5f, &state));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_standoff_step(&rule, 1.0f, 0.0f, &state));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_standoff_step(&rule, (float)NAN, 0.5f, &state));
}

/* Every condition on its own: one number wrong, the others right. */
void test_standoff_refuses_each_bad_number_alone(void)
{
    const float bad[] = {0.0f, -1.0f, (float)NAN};
    const pfl_standoff_t good = {2.0f, 30.0f, 100.0f, 5.0f};
    pfl_standoff_state_t state = {50.0f, 1.0f, 60.0f, 3u};
    const pfl_standoff_state_t before = state;

    for (uint32_t k = 0u; k < 3u; k++) {
        pfl_standoff_t rule[4] = {good, good, good, good};
        rule[0].reach_gain = bad[k];
        rule[1].min_m = bad[k];
        rule[2].max_m = bad[k];
        rule[3].rate_max_mps = bad[k];
        for (uint32_t i = 0u; i < 4u; i++) {
            TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_standoff_step(&rule[i], 40.0f, 0.5f, &state));
        }
    }
    pfl_standoff_t endless = good;
    endless.max_m = (float)INFINITY;
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_standoff_step(&endless, 40.0f, 0.5f, &state));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_standoff_step(NULL, 40.0f, 0.5f, &state));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_standoff_step(&good, 40.0f, 0.5f, NULL));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_standoff_step(&good, 40.0f, (float)INFINITY, &state));
    pfl_standoff_t steep = good;
    steep.reach_gain = (float)INFINITY;
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_standoff_step(&steep, 0.0f, 0.5f, &state));
    pfl_standoff_t sudden = good;
    sudden.rate_max_mps = (float)INFINITY;
    TEST_ASSERT_EQUAL_INT(PFL_ERR_NONFINITE, pfl_standoff_step(&sudden, 40.0f, 1e-38f, &state));
    TEST_ASSERT_EQUAL_MEMORY(&before, &state, sizeof state);
    state.distance_m = (float)NAN;
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_standoff_step(&good, 40.0f, 0.5f, &state));
}

void test_standoff_counts_its_steps_and_stays_at_the_end_of_the_range(void)
{
    const pfl_standoff_t rule = {2.0f, 30.0f, 100.0f, 5.0f};
    pfl_standoff_state_t state = {50.0f, 0.0f, 50.0f, UINT32_MAX - 1u};

    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_standoff_step(&rule, 25.0f, 0.5f, &state));
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX, state.steps);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_standoff_step(&rule, 25.0f, 0.5f, &state));
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX, state.steps);
    TEST_ASSERT_EQUAL_FLOAT(50.0f, state.distance_m);
}

/* ---- LVFG ------------------------------------------------------------------------------------------------------------ */

void test_lvfg_gives_the_page_s_commands(void)
{
    const pfl_lvfg_t lvfg = {limits, 0.5f, 1.2f, false};
    pfl_planar_uav_input_t command[2];

    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_lvfg_command(&lvfg, pair, 2u, &estimate, &standoff, command));
    TEST_ASSERT_FLOAT_WITHIN(3e-5f, 16.829414f, command[0].speed_mps);
    TEST_ASSERT_FLOAT_WITHIN(2e-6f, 0.351869f, command[0].turn_radps);
    TEST_ASSERT_FLOAT_WITHIN(3e-5f, 13.170586f, command[1].speed_mps);
    TEST_ASSERT_FLOAT_WITHIN(2e-6f, 0.556670f, command[1].turn_radps);
}

void test_lvfg_with_target_motion_gives_the_page_s_commands(void)
{
    const pfl_lvfg_t lvfg = {limits, 1.5f, 1.2f, true};
    pfl_planar_uav_input_t command[2];

    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_lvfg_command(&lvfg, pair, 2u, &estimate, &standoff, command));
    TEST_ASSERT_FLOAT_WITHIN(4e-6f, -0.009554f, command[0].turn_radps);
    TEST_ASSERT_EQUAL_FLOAT(0.7f, command[1].turn_radps);
}

void test_lvfg_alone_flies_at_cruise(void)
{
    const pfl_lvfg_t lvfg = {limits, 0.5f, 1.2f, false};
    pfl_planar_uav_input_t command;

    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_lvfg_command(&lvfg, pair, 1u, &estimate, &standoff, &command));
    TEST_ASSERT_EQUAL_FLOAT(15.0f, command.speed_mps);
    TEST_ASSERT_FLOAT_WITHIN(2e-6f, 0.351869f, command.turn_radps);
}

/* On top of the target, and with targets faster than the UAV: finite, and within the limits. */
void test_lvfg_stays_within_its_limits(void)
{
    for (uint32_t run = 0u; run < RUNS; run++) {
        const pfl_lvfg_t lvfg = {limits, between(0.1, 3.0), between(0.0, 3.0), (run & 1u) != 0u};
        const bool above = (run % 10u) == 0u;
        const pfl_target_t target = {between(-200.0, 200.0), between(-200.0, 200.0), between(-40.0, 40.0),
                                     between(-40.0, 40.0)};
        const pfl_standoff_state_t rd = {between(1.0, 100.0), between(-20.0, 20.0), 1.0f, 1u};
        pfl_uav_t uav[2];
        pfl_planar_uav_input_t command[2];

        for (int i = 0; i < 2; i++) {
            uav[i] =
                (pfl_uav_t){above ? target.x_m : between(-200.0, 200.0), above ? target.y_m : between(-200.0, 200.0),
                            between(-100.0, 100.0), between(0.0, 30.0), between(-1.0, 1.0)};
        }
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_lvfg_command(&lvfg, uav, 2u, &target, &rd, command));
        for (int i = 0; i < 2; i++) {
            TEST_ASSERT_TRUE(command[i].speed_mps >= 8.0f && command[i].speed_mps <= 22.0f);
            TEST_ASSERT_TRUE(command[i].turn_radps >= -0.7f && command[i].turn_radps <= 0.7f);
        }
    }
}

void test_lvfg_refuses_bad_input_and_touches_nothing(void)
{
    pfl_lvfg_t lvfg = {limits, 0.5f, 1.2f, false};
    pfl_planar_uav_input_t command[2] = {{1.0f, 2.0f}, {3.0f, 4.0f}};
    pfl_target_t lost = estimate;
    pfl_uav_t crazy[2] = {pair[0], pair[1]};

    lost.x_m = (float)NAN;
    crazy[1].heading_rad = 1e9f;
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_lvfg_command(NULL, pair, 2u, &estimate, &standoff, command));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_lvfg_command(&lvfg, pair, 3u, &estimate, &standoff, command));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_lvfg_command(&lvfg, pair, 0u, &estimate, &standoff, command));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_lvfg_command(&lvfg, pair, 2u, &lost, &standoff, command));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_lvfg_command(&lvfg, crazy, 2u, &estimate, &standoff, command));
    lost.x_m = 1e30f;
    lost.y_m = -1e30f;
    TEST_ASSERT_EQUAL_INT(PFL_ERR_NONFINITE, pfl_lvfg_command(&lvfg, pair, 2u, &lost, &standoff, command));
    lvfg.limits.turn_max_radps = 0.0f;
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_lvfg_command(&lvfg, pair, 2u, &estimate, &standoff, command));
    TEST_ASSERT_EQUAL_FLOAT(1.0f, command[0].speed_mps);
    TEST_ASSERT_EQUAL_FLOAT(4.0f, command[1].turn_radps);
    lvfg.limits.turn_max_radps = 0.001f; /* slow is not bad */
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_lvfg_command(&lvfg, pair, 2u, &estimate, &standoff, command));
}

static pfl_status_t lvfg_with(const pfl_lvfg_t *lvfg, const pfl_uav_t *uav, const pfl_target_t *target,
                              const pfl_standoff_state_t *rd)
{
    pfl_planar_uav_input_t command[2];

    return pfl_lvfg_command(lvfg, uav, 2u, target, rd, command);
}

void test_lvfg_refuses_each_bad_number_alone(void)
{
    const pfl_lvfg_t good = {limits, 0.5f, 1.2f, false};
    const float nan = (float)NAN;

    TEST_ASSERT_EQUAL_INT(PFL_OK, lvfg_with(&good, pair, &estimate, &standoff));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, lvfg_with(&good, NULL, &estimate, &standoff));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, lvfg_with(&good, pair, NULL, &standoff));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, lvfg_with(&good, pair, &estimate, NULL));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_lvfg_command(&good, pair, 2u, &estimate, &standoff, NULL));
    for (uint32_t i = 0u; i < 11u; i++) {
        pfl_lvfg_t g = good;
        float *number[] = {&g.turn_gain,
                           &g.phase_gain,
                           &g.limits.cruise_mps,
                           &g.limits.speed_range_mps,
                           &g.limits.turn_max_radps,
                           &g.limits.speed_range_mps,
                           &g.limits.speed_range_mps,
                           &g.limits.turn_max_radps,
                           &g.limits.speed_range_mps,
                           &g.limits.turn_max_radps,
                           &g.limits.turn_max_radps};
        const float wrong[] = {nan, nan, (float)INFINITY, nan, nan, 15.0f, 0.0f, 0.0f, -1.0f, -1.0f, (float)INFINITY};
        *number[i] = wrong[i];
        TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, lvfg_with(&g, pair, &estimate, &standoff));
    }
    for (uint32_t i = 0u; i < 4u; i++) {
        pfl_target_t t = estimate;
        float *number[] = {&t.x_m, &t.y_m, &t.vx_mps, &t.vy_mps};
        *number[i] = nan;
        TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, lvfg_with(&good, pair, &t, &standoff));
    }
    for (uint32_t i = 0u; i < 6u; i++) {
        pfl_uav_t u[2] = {pair[0], pair[1]};
        float *number[] = {&u[1].x_m,        &u[1].y_m,         &u[1].speed_mps,
                           &u[1].turn_radps, &u[1].heading_rad, &u[1].heading_rad};
        *number[i] = (i < 4u) ? nan : ((i == 4u) ? -1601.0f : 1601.0f);
        TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, lvfg_with(&good, u, &estimate, &standoff));
    }
    for (uint32_t i = 0u; i < 3u; i++) {
        pfl_standoff_state_t rd = standoff;
        float *number[] = {&rd.distance_m, &rd.distance_m, &rd.rate_mps};
        *number[i] = (i == 1u) ? 0.0f : nan;
        TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, lvfg_with(&good, pair, &estimate, &rd));
    }
}

/* The second UAV is ahead of the first by less than half an orbit, by more, or just behind: who is faster, and by how much. */
void test_lvfg_keeps_the_phase_whatever_the_gap(void)
{
    static const double gaps[] = {0.5, 3.0, 3.3, 6.0, -0.5};
    const pfl_lvfg_t lvfg = {limits, 0.5f, 0.01f, false};
    const pfl_target_t target = {0.0f, 0.0f, 0.0f, 0.0f};
    const pfl_standoff_state_t close = {0.5f, 0.0f, 0.5f, 1u}; /* below a metre is legal too */
    pfl_planar_uav_input_t command[2];

    for (uint32_t k = 0u; k < 5u; k++) {
        const double gap = gaps[k] < 0.0 ? gaps[k] + 2.0 * 3.14159265358979 : gaps[k];
        const pfl_uav_t uav[2] = {{50.0f, 0.0f, 1.6f, 15.0f, 0.3f},
                                  {(float)(50.0 * cos(gaps[k])), (float)(50.0 * sin(gaps[k])), 1.6f, 15.0f, 0.3f}};
        const double faster = 0.01 * (gap - 3.14159265358979) * 36.0;
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_lvfg_command(&lvfg, uav, 2u, &target, &standoff, command));
        TEST_ASSERT_FLOAT_WITHIN(1e-5f, (float)(15.0 + faster), command[0].speed_mps);
        TEST_ASSERT_FLOAT_WITHIN(1e-5f, (float)(15.0 - faster), command[1].speed_mps);
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_lvfg_command(&lvfg, uav, 2u, &target, &close, command));
    }
}

/* Legal numbers whose commands are not finite: of the first UAV, of the second, and of the phase. */
void test_lvfg_hands_out_nothing_that_is_not_finite(void)
{
    pfl_lvfg_t g = {limits, 0.5f, 1.2f, false};
    pfl_uav_t far[2] = {pair[0], pair[1]};

    far[0].x_m = 3e38f;
    TEST_ASSERT_EQUAL_INT(PFL_ERR_NONFINITE, lvfg_with(&g, far, &estimate, &standoff));
    far[0] = pair[0];
    far[1].x_m = 3e38f;
    TEST_ASSERT_EQUAL_INT(PFL_ERR_NONFINITE, lvfg_with(&g, far, &estimate, &standoff));
    g.phase_gain = 3e38f;
    TEST_ASSERT_EQUAL_INT(PFL_ERR_NONFINITE, lvfg_with(&g, pair, &estimate, &standoff));
    g.phase_gain = 1.2f;
    TEST_ASSERT_EQUAL_INT(PFL_OK, lvfg_with(&g, pair, &estimate, &standoff));
}

/* ---- NMPC ------------------------------------------------------------------------------------------------------------ */

static pfl_nmpc_work_t work;

static pfl_nmpc_t page_nmpc(void)
{
    return (pfl_nmpc_t){
        .limits = limits,
        .dt_s = 0.5f,
        .lag_share = 0.7768698f,
        .turn_nominal_radps = 0.5f,
        .distance_weight = 500.0f / 6.0f,
        .phase_weight = 100.0f / 6.0f,
        .distance_weight_last = 500.0f,
        .phase_weight_last = 100.0f,
        .speed_weight = 100.0f,
        .turn_weight = 50.0f,
        .penalty = 1000.0f,
        .separation_m = 30.0f,
        .phase_form = PFL_PHASE_PRODUCT,
    };
}

static pfl_nmpc_plan_t constant_plan(float speed_mps, float turn_radps)
{
    pfl_nmpc_plan_t plan;

    for (uint32_t k = 0u; k < PFL_NMPC_STEPS; k++) {
        plan.speed_mps[k] = speed_mps;
        plan.turn_radps[k] = turn_radps;
    }
    return plan;
}

void test_nmpc_predicts_as_the_page(void)
{
    const pfl_nmpc_t nmpc = page_nmpc();
    const pfl_nmpc_plan_t plan = constant_plan(15.5f, 0.45f);
    pfl_nmpc_path_t path;
    pfl_uav_t last;

    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_nmpc_rollout(&nmpc, &pair[0], &plan, &path, &last));
    TEST_ASSERT_FLOAT_WITHIN(5e-5f, 105.991739f, last.x_m);
    TEST_ASSERT_FLOAT_WITHIN(5e-5f, 35.834912f, last.y_m);
    TEST_ASSERT_FLOAT_WITHIN(2e-6f, 3.282176f, last.heading_rad);
    TEST_ASSERT_FLOAT_WITHIN(5e-6f, 15.499938f, last.speed_mps);
    TEST_ASSERT_FLOAT_WITHIN(1e-6f, 0.450006f, last.turn_radps);
}

void test_nmpc_cost_and_gradient_are_the_page_s(void)
{
    static const float speed[PFL_NMPC_STEPS] = {-1.695834f, -0.216203f, 1.143917f, 2.154337f, 2.493370f, 1.020408f};
    static const float turn[PFL_NMPC_STEPS] = {167.517373f, 117.357759f, 67.902665f,
                                               24.874483f,  -5.102041f,  -5.102041f};
    pfl_nmpc_t nmpc = page_nmpc();
    const pfl_nmpc_plan_t plan = constant_plan(15.5f, 0.45f);
    pfl_nmpc_path_t target;
    pfl_nmpc_path_t other;
    pfl_nmpc_plan_t gradient;
    float cost;

    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_nmpc_extrapolate(&nmpc, &estimate, &target));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_nmpc_rollout(&nmpc, &pair[1], &plan, &other, NULL));
    const pfl_nmpc_problem_t problem = {pair[0], &target, &other, 36.0f};
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_nmpc_cost(&nmpc, &problem, &plan, &work, &cost, &gradient));
    TEST_ASSERT_FLOAT_WITHIN(2e-4f, 149.452512f, cost);
    for (uint32_t k = 0u; k < PFL_NMPC_STEPS; k++) {
        TEST_ASSERT_FLOAT_WITHIN(1e-4f, speed[k], gradient.speed_mps[k]);
        TEST_ASSERT_FLOAT_WITHIN(4e-4f, turn[k], gradient.turn_radps[k]);
    }
    nmpc.phase_form = PFL_PHASE_DIRECTION;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_nmpc_cost(&nmpc, &problem, &plan, &work, &cost, &gradient));
    TEST_ASSERT_FLOAT_WITHIN(2e-4f, 152.643741f, cost);
    TEST_ASSERT_FLOAT_WITHIN(1e-4f, -2.233991f, gradient.speed_mps[0]);
    TEST_ASSERT_FLOAT_WITHIN(4e-4f, 168.587269f, gradient.turn_radps[0]);
}

/* A situation in which every term counts: limits exceeded, the pair too close, anywhere around the target. */
typedef struct {
    pfl_nmpc_t nmpc;
    pfl_nmpc_path_t target, other;
    pfl_nmpc_problem_t problem;
    pfl_nmpc_plan_t plan;
} situation_t;

static void make_situation(situation_t *s, uint32_t run)
{
    const pfl_target_t target = {between(-20.0, 20.0), between(-20.0, 20.0), between(-6.0, 6.0), between(-6.0, 6.0)};
    pfl_uav_t uav[2];
    pfl_nmpc_plan_t plan[2];

    s->nmpc = page_nmpc();
    s->nmpc.phase_form = (run & 1u) != 0u ? PFL_PHASE_DIRECTION : PFL_PHASE_PRODUCT;
    s->nmpc.lag_share = (run & 2u) != 0u ? 1.5f : 0.7768698f;
    for (int i = 0; i < 2; i++) {
        uav[i] = (pfl_uav_t){between(-60.0, 60.0), between(-60.0, 60.0), between(-6.0, 6.0), between(8.0, 22.0),
                             between(-0.7, 0.7)};
        for (uint32_t k = 0u; k < PFL_NMPC_STEPS; k++) {
            plan[i].speed_mps[k] = between(6.0, 24.0);
            plan[i].turn_radps[k] = between(-0.9, 0.9);
        }
    }
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_nmpc_extrapolate(&s->nmpc, &target, &s->target));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_nmpc_rollout(&s->nmpc, &uav[1], &plan[1], &s->other, NULL));
    s->plan = plan[0];
    s->problem = (pfl_nmpc_problem_t){uav[0], &s->target, (run % 5u) == 0u ? NULL : &s->other, between(30.0, 60.0)};
}

static double cost_with(const situation_t *s, float *number, float value)
{
    const float before = *number;
    float cost;

    *number = value;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_nmpc_cost(&s->nmpc, &s->problem, &s->plan, &work, &cost, NULL));
    *number = before;
    return (double)cost;
}

/* Differences of single precision are coarse: a wide step, and as tolerance its rounding and curvature, both measured on
 * the spot by a second step of half the width. */
static void check_slope(situation_t *s, float *number, float width, float slope)
{
    const float x = *number;
    const double whole = (cost_with(s, number, x + width) - cost_with(s, number, x - width)) / (2.0 * (double)width);
    const double half =
        (cost_with(s, number, x + 0.5f * width) - cost_with(s, number, x - 0.5f * width)) / (double)width;
    const double exact = (4.0 * half - whole) / 3.0; /* Richardson's: of fourth order */
    const double rounding = 4e-7 * cost_with(s, number, x) / (double)width;
    const double tolerance = 20.0 * rounding + fabs(half - whole) + 1e-3 * fabs(exact);

    TEST_ASSERT_DOUBLE_WITHIN(tolerance, exact, (double)slope);
}

void test_nmpc_gradient_is_that_of_the_cost(void)
{
    for (uint32_t run = 0u; run < 300u; run++) {
        situation_t s;
        pfl_nmpc_plan_t gradient;
        float cost;

        make_situation(&s, run);
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_nmpc_cost(&s.nmpc, &s.problem, &s.plan, &work, &cost, &gradient));
        for (uint32_t k = 0u; k < PFL_NMPC_STEPS; k++) {
            check_slope(&s, &s.plan.speed_mps[k], 0.03f, gradient.speed_mps[k]);
            check_slope(&s, &s.plan.turn_radps[k], 0.01f, gradient.turn_radps[k]);
        }
    }
}

/* The penalty alone, with all other weights zero: half of it times the square of what is too much, as a share of the
 * range, whichever way. */
void test_nmpc_penalty_is_the_same_both_ways(void)
{
    situation_t s;
    make_situation(&s, 0u);
    s.problem.pair = NULL;
    s.nmpc.distance_weight = s.nmpc.distance_weight_last = 0.0f;
    s.nmpc.phase_weight = s.nmpc.phase_weight_last = 0.0f;
    s.nmpc.speed_weight = s.nmpc.turn_weight = 0.0f;
    const pfl_uav_limits_t *l = &s.nmpc.limits;
    const double range = (double)(1.5f * l->speed_range_mps);
    const pfl_nmpc_plan_t slow = constant_plan((float)((double)l->cruise_mps - range), -1.5f * l->turn_max_radps);
    const pfl_nmpc_plan_t fast = constant_plan((float)((double)l->cruise_mps + range), 1.5f * l->turn_max_radps);
    const float expected = 0.5f * s.nmpc.penalty * (float)PFL_NMPC_STEPS * (0.25f + 0.25f);
    float cost;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_nmpc_cost(&s.nmpc, &s.problem, &slow, &work, &cost, NULL));
    TEST_ASSERT_FLOAT_WITHIN(1e-5f * expected, expected, cost);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_nmpc_cost(&s.nmpc, &s.problem, &fast, &work, &cost, NULL));
    TEST_ASSERT_FLOAT_WITHIN(1e-5f * expected, expected, cost);
}

/* A cost that is quadratic in one kind of command alone: the descent finds its minimum. */
void test_nmpc_finds_the_minimum_of_a_parabola(void)
{
    for (uint32_t kind = 0u; kind < 2u; kind++) {
        situation_t s;
        pfl_nmpc_report_t report;
        make_situation(&s, 0u);
        s.problem.pair = NULL;
        s.nmpc.distance_weight = s.nmpc.distance_weight_last = 0.0f;
        s.nmpc.phase_weight = s.nmpc.phase_weight_last = 0.0f;
        s.nmpc.penalty = 0.0f;
        s.nmpc.speed_weight = (kind == 0u) ? 100.0f : 0.0f;
        s.nmpc.turn_weight = (kind == 0u) ? 0.0f : 50.0f;
        const pfl_uav_limits_t *l = &s.nmpc.limits;
        s.plan = constant_plan(l->cruise_mps + 0.8f * l->speed_range_mps, -0.5f * l->turn_max_radps);
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_nmpc_solve(&s.nmpc, &s.problem, &s.plan, &work, &report));
        for (uint32_t k = 0u; k < PFL_NMPC_STEPS; k++) {
            if (kind == 0u) {
                TEST_ASSERT_FLOAT_WITHIN(0.01f * l->speed_range_mps, l->cruise_mps, s.plan.speed_mps[k]);
            } else {
                TEST_ASSERT_FLOAT_WITHIN(0.01f * l->turn_max_radps, s.nmpc.turn_nominal_radps, s.plan.turn_radps[k]);
            }
        }
    }
}

void test_nmpc_never_gets_worse_and_keeps_its_bound(void)
{
    uint32_t most = 0u;

    for (uint32_t run = 0u; run < RUNS; run++) {
        situation_t s;
        pfl_nmpc_report_t report;
        float before;

        make_situation(&s, run);
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_nmpc_cost(&s.nmpc, &s.problem, &s.plan, &work, &before, NULL));
        TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_nmpc_solve(&s.nmpc, &s.problem, &s.plan, &work, &report));
        TEST_ASSERT_TRUE(report.cost <= before);
        TEST_ASSERT_TRUE(report.evaluations >= 1u + PFL_NMPC_ITERATIONS);
        TEST_ASSERT_TRUE(report.evaluations <= PFL_NMPC_EVALUATIONS_MAX);
        most = report.evaluations > most ? report.evaluations : most;
        for (uint32_t k = 0u; k < PFL_NMPC_STEPS; k++) {
            TEST_ASSERT_TRUE(s.plan.speed_mps[k] >= 8.0f && s.plan.speed_mps[k] <= 22.0f);
            TEST_ASSERT_TRUE(s.plan.turn_radps[k] >= -0.7f && s.plan.turn_radps[k] <= 0.7f);
        }
    }
    TEST_ASSERT_TRUE(most > 9u);
}

/* A penalty so steep that no step goes down: every iteration spends all its trials, and that is the bound. */
void test_nmpc_worst_case_is_the_bound(void)
{
    pfl_nmpc_t nmpc = page_nmpc();
    pfl_nmpc_plan_t plan = constant_plan(30.0f, 0.45f);
    const pfl_nmpc_plan_t before = plan;
    pfl_nmpc_path_t target;
    pfl_nmpc_report_t report;

    nmpc.penalty = 1e12f;
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_nmpc_extrapolate(&nmpc, &estimate, &target));
    const pfl_nmpc_problem_t problem = {pair[0], &target, NULL, 36.0f};
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_nmpc_solve(&nmpc, &problem, &plan, &work, &report));
    TEST_ASSERT_EQUAL_UINT32(PFL_NMPC_EVALUATIONS_MAX, report.evaluations);
    TEST_ASSERT_EQUAL_UINT32(49u, report.evaluations);
    TEST_ASSERT_EQUAL_FLOAT(22.0f, plan.speed_mps[0]); /* kept, and clipped */
    TEST_ASSERT_EQUAL_FLOAT(before.turn_radps[0], plan.turn_radps[0]);
}

void test_nmpc_refuses_bad_input_and_touches_nothing(void)
{
    pfl_nmpc_t nmpc = page_nmpc();
    pfl_nmpc_plan_t plan = constant_plan(15.0f, 0.5f);
    const pfl_nmpc_plan_t before = plan;
    pfl_nmpc_path_t target;
    pfl_nmpc_report_t report = {0};

    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_nmpc_extrapolate(&nmpc, &estimate, &target));
    pfl_nmpc_problem_t problem = {pair[0], &target, NULL, 36.0f};
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_nmpc_solve(NULL, &problem, &plan, &work, &report));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_nmpc_solve(&nmpc, &problem, &plan, NULL, &report));
    nmpc.lag_share = 0.0f;
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_nmpc_solve(&nmpc, &problem, &plan, &work, &report));
    nmpc = page_nmpc();
    problem.distance_m = 0.0f;
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_nmpc_solve(&nmpc, &problem, &plan, &work, &report));
    problem.distance_m = 36.0f;
    target.x_m[3] = (float)INFINITY;
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_nmpc_solve(&nmpc, &problem, &plan, &work, &report));
    target.x_m[3] = 1e30f;
    TEST_ASSERT_EQUAL_INT(PFL_ERR_NONFINITE, pfl_nmpc_solve(&nmpc, &problem, &plan, &work, &report));
    TEST_ASSERT_EQUAL_MEMORY(&before, &plan, sizeof plan);
    TEST_ASSERT_EQUAL_UINT32(0u, report.evaluations);
}

void test_nmpc_refuses_each_bad_setting_alone(void)
{
    const pfl_nmpc_plan_t plan = constant_plan(15.0f, 0.5f);
    const pfl_nmpc_t good = page_nmpc();
    const float nan = (float)NAN;
    pfl_nmpc_path_t path;

    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_nmpc_rollout(&good, &pair[0], &plan, &path, NULL));
    for (uint32_t i = 0u; i < 13u; i++) {
        pfl_nmpc_t g = good;
        float *number[] = {&g.limits.cruise_mps,
                           &g.penalty,
                           &g.turn_nominal_radps,
                           &g.dt_s,
                           &g.dt_s,
                           &g.dt_s,
                           &g.lag_share,
                           &g.lag_share,
                           &g.separation_m,
                           &g.separation_m,
                           &g.separation_m,
                           &g.phase_weight,
                           &g.speed_weight};
        const float wrong[] = {nan,  (float)INFINITY, nan, nan, 0.0f, (float)INFINITY, 0.0f, 2.5f, nan,
                               0.0f, (float)INFINITY, nan, nan};
        *number[i] = wrong[i];
        TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_nmpc_rollout(&g, &pair[0], &plan, &path, NULL));
    }
    pfl_nmpc_t form = good;
    form.phase_form = (uint32_t)PFL_PHASE_DIRECTION + 1u;
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_nmpc_rollout(&form, &pair[0], &plan, &path, NULL));
}

void test_nmpc_predictions_refuse_each_bad_argument_alone(void)
{
    pfl_nmpc_plan_t plan = constant_plan(15.0f, 0.5f);
    pfl_nmpc_t nmpc = page_nmpc();
    pfl_nmpc_path_t path;
    pfl_uav_t uav = pair[0];
    pfl_target_t target = estimate;

    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_nmpc_rollout(NULL, &uav, &plan, &path, NULL));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_nmpc_rollout(&nmpc, NULL, &plan, &path, NULL));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_nmpc_rollout(&nmpc, &uav, NULL, &path, NULL));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_nmpc_rollout(&nmpc, &uav, &plan, NULL, NULL));
    uav.x_m = (float)NAN;
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_nmpc_rollout(&nmpc, &uav, &plan, &path, NULL));
    uav = pair[0];
    plan.turn_radps[5] = (float)NAN;
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_nmpc_rollout(&nmpc, &uav, &plan, &path, NULL));
    plan = constant_plan(15.0f, 0.5f);
    nmpc.dt_s = 5.0f;
    uav.speed_mps = 3e38f; /* its place overflows */
    TEST_ASSERT_EQUAL_INT(PFL_ERR_NONFINITE, pfl_nmpc_rollout(&nmpc, &uav, &plan, &path, NULL));
    uav = pair[0];
    plan.turn_radps[4] = 3e38f; /* the heading at the end */
    TEST_ASSERT_EQUAL_INT(PFL_ERR_NONFINITE, pfl_nmpc_rollout(&nmpc, &uav, &plan, &path, NULL));
    nmpc.dt_s = 0.5f;

    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_nmpc_extrapolate(NULL, &target, &path));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_nmpc_extrapolate(&nmpc, NULL, &path));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_nmpc_extrapolate(&nmpc, &target, NULL));
    target.vy_mps = 3e38f;
    nmpc.dt_s = 10.0f;
    TEST_ASSERT_EQUAL_INT(PFL_ERR_NONFINITE, pfl_nmpc_extrapolate(&nmpc, &target, &path));
    target.vy_mps = (float)NAN;
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_nmpc_extrapolate(&nmpc, &target, &path));
    nmpc.dt_s = (float)NAN;
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_nmpc_extrapolate(&nmpc, &estimate, &path));
}

void test_nmpc_cost_and_solve_refuse_each_bad_argument_alone(void)
{
    const pfl_nmpc_t nmpc = page_nmpc();
    const pfl_nmpc_t unset = {0};
    pfl_nmpc_plan_t plan = constant_plan(15.0f, 0.5f);
    pfl_nmpc_path_t target;
    pfl_nmpc_path_t other;
    float cost = 7.0f;

    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_nmpc_extrapolate(&nmpc, &estimate, &target));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_nmpc_rollout(&nmpc, &pair[1], &plan, &other, NULL));
    const pfl_nmpc_problem_t good = {pair[0], &target, &other, 36.0f};
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_nmpc_cost(NULL, &good, &plan, &work, &cost, NULL));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_nmpc_cost(&unset, &good, &plan, &work, &cost, NULL));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_nmpc_cost(&nmpc, NULL, &plan, &work, &cost, NULL));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_nmpc_cost(&nmpc, &good, NULL, &work, &cost, NULL));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_nmpc_cost(&nmpc, &good, &plan, NULL, &cost, NULL));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_nmpc_cost(&nmpc, &good, &plan, &work, NULL, NULL));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_nmpc_solve(&nmpc, NULL, &plan, &work, NULL));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_nmpc_solve(&nmpc, &good, NULL, &work, NULL));
    for (uint32_t i = 0u; i < 5u; i++) {
        pfl_nmpc_problem_t p = good;
        pfl_nmpc_path_t broken = other;
        broken.y_m[2] = (float)NAN;
        p.uav.y_m = (i == 0u) ? (float)NAN : p.uav.y_m;
        p.target = (i == 1u) ? NULL : p.target;
        p.pair = (i == 2u) ? &broken : p.pair;
        p.distance_m = (i == 3u) ? (float)INFINITY : ((i == 4u) ? -36.0f : p.distance_m);
        TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_nmpc_cost(&nmpc, &p, &plan, &work, &cost, NULL));
        TEST_ASSERT_EQUAL_INT(PFL_ERR_ARG, pfl_nmpc_solve(&nmpc, &p, &plan, &work, NULL));
    }
    plan.speed_mps[1] = 1e25f; /* its square overflows */
    TEST_ASSERT_EQUAL_INT(PFL_ERR_NONFINITE, pfl_nmpc_cost(&nmpc, &good, &plan, &work, &cost, NULL));
    TEST_ASSERT_EQUAL_FLOAT(7.0f, cost);
    plan.speed_mps[1] = 15.0f;
    pfl_nmpc_t steep =
        nmpc; /* the cost is finite, its slope is not: a small error under a huge weight, and a long way */
    steep.distance_weight_last = 3e38f;
    steep.dt_s = 3.0f;
    TEST_ASSERT_EQUAL_INT(PFL_ERR_NONFINITE, pfl_nmpc_cost(&steep, &good, &plan, &work, &cost, NULL));
    TEST_ASSERT_EQUAL_FLOAT(7.0f, cost);
    plan = constant_plan(15.0f, 0.5f);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_nmpc_solve(&nmpc, &good, &plan, &work, NULL)); /* a report is not wanted */
}

/* A pair on top of the target: lengths have a floor, nothing is divided by zero. */
void test_nmpc_with_the_pair_on_the_target_is_finite(void)
{
    const pfl_nmpc_t nmpc = page_nmpc();
    pfl_nmpc_plan_t plan = constant_plan(15.0f, 0.5f);
    pfl_nmpc_plan_t gradient;
    pfl_nmpc_path_t target;
    float cost;

    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_nmpc_extrapolate(&nmpc, &estimate, &target));
    const pfl_nmpc_problem_t problem = {pair[0], &target, &target, 36.0f};
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_nmpc_cost(&nmpc, &problem, &plan, &work, &cost, &gradient));
    TEST_ASSERT_TRUE(ut_finite(cost) && ut_finite(gradient.turn_radps[0]));
}

void test_nmpc_shift_repeats_the_last_commands(void)
{
    pfl_nmpc_plan_t plan = constant_plan(15.0f, 0.5f);

    plan.speed_mps[1] = 16.0f;
    plan.turn_radps[PFL_NMPC_STEPS - 1u] = 0.1f;
    pfl_nmpc_shift(&plan);
    TEST_ASSERT_EQUAL_FLOAT(16.0f, plan.speed_mps[0]);
    TEST_ASSERT_EQUAL_FLOAT(15.0f, plan.speed_mps[1]);
    TEST_ASSERT_EQUAL_FLOAT(0.1f, plan.turn_radps[PFL_NMPC_STEPS - 2u]);
    TEST_ASSERT_EQUAL_FLOAT(0.1f, plan.turn_radps[PFL_NMPC_STEPS - 1u]);
}
