/* A long flight without a fault. */
#ifndef SURVIVAL_SOAK_H
#define SURVIVAL_SOAK_H

/* At 100 Hz, in simulated time. Prints one line a vehicle. 0. */
int soak_fly(double hours);

#endif
