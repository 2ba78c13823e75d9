/* The marginalised filter with one covariance for all particles: marginal.h has its equations. That the linear part
 * drives state k is a measurement of it, whose innovation e is drawn rather than observed: with g = P a and
 * s = a' g + variance, e = sqrt(s) w, the state moves by a' l + e, l by (g / s) e, and P by -g g' / s. What is truly
 * measured does the same with the e that it has. Rows are taken one after the other, which is exact while their noises
 * are independent. */
#include "marginal.h"

#include "pflight/math.h"

/* ---- The covariance, once a step --------------------------------------------------------------------------------- */

/* One row absorbed by the covariance; answers s. */
static float absorb(uint32_t linear, float *cov, const float *row, float variance, float *gain)
{
    float g[PFL_MARGINAL_MAX];
    float s = variance;
    for (uint32_t j = 0u; j < linear; j++) {
        g[j] = 0.0f;
        for (uint32_t c = 0u; c < linear; c++) {
            g[j] += row[c] * cov[pfl_marginal_at(linear, j, c)];
        }
        s += row[j] * g[j];
    }
    for (uint32_t j = 0u; j < linear; j++) {
        gain[j] = g[j] / s;
        for (uint32_t c = j; c < linear; c++) {
            cov[pfl_marginal_at(linear, j, c)] -= gain[j] * g[c];
        }
    }
    return s;
}

/* cov <- transition cov transition' + process_cov */
static void carry_on(const pfl_marginal_t *m, float *cov)
{
    const uint32_t linear = m->linear;
    float half[PFL_MARGINAL_MAX][PFL_MARGINAL_MAX];
    for (uint32_t r = 0u; r < linear; r++) {
        for (uint32_t c = 0u; c < linear; c++) {
            half[r][c] = 0.0f;
            for (uint32_t k = 0u; k < linear; k++) {
                half[r][c] += m->transition[r][k] * cov[pfl_marginal_at(linear, k, c)];
            }
        }
    }
    for (uint32_t r = 0u; r < linear; r++) {
        for (uint32_t c = r; c < linear; c++) {
            float sum = m->process_cov[pfl_marginal_at(linear, r, c)];
            for (uint32_t k = 0u; k < linear; k++) {
                sum += half[r][k] * m->transition[c][k];
            }
            cov[pfl_marginal_at(linear, r, c)] = sum;
        }
    }
}

void pfl_marginal_shared_step(pfl_marginal_shared_t *s, bool measured)
{
    const pfl_marginal_t *m = &s->model;
    for (uint32_t k = 0u; k < m->driven; k++) {
        s->drive_root[k] = pfl_sqrtf(absorb(m->linear, s->cov, m->drive[k], m->drive_variance[k], s->drive_gain[k]));
    }
    carry_on(m, s->cov);
    for (uint32_t k = 0u; measured && (k < m->measured); k++) {
        s->see_weight[k] = 0.5f / absorb(m->linear, s->cov, m->see[k], m->see_variance[k], s->see_gain[k]);
    }
}

/* ---- The means, for every particle ------------------------------------------------------------------------------- */

/* sum <- sum + row l */
static void add_row(const pfl_marginal_t *m, const float *row, const pfl_batch_t *p, float *sum)
{
    for (uint32_t j = 0u; j < m->linear; j++) {
        if (!pfl_marginal_is_zero(row[j])) {
            pfl_marginal_add_scaled(sum, row[j], PFL_STATE(p, m->mean + j), p->n);
        }
    }
}

/* l <- l + factor gain e */
static void add_gain(const pfl_marginal_t *m, const float *gain, float factor, const float *e, const pfl_batch_t *p)
{
    for (uint32_t j = 0u; j < m->linear; j++) {
        pfl_marginal_add_scaled(PFL_STATE(p, m->mean + j), gain[j] * factor, e, p->n);
    }
}

static void drive(const pfl_marginal_shared_t *s, const pfl_batch_t *p)
{
    const pfl_marginal_t *m = &s->model;
    for (uint32_t k = 0u; k < m->driven; k++) {
        float *x = PFL_STATE(p, m->state[k]);
        add_row(m, m->drive[k], p, x);
        pfl_marginal_add_scaled(x, s->drive_root[k], PFL_NOISE(p, m->noise[k]), p->n);
        add_gain(m, s->drive_gain[k], s->drive_root[k], PFL_NOISE(p, m->noise[k]), p);
    }
}

static void carry_means(const pfl_marginal_t *m, const pfl_batch_t *p)
{
    float after[PFL_MARGINAL_MAX][STRIP];
    for (uint32_t r = 0u; r < m->linear; r++) {
        pfl_marginal_fill(after[r], m->drift[r], p->n);
        add_row(m, m->transition[r], p, after[r]);
    }
    for (uint32_t r = 0u; r < m->linear; r++) {
        (void)memcpy(PFL_STATE(p, m->mean + r), after[r], sizeof(float) * p->n);
    }
}

static void see(const pfl_marginal_shared_t *s, const float *z, const pfl_batch_t *p)
{
    const pfl_marginal_t *m = &s->model;
    float *restrict ll = PFL_STATE(p, m->loglik_state);
    pfl_marginal_fill(ll, 0.0f, p->n);
    for (uint32_t k = 0u; (z != NULL) && (k < m->measured); k++) {
        const float weight = s->see_weight[k];
        float e[STRIP];
        pfl_marginal_measure(m, k, p, e, NULL);
        add_row(m, m->see[k], p, e);
        for (uint32_t i = 0u; i < p->n; i++) {
            e[i] = z[k] - e[i];
            ll[i] -= weight * (e[i] * e[i]);
        }
        add_gain(m, s->see_gain[k], 1.0f, e, p);
    }
}

void pfl_marginal_shared_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    const pfl_marginal_shared_t *s = (const pfl_marginal_shared_t *)user;
    const pfl_marginal_t *m = &s->model;
    const pfl_marginal_input_t *in = (const pfl_marginal_input_t *)u;
    if (m->predict != NULL) {
        m->predict(m->user, in->u, dt_s, p);
    }
    drive(s, p);
    for (uint32_t from = 0u; from < p->n; from += STRIP) {
        const pfl_batch_t strip = pfl_marginal_strip(p, from);
        carry_means(m, &strip);
        if (m->measured > 0u) {
            see(s, in->z, &strip);
        }
    }
}

void pfl_marginal_loglik(void *user, const void *z, const pfl_view_t *p, float *ll)
{
    const pfl_marginal_t *m = (const pfl_marginal_t *)user;
    (void)z;
    (void)memcpy(ll, &p->x[(size_t)m->loglik_state * p->stride], sizeof(float) * p->n);
}
