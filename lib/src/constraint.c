/* State constraints: bounded acceptance-rejection, then projection. filter.h tells the rule.
 *
 * With retries predict.c keeps a batch as it was before its move. Those that landed outside are gathered from there, close
 * together, moved again with new noise, and those that are inside now go back to their places. */
#include "guard.h"

/* Flags and indices live in the work column that no noise uses. */
static uint32_t *flags_of(pfl_t *f)
{
    return (uint32_t *)(void *)&f->work[PFL_WORK_FLOATS(f->config->states, f->config->noises) - PFL_BATCH];
}

static void *user_of(const pfl_t *f)
{
    return (f->config->constraint->user != NULL) ? f->config->constraint->user : f->config->user;
}

/* Flags to places of those without one, in order; returns how many. Never written further than read. */
/*@ requires n <= PFL_BATCH && \valid(list + (0 .. n - 1));
    assigns list[0 .. n - 1];
    ensures \result <= n;
    ensures \forall integer k; 0 <= k < \result ==> list[k] < n; */
static uint32_t places(uint32_t *list, uint32_t n)
{
    uint32_t outside = 0u;
    /*@ loop invariant outside <= i <= n && \forall integer k; 0 <= k < outside ==> list[k] < n;
        loop assigns i, outside, list[0 .. n - 1];
        loop variant n - i; */
    for (uint32_t i = 0u; i < n; i++) {
        const uint32_t is_outside = (list[i] == 0u) ? 1u : 0u;
        list[outside] = i;
        outside += is_outside;
    }
    return outside;
}

/* Places (0 .. n-1) of particles outside; returns how many. */
static uint32_t list_outside(pfl_t *f, uint32_t first, uint32_t n)
{
    const pfl_view_t view = {&f->x[first], f->stride, first, n};
    uint32_t *list = flags_of(f);
    f->config->constraint->inside(user_of(f), &view, list);
    pfl_guard_after_callback(f);
    return places(list, n);
}

/* One more attempt for the listed particles: written to their places whatever it gives, so that the last proposal is
 * what gets projected. */
static void try_again(pfl_t *f, const void *u, float dt_s, uint32_t first, uint32_t listed)
{
    const uint32_t states = f->config->states;
    const uint32_t *list = flags_of(f);
    float *fresh = &f->retry[(size_t)states * PFL_BATCH];
    for (uint32_t d = 0u; d < states; d++) {
        const size_t column = (size_t)d * PFL_BATCH;
        for (uint32_t k = 0u; k < listed; k++) {
            fresh[column + k] = f->retry[column + list[k]];
        }
    }
    const pfl_batch_t batch = {fresh, PFL_BATCH, f->work, first, listed};
    for (uint32_t q = 0u; q < f->config->noises; q++) {
        pfl_rng_normals(&f->rng, &f->work[(size_t)q * PFL_BATCH], (listed + (PFL_GROUP - 1u)) / PFL_GROUP);
    }
    f->config->predict(f->config->user, u, dt_s, &batch);
    pfl_guard_after_callback(f);
    for (uint32_t d = 0u; d < states; d++) {
        float *x = &f->x[((size_t)d * f->stride) + first];
        for (uint32_t k = 0u; k < listed; k++) {
            x[list[k]] = fresh[((size_t)d * PFL_BATCH) + k];
        }
    }
}

void pfl_constraint_keep(pfl_t *f, const void *u, float dt_s, uint32_t first, uint32_t n)
{
    const pfl_constraint_t *constraint = f->config->constraint;
    uint32_t outside = list_outside(f, first, n);
    for (uint32_t draw = 1u; (outside > 0u) && (draw < constraint->tries); draw++) {
        try_again(f, u, dt_s, first, outside);
        pfl_count(&f->redrawn, outside);
        outside = list_outside(f, first, n);
    }
    if (outside > 0u) {
        const pfl_batch_t batch = pfl_batch_at(f, first, n);
        constraint->project(user_of(f), &batch);
        pfl_guard_after_callback(f);
        pfl_count(&f->projected, outside);
    }
}
