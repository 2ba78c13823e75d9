/* The whole library in one include. */
#ifndef PFLIGHT_PFLIGHT_H
#define PFLIGHT_PFLIGHT_H

#include "pflight/filter.h"
#include "pflight/math.h"
#include "pflight/models.h"
#include "pflight/port.h"
#include "pflight/rng.h"
#include "pflight/sensors.h"
#include "pflight/status.h"

#endif
