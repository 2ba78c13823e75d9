/* Stand-in for the topic. */
#pragma once
#include <stdint.h>
struct debug_key_value_s {
    uint64_t timestamp;
    float value;
    char key[10];
};
