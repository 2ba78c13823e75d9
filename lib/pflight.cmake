# What the library is made of, as plain lists: include() this file to take pflight into a build of your own
# (PX4, ArduPilot, Zephyr, ESP-IDF) without its targets. No globs, so that a stray file never changes a build.
#
#   PFLIGHT_INCLUDE_DIR      the folder for -I
#   PFLIGHT_LIB_SOURCES      absolute paths of the sources; drop the model_, sensor_, constraint_ and guidance_ files
#                            that you do not use
#   PFLIGHT_LIB_HEADERS      absolute paths of the public headers
#   PFLIGHT_COMPILE_OPTIONS  the flags that the results depend on: give them to the sources themselves
#                            (target_compile_options(... PRIVATE ...)), so that they win over directory flags
#
# A port (pflight/port.h) is needed beside it: take a folder of port/ or write your own.

set(PFLIGHT_INCLUDE_DIR "${CMAKE_CURRENT_LIST_DIR}/include")

set(PFLIGHT_LIB_SOURCES
  math.c
  rng.c
  normals.c
  arena.c
  filter.c
  predict.c
  constraint.c
  kernel.c
  regularised.c
  scout.c
  tempered.c
  adaptive.c
  auxiliary.c
  parents.c
  jump.c
  road_network.c
  weights.c
  resample.c
  resample_schemes.c
  moments.c
  circles.c
  estimate.c
  reset.c
  snapshot.c
  forecast.c
  meter.c
  clock.c
  status.c
  guard.c
  config_copy.c
  watch.c
  health.c
  scrub.c
  self_test.c
  model_land_vehicle.c
  model_constant_velocity.c
  model_odometry.c
  model_uav_autopilot.c
  model_planar_uav.c
  model_road_target.c
  constraint_ring.c
  guidance_lvfg.c
  guidance_nmpc.c
  sensor_position.c
  sensor_position_distance.c
  sensor_range.c
  sensor_range_bearing.c
  model_coast.c
  model_turn.c
  sensor_coloured.c
  sensor_velocity.c
  error_laws.c
  sensor_errors.c
  model_drift.c
  guidance_waypoint.c
  antithetic.c
  proposal_linear.c
  marginal_shared.c
  marginal_each.c
  sensor_terrain.c
  model_dead_reckoning.c
  wind.c
  model_hover.c
  model_wheels.c
  pseudorange.c
  range_bias.c
  sensor_biased.c
)
list(TRANSFORM PFLIGHT_LIB_SOURCES PREPEND "${CMAKE_CURRENT_LIST_DIR}/src/")

set(PFLIGHT_LIB_HEADERS
  pflight.h
  adaptive.h
  antithetic.h
  auxiliary.h
  clock.h
  constraints.h
  errors.h
  filter.h
  guidance.h
  health.h
  jump.h
  marginal.h
  math.h
  models.h
  per_particle.h
  port.h
  proposal.h
  regularised.h
  pseudorange.h
  range_bias.h
  rng.h
  road_network.h
  sensors.h
  status.h
  tempered.h
  terrain.h
  version.h
  waypoints.h
  wind.h
)
list(TRANSFORM PFLIGHT_LIB_HEADERS PREPEND "${PFLIGHT_INCLUDE_DIR}/pflight/")

# The same bits everywhere: no fused multiply-add, no value-changing optimisation. No errno, so that sqrtf is one
# instruction. -O3 vectorises the particle loops; a build for size (MinSizeRel) or for debugging keeps its own level.
set(PFLIGHT_COMPILE_OPTIONS "")
if(CMAKE_C_COMPILER_ID MATCHES "GNU|Clang")
  set(PFLIGHT_COMPILE_OPTIONS
    -fno-fast-math
    -ffp-contract=off
    -fno-math-errno
    $<$<OR:$<CONFIG:Release>,$<CONFIG:RelWithDebInfo>>:-O3>
  )
  # Small cores: keep the polynomials' coefficients in registers over a loop rather than loading them for every particle.
  if(CMAKE_C_COMPILER_ID STREQUAL "GNU" AND CMAKE_SYSTEM_PROCESSOR MATCHES "^(arm|cortex|riscv)")
    list(APPEND PFLIGHT_COMPILE_OPTIONS -fira-loop-pressure -fno-schedule-insns)
  endif()
endif()
