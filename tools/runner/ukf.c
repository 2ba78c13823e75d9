/* The unscented transform and the two steps made of it: see ukf.h. */
#include "ukf.h"

#include <math.h>
#include <string.h>

#define POINTS_MAX (2 * GAUSSIAN_MAX + 1)

/* With alpha = 1 and kappa = 0 the scaling parameter lambda is zero: sigma points sqrt(n) standard deviations out,
 * weight 0 for the centre in the mean, and 0 + (1 - alpha^2 + beta) = 2 in the covariance. */
static const double centre_weight_mean = 0.0;
static const double centre_weight_covariance = 2.0;

typedef struct {
    int count;                              /* 2 n + 1 */
    double point[POINTS_MAX][GAUSSIAN_MAX]; /* the centre first */
} sigma_points_t;

static double weight(const sigma_points_t *points, int i, double centre)
{
    return i == 0 ? centre : 1.0 / (double)(points->count - 1);
}

static void draw_points(const gaussian_t *belief, sigma_points_t *points)
{
    const int n = belief->n;
    const double spread = sqrt((double)n);
    double root[GAUSSIAN_MAX2];

    matrix_square_root(belief->p, root, n);
    points->count = 2 * n + 1;
    for (int i = 0; i < points->count; i++) {
        memcpy(points->point[i], belief->x, (size_t)n * sizeof belief->x[0]);
    }
    for (int j = 0; j < n; j++) {
        for (int i = 0; i < n; i++) {
            points->point[1 + j][i] += spread * root[i * n + j];
            points->point[1 + n + j][i] -= spread * root[i * n + j];
        }
    }
}

static void map_points(const sigma_points_t *in, sigma_points_t *out, ukf_function_t function, const void *user)
{
    out->count = in->count;
    for (int i = 0; i < in->count; i++) {
        function(user, in->point[i], out->point[i]);
    }
}

static void mean_of(const sigma_points_t *points, int n, double *mean)
{
    for (int d = 0; d < n; d++) {
        mean[d] = 0.0;
        for (int i = 0; i < points->count; i++) {
            mean[d] += weight(points, i, centre_weight_mean) * points->point[i][d];
        }
    }
}

/* covariance (n x m) of the points a (n) about ma and b (m) about mb. */
static void covariance_of(const sigma_points_t *a, const double *ma, int n, const sigma_points_t *b, const double *mb,
                          int m, double *covariance)
{
    for (int d = 0; d < n; d++) {
        for (int e = 0; e < m; e++) {
            double sum = 0.0;
            for (int i = 0; i < a->count; i++) {
                const double product = (a->point[i][d] - ma[d]) * (b->point[i][e] - mb[e]);
                sum += weight(a, i, centre_weight_covariance) * product;
            }
            covariance[d * m + e] = sum;
        }
    }
}

void ukf_predict(gaussian_t *belief, ukf_function_t model, const void *user, const double *q)
{
    const int n = belief->n;
    sigma_points_t before;
    sigma_points_t after;

    draw_points(belief, &before);
    map_points(&before, &after, model, user);
    mean_of(&after, n, belief->x);
    covariance_of(&after, belief->x, n, &after, belief->x, n, belief->p);
    for (int i = 0; i < n * n; i++) {
        belief->p[i] += q[i];
    }
    gaussian_symmetrise(belief);
}

bool ukf_update(gaussian_t *belief, ukf_function_t measurement, const void *user, const double *z, const double *r,
                int m)
{
    const int n = belief->n;
    sigma_points_t points;
    sigma_points_t seen;
    double z_mean[GAUSSIAN_MAX];
    double y[GAUSSIAN_MAX];
    double c[GAUSSIAN_MAX2];
    double s[GAUSSIAN_MAX2];

    draw_points(belief, &points);
    map_points(&points, &seen, measurement, user);
    mean_of(&seen, m, z_mean);
    covariance_of(&points, belief->x, n, &seen, z_mean, m, c);
    covariance_of(&seen, z_mean, m, &seen, z_mean, m, s);
    for (int i = 0; i < m * m; i++) {
        s[i] += r[i];
    }
    for (int i = 0; i < m; i++) {
        y[i] = z[i] - z_mean[i];
    }
    return gaussian_condition(belief, c, s, y, m);
}
