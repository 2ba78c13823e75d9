/* The unscented Kalman filter with additive noise (Julier and Uhlmann; weights of Wan and van der Merwe): alpha = 1,
 * beta = 2, kappa = 0. A baseline in double, for the host. A covariance may be singular, even zero. */
#ifndef RUNNER_UKF_H
#define RUNNER_UKF_H

#include "gaussian.h"

/* out <- f(in): the model (n to n) or the measurement (n to m), without noise. */
typedef void (*ukf_function_t)(const void *user, const double *in, double *out);

/* Moves the belief through the model; q: process noise, n x n. */
void ukf_predict(gaussian_t *belief, ukf_function_t model, const void *user, const double *q);

/* Conditions on z (m); sigma points are drawn anew from the predicted belief. r: m x m. False when the innovation has
 * no variance. */
bool ukf_update(gaussian_t *belief, ukf_function_t measurement, const void *user, const double *z, const double *r,
                int m);

#endif
