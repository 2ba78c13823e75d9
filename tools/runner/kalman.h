/* The Kalman filter, and the extended one: the same two steps with the Jacobian in the place of the matrix. A baseline
 * in double, for the host. */
#ifndef RUNNER_KALMAN_H
#define RUNNER_KALMAN_H

#include "gaussian.h"

/* x <- next (the model applied to x by the caller), p <- f p f' + q. f: Jacobian of the model at the old x, q: process
 * noise; both n x n. */
void kalman_predict(gaussian_t *belief, const double *next, const double *f, const double *q);

/* Conditions on z = h x + noise of covariance r. h: m x n, r: m x m. False when the innovation has no variance. */
bool kalman_update(gaussian_t *belief, const double *z, const double *h, const double *r, int m);

#endif
