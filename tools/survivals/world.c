/* Truth and samples. Both vehicles go round in wide circles, so that a flight may last for hours. */
#include "world.h"

#include <math.h>

const float world_sigma[SENSORS] = {2.0f, 3.0f, 1.0f};

pfl_land_vehicle_t world_vehicle(double dt_s)
{
    const pfl_land_vehicle_t vehicle = {.power_w = 60000.0f,
                                        .drag_area_m2 = 6.0f,
                                        .mass_kg = 1500.0f,
                                        .wheelbase_m = 2.7f,
                                        .speed_min_mps = 1.0f,
                                        .sigma_position_mps = 4.0f,
                                        .sigma_speed_mps = (float)(1.5 * sqrt(dt_s)),
                                        .sigma_heading_rad = (float)(0.15 * sqrt(dt_s))};
    return vehicle;
}

void world_start(world_t *world, world_kind_t kind, uint64_t flight, double rate_hz)
{
    const world_t fresh = {.kind = kind, .dt_s = 1.0 / rate_hz, .speed = 14.0};
    *world = fresh;
    host_random_start(&world->motion, flight, (uint64_t)kind, RANDOM_TRUTH);
    host_random_start(&world->noise, flight, (uint64_t)kind, RANDOM_MEASUREMENT);
    world->x = 20.0 * host_random_normal(&world->motion);
    world->y = 20.0 * host_random_normal(&world->motion);
    world->heading = 3.0 * (host_random_uniform(&world->motion) - 0.5);
}

static void drive(world_t *world, const pfl_land_input_t *input)
{
    const pfl_land_vehicle_t vehicle = world_vehicle(world->dt_s);
    const double dt = world->dt_s;
    const double v = world->speed;
    const double force = ((double)vehicle.power_w * (double)input->throttle) / fmax(v, (double)vehicle.speed_min_mps);
    const double step = sqrt(dt) * 0.3;
    world->x += (dt * v * cos(world->heading)) + (step * host_random_normal(&world->motion));
    world->y += (dt * v * sin(world->heading)) + (step * host_random_normal(&world->motion));
    world->speed += (dt * (force - ((double)vehicle.drag_area_m2 * v * v))) / (double)vehicle.mass_kg;
    world->heading += (dt * v * tan((double)input->steer_rad)) / (double)vehicle.wheelbase_m;
}

static void turn(world_t *world)
{
    const double rate = (15.0 / 300.0) * (1.0 + (0.3 * sin(0.11 * world->t_s)));
    world->heading += world->dt_s * rate;
    world->speed = 15.0 + sin(0.23 * world->t_s);
    world->x += world->dt_s * world->speed * cos(world->heading);
    world->y += world->dt_s * world->speed * sin(world->heading);
}

static void observe(world_t *world, instant_t *instant)
{
    const double vx = world->speed * cos(world->heading);
    const double vy = world->speed * sin(world->heading);
    const double seen[SENSORS][2] = {{world->x, world->y}, {world->x, world->y}, {vx, vy}};
    for (uint32_t k = 0u; k < SENSORS; k++) {
        for (uint32_t axis = 0u; axis < 2u; axis++) {
            const double error = (double)world_sigma[k] * host_random_normal(&world->noise);
            instant->sample.z[k][axis] = (float)(seen[k][axis] + error);
        }
    }
    const bool land = world->kind == WORLD_LAND;
    instant->truth[0] = (float)world->x;
    instant->truth[1] = (float)world->y;
    instant->truth[2] = (float)(land ? world->speed : vx);
    instant->truth[3] = (float)(land ? world->heading : vy);
}

void world_step(world_t *world, instant_t *instant)
{
    const pfl_land_input_t input = {0.3f + (0.1f * (float)sin(0.2 * world->t_s)),
                                    0.03f + (0.02f * (float)sin(0.3 * world->t_s))};
    instant->input = input;
    if (world->kind == WORLD_LAND) {
        drive(world, &input);
    } else {
        turn(world);
    }
    world->t_s += world->dt_s;
    observe(world, instant);
}
