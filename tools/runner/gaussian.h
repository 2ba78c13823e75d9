/* Small Gaussian beliefs in double, the ground of the baseline filters, and the dense algebra they share. Matrices
 * stand row by row, as tightly as their size. */
#ifndef RUNNER_GAUSSIAN_H
#define RUNNER_GAUSSIAN_H

#include <stdbool.h>

#define GAUSSIAN_MAX 8
#define GAUSSIAN_MAX2 (GAUSSIAN_MAX * GAUSSIAN_MAX)

typedef struct {
    int n; /* states, 1 .. GAUSSIAN_MAX */
    double x[GAUSSIAN_MAX];
    double p[GAUSSIAN_MAX2]; /* covariance, n x n */
} gaussian_t;

/* c (rows x columns) <- a (rows x inner) b (inner x columns). c is neither a nor b. */
void matrix_multiply(const double *a, const double *b, double *c, int rows, int inner, int columns);

/* c (rows x columns) <- a (rows x inner) times the transpose of b (columns x inner). c is neither a nor b. */
void matrix_multiply_transposed(const double *a, const double *b, double *c, int rows, int inner, int columns);

/* Lower triangle l with l l' = a, for a symmetric and positive semidefinite: a direction without variance gets a
 * column of zeros instead of a failure. */
void matrix_square_root(const double *a, double *l, int n);

/* Conditions the belief on an innovation y (m) with covariance s (m x m, positive definite) and cross covariance c
 * (n x m) of state and measurement: x += c s^-1 y, p -= c s^-1 c'. False when s is singular. */
bool gaussian_condition(gaussian_t *belief, const double *c, const double *s, const double *y, int m);

/* Makes the covariance symmetric, against the drift of rounding. */
void gaussian_symmetrise(gaussian_t *belief);

#endif
