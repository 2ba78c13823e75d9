/* The figures of `standoff` beside those of the paper and of its page, and what is accepted. */
#include "standoff.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define RUNS_FOR_ACCEPTANCE 200u /* the page's limits are four standard errors of so many */

bool standoff_has_pf(const standoff_study_t *s)
{
    return s->constrained && s->uavs == 1u && s->motion == MOTION_CV && s->guidance == GUIDANCE_LVFG;
}

bool standoff_has_cpf(const standoff_study_t *s)
{
    return s->constrained && s->uavs == 2u && s->guidance == GUIDANCE_LVFG;
}

bool standoff_has_ekf(const standoff_study_t *s)
{
    return s->constrained && s->guidance == GUIDANCE_LVFG;
}

/* The settings that the page's figures are stated for; empty when one is changed that the page does not know. */
static void write_key(const standoff_study_t *s, char *key, size_t room)
{
    static const char *const motion[] = {"cv", "road", "lane"};
    static const char *const guidance[] = {"lvfg", "lvfg+", "nmpc", "nmpc+"};
    static const char *const fallback[] = {"slide", "clamp", "bounce", "weight", "keep"};
    char filter[64];
    char constraint[32] = "";

    if (s->ekf) {
        (void)snprintf(filter, sizeof filter, "ekf%s", s->uavs == 2u ? "-multi" : "");
    } else {
        (void)snprintf(filter, sizeof filter, "%s%s %s %lu", s->constrained ? "cpf" : "pf",
                       s->uavs == 2u ? "-multi" : "", motion[s->motion], (unsigned long)s->particles);
    }
    if (!s->ekf && s->constrained && s->motion == MOTION_CV) {
        (void)snprintf(constraint, sizeof constraint, " tries=%lu %s", (unsigned long)s->tries, fallback[s->fallback]);
    }
    (void)snprintf(key, room, "%s%s %s %s %s", filter, constraint, guidance[s->guidance], s->outages ? "inout" : "in",
                   s->euler_plant ? "euler" : "zoh");
    if (!s->as_page) {
        key[0] = '\0';
    }
}

/* Adds a metric with what the page and the paper say of it. */
static metric_t *add(const standoff_study_t *s, verdict_t *verdict, size_t runs, unsigned id, const char *name,
                     figure_t ours)
{
    metric_t *metric = verdict_add(verdict, name, ours);
    char key[160];

    write_key(s, key, sizeof key);
    const standoff_reference_t *reference = standoff_reference(key, id);
    if (reference == NULL) {
        return metric;
    }
    const double limit = s->calm ? reference->calm_limit : reference->limit;
    metric->paper = s->calm ? MISSING : reference->paper;
    metric->reference = s->calm ? reference->calm : reference->ours;
    if (!isnan(limit) && runs >= RUNS_FOR_ACCEPTANCE) {
        metric_accept(metric, 0.0, limit);
    }
    return metric;
}

static double extreme(table_t runs, size_t column, double sign)
{
    double most = -(double)INFINITY;

    for (size_t r = 0u; r < runs.n; r++) {
        most = fmax(most, sign * runs.table[r * runs.width + column]);
    }
    return sign * most;
}

static void add_means(const standoff_study_t *s, table_t runs, verdict_t *verdict)
{
    static const struct {
        const char *name;
        unsigned id;
        bool for_pair;
    } means[] = {
        {"position_m", STANDOFF_POSITION, false},
        {"position_out_m", STANDOFF_POSITION_OUT, false},
        {"velocity_mps", STANDOFF_VELOCITY, false},
        {"velocity_out_mps", STANDOFF_VELOCITY_OUT, false},
        {"standoff_m", STANDOFF_DISTANCE, false},
        {"phase_deg", STANDOFF_PHASE, true},
        {"loss", STANDOFF_LOSS, false},
        {"loss_any", STANDOFF_LOSS_ANY, false},
        {"effort_speed_m", STANDOFF_EFFORT_SPEED, false},
        {"effort_turn_rad", STANDOFF_EFFORT_TURN, false},
        {"mean_rd_out_m", STANDOFF_WANTED_OUT, false},
    };

    for (size_t i = 0u; i < sizeof means / sizeof means[0]; i++) {
        if (s->uavs == 2u || !means[i].for_pair) {
            metric_t *metric = add(s, verdict, runs.n, means[i].id, means[i].name, stats_mean(runs, means[i].id));
            if (!s->ekf && !s->constrained && means[i].id == STANDOFF_POSITION && !isnan(metric->lo)) {
                metric->lo = s->calm ? 6.7 : 6.6; /* fidelity: a plain particle filter must not be better either */
            }
        }
    }
    if (s->uavs == 2u) {
        const figure_t closest = {extreme(runs, STANDOFF_CLOSEST, -1.0), MISSING};
        (void)add(s, verdict, runs.n, STANDOFF_CLOSEST, "closest_pair_m", closest);
    }
}

static void add_particles(const standoff_study_t *s, table_t runs, verdict_t *verdict)
{
    metric_t *draws = add(s, verdict, runs.n, STANDOFF_DRAWS, "draws_per_particle", stats_mean(runs, STANDOFF_DRAWS));
    (void)add(s, verdict, runs.n, STANDOFF_FALLBACK, "fallback_share", stats_mean(runs, STANDOFF_FALLBACK));
    metric_t *off_road = add(s, verdict, runs.n, STANDOFF_OFF_ROAD, "off_road", stats_mean(runs, STANDOFF_OFF_ROAD));

    if (s->constrained) { /* by construction */
        metric_accept(draws, 1.0, s->motion == MOTION_CV ? (double)s->tries : 1.0);
    }
    if (s->constrained && (s->motion != MOTION_CV || s->fallback < FALLBACK_WEIGHT)) {
        metric_accept(off_road, 0.0, 0.0);
    }
}

static void add_nmpc(const standoff_study_t *s, table_t runs, verdict_t *verdict)
{
    if (s->guidance == GUIDANCE_NMPC || s->guidance == GUIDANCE_NMPC_PLUS) {
        const figure_t most = {extreme(runs, STANDOFF_EVALUATIONS_MAX, 1.0), MISSING};
        verdict_add(verdict, "nmpc_evaluations", stats_mean(runs, STANDOFF_EVALUATIONS));
        metric_t *bound = verdict_add(verdict, "nmpc_evaluations_max", most);
        metric_accept(bound, 1.0, (double)PFL_NMPC_EVALUATIONS_MAX);
        text_add(&verdict->notes, "nmpc_evaluations: predictions in a call; the bound is fixed by its loops.\n");
    }
}

static void add_ratios(const standoff_study_t *s, table_t runs, verdict_t *verdict)
{
    if (standoff_has_pf(s)) {
        (void)add(s, verdict, runs.n, STANDOFF_POSITION_PF, "position_ratio_pf",
                  stats_ratio(runs, STANDOFF_POSITION, STANDOFF_POSITION_PF));
    }
    if (standoff_has_cpf(s)) {
        (void)add(s, verdict, runs.n, STANDOFF_POSITION_CPF, "position_ratio_cpf",
                  stats_ratio(runs, STANDOFF_POSITION, STANDOFF_POSITION_CPF));
    }
    if (standoff_has_ekf(s)) {
        (void)add(s, verdict, runs.n, STANDOFF_POSITION_EKF, "position_ratio_ekf",
                  stats_ratio(runs, STANDOFF_POSITION, STANDOFF_POSITION_EKF));
        text_add(&verdict->notes, "position_ratio_*: over the position error of another filter in the same world: pf "
                                  "without the road, cpf with one UAV,\nekf in road coordinates, the yardstick.\n");
    }
}

static void add_notes(const standoff_study_t *s, verdict_t *verdict)
{
    if (s->ekf) {
        text_add(&verdict->notes, "The road makes the belief unimodal: three states in a Kalman filter on its "
                                  "coordinates are better than 200 plain particles.\n");
    } else if (s->motion == MOTION_LANE) {
        text_add(&verdict->notes, "Beyond the paper: particles in the road's coordinates with the EKF's model, kernel "
                                  "step, first sights in parts.\n");
    } else if (s->constrained && s->uavs == 2u && s->guidance == GUIDANCE_LVFG && s->outages && !s->calm) {
        text_add(&verdict->notes, "The paper's position errors of two UAVs are not reached: with its acceleration "
                                  "noise a start known perfectly already\ncosts 3.3 m in the outages.\n");
    } else {
        /* the figures speak for themselves */
    }
    if (s->fallback == FALLBACK_WEIGHT && s->constrained) {
        text_add(&verdict->notes,
                 "fallback=weight: when the whole cloud would die it lives on for the step, and slides in the next.\n");
    }
}

void standoff_judge(const plan_t *plan, table_t runs, verdict_t *verdict)
{
    const standoff_study_t *s = plan->own;

    add_means(s, runs, verdict);
    if (!s->ekf) {
        add_particles(s, runs, verdict);
    }
    add_nmpc(s, runs, verdict);
    add_ratios(s, runs, verdict);
    add_notes(s, verdict);
}
