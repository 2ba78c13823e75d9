/* The marginalised filter with a covariance for each particle: as marginal_shared.c, the numbers there being columns
 * here. A strip of the batch at a time, so that the workspace stays small; every loop is over its particles, for
 * vectors. */
#include "marginal.h"

#include "math_kernels.h"
#include "sqrt_kernel.h"

/* The workspace of a strip, and where the particles keep mean and covariance. */
typedef struct {
    uint32_t linear, n;
    float *drive, *transition, *half, *row, *g, *s, *e; /* `row` is one of `see` */
    float *mean, *cov;
    size_t stride;
} strip_t;

static strip_t lay_out(const pfl_marginal_each_t *s, const pfl_batch_t *p)
{
    const uint32_t linear = s->model.linear;
    strip_t a = {.linear = linear, .n = p->n, .stride = p->stride};
    a.mean = PFL_STATE(p, s->model.mean);
    a.cov = PFL_STATE(p, s->cov);
    a.drive = s->work;
    a.transition = &a.drive[s->model.driven * linear * STRIP];
    a.half = &a.transition[linear * linear * STRIP];
    a.row = &a.half[linear * linear * STRIP];
    a.g = &a.row[linear * STRIP];
    a.s = &a.g[linear * STRIP];
    a.e = &a.s[STRIP];
    return a;
}

static float *cov_at(const strip_t *a, uint32_t r, uint32_t c)
{
    return &a->cov[pfl_marginal_at(a->linear, r, c) * a->stride];
}

/* sum <- sum + x y */
static void add_product(float *restrict sum, const float *restrict x, const float *restrict y, uint32_t n)
{
    for (uint32_t i = 0u; i < n; i++) {
        sum[i] += x[i] * y[i];
    }
}

/* sum <- sum + row l; `pattern` tells the row's zeros. */
static void add_row(const strip_t *a, const float *pattern, const float *row, float *sum)
{
    for (uint32_t j = 0u; j < a->linear; j++) {
        if (!pfl_marginal_is_zero(pattern[j])) {
            add_product(sum, &row[j * STRIP], &a->mean[j * a->stride], a->n);
        }
    }
}

/* g <- P row', s <- row g + variance */
static void project(const strip_t *a, const float *pattern, const float *row, float variance)
{
    pfl_marginal_fill(a->s, variance, a->n);
    for (uint32_t j = 0u; j < a->linear; j++) {
        float *g = &a->g[j * STRIP];
        pfl_marginal_fill(g, 0.0f, a->n);
        for (uint32_t c = 0u; c < a->linear; c++) {
            if (!pfl_marginal_is_zero(pattern[c])) {
                add_product(g, &row[c * STRIP], cov_at(a, j, c), a->n);
            }
        }
        if (!pfl_marginal_is_zero(pattern[j])) {
            add_product(a->s, &row[j * STRIP], g, a->n);
        }
    }
}

/* l <- l + g e / s, P <- P - g g' / s; s holds its inverse. */
static void absorb(const strip_t *a)
{
    const uint32_t n = a->n;
    for (uint32_t j = 0u; j < a->linear; j++) {
        const float *restrict g = &a->g[j * STRIP];
        const float *restrict inverse = a->s;
        const float *restrict e = a->e;
        float *restrict mean = &a->mean[j * a->stride];
        for (uint32_t i = 0u; i < n; i++) {
            mean[i] += (g[i] * inverse[i]) * e[i];
        }
        for (uint32_t c = j; c < a->linear; c++) {
            const float *restrict other = &a->g[c * STRIP];
            float *restrict cov = cov_at(a, j, c);
            for (uint32_t i = 0u; i < n; i++) {
                cov[i] -= (g[i] * inverse[i]) * other[i];
            }
        }
    }
}

static void drive(const pfl_marginal_t *m, const strip_t *a, const pfl_batch_t *p)
{
    for (uint32_t k = 0u; k < m->driven; k++) {
        const float *row = &a->drive[k * a->linear * STRIP];
        const float *restrict w = PFL_NOISE(p, m->noise[k]);
        float *restrict x = PFL_STATE(p, m->state[k]);
        float *restrict e = a->e;
        float *restrict s = a->s;
        project(a, m->drive[k], row, m->drive_variance[k]);
        add_row(a, m->drive[k], row, x);
        for (uint32_t i = 0u; i < a->n; i++) {
            e[i] = pfl_sqrt_kernel(s[i]) * w[i];
            s[i] = 1.0f / s[i];
            x[i] += e[i];
        }
        absorb(a);
    }
}

/* l <- transition l + drift, P <- transition P transition' + process_cov. g is the new mean for a while. */
static void carry_on(const pfl_marginal_t *m, const strip_t *a)
{
    const uint32_t linear = a->linear;
    for (uint32_t r = 0u; r < linear; r++) {
        const float *row = &a->transition[r * linear * STRIP];
        pfl_marginal_fill(&a->g[r * STRIP], m->drift[r], a->n);
        add_row(a, m->transition[r], row, &a->g[r * STRIP]);
        for (uint32_t c = 0u; c < linear; c++) {
            float *half = &a->half[((r * linear) + c) * STRIP];
            pfl_marginal_fill(half, 0.0f, a->n);
            for (uint32_t k = 0u; k < linear; k++) {
                if (!pfl_marginal_is_zero(m->transition[r][k])) {
                    add_product(half, &row[k * STRIP], cov_at(a, k, c), a->n);
                }
            }
        }
    }
    for (uint32_t r = 0u; r < linear; r++) {
        (void)memcpy(&a->mean[r * a->stride], &a->g[r * STRIP], sizeof(float) * a->n);
        for (uint32_t c = r; c < linear; c++) {
            float *cov = cov_at(a, r, c);
            pfl_marginal_fill(cov, m->process_cov[pfl_marginal_at(linear, r, c)], a->n);
            for (uint32_t k = 0u; k < linear; k++) {
                if (!pfl_marginal_is_zero(m->transition[c][k])) {
                    add_product(cov, &a->half[((r * linear) + k) * STRIP], &a->transition[((c * linear) + k) * STRIP],
                                a->n);
                }
            }
        }
    }
}

/* The normaliser is less its value for a known l, the largest that it can have: 0 stays a perfect match. */
static void see(const pfl_marginal_t *m, const float *z, const strip_t *a, const pfl_batch_t *p)
{
    float *restrict ll = PFL_STATE(p, m->loglik_state);
    float *restrict e = a->e;
    float *restrict s = a->s;
    pfl_marginal_fill(ll, 0.0f, p->n);
    for (uint32_t k = 0u; (z != NULL) && (k < m->measured); k++) {
        const float inverse = 1.0f / m->see_variance[k];
        for (uint32_t j = 0u; j < a->linear; j++) {
            pfl_marginal_fill(&a->row[j * STRIP], m->see[k][j], a->n);
        }
        pfl_marginal_measure(m, k, p, e, a->row);
        add_row(a, m->see[k], a->row, e);
        project(a, m->see[k], a->row, m->see_variance[k]);
        for (uint32_t i = 0u; i < a->n; i++) {
            e[i] = z[k] - e[i];
            ll[i] -= 0.5f * (((e[i] * e[i]) / s[i]) + pfl_log_positive_kernel(s[i] * inverse));
            s[i] = 1.0f / s[i];
        }
        absorb(a);
    }
}

static void fill_matrix(const strip_t *a, float *to, const float (*from)[PFL_MARGINAL_MAX], uint32_t rows)
{
    for (uint32_t r = 0u; r < rows; r++) {
        for (uint32_t c = 0u; c < a->linear; c++) {
            pfl_marginal_fill(&to[((r * a->linear) + c) * STRIP], from[r][c], a->n);
        }
    }
}

void pfl_marginal_each_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    const pfl_marginal_each_t *s = (const pfl_marginal_each_t *)user;
    const pfl_marginal_t *m = &s->model;
    const pfl_marginal_input_t *in = (const pfl_marginal_input_t *)u;
    for (uint32_t from = 0u; from < p->n; from += STRIP) {
        const pfl_batch_t strip = pfl_marginal_strip(p, from);
        const strip_t a = lay_out(s, &strip);
        fill_matrix(&a, a.drive, m->drive, m->driven);
        fill_matrix(&a, a.transition, m->transition, m->linear);
        if (s->matrices != NULL) {
            const pfl_view_t view = {strip.x, strip.stride, strip.first, strip.n};
            s->matrices(m->user, in->u, dt_s, &view, a.drive, a.transition);
        }
        if (m->predict != NULL) {
            m->predict(m->user, in->u, dt_s, &strip);
        }
        drive(m, &a, &strip);
        carry_on(m, &a);
        if (m->measured > 0u) {
            see(m, in->z, &a, &strip);
        }
    }
}
