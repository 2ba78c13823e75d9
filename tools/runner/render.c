/* Text of the results: see render.h. */
#include "render.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

bool metric_is_judged(const metric_t *metric)
{
    return !isnan(metric->lo);
}

bool metric_is_accepted(const metric_t *metric)
{
    return metric->ours.mean >= metric->lo && metric->ours.mean <= metric->hi;
}

bool timing_is_accepted(const timing_t *timing)
{
    return !(timing->cycle.p50_us > timing->budget_us);
}

bool outcome_is_accepted(const outcome_t *outcome)
{
    const verdict_t *verdict = &outcome->verdict;

    for (size_t i = 0u; i < verdict->count; i++) {
        if (metric_is_judged(&verdict->metric[i]) && !metric_is_accepted(&verdict->metric[i])) {
            return false;
        }
    }
    return timing_is_accepted(&outcome->timing);
}

/* ---- Table ------------------------------------------------------------------------------------------------------- */

/* A figure, or a dash for one that does not exist. */
static const char *cell(double x, const char *format, char *room, size_t size)
{
    if (isnan(x)) {
        return "-";
    }
    (void)snprintf(room, size, format, x);
    return room;
}

/* The figure to compare with and our deviation from it: two columns. */
static void add_comparison(text_t *text, double ours, double theirs)
{
    char figure[32];
    char deviation[32];

    text_add(text, " %10s %9s", cell(theirs, "%.4f", figure, sizeof figure),
             cell(100.0 * (ours / theirs - 1.0), "%+.2f %%", deviation, sizeof deviation));
}

static void add_metric(text_t *text, const metric_t *metric)
{
    /* A band as narrow as rounding cannot be read off four decimals. */
    const char *band = metric->hi - metric->lo < 1e-3 ? "%.7f .. %.7f" : "%.4f .. %.4f";
    char error[32];

    text_add(text, "  %-18s %10.4f %9s", metric->name, metric->ours.mean,
             cell(metric->ours.error, "%.4f", error, sizeof error));
    add_comparison(text, metric->ours.mean, metric->paper);
    add_comparison(text, metric->ours.mean, metric->reference);
    if (metric_is_judged(metric)) {
        char accepted[64];
        (void)snprintf(accepted, sizeof accepted, band, metric->lo, metric->hi);
        text_add(text, "  %-22s %s", accepted, metric_is_accepted(metric) ? "PASS" : "FAIL");
    }
    text_add(text, "\n");
}

static void add_settings(text_t *text, const study_t *study)
{
    text_add(text, "  filter=%s particles=%lu runs=%lu seed=%llu", study->filter, (unsigned long)study->particles,
             (unsigned long)study->runs, (unsigned long long)study->seed);
    for (size_t i = 0u; i < study->scenario->settings_count; i++) {
        text_add(text, " %s=%s", study->scenario->settings[i].key, study->value[i]);
    }
    text_add(text, "\n");
}

static void add_notes(text_t *text, const char *notes)
{
    while (notes != NULL && *notes != '\0') {
        const size_t length = strcspn(notes, "\n");
        text_add(text, "  %.*s\n", (int)length, notes);
        notes += length + (notes[length] == '\n' ? 1u : 0u);
    }
}

static void add_spread(text_t *text, const char *what, const spread_t *spread)
{
    text_add(text, "  %-13s p50 %.1f us, p99 %.1f us, max %.1f us", what, spread->p50_us, spread->p99_us,
             spread->max_us);
}

static void add_timing(text_t *text, const outcome_t *outcome)
{
    const timing_t *timing = &outcome->timing;

    if (!isnan(timing->cycle.p50_us)) {
        add_spread(text, "filter cycle:", &timing->cycle);
        text_add(text, "; budget %.0f us", timing->budget_us);
        if (!(outcome->study->budget_us > 0.0)) {
            text_add(text, " (%s)", outcome->plan->budget_reason);
        }
        text_add(text, ", %lu over it  %s\n", (unsigned long)timing->overruns,
                 timing_is_accepted(timing) ? "PASS" : "FAIL: p50 over it");
    }
    if (!isnan(timing->resampling.p50_us)) {
        add_spread(text, "of it resampling:", &timing->resampling);
        text_add(text, ", in %.1f %% of the cycles\n", 100.0 * timing->resampled_share);
    }
    text_add(text, "  hash %016llx\n", (unsigned long long)outcome->hash);
}

void render_table(const outcome_t *outcome, text_t *text)
{
    const verdict_t *verdict = &outcome->verdict;
    bool compared = false;

    text_add(text, "%s: %s\n", outcome->study->scenario->name, outcome->study->scenario->summary);
    add_settings(text, outcome->study);
    text_add(text, "  %-18s %10s %9s %10s %9s %10s %9s  %-22s\n", "metric", "ours", "+-", "paper", "off by",
             "reference", "off by", "accepted");
    for (size_t i = 0u; i < verdict->count; i++) {
        add_metric(text, &verdict->metric[i]);
        compared = compared || !isnan(verdict->metric[i].reference) || metric_is_judged(&verdict->metric[i]);
    }
    if (!compared) {
        text_add(text, "  no reference for these settings\n");
    }
    add_timing(text, outcome);
    add_notes(text, verdict->notes.bytes);
    text_add(text, "\n");
}

/* ---- CSV --------------------------------------------------------------------------------------------------------- */

static void add_names(text_t *text, const char *const *name, size_t names)
{
    for (size_t c = 0u; c < names; c++) {
        text_add(text, ",%s", name[c]);
    }
}

static void add_header(text_t *text, const plan_t *plan)
{
    text_add(text, plan->period_s > 0.0 ? "k,t_s" : "k");
    add_names(text, plan->column, plan->columns);
}

static void add_instant(text_t *text, const plan_t *plan, size_t k)
{
    text_add(text, "%lu", (unsigned long)(k + 1u));
    if (plan->period_s > 0.0) {
        text_add(text, ",%.9g", (double)(k + 1u) * plan->period_s);
    }
}

static void add_field(text_t *text, double x)
{
    text_add(text, isnan(x) ? "," : ",%.9g", x);
}

void render_csv(const outcome_t *outcome, text_t *text)
{
    const plan_t *plan = outcome->plan;
    const table_t runs = {outcome->results->series, outcome->study->runs, plan->steps * plan->columns};

    add_header(text, plan);
    text_add(text, "\n");
    for (size_t k = 0u; k < plan->steps; k++) {
        add_instant(text, plan, k);
        for (size_t c = 0u; c < plan->columns; c++) {
            add_field(text, stats_mean(runs, k * plan->columns + c).mean);
        }
        text_add(text, "\n");
    }
}

/* Cycle k of a traced run; empty fields where there is none. */
static void add_cycle(text_t *text, const plan_t *plan, const results_t *results, size_t k)
{
    if (k >= plan->cycles) {
        text_add(text, ",,,,");
        return;
    }
    const cycle_t *cycle = &results->cycle[k];
    const uint32_t before = k == 0u ? 0u : cycle[-1].resampled;
    if (cycle->ess > 0.0f) {
        text_add(text, ",%.9g,%d", (double)cycle->ess, cycle->resampled > before ? 1 : 0);
    } else {
        text_add(text, ",,");
    }
    text_add(text, ",%lu,%lu", (unsigned long)results->cycles_ns[k], (unsigned long)cycle->resample_ns);
}

void render_trace(const plan_t *plan, const results_t *results, text_t *text)
{
    add_header(text, plan);
    add_names(text, plan->trace_column, plan->trace_columns);
    text_add(text, ",ess,resampled,cycles_ns,resample_ns\n");
    for (size_t k = 0u; k < plan->steps; k++) {
        add_instant(text, plan, k);
        for (size_t c = 0u; c < plan->columns; c++) {
            add_field(text, results->series[k * plan->columns + c]);
        }
        for (size_t c = 0u; c < plan->trace_columns; c++) {
            add_field(text, results->trace[k * plan->trace_columns + c]);
        }
        add_cycle(text, plan, results, k);
        text_add(text, "\n");
    }
}
