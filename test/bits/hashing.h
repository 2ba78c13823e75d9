/* What the two files of the bit hashes share: one running hash, its inputs, and the line it ends in. */
#ifndef BITS_HASHING_H
#define BITS_HASHING_H

#include <stdint.h>

void begin(uint64_t seed);
void end(const char *part);
void mix(float x);
float between(float low, float high);

/* bits_modules.c: the models, sensors, constraints and guidance that bits_main.c does not fly. */
void of_modules(void);

#endif
