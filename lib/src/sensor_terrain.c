/* The height above ground against an elevation grid: terrain.h has the equation. */
#include "pflight/terrain.h"

#include "math_kernels.h"

/* A coordinate in grid steps, kept on the grid: whole steps and the rest of one. */
static inline uint32_t cell_of(float at, uint32_t count, float *rest)
{
    const float last = (float)(count - 1u);
    const float low = (at > 0.0f) ? at : 0.0f;
    const float kept = (low < last) ? low : last;
    const uint32_t whole = (uint32_t)kept;
    const uint32_t cell = (whole < (count - 1u)) ? whole : (count - 2u);
    *rest = kept - (float)cell;
    return cell;
}

float pfl_grid_height(const pfl_grid_t *grid, float north_m, float east_m)
{
    float up;
    float right;
    const uint32_t r = cell_of((north_m - grid->north_m) * grid->rows_per_m, grid->rows, &up);
    const uint32_t c = cell_of((east_m - grid->east_m) * grid->columns_per_m, grid->columns, &right);
    const int16_t *south = &grid->height_m[((size_t)r * grid->columns) + c];
    const int16_t *north = south + grid->columns;
    const float below = (float)south[0] + (right * (float)(south[1] - south[0]));
    const float above = (float)north[0] + (right * (float)(north[1] - north[0]));
    return below + (up * (above - below));
}

void pfl_terrain_loglik(void *user, const void *z, const pfl_view_t *p, float *restrict ll)
{
    const pfl_terrain_t *s = (const pfl_terrain_t *)user;
    const pfl_terrain_z_t *m = (const pfl_terrain_z_t *)z;
    const float *restrict north = &p->x[(size_t)s->north_state * p->stride];
    const float *restrict east = &p->x[(size_t)s->east_state * p->stride];
    const float inv_good = 1.0f / m->sigma_m;
    const float inv_tree = 1.0f / s->tree_sigma_m;
    const float good = ((1.0f - s->tree_share) - s->gross_share) * inv_good;
    const float tree = s->tree_share * inv_tree;
    const float gross = (s->gross_share > 0.0f) ? ((2.5066283f * s->gross_share) / s->gross_span_m) : 0.0f;
    const float inv_most = 1.0f / ((good + tree) + gross);
    for (uint32_t i = 0u; i < p->n; i++) {
        ll[i] = (m->altitude_m - m->agl_m) - pfl_grid_height(s->grid, north[i], east[i]);
    }
    if (s->bias_state != PFL_TERRAIN_NO_BIAS) {
        const float *restrict bias = &p->x[(size_t)s->bias_state * p->stride];
        for (uint32_t i = 0u; i < p->n; i++) {
            ll[i] -= bias[i];
        }
    }
    for (uint32_t i = 0u; i < p->n; i++) {
        const float y = ll[i] * inv_good;
        const float t = (ll[i] - s->tree_mean_m) * inv_tree;
        const float sum = ((good * pfl_exp_kernel(-0.5f * (y * y))) + (tree * pfl_exp_kernel(-0.5f * (t * t)))) + gross;
        ll[i] = m->power * pfl_log_kernel(sum * inv_most);
    }
}

float pfl_terrain_power(float spread_m, float scale_m, float least)
{
    const float share = spread_m / scale_m;
    const float power = 1.0f / (1.0f + (share * share));
    return (power > least) ? power : least;
}
