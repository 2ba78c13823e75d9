/* The configurations of the aircraft's two filters. */
#ifndef SURVIVAL_SETUP_H
#define SURVIVAL_SETUP_H

#include "plane.h"

void setup_filter(settings_t *settings, const plan_t *plan);
const pfl_config_t *setup_second(void);

#endif
