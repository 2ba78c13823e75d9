/* What the two files that judge the UAV's figures share. */
#ifndef RUNNER_UAV_JUDGE_H
#define RUNNER_UAV_JUDGE_H

#include "uav_trajectory.h"

bool uav_is_value(double x, double value);
void uav_accept(metric_t *metric, double lo, double hi);

/* Square root of a mean, with its standard error (delta method). */
figure_t uav_root(figure_t square);

/* For the simulations that forecast. */
void uav_judge_forecasts(const uav_study_t *s, table_t runs, verdict_t *verdict);

#endif
