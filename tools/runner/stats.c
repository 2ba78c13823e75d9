/* Mean, ratio, median, quantile: see stats.h. */
#include "stats.h"

#include <stdlib.h>

static double at(table_t runs, size_t row, size_t column)
{
    return runs.table[row * runs.width + column];
}

static double column_mean(table_t runs, size_t column)
{
    double sum = 0.0;

    for (size_t r = 0u; r < runs.n; r++) {
        sum += at(runs, r, column);
    }
    return sum / (double)runs.n;
}

/* Standard error of a mean from the sum of squared deviations of n values. */
static double error_of_mean(double squares, size_t n)
{
    return n > 1u ? sqrt(squares / (double)(n - 1u) / (double)n) : MISSING;
}

figure_t stats_mean(table_t runs, size_t column)
{
    const double mean = column_mean(runs, column);
    double squares = 0.0;

    for (size_t r = 0u; r < runs.n; r++) {
        const double deviation = at(runs, r, column) - mean;
        squares += deviation * deviation;
    }
    return (figure_t){mean, error_of_mean(squares, runs.n)};
}

figure_t stats_ratio(table_t runs, size_t above, size_t below)
{
    const double mean_below = column_mean(runs, below);
    const double ratio = column_mean(runs, above) / mean_below;
    double squares = 0.0;

    for (size_t r = 0u; r < runs.n; r++) {
        const double difference = at(runs, r, above) - ratio * at(runs, r, below);
        squares += difference * difference;
    }
    return (figure_t){ratio, error_of_mean(squares, runs.n) / mean_below};
}

static int compare_doubles(const void *a, const void *b)
{
    const double x = *(const double *)a;
    const double y = *(const double *)b;

    return (x > y) - (x < y);
}

void stats_sort(double *x, size_t n)
{
    qsort(x, n, sizeof *x, compare_doubles);
}

figure_t stats_largest(table_t runs, size_t column)
{
    double largest = at(runs, 0u, column);

    for (size_t r = 1u; r < runs.n; r++) {
        largest = fmax(largest, at(runs, r, column));
    }
    return (figure_t){largest, MISSING};
}

figure_t stats_root(figure_t square)
{
    const double root = sqrt(square.mean);

    return (figure_t){root, root > 0.0 ? square.error / (2.0 * root) : 0.0};
}

figure_t stats_median(table_t runs, size_t column)
{
    const size_t n = runs.n;
    double *sorted = malloc(n * sizeof *sorted);
    figure_t median = {MISSING, MISSING};

    if (sorted == NULL) {
        return median;
    }
    for (size_t r = 0u; r < n; r++) {
        sorted[r] = at(runs, r, column);
    }
    stats_sort(sorted, n);
    median.mean = 0.5 * (sorted[(n - 1u) / 2u] + sorted[n / 2u]);
    if (n > 4u) {
        const size_t step = (size_t)(0.5 * sqrt((double)n));
        median.error = 0.5 * (sorted[n / 2u + step] - sorted[(n - 1u) / 2u - step]);
    }
    free(sorted);
    return median;
}

static int compare_u32(const void *a, const void *b)
{
    const uint32_t x = *(const uint32_t *)a;
    const uint32_t y = *(const uint32_t *)b;

    return (x > y) - (x < y);
}

void stats_sort_u32(uint32_t *x, size_t n)
{
    qsort(x, n, sizeof *x, compare_u32);
}

uint32_t stats_quantile_u32(const uint32_t *sorted, size_t n, double p)
{
    const size_t rank = (size_t)ceil(p * (double)n);

    return sorted[rank == 0u ? 0u : rank - 1u];
}
