/* WGS-84 by its two radii of curvature at the origin: see gps_geodesy.h. */
#include "gps_geodesy.h"

#include <math.h>

#define SEMI_MAJOR_M 6378137.0
#define FLATTENING (1.0 / 298.257223563)
#define RAD_PER_DEG 0.017453292519943295769

flat_earth_t flat_earth_at(geodetic_t origin)
{
    const double e2 = FLATTENING * (2.0 - FLATTENING);
    const double sine = sin(origin.latitude_deg * RAD_PER_DEG);
    const double w2 = 1.0 - e2 * sine * sine;
    flat_earth_t earth = {.at = origin};

    earth.normal_m = SEMI_MAJOR_M / sqrt(w2);
    earth.meridian_m = earth.normal_m * (1.0 - e2) / w2;
    earth.north_rad_each = atan(1.0 / earth.meridian_m);
    earth.east_rad_each = atan(1.0 / (earth.normal_m * cos(origin.latitude_deg * RAD_PER_DEG)));
    return earth;
}

void flat_earth_to_ned(const flat_earth_t *earth, geodetic_t point, double *ned)
{
    ned[0] = (point.latitude_deg - earth->at.latitude_deg) * RAD_PER_DEG / earth->north_rad_each;
    ned[1] = (point.longitude_deg - earth->at.longitude_deg) * RAD_PER_DEG / earth->east_rad_each;
    ned[2] = earth->at.altitude_m - point.altitude_m;
}

geodetic_t flat_earth_from_ned(const flat_earth_t *earth, const double *ned)
{
    return (geodetic_t){
        .latitude_deg = earth->at.latitude_deg + ned[0] * earth->north_rad_each / RAD_PER_DEG,
        .longitude_deg = earth->at.longitude_deg + ned[1] * earth->east_rad_each / RAD_PER_DEG,
        .altitude_m = earth->at.altitude_m - ned[2],
    };
}
