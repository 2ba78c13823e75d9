/* JUnit XML: see junit.h. */
#include "junit.h"

#include <math.h>

/* Text within an attribute or an element. Control characters, which XML cannot hold, become question marks. */
static void add_escaped(text_t *text, const char *string)
{
    for (; *string != '\0'; string++) {
        const char c = *string;
        if (c == '&') {
            text_add(text, "&amp;");
        } else if (c == '<') {
            text_add(text, "&lt;");
        } else if (c == '>') {
            text_add(text, "&gt;");
        } else if (c == '"') {
            text_add(text, "&quot;");
        } else {
            text_add(text, "%c", (unsigned char)c < 0x20u ? '?' : c);
        }
    }
}

static void begin_case(junit_suite_t *suite, const char *scenario, const char *id, const char *name)
{
    text_add(&suite->cases, "    <testcase classname=\"");
    add_escaped(&suite->cases, scenario);
    text_add(&suite->cases, ".");
    add_escaped(&suite->cases, id);
    text_add(&suite->cases, "\" name=\"");
    add_escaped(&suite->cases, name);
    text_add(&suite->cases, "\"");
    suite->tests++;
}

static void add_metric(junit_suite_t *suite, const outcome_t *outcome, const char *id, const metric_t *metric)
{
    begin_case(suite, outcome->study->scenario->name, id, metric->name);
    if (metric_is_accepted(metric)) {
        text_add(&suite->cases, "/>\n");
        return;
    }
    suite->failures++;
    text_add(&suite->cases, "><failure message=\"%.9g is outside %.9g .. %.9g\">ours %.9g +- %.9g\npaper %.9g\n",
             metric->ours.mean, metric->lo, metric->hi, metric->ours.mean, metric->ours.error, metric->paper);
    text_add(&suite->cases, "reference %.9g\naccepted %.9g .. %.9g</failure></testcase>\n", metric->reference,
             metric->lo, metric->hi);
}

static void add_budget(junit_suite_t *suite, const outcome_t *outcome, const char *id)
{
    const timing_t *timing = &outcome->timing;

    begin_case(suite, outcome->study->scenario->name, id, "budget_p50_us");
    if (timing_is_accepted(timing)) {
        text_add(&suite->cases, "/>\n");
        return;
    }
    suite->failures++;
    text_add(&suite->cases,
             "><failure message=\"p50 %.3f us is over the budget of %.3f us\">p99 %.3f us, max %.3f us, %lu cycles "
             "over the budget</failure></testcase>\n",
             timing->cycle.p50_us, timing->budget_us, timing->cycle.p99_us, timing->cycle.max_us,
             (unsigned long)timing->overruns);
}

void junit_add_study(junit_suite_t *suite, const outcome_t *outcome, const char *id)
{
    for (size_t i = 0u; i < outcome->verdict.count; i++) {
        if (metric_is_judged(&outcome->verdict.metric[i])) {
            add_metric(suite, outcome, id, &outcome->verdict.metric[i]);
        }
    }
    if (!isnan(outcome->timing.cycle.p50_us)) {
        add_budget(suite, outcome, id);
    }
    suite->elapsed_s += outcome->elapsed_s;
}

void junit_add_skipped(junit_suite_t *suite, const char *scenario, const char *reason)
{
    begin_case(suite, scenario, scenario, "recordings");
    suite->skipped++;
    text_add(&suite->cases, "><skipped message=\"");
    add_escaped(&suite->cases, reason);
    text_add(&suite->cases, "\"/></testcase>\n");
}

void junit_add_suite(text_t *document, const char *scenario, junit_suite_t *suite)
{
    text_add(document, "  <testsuite name=\"");
    add_escaped(document, scenario);
    text_add(document, "\" tests=\"%u\" failures=\"%u\" errors=\"0\" skipped=\"%u\" time=\"%.3f\">\n%s  </testsuite>\n",
             suite->tests, suite->failures, suite->skipped, suite->elapsed_s,
             suite->cases.bytes != NULL ? suite->cases.bytes : "");
    document->spoilt = document->spoilt || suite->cases.spoilt;
    text_free(&suite->cases);
}

void junit_begin(text_t *document)
{
    text_add(document, "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites name=\"pflight\">\n");
}

void junit_end(text_t *document)
{
    text_add(document, "</testsuites>\n");
}
