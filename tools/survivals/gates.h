/* The same flights with and without gates and watch. */
#ifndef SURVIVAL_GATES_H
#define SURVIVAL_GATES_H

#include <stdint.h>

/* Prints one line for each vehicle, trouble and set-up. 0. */
int gates_fly(uint32_t runs);

#endif
