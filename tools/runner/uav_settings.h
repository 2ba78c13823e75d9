/* Settings of the scenario `uav-trajectory`: what --set takes, and the study that comes out. */
#ifndef RUNNER_UAV_SETTINGS_H
#define RUNNER_UAV_SETTINGS_H

#include "uav_trajectory.h"

enum { UAV_SETTINGS = 12 };
extern const setting_t uav_settings[UAV_SETTINGS];

/* False with the failure filled in where settings contradict each other. */
bool uav_read_settings(const study_t *study, uav_study_t *s, failure_t *failure);

#endif
