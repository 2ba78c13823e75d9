/* What is flown: a vehicle's truth, its inputs and what three sensors see of it, at a fixed rate. Two receivers of
 * positions and one of the velocity: a bias of one receiver can then be told, as in any aircraft with two. */
#ifndef SURVIVAL_WORLD_H
#define SURVIVAL_WORLD_H

#include "host_random.h"

#include "pflight/models.h"

#define SENSORS 3u
#define STATES 4u

typedef enum { WORLD_LAND = 0, WORLD_GPS = 1, WORLDS = 2 } world_kind_t;

/* Of the sensors, in the order of their numbers. */
typedef struct {
    float z[SENSORS][2];
} sample_t;

typedef struct {
    pfl_land_input_t input;
    float truth[STATES]; /* in the states of the filter's model */
    sample_t sample;
} instant_t;

typedef struct {
    world_kind_t kind;
    double dt_s;
    double t_s;
    double x, y, speed, heading;
    host_random_t noise;
    host_random_t motion;
} world_t;

extern const float world_sigma[SENSORS]; /* of each component a sensor measures */

void world_start(world_t *world, world_kind_t kind, uint64_t flight, double rate_hz);

/* The next instant. */
void world_step(world_t *world, instant_t *instant);

/* Parameters of the land vehicle that is flown, and of the filter's model of it. */
pfl_land_vehicle_t world_vehicle(double dt_s);

#endif
