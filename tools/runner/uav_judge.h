/* What the two files that judge the UAV's figures share. */
#ifndef RUNNER_UAV_JUDGE_H
#define RUNNER_UAV_JUDGE_H

#include "uav_trajectory.h"

bool uav_is_value(double x, double value);

/* For the simulations that forecast. */
void uav_judge_forecasts(const uav_study_t *s, table_t runs, verdict_t *verdict);

#endif
