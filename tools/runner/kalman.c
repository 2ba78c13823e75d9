/* Kalman's two steps: see kalman.h. */
#include "kalman.h"

void kalman_predict(gaussian_t *belief, const double *next, const double *f, const double *q)
{
    const int n = belief->n;
    double fp[GAUSSIAN_MAX2];

    matrix_multiply(f, belief->p, fp, n, n, n);
    matrix_multiply_transposed(fp, f, belief->p, n, n, n);
    for (int i = 0; i < n * n; i++) {
        belief->p[i] += q[i];
    }
    for (int i = 0; i < n; i++) {
        belief->x[i] = next[i];
    }
    gaussian_symmetrise(belief);
}

bool kalman_update(gaussian_t *belief, const double *z, const double *h, const double *r, int m)
{
    const int n = belief->n;
    double c[GAUSSIAN_MAX2];
    double s[GAUSSIAN_MAX2];
    double y[GAUSSIAN_MAX];

    matrix_multiply_transposed(belief->p, h, c, n, n, m);
    matrix_multiply(h, c, s, m, n, m);
    matrix_multiply(h, belief->x, y, m, n, 1);
    for (int i = 0; i < m * m; i++) {
        s[i] += r[i];
    }
    for (int i = 0; i < m; i++) {
        y[i] = z[i] - y[i];
    }
    return gaussian_condition(belief, c, s, y, m);
}
