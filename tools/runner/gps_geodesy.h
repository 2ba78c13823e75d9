/* Latitude, longitude and altitude to metres north, east and down about an origin, and back, on a flat earth. Double:
 * single precision has steps of half a metre in latitude and longitude. */
#ifndef RUNNER_GPS_GEODESY_H
#define RUNNER_GPS_GEODESY_H

typedef struct {
    double latitude_deg;
    double longitude_deg;
    double altitude_m;
} geodetic_t;

/* An origin with what depends on it alone. */
typedef struct {
    geodetic_t at;
    double meridian_m;     /* radius of curvature in the meridian, R_M */
    double normal_m;       /* and in the prime vertical, R_N */
    double north_rad_each; /* latitude of a metre north [rad/m] */
    double east_rad_each;  /* longitude of a metre east [rad/m] */
} flat_earth_t;

flat_earth_t flat_earth_at(geodetic_t origin);
void flat_earth_to_ned(const flat_earth_t *earth, geodetic_t point, double *ned);
geodetic_t flat_earth_from_ned(const flat_earth_t *earth, const double *ned);

#endif
