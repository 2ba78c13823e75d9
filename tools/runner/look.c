/* Steps of a filter as lines of JSON: see look.h. */
#include "look.h"

#include "stats.h"

#include <math.h>
#include <stdlib.h>

/* JSON has no word for what is not finite but null. */
static void add_number(text_t *text, double x)
{
    text_add(text, isfinite(x) ? "%.7g" : "null", x);
}

static void add_pair(text_t *text, const char *name, const double *pair)
{
    text_add(text, ",\"%s\":[", name);
    add_number(text, pair[0]);
    text_add(text, ",");
    add_number(text, pair[1]);
    text_add(text, "]");
}

/* The particles' standard deviations about the estimate; returns their correlation. */
static double spread_of(const pfl_view_t *view, const float *log_weights, const look_at_t *at, double *sigma)
{
    double all = 0.0;
    double product = 0.0;
    double square[2] = {0.0, 0.0};

    for (uint32_t i = 0u; i < view->n; i++) {
        const double weight = exp((double)log_weights[i]);
        const double x = (double)PFL_STATE(view, at->state[0])[i] - at->estimate[0];
        const double y = (double)PFL_STATE(view, at->state[1])[i] - at->estimate[1];
        all += weight;
        square[0] += weight * x * x;
        square[1] += weight * y * y;
        product += weight * x * y;
    }
    for (unsigned a = 0u; a < 2u; a++) {
        sigma[a] = sqrt(square[a] / all + at->variance[a]);
    }
    return product / (all * sigma[0] * sigma[1]);
}

/* Evenly spread over the array: after a resampling, copies of one particle stand anywhere in it. */
static void add_cloud(text_t *text, const pfl_view_t *view, const look_at_t *at)
{
    const uint32_t points = view->n < LOOK_POINTS ? view->n : LOOK_POINTS;

    text_add(text, ",\"cloud\":[");
    for (uint32_t j = 0u; j < points; j++) {
        const size_t i = (size_t)((uint64_t)j * view->n / points);
        text_add(text, "%s%.6g,%.6g", j > 0u ? "," : "", (double)PFL_STATE(view, at->state[0])[i],
                 (double)PFL_STATE(view, at->state[1])[i]);
    }
    text_add(text, "]");
}

static void add_health(look_t *look, const pfl_health_t *health)
{
    text_add(&look->text, ",\"ess\":%.6g,\"resampled\":%lu,\"phase\":%d,\"fault\":%lu,\"reject\":%lu,\"mode\":%lu",
             (double)health->ess, (unsigned long)(health->resampled - look->resampled), (int)health->phase,
             (unsigned long)health->fault, (unsigned long)health->reject, (unsigned long)health->mode);
    text_add(&look->text, ",\"event\":%lu,\"us\":%.6g", (unsigned long)health->event,
             1e6 * (double)health->cycles_last / (double)pfl_port_cycles_hz());
    look->resampled = health->resampled;
}

void look_line(look_t *look)
{
    text_add(&look->text, "\n");
    if (look->stream != NULL && !look->text.spoilt) {
        (void)fwrite(look->text.bytes, 1u, look->text.length, look->stream);
        (void)fflush(look->stream); /* whether all went well is asked at the end */
        look->text.length = 0u;
    }
}

void look_take(look_t *look, const pfl_t *filter, const look_at_t *at)
{
    pfl_view_t view;
    pfl_health_t health;
    double sigma[2];

    if (look == NULL || pfl_particles(filter, &view, NULL) != PFL_OK || pfl_health(filter, &health) != PFL_OK) {
        return;
    }
    float *log_weights = malloc((view.n + 1u) * sizeof *log_weights);
    if (log_weights == NULL) {
        look->text.spoilt = true;
        return;
    }
    (void)pfl_particles(filter, &view, log_weights);
    const double correlation = spread_of(&view, log_weights, at, sigma);
    free(log_weights);
    if (look->taken == 0u) { /* the end of the line that tells what is shown */
        text_add(&look->text, ",\"axes\":[\"%s\",\"%s\"],\"against\":\"%s\"}", at->axis[0], at->axis[1],
                 at->instead != NULL ? at->instead : "truth");
        look_line(look);
    }
    text_add(&look->text, "{\"t\":%.9g,\"n\":%lu", at->t_s, (unsigned long)view.n);
    add_pair(&look->text, "truth", at->truth);
    add_pair(&look->text, "estimate", at->estimate);
    add_pair(&look->text, "sigma", sigma);
    text_add(&look->text, ",\"correlation\":");
    add_number(&look->text, correlation);
    add_health(look, &health);
    if (look->taken % look->every == 0u) {
        add_cloud(&look->text, &view, at);
    }
    text_add(&look->text, "}");
    look_line(look);
    look->taken++;
}
