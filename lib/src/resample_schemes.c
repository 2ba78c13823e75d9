/* The resampling schemes besides the systematic one: integer weights to offspring counts, both in the scratch column.
 * resample.c has the arithmetic; a configuration that names none of them leaves this file out of the image. */
#include "resample.h"

#include "rng_kernels.h"

/* Systematic with a V of its own for the point of each stratum k <= c N / S < k + 1. */
/*@ requires sized(f) && column(f->scratch, f) && \valid(f);
    assigns f->scratch[0 .. f->stride - 1], f->rng.one[0 .. 3]; */
void pfl_stratified(pfl_t *f)
{
    const uint32_t count = f->config->particles;
    const comb_t comb = pfl_comb_of(count, pfl_quantise(f));
    uint32_t reach = 0u;
    uint32_t before = 0u;
    uint32_t drawn = 0u; /* strata whose V is known: those below `drawn` */
    uint32_t start = 0u;
    /*@ loop invariant i <= count && drawn <= count;
        loop assigns i, reach, before, drawn, start, f->scratch[0 .. count - 1], f->rng.one[0 .. 3];
        loop variant count - i; */
    for (uint32_t i = 0u; i < count; i++) {
        reach += pfl_load_u32(&f->scratch[i]);
        const uint32_t high = height(comb.factor, reach);
        /*@ loop invariant drawn <= count;
            loop assigns drawn, start, f->rng.one[0 .. 3];
            loop variant count - drawn; */
        while ((drawn <= (high >> comb.shift)) && (drawn < count)) {
            start = pfl_xoshiro_next(f->rng.one) >> (32u - comb.shift);
            drawn++;
        }
        const uint32_t below = (high + start) >> comb.shift;
        pfl_store_u32(&f->scratch[i], below - before);
        before = below;
    }
}

/* Two schemes draw particles in any order: their counts grow in the log-weight column, while the scratch column holds
 * running sums; then the columns change places. */
/*@ requires \valid(f);
    assigns f->log_weight, f->scratch;
    ensures f->log_weight == \old(f->scratch) && f->scratch == \old(f->log_weight); */
static void exchange_columns(pfl_t *f)
{
    float *counts = f->log_weight;
    f->log_weight = f->scratch;
    f->scratch = counts;
}

/* First particle whose running sum exceeds u. */
/*@ requires sized(f) && column(f->scratch, f);
    assigns \nothing;
    ensures \result < f->config->particles; */
static uint32_t search(const pfl_t *f, uint32_t u)
{
    uint32_t low = 0u;
    uint32_t high = f->config->particles - 1u;
    /*@ loop invariant low <= high < f->config->particles;
        loop assigns low, high;
        loop variant high - low; */
    while (low < high) {
        const uint32_t middle = low + ((high - low) / 2u);
        if (pfl_load_u32(&f->scratch[middle]) > u) {
            high = middle;
        } else {
            low = middle + 1u;
        }
    }
    return low;
}

/* Adds `draws` independent draws from the running sums to the counts. */
/*@ requires sized(f) && column(f->scratch, f) && column(f->log_weight, f) && \valid(f);
    assigns f->log_weight[0 .. f->stride - 1], f->rng.one[0 .. 3]; */
static void draw_independently(pfl_t *f, uint32_t total, uint32_t draws)
{
    /*@ loop invariant k <= draws;
        loop assigns k, f->log_weight[0 .. f->stride - 1], f->rng.one[0 .. 3];
        loop variant draws - k; */
    for (uint32_t k = 0u; k < draws; k++) {
        const uint64_t r = pfl_xoshiro_next(f->rng.one);
        const uint32_t i = search(f, (uint32_t)((r * total) >> 32));
        pfl_store_u32(&f->log_weight[i], pfl_load_u32(&f->log_weight[i]) + 1u);
    }
}

/*@ requires sized(f) && column(f->scratch, f) && column(f->log_weight, f) && \valid(f);
    assigns f->scratch[0 .. f->stride - 1], f->log_weight[0 .. f->stride - 1], f->rng.one[0 .. 3], f->scratch,
            f->log_weight;
    ensures f->log_weight == \old(f->scratch) && f->scratch == \old(f->log_weight); */
void pfl_multinomial(pfl_t *f)
{
    const uint32_t count = f->config->particles;
    uint32_t sum = 0u;
    (void)pfl_quantise(f);
    /*@ loop invariant i <= count;
        loop assigns i, sum, f->scratch[0 .. count - 1], f->log_weight[0 .. count - 1];
        loop variant count - i; */
    for (uint32_t i = 0u; i < count; i++) {
        sum += pfl_load_u32(&f->scratch[i]);
        pfl_store_u32(&f->scratch[i], sum);
        pfl_store_u32(&f->log_weight[i], 0u);
    }
    draw_independently(f, sum, count);
    exchange_columns(f);
}

/* One more copy to the first particles that have some. */
/*@ requires sized(f) && column(f->log_weight, f);
    assigns f->log_weight[0 .. f->stride - 1]; */
static void give_away(pfl_t *f, uint32_t left)
{
    /*@ loop invariant i <= f->config->particles;
        loop assigns i, left, f->log_weight[0 .. f->stride - 1];
        loop variant f->config->particles - i; */
    for (uint32_t i = 0u; i < f->config->particles; i++) {
        const uint32_t copies = pfl_load_u32(&f->log_weight[i]);
        const uint32_t more = ((copies > 0u) && (left > 0u)) ? 1u : 0u;
        pfl_store_u32(&f->log_weight[i], copies + more);
        left -= more;
    }
}

/*@ requires sized(f) && column(f->scratch, f) && column(f->log_weight, f) && \valid(f);
    assigns f->scratch[0 .. f->stride - 1], f->log_weight[0 .. f->stride - 1], f->rng.one[0 .. 3], f->scratch,
            f->log_weight;
    ensures f->log_weight == \old(f->scratch) && f->scratch == \old(f->log_weight); */
void pfl_residual(pfl_t *f)
{
    const uint32_t count = f->config->particles;
    const comb_t comb = pfl_comb_of(count, pfl_quantise(f)); /* shares q M sum to less than N + 1: as do the copies */
    uint32_t bits = 32u; /* 2^bits N <= 2^32: remainders of that many bits cannot overflow their sum */
    /*@ loop invariant 11 <= bits <= 32 && half < (1 << (bits - 11));
        loop assigns bits, half;
        loop variant bits; */
    for (uint32_t half = count; half != 0u; half /= 2u) {
        bits--;
    }
    uint32_t left = count;
    uint32_t rest = 0u;
    /*@ loop invariant i <= count;
        loop assigns i, left, rest, f->scratch[0 .. count - 1], f->log_weight[0 .. count - 1];
        loop variant count - i; */
    for (uint32_t i = 0u; i < count; i++) {
        const uint64_t share = ((uint64_t)pfl_load_u32(&f->scratch[i]) * comb.factor) >> comb.shift;
        const uint32_t copies = (uint32_t)(share >> 32);
        left -= copies;
        rest += (uint32_t)share >> (32u - bits);
        pfl_store_u32(&f->log_weight[i], copies);
        pfl_store_u32(&f->scratch[i], rest);
    }
    if (rest != 0u) {
        draw_independently(f, rest, left);
    } else { /* remainders too small for their bits, N >= 65536 only */
        give_away(f, left);
    }
    exchange_columns(f);
}
