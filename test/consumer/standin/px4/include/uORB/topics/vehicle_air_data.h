/* Stand-in for the topic, with the fields that are used. */
#pragma once
#include <stdint.h>
struct vehicle_air_data_s {
    uint64_t timestamp_sample;
    float baro_alt_meter;
};
