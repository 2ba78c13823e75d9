/* JSON of the results: see json.h. */
#include "json.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

void json_string(text_t *text, const char *string)
{
    text_add(text, "\"");
    for (; *string != '\0'; string++) {
        const unsigned char c = (unsigned char)*string;
        text_add(text, c < 0x20u ? "\\u%04x" : (c == '"' || c == '\\') ? "\\%c" : "%c", (int)c);
    }
    text_add(text, "\"");
}

/* JSON has no word for what is not finite but null. */
static void add_number(text_t *text, double x)
{
    if (isfinite(x)) {
        text_add(text, "%.17g", x);
    } else {
        text_add(text, "null");
    }
}

static void add_named(text_t *text, const char *before, const char *name, double x)
{
    text_add(text, "%s\"%s\":", before, name);
    add_number(text, x);
}

/* A setting that is a number becomes one. */
static void add_value(text_t *text, const char *value)
{
    char *end;
    const double number = strtod(value, &end);

    if (end != value && *end == '\0') {
        add_number(text, number);
    } else {
        json_string(text, value);
    }
}

static void add_settings(text_t *text, const study_t *study)
{
    text_add(text, ",\"settings\":{\"filter\":");
    json_string(text, study->filter);
    text_add(text, ",\"particles\":%lu,\"runs\":%lu,\"seed\":%llu", (unsigned long)study->particles,
             (unsigned long)study->runs, (unsigned long long)study->seed);
    for (size_t i = 0u; i < study->scenario->settings_count; i++) {
        text_add(text, ",");
        json_string(text, study->scenario->settings[i].key);
        text_add(text, ":");
        add_value(text, study->value[i]);
    }
    text_add(text, "}");
}

/* What the metric is compared with and judged by. */
static void add_comparison(text_t *text, const metric_t *metric)
{
    add_named(text, ",", "paper", metric->paper);
    add_named(text, ",", "reference", metric->reference);
    add_named(text, ",", "lo", metric->lo);
    add_named(text, ",", "hi", metric->hi);
    if (metric_is_judged(metric)) {
        text_add(text, ",\"verdict\":\"%s\"", metric_is_accepted(metric) ? "pass" : "fail");
    } else {
        text_add(text, ",\"verdict\":null");
    }
}

static void add_metrics(text_t *text, const verdict_t *verdict, bool compared)
{
    text_add(text, ",\"metrics\":{");
    for (size_t i = 0u; i < verdict->count; i++) {
        const metric_t *metric = &verdict->metric[i];
        text_add(text, i == 0u ? "" : ",");
        json_string(text, metric->name);
        add_named(text, ":{", "mean", metric->ours.mean);
        add_named(text, ",", "stderr", metric->ours.error);
        if (compared) {
            add_comparison(text, metric);
        }
        text_add(text, "}");
    }
    text_add(text, "}");
}

static void add_timing(text_t *text, const timing_t *timing, bool more)
{
    const bool timed = !isnan(timing->cycle.p50_us);

    add_named(text, ",\"timing\":{", "p50_us", timed ? timing->cycle.p50_us : 0.0);
    add_named(text, ",", "p99_us", timed ? timing->cycle.p99_us : 0.0);
    add_named(text, ",", "max_us", timed ? timing->cycle.max_us : 0.0);
    add_named(text, ",", "budget_us", timing->budget_us);
    text_add(text, ",\"overruns\":%lu", (unsigned long)timing->overruns);
    if (more) {
        text_add(text, ",\"verdict\":%s", !timed ? "null" : timing_is_accepted(timing) ? "\"pass\"" : "\"fail\"");
        add_named(text, ",", "resample_p50_us", timing->resampling.p50_us);
        add_named(text, ",", "resample_p99_us", timing->resampling.p99_us);
        add_named(text, ",", "resample_max_us", timing->resampling.max_us);
        add_named(text, ",", "resampled_share", timing->resampled_share);
    }
    text_add(text, "}");
}

/* Without the closing brace. */
static void add_study(text_t *text, const outcome_t *outcome, bool more)
{
    text_add(text, "{\"schema\":1,\"scenario\":");
    json_string(text, outcome->study->scenario->name);
    add_settings(text, outcome->study);
    add_metrics(text, &outcome->verdict, more);
    add_timing(text, &outcome->timing, more);
    text_add(text, ",\"hash\":\"%016llx\"", (unsigned long long)outcome->hash);
}

void json_study(const outcome_t *outcome, text_t *text)
{
    add_study(text, outcome, false);
    text_add(text, "}\n");
}

static void add_notes(text_t *text, const char *notes)
{
    text_add(text, ",\"notes\":");
    json_string(text, notes != NULL ? notes : "");
}

/* The settings that are not as by default. */
static void add_special(text_t *text, const study_t *study)
{
    bool first = true;

    text_add(text, ",\"special\":[");
    for (size_t i = 0u; i < study->scenario->settings_count; i++) {
        if (strcmp(study->value[i], study->scenario->settings[i].fallback) != 0) {
            text_add(text, first ? "" : ",");
            json_string(text, study->scenario->settings[i].key);
            first = false;
        }
    }
    text_add(text, "]");
}

static void add_file(text_t *text, const char *name, bool is_there, const char *id, const char *suffix)
{
    if (is_there) {
        text_add(text, ",\"%s\":\"csv/%s.%s\"", name, id, suffix);
    } else {
        text_add(text, ",\"%s\":null", name);
    }
}

void json_look(const study_t *study, const plan_t *plan, uint32_t run, text_t *text)
{
    text_add(text, "{\"schema\":1,\"scenario\":");
    json_string(text, study->scenario->name);
    add_settings(text, study);
    text_add(text, ",\"run\":%lu", (unsigned long)run);
    add_named(text, ",", "budget_us", study->budget_us > 0.0 ? study->budget_us : plan->budget_us);
}

void json_summary_study(const outcome_t *outcome, const char *id, const traced_t *traced, text_t *text)
{
    add_study(text, outcome, true);
    text_add(text, ",\"accepted\":%s,\"id\":", outcome_is_accepted(outcome) ? "true" : "false");
    json_string(text, id);
    add_special(text, outcome->study);
    text_add(text, ",\"summary\":");
    json_string(text, outcome->study->scenario->summary);
    text_add(text, ",\"budget_reason\":");
    json_string(text, outcome->study->budget_us > 0.0 ? "" : outcome->plan->budget_reason);
    add_named(text, ",", "elapsed_s", outcome->elapsed_s);
    text_add(text, ",\"csv\":\"csv/%s.csv\",\"trace\":\"csv/%s.trace.csv\"", id, id);
    add_file(text, "cloud", traced->cloud, id, "cloud.csv");
    add_file(text, "look", traced->look, id, "look.jsonl");
    add_notes(text, outcome->verdict.notes.bytes);
    text_add(text, "}");
}
