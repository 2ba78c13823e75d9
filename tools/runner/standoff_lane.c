/* The better filter of `standoff`, beyond the paper: particles in the road's coordinates. Its prior, its sensor, which
 * knows the road's shape, and its answer. */
#include "standoff.h"

#include <math.h>

#define SIGMA_ARC_M 10.0f
#define SIGMA_SPEED_MPS 3.0f
#define OFFSET_SIGMA_M 0.7 /* of the target around the center line, as the EKF has it */
#define OFFSET_KEPT 0.9    /* of it in one step */
#define REACH_SIGMAS 3.0   /* likewise */

pfl_lane_target_t standoff_lane_model(double sigma_along)
{
    return (pfl_lane_target_t){
        .sigma_along = (float)(sigma_along * sqrt(STANDOFF_PERIOD_S)),
        .speed_min_mps = -(float)INFINITY,
        .speed_max_mps = (float)INFINITY,
        .half_width_m = (float)(0.5 * (ROAD_OUTER_M - ROAD_INNER_M)),
        .sigma_offset_m = (float)OFFSET_SIGMA_M,
        .offset_time_s = (float)(-STANDOFF_PERIOD_S / log(OFFSET_KEPT)),
    };
}

/* The prior's mean on the road, as the EKF starts. */
void standoff_lane_start(const double *prior, float *start)
{
    const double angle = atan2(prior[TARGET_Y], prior[TARGET_X]);

    start[PFL_LANE_ARC] = (float)(ROAD_CENTER_LINE_M * angle);
    start[PFL_LANE_SPEED] = (float)(prior[TARGET_VY] * cos(angle) - prior[TARGET_VX] * sin(angle));
    start[PFL_LANE_OFFSET] = 0.0f;
}

void standoff_lane_draw(const float *start, const pfl_batch_t *p)
{
    static const float sigma[PFL_LANE_STATES] = {SIGMA_ARC_M, SIGMA_SPEED_MPS, (float)OFFSET_SIGMA_M};
    const float edge = (float)(0.5 * (ROAD_OUTER_M - ROAD_INNER_M));

    for (uint32_t d = 0u; d < PFL_LANE_STATES; d++) {
        float *x = PFL_STATE(p, d);
        const float *w = PFL_NOISE(p, d);
        for (uint32_t i = 0u; i < p->n; i++) {
            x[i] = start[d] + sigma[d] * w[i];
            if (d == PFL_LANE_OFFSET) {
                x[i] = fminf(fmaxf(x[i], -edge), edge);
            }
        }
    }
}

/* The places of a batch go to the ready sensor, as if they were states. */
void standoff_lane_loglik(void *user, const void *z, const pfl_view_t *p, float *ll)
{
    const float *arc = p->x + PFL_LANE_ARC * p->stride;
    const float *offset = p->x + PFL_LANE_OFFSET * p->stride;
    float place[2u * PFL_BATCH]; /* x, then y */
    float angle[PFL_BATCH];
    const pfl_view_t places = {place, PFL_BATCH, p->first, p->n};

    for (uint32_t i = 0u; i < p->n; i++) {
        angle[i] = arc[i] * (float)(1.0 / ROAD_CENTER_LINE_M);
    }
    pfl_sincosf_n(angle, place + PFL_BATCH, place, p->n);
    for (uint32_t i = 0u; i < p->n; i++) {
        const float radius = (float)ROAD_CENTER_LINE_M + offset[i];
        place[i] *= radius;
        place[PFL_BATCH + i] *= radius;
    }
    pfl_range_bearing_loglik(user, z, &places, ll);
}

void standoff_lane_belief(const float *mean, const float *cov, standoff_belief_t *belief)
{
    const double angle = (double)mean[PFL_LANE_ARC] / ROAD_CENTER_LINE_M;
    const double radius = ROAD_CENTER_LINE_M + (double)mean[PFL_LANE_OFFSET];
    const double along = (double)mean[PFL_LANE_SPEED] * radius / ROAD_CENTER_LINE_M;

    belief->target[TARGET_X] = radius * cos(angle);
    belief->target[TARGET_Y] = radius * sin(angle);
    belief->target[TARGET_VX] = -along * sin(angle);
    belief->target[TARGET_VY] = along * cos(angle);
    belief->reach_m = REACH_SIGMAS * sqrt((double)cov[0]);
}
