/* Nonlinear model predictive control for standoff tracking: guidance.h says what it minimises. The prediction is the
 * planar UAV with forward Euler on the way and the lags as shares; the gradient runs the same steps backwards. */
#include "guidance_core.h"

#include "math_kernels.h"
#include "sqrt_kernel.h"

#define STEPS PFL_NMPC_STEPS
#define NEAR_M 1.0e-3f /* closer than this to the target or the pair a direction means nothing: guards divisions */

#define STEP_FIRST 1.0e-3f
#define STEP_MIN 1.0e-5f
#define STEP_MAX 0.1f
#define STEP_AFTER_FAILURE 1.0e-4f
#define DESCENT_SHARE 1.0e-4f /* of the decrease that the gradient promises; less is no progress */

/* A predicted flight. */
typedef struct {
    pfl_nmpc_path_t path;
    float cosine[STEPS], sine[STEPS]; /* of the heading at the start of each step */
    float speed[STEPS + 1u];
    float heading, turn; /* at the end */
} flight_t;

/* What the caller's workspace holds. */
typedef struct {
    float pair_x[STEPS + 1u], pair_y[STEPS + 1u], pair_r[STEPS + 1u]; /* seen from the target */
    flight_t flight;
    pfl_nmpc_plan_t plan, candidate, gradient, fresh;
} work_t;

typedef char pfl_nmpc_work_fits[(sizeof(work_t) <= sizeof(pfl_nmpc_work_t)) ? 1 : -1];

/* A problem, with what does not depend on the plan. */
typedef struct {
    const pfl_nmpc_t *g;
    const pfl_nmpc_problem_t *problem;
    work_t *work;
    float over_rd2; /* 1 / rd^2 */
} context_t;

/* The place of step k, seen from target and pair. */
typedef struct {
    float x, y, r;           /* from the target */
    float rt;                /* error of the distance, relative */
    float dt;                /* of the phase, PFL_PHASE_PRODUCT */
    float ex, ey;            /* of the phase, PFL_PHASE_DIRECTION */
    float gap_x, gap_y, gap; /* from the pair */
    float close;             /* by how much the separation falls short, as a share; 0: enough */
} place_t;

/* ---- Prediction -------------------------------------------------------------------------------------------------- */

static void fly(const pfl_nmpc_t *g, const pfl_uav_t *uav, const pfl_nmpc_plan_t *plan, flight_t *f)
{
    float x = uav->x_m;
    float y = uav->y_m;
    float heading = pfl_wrap_pi_kernel(uav->heading_rad);
    float speed = uav->speed_mps;
    float turn = uav->turn_radps;
    for (uint32_t k = 0u; k < STEPS; k++) {
        const float way = g->dt_s * speed;
        pfl_sincos_kernel(heading, &f->sine[k], &f->cosine[k]);
        f->path.x_m[k] = x;
        f->path.y_m[k] = y;
        f->speed[k] = speed;
        x += way * f->cosine[k];
        y += way * f->sine[k];
        heading += g->dt_s * turn;
        speed += g->lag_share * (plan->speed_mps[k] - speed);
        turn += g->lag_share * (plan->turn_radps[k] - turn);
    }
    f->path.x_m[STEPS] = x;
    f->path.y_m[STEPS] = y;
    f->speed[STEPS] = speed;
    f->heading = heading;
    f->turn = turn;
}

/* ---- Cost -------------------------------------------------------------------------------------------------------- */

static float length_of(float x, float y)
{
    const float r = pfl_sqrt_kernel((x * x) + (y * y));
    return (r < NEAR_M) ? NEAR_M : r;
}

static context_t make_context(const pfl_nmpc_t *g, const pfl_nmpc_problem_t *problem, pfl_nmpc_work_t *work)
{
    work_t *w = (work_t *)(void *)work->numbers;
    const context_t c = {g, problem, w, 1.0f / (problem->distance_m * problem->distance_m)};
    for (uint32_t k = 0u; (problem->pair != NULL) && (k <= STEPS); k++) {
        w->pair_x[k] = problem->pair->x_m[k] - problem->target->x_m[k];
        w->pair_y[k] = problem->pair->y_m[k] - problem->target->y_m[k];
        w->pair_r[k] = length_of(w->pair_x[k], w->pair_y[k]);
    }
    return c;
}

static place_t look(const context_t *c, const pfl_nmpc_path_t *path, uint32_t k)
{
    const pfl_nmpc_problem_t *problem = c->problem;
    place_t p;
    memset(&p, 0, sizeof p);
    p.x = path->x_m[k] - problem->target->x_m[k];
    p.y = path->y_m[k] - problem->target->y_m[k];
    p.r = length_of(p.x, p.y);
    p.rt = 1.0f - (((p.x * p.x) + (p.y * p.y)) * c->over_rd2);
    if (problem->pair != NULL) {
        if (c->g->phase_form == (uint32_t)PFL_PHASE_DIRECTION) {
            p.ex = (p.x / p.r) + (c->work->pair_x[k] / c->work->pair_r[k]);
            p.ey = (p.y / p.r) + (c->work->pair_y[k] / c->work->pair_r[k]);
        } else {
            p.dt =
                (((p.x * c->work->pair_x[k]) + (p.y * c->work->pair_y[k])) + (p.r * c->work->pair_r[k])) * c->over_rd2;
        }
        p.gap_x = path->x_m[k] - problem->pair->x_m[k];
        p.gap_y = path->y_m[k] - problem->pair->y_m[k];
        p.gap = length_of(p.gap_x, p.gap_y);
        const float close = (c->g->separation_m - p.gap) / c->g->separation_m;
        p.close = (close > 0.0f) ? close : 0.0f;
    }
    return p;
}

static float distance_weight(const pfl_nmpc_t *g, uint32_t k)
{
    return (k == STEPS) ? g->distance_weight_last : g->distance_weight;
}

static float phase_weight(const pfl_nmpc_t *g, uint32_t k)
{
    return (k == STEPS) ? g->phase_weight_last : g->phase_weight;
}

/* By how much a command exceeds its range, as a share; its sign goes along. */
static float excess(float off, float range)
{
    const float size = (off < 0.0f) ? -off : off;
    const float over = (size - range) / range;
    const float beyond = (over > 0.0f) ? over : 0.0f;
    return (off < 0.0f) ? -beyond : beyond;
}

static float cost_of(const context_t *c, const pfl_nmpc_plan_t *plan, const flight_t *f)
{
    const pfl_nmpc_t *g = c->g;
    const pfl_uav_limits_t *l = &g->limits;
    float twice = 0.0f;
    for (uint32_t k = 0u; k <= STEPS; k++) {
        const place_t p = look(c, &f->path, k);
        const float phase2 = (p.dt * p.dt) + ((p.ex * p.ex) + (p.ey * p.ey));
        twice += (distance_weight(g, k) * (p.rt * p.rt)) + (phase_weight(g, k) * phase2);
        twice += g->penalty * (p.close * p.close);
    }
    for (uint32_t k = 0u; k < STEPS; k++) {
        const float off = plan->speed_mps[k] - l->cruise_mps;
        const float speed = off / l->speed_range_mps;
        const float turn = (plan->turn_radps[k] - g->turn_nominal_radps) / l->turn_max_radps;
        const float over_speed = excess(off, l->speed_range_mps);
        const float over_turn = excess(plan->turn_radps[k], l->turn_max_radps);
        twice += (g->speed_weight * (speed * speed)) + (g->turn_weight * (turn * turn));
        twice += g->penalty * ((over_speed * over_speed) + (over_turn * over_turn));
    }
    return 0.5f * twice;
}

/* ---- Gradient ---------------------------------------------------------------------------------------------------- */

/* Of the cost of step k by the place at k. */
static void place_gradient(const context_t *c, const flight_t *f, uint32_t k, float *gx, float *gy)
{
    const pfl_nmpc_t *g = c->g;
    const place_t p = look(c, &f->path, k);
    const float pull = ((-2.0f * distance_weight(g, k)) * p.rt) * c->over_rd2;
    float x = pull * p.x;
    float y = pull * p.y;
    if (c->problem->pair != NULL) {
        if (g->phase_form == (uint32_t)PFL_PHASE_DIRECTION) {
            const float ux = p.x / p.r;
            const float uy = p.y / p.r;
            const float along = (p.ex * ux) + (p.ey * uy);
            const float share = phase_weight(g, k) / p.r;
            x += share * (p.ex - (along * ux));
            y += share * (p.ey - (along * uy));
        } else {
            const float share = (phase_weight(g, k) * p.dt) * c->over_rd2;
            const float ratio = c->work->pair_r[k] / p.r;
            x += share * (c->work->pair_x[k] + (ratio * p.x));
            y += share * (c->work->pair_y[k] + (ratio * p.y));
        }
        const float push = (g->penalty * p.close) / (g->separation_m * p.gap);
        x -= push * p.gap_x;
        y -= push * p.gap_y;
    }
    *gx = x;
    *gy = y;
}

/* l: sensitivities of the cost to come to place, heading, speed and turn rate. */
static void gradient_of(const context_t *c, const pfl_nmpc_plan_t *plan, const flight_t *f, pfl_nmpc_plan_t *gradient)
{
    const pfl_nmpc_t *g = c->g;
    const pfl_uav_limits_t *l = &g->limits;
    const float stays = 1.0f - g->lag_share;
    float lx;
    float ly;
    float l_heading = 0.0f;
    float l_speed = 0.0f;
    float l_turn = 0.0f;
    place_gradient(c, f, STEPS, &lx, &ly);
    for (uint32_t k = STEPS; k > 0u; k--) {
        const uint32_t i = k - 1u;
        const float off = plan->speed_mps[i] - l->cruise_mps;
        const float turn = (plan->turn_radps[i] - g->turn_nominal_radps) / l->turn_max_radps;
        const float speed_pull =
            (g->speed_weight * (off / l->speed_range_mps)) + (g->penalty * excess(off, l->speed_range_mps));
        const float turn_pull = (g->turn_weight * turn) + (g->penalty * excess(plan->turn_radps[i], l->turn_max_radps));
        float gx;
        float gy;
        gradient->speed_mps[i] = (speed_pull / l->speed_range_mps) + (g->lag_share * l_speed);
        gradient->turn_radps[i] = (turn_pull / l->turn_max_radps) + (g->lag_share * l_turn);
        place_gradient(c, f, i, &gx, &gy);
        l_turn = (stays * l_turn) + (g->dt_s * l_heading);
        l_speed = (stays * l_speed) + (g->dt_s * ((lx * f->cosine[i]) + (ly * f->sine[i])));
        l_heading += (g->dt_s * f->speed[i]) * ((ly * f->cosine[i]) - (lx * f->sine[i]));
        lx += gx;
        ly += gy;
    }
}

/* ---- Descent ----------------------------------------------------------------------------------------------------- */

/* The commands have unlike units: the descent sees each divided by its range. */
typedef struct {
    float speed2, turn2; /* squared ranges */
} scale_t;

static float dot(const scale_t *s, const pfl_nmpc_plan_t *a, const pfl_nmpc_plan_t *b)
{
    float speed = 0.0f;
    float turn = 0.0f;
    for (uint32_t k = 0u; k < STEPS; k++) {
        speed += a->speed_mps[k] * b->speed_mps[k];
        turn += a->turn_radps[k] * b->turn_radps[k];
    }
    return (s->speed2 * speed) + (s->turn2 * turn);
}

static void move_plan(const scale_t *s, const pfl_nmpc_plan_t *plan, const pfl_nmpc_plan_t *gradient, float step,
                      pfl_nmpc_plan_t *out)
{
    for (uint32_t k = 0u; k < STEPS; k++) {
        out->speed_mps[k] = plan->speed_mps[k] - ((step * s->speed2) * gradient->speed_mps[k]);
        out->turn_radps[k] = plan->turn_radps[k] - ((step * s->turn2) * gradient->turn_radps[k]);
    }
}

/* The next step length, from the last move, -step times the old gradient, and how the gradient changed over it. */
static float next_step(const scale_t *s, float step, const pfl_nmpc_plan_t *old, const pfl_nmpc_plan_t *gradient)
{
    const float old2 = dot(s, old, old);
    const float curvature = old2 - dot(s, old, gradient); /* s.y / step */
    return (curvature > 0.0f) ? pfl_clip(step * (old2 / curvature), STEP_MIN, STEP_MAX) : step;
}

/* Searches along the gradient; true when a trial was good enough: plan, flight and cost are then its own. */
static bool improve(const context_t *c, const scale_t *s, float *step, pfl_nmpc_report_t *report)
{
    work_t *w = c->work;
    const float slope = DESCENT_SHARE * dot(s, &w->gradient, &w->gradient);
    for (uint32_t trial = 0u; trial < PFL_NMPC_TRIALS; trial++) {
        move_plan(s, &w->plan, &w->gradient, *step, &w->candidate);
        fly(c->g, &c->problem->uav, &w->candidate, &w->flight);
        const float cost = cost_of(c, &w->candidate, &w->flight);
        report->evaluations++;
        if (cost <= (report->cost - (slope * *step))) {
            w->plan = w->candidate;
            report->cost = cost;
            return true;
        }
        *step *= 0.25f;
    }
    return false;
}

static pfl_nmpc_report_t descend(const context_t *c)
{
    const pfl_uav_limits_t *l = &c->g->limits;
    const scale_t s = {l->speed_range_mps * l->speed_range_mps, l->turn_max_radps * l->turn_max_radps};
    work_t *w = c->work;
    float step = STEP_FIRST;
    fly(c->g, &c->problem->uav, &w->plan, &w->flight);
    pfl_nmpc_report_t report = {cost_of(c, &w->plan, &w->flight), 1u};
    gradient_of(c, &w->plan, &w->flight, &w->gradient);
    for (uint32_t iteration = 0u; iteration < PFL_NMPC_ITERATIONS; iteration++) {
        if (!improve(c, &s, &step, &report)) {
            step = STEP_AFTER_FAILURE;
        } else if ((iteration + 1u) < PFL_NMPC_ITERATIONS) {
            gradient_of(c, &w->plan, &w->flight, &w->fresh);
            step = next_step(&s, step, &w->gradient, &w->fresh);
            w->gradient = w->fresh;
        } else {
            /* the last move needs no gradient */
        }
    }
    return report;
}

/* ---- Checks and calls -------------------------------------------------------------------------------------------- */

static bool settings_are_good(const pfl_nmpc_t *g)
{
    if (g == NULL) {
        return false;
    }
    const float sum = ((g->distance_weight + g->phase_weight) + (g->distance_weight_last + g->phase_weight_last)) +
                      ((g->speed_weight + g->turn_weight) + (g->penalty + g->turn_nominal_radps));
    return pfl_limits_are_good(&g->limits) && pfl_is_finite(sum) && pfl_is_finite(g->dt_s) && (g->dt_s > 0.0f) &&
           (g->lag_share > 0.0f) && (g->lag_share <= 2.0f) && pfl_is_finite(g->separation_m) &&
           (g->separation_m > 0.0f) && (g->phase_form <= (uint32_t)PFL_PHASE_DIRECTION);
}

static bool numbers_are_finite(const float *a, const float *b, uint32_t n)
{
    bool finite = true;
    for (uint32_t k = 0u; k < n; k++) {
        finite = finite && pfl_is_finite(a[k]) && pfl_is_finite(b[k]);
    }
    return finite;
}

static bool plan_is_good(const pfl_nmpc_plan_t *plan)
{
    return (plan != NULL) && numbers_are_finite(plan->speed_mps, plan->turn_radps, STEPS);
}

static bool path_is_good(const pfl_nmpc_path_t *path)
{
    return numbers_are_finite(path->x_m, path->y_m, STEPS + 1u);
}

static bool problem_is_good(const pfl_nmpc_problem_t *problem)
{
    return (problem != NULL) && pfl_uav_is_good(&problem->uav) && (problem->target != NULL) &&
           path_is_good(problem->target) && ((problem->pair == NULL) || path_is_good(problem->pair)) &&
           pfl_is_finite(problem->distance_m) && (problem->distance_m > 0.0f);
}

void pfl_nmpc_shift(pfl_nmpc_plan_t *plan)
{
    const pfl_nmpc_plan_t old = *plan; /* in place a compiler makes it a memmove, which lib/ does without */
    for (uint32_t k = 0u; (k + 1u) < STEPS; k++) {
        plan->speed_mps[k] = old.speed_mps[k + 1u];
        plan->turn_radps[k] = old.turn_radps[k + 1u];
    }
}

pfl_status_t pfl_nmpc_rollout(const pfl_nmpc_t *nmpc, const pfl_uav_t *uav, const pfl_nmpc_plan_t *plan,
                              pfl_nmpc_path_t *path, pfl_uav_t *last)
{
    flight_t flight;
    if ((uav == NULL) || (path == NULL) || !settings_are_good(nmpc) || !pfl_uav_is_good(uav) || !plan_is_good(plan)) {
        return PFL_ERR_ARG;
    }
    fly(nmpc, uav, plan, &flight);
    if (!path_is_good(&flight.path) || !pfl_is_finite(flight.heading)) {
        return PFL_ERR_NONFINITE;
    }
    *path = flight.path;
    if (last != NULL) {
        const pfl_uav_t end = {flight.path.x_m[STEPS], flight.path.y_m[STEPS], flight.heading, flight.speed[STEPS],
                               flight.turn};
        *last = end;
    }
    return PFL_OK;
}

pfl_status_t pfl_nmpc_extrapolate(const pfl_nmpc_t *nmpc, const pfl_target_t *target, pfl_nmpc_path_t *path)
{
    pfl_nmpc_path_t line;
    if ((nmpc == NULL) || (path == NULL) || !pfl_target_is_good(target) || !pfl_is_finite(nmpc->dt_s)) {
        return PFL_ERR_ARG;
    }
    for (uint32_t k = 0u; k <= STEPS; k++) {
        const float ahead_s = nmpc->dt_s * (float)k;
        line.x_m[k] = target->x_m + (ahead_s * target->vx_mps);
        line.y_m[k] = target->y_m + (ahead_s * target->vy_mps);
    }
    if (!path_is_good(&line)) {
        return PFL_ERR_NONFINITE;
    }
    *path = line;
    return PFL_OK;
}

pfl_status_t pfl_nmpc_cost(const pfl_nmpc_t *nmpc, const pfl_nmpc_problem_t *problem, const pfl_nmpc_plan_t *plan,
                           pfl_nmpc_work_t *work, float *cost, pfl_nmpc_plan_t *gradient)
{
    if ((work == NULL) || (cost == NULL) || !settings_are_good(nmpc) || !problem_is_good(problem) ||
        !plan_is_good(plan)) {
        return PFL_ERR_ARG;
    }
    const context_t c = make_context(nmpc, problem, work);
    fly(nmpc, &problem->uav, plan, &c.work->flight);
    const float value = cost_of(&c, plan, &c.work->flight);
    gradient_of(&c, plan, &c.work->flight, &c.work->gradient);
    if (!pfl_is_finite(value) || !plan_is_good(&c.work->gradient)) {
        return PFL_ERR_NONFINITE;
    }
    *cost = value;
    if (gradient != NULL) {
        *gradient = c.work->gradient;
    }
    return PFL_OK;
}

pfl_status_t pfl_nmpc_solve(const pfl_nmpc_t *nmpc, const pfl_nmpc_problem_t *problem, pfl_nmpc_plan_t *plan,
                            pfl_nmpc_work_t *work, pfl_nmpc_report_t *report)
{
    if ((work == NULL) || !settings_are_good(nmpc) || !problem_is_good(problem) || !plan_is_good(plan)) {
        return PFL_ERR_ARG;
    }
    const context_t c = make_context(nmpc, problem, work);
    const pfl_uav_limits_t *l = &nmpc->limits;
    const pfl_nmpc_plan_t *better = &c.work->plan;
    c.work->plan = *plan;
    const pfl_nmpc_report_t done = descend(&c);
    if (!pfl_is_finite(done.cost)) {
        return PFL_ERR_NONFINITE;
    }
    for (uint32_t k = 0u; k < STEPS; k++) { /* a trial that is not finite is never taken: neither is this plan */
        plan->speed_mps[k] =
            pfl_clip(better->speed_mps[k], l->cruise_mps - l->speed_range_mps, l->cruise_mps + l->speed_range_mps);
        plan->turn_radps[k] = pfl_clip(better->turn_radps[k], -l->turn_max_radps, l->turn_max_radps);
    }
    if (report != NULL) {
        *report = done;
    }
    return PFL_OK;
}
