/* Dense algebra of at most eight dimensions, written for clarity: see gaussian.h. */
#include "gaussian.h"

#include <math.h>

/* A pivot below this share of its diagonal element is rounding, hence zero. */
#define PIVOT_ROUNDING 1e-13

void matrix_multiply(const double *a, const double *b, double *c, int rows, int inner, int columns)
{
    for (int i = 0; i < rows; i++) {
        for (int j = 0; j < columns; j++) {
            double sum = 0.0;
            for (int k = 0; k < inner; k++) {
                sum += a[i * inner + k] * b[k * columns + j];
            }
            c[i * columns + j] = sum;
        }
    }
}

void matrix_multiply_transposed(const double *a, const double *b, double *c, int rows, int inner, int columns)
{
    for (int i = 0; i < rows; i++) {
        for (int j = 0; j < columns; j++) {
            double sum = 0.0;
            for (int k = 0; k < inner; k++) {
                sum += a[i * inner + k] * b[j * inner + k];
            }
            c[i * columns + j] = sum;
        }
    }
}

void matrix_square_root(const double *a, double *l, int n)
{
    for (int i = 0; i < n * n; i++) {
        l[i] = 0.0;
    }
    for (int j = 0; j < n; j++) {
        double pivot = a[j * n + j];
        for (int k = 0; k < j; k++) {
            pivot -= l[j * n + k] * l[j * n + k];
        }
        if (pivot <= PIVOT_ROUNDING * a[j * n + j]) {
            continue;
        }
        l[j * n + j] = sqrt(pivot);
        for (int i = j + 1; i < n; i++) {
            double sum = a[i * n + j];
            for (int k = 0; k < j; k++) {
                sum -= l[i * n + k] * l[j * n + k];
            }
            l[i * n + j] = sum / l[j * n + j];
        }
    }
}

/* Solves l l' x = b in place, l a lower triangle without a zero on its diagonal. */
static void solve_factored(const double *l, double *x, int n)
{
    for (int i = 0; i < n; i++) {
        for (int k = 0; k < i; k++) {
            x[i] -= l[i * n + k] * x[k];
        }
        x[i] /= l[i * n + i];
    }
    for (int i = n - 1; i >= 0; i--) {
        for (int k = i + 1; k < n; k++) {
            x[i] -= l[k * n + i] * x[k];
        }
        x[i] /= l[i * n + i];
    }
}

bool gaussian_condition(gaussian_t *belief, const double *c, const double *s, const double *y, int m)
{
    const int n = belief->n;
    double factor[GAUSSIAN_MAX2];
    double gain[GAUSSIAN_MAX2] = {0.0};
    double less[GAUSSIAN_MAX2];

    matrix_square_root(s, factor, m);
    for (int j = 0; j < m; j++) {
        if (!(factor[j * m + j] > 0.0)) {
            return false;
        }
    }
    for (int i = 0; i < n; i++) {
        for (int j = 0; j < m; j++) {
            gain[i * m + j] = c[i * m + j];
        }
        solve_factored(factor, &gain[i * m], m); /* s is symmetric: row i of c s^-1 solves s g = c_i */
        for (int j = 0; j < m; j++) {
            belief->x[i] += gain[i * m + j] * y[j];
        }
    }
    matrix_multiply_transposed(gain, c, less, n, m, n);
    for (int i = 0; i < n * n; i++) {
        belief->p[i] -= less[i];
    }
    gaussian_symmetrise(belief);
    return true;
}

void gaussian_symmetrise(gaussian_t *belief)
{
    const int n = belief->n;

    for (int i = 0; i < n; i++) {
        for (int j = 0; j < i; j++) {
            const double mean = 0.5 * (belief->p[i * n + j] + belief->p[j * n + i]);
            belief->p[i * n + j] = mean;
            belief->p[j * n + i] = mean;
        }
    }
}
