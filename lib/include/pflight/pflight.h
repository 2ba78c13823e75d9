/* The whole library in one include. */
#ifndef PFLIGHT_PFLIGHT_H
#define PFLIGHT_PFLIGHT_H

#include "pflight/adaptive.h"
#include "pflight/antithetic.h"
#include "pflight/auxiliary.h"
#include "pflight/clock.h"
#include "pflight/constraints.h"
#include "pflight/errors.h"
#include "pflight/filter.h"
#include "pflight/guidance.h"
#include "pflight/health.h"
#include "pflight/jump.h"
#include "pflight/marginal.h"
#include "pflight/math.h"
#include "pflight/models.h"
#include "pflight/per_particle.h"
#include "pflight/port.h"
#include "pflight/proposal.h"
#include "pflight/pseudorange.h"
#include "pflight/range_bias.h"
#include "pflight/regularised.h"
#include "pflight/rng.h"
#include "pflight/road_network.h"
#include "pflight/sensors.h"
#include "pflight/status.h"
#include "pflight/tempered.h"
#include "pflight/terrain.h"
#include "pflight/version.h"
#include "pflight/waypoints.h"
#include "pflight/wind.h"

#endif
