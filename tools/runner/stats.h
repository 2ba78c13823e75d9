/* Statistics over Monte Carlo runs. Sums go in run order, so that they do not depend on who computed which run. */
#ifndef RUNNER_STATS_H
#define RUNNER_STATS_H

#include <math.h>
#include <stddef.h>
#include <stdint.h>

/* A figure that does not exist. */
#define MISSING ((double)NAN)

/* A figure and its Monte Carlo standard error; the latter is MISSING where there are too few runs for one. */
typedef struct {
    double mean;
    double error;
} figure_t;

/* Column `column` of a table of n rows that are `width` wide. */
typedef struct {
    const double *table;
    size_t n;
    size_t width;
} table_t;

/* Mean of a column; standard deviation over sqrt(n). */
figure_t stats_mean(table_t runs, size_t column);

/* Sum of one column over the sum of another. The standard error is that of the mean paired difference
 * `above - ratio * below` over the mean of `below` (delta method). */
figure_t stats_ratio(table_t runs, size_t above, size_t below);

/* Median of a column. Its standard error is half the distance of the order statistics that lie sqrt(n) / 2 to both
 * sides: about one binomial standard deviation, whatever the distribution. MISSING when out of memory. */
figure_t stats_median(table_t runs, size_t column);

/* The largest of a column; it has no error. */
figure_t stats_largest(table_t runs, size_t column);

/* Square root of a mean square, with its standard error (delta method). */
figure_t stats_root(figure_t square);

/* Sorts n values. */
void stats_sort(double *x, size_t n);

/* Sorts n cycle times. */
void stats_sort_u32(uint32_t *x, size_t n);

/* Smallest element that is not below a share p of all; x sorted, n > 0, 0 < p <= 1. */
uint32_t stats_quantile_u32(const uint32_t *sorted, size_t n, double p);

#endif
