/* The figures of `uwb-range` and their acceptance: no paper has any for these recordings, so the bounds are the
 * project's own, for 500 particles and the median over many seeds; no single seed may be above 1.3 times that. */
#include "uwb_range.h"

#include <math.h>
#include <string.h>

#define ACCEPTED_PARTICLES 500u
#define SEEDS_FOR_MEDIAN 20u
#define WORST_SHARE 1.3

static double bound_of(const uwb_study_t *s)
{
    if (s->online) {
        return s->indoor ? 0.085 : (s->los ? 0.72 : 0.84);
    }
    if (s->indoor) {
        return 0.09;
    }
    return s->los ? 0.75 : 0.88;
}

void uwb_judge(const plan_t *plan, table_t runs, verdict_t *verdict)
{
    const uwb_study_t *s = plan->own;
    const bool judged = s->particles == ACCEPTED_PARTICLES && !s->gaussian && !s->blind;
    const double bound = bound_of(s);
    metric_t *rmse = verdict_add(verdict, "rmse_m", stats_mean(runs, UWB_RMSE));

    verdict_add(verdict, "p95_m", stats_mean(runs, UWB_P95));
    verdict_add(verdict, "max_m", stats_mean(runs, UWB_MAX));
    verdict_add(verdict, "resampled_share", stats_mean(runs, UWB_RESAMPLED));
    if (runs.n > 1u) {
        metric_t *median = verdict_add(verdict, "rmse_m_median", stats_median(runs, UWB_RMSE));
        metric_t *most = verdict_add(verdict, "rmse_m_worst", stats_largest(runs, UWB_RMSE));
        if (judged) {
            metric_accept(most, 0.0, WORST_SHARE * bound);
        }
        if (judged && runs.n >= SEEDS_FOR_MEDIAN) {
            metric_accept(median, 0.0, bound);
        }
    } else if (judged) {
        metric_accept(rmse, 0.0, WORST_SHARE * bound);
    }
    text_add(&verdict->notes, s->indoor ? "One error a range, after the first 60; the start is anywhere in the square, "
                                          "with any heading.\n"
                                        : "One error a range, from the first on, horizontal, against the truth 0.18 s "
                                          "before the stamp; the start comes from the first range alone.\n");
    if (!s->indoor && !s->common_bias && !s->online) {
        text_add(&verdict->notes, "The range bias of each anchor was calibrated on these very recordings; bias=common "
                                  "uses 0.10 m for all.\n");
    }
}
