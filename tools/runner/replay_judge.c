/* The figures of `replay`: what a log can tell of a filter, with truth and without. Nothing is accepted or refused. */
#include "replay.h"

#include <math.h>
#include <string.h>

static void note_consistency(verdict_t *verdict, double positions)
{
    const double half = 1.96 * 2.0 / sqrt(positions); /* of a mean of that many chi-squares of two */

    text_add(&verdict->notes,
             "innovation_m: position measured less predicted, rms. nis: the same over its covariance, mean square: "
             "%.2f .. %.2f for a consistent filter whose measurements have white errors; above, the noises are too "
             "small, below, too large.\n",
             2.0 - half, 2.0 + half);
}

void replay_judge(const plan_t *plan, table_t runs, verdict_t *verdict)
{
    const replay_study_t *s = plan->own;
    const figure_t scored = stats_mean(runs, REPLAY_SCORED);
    const figure_t error = stats_mean(runs, REPLAY_ERROR);

    if (scored.mean > 0.0) {
        verdict_add(verdict, "innovation_m", stats_mean(runs, REPLAY_INNOVATION));
        verdict_add(verdict, "nis", stats_mean(runs, REPLAY_NIS));
        verdict_add(verdict, "nis_inside_95", stats_mean(runs, REPLAY_INSIDE));
        note_consistency(verdict, scored.mean);
    }
    if (isfinite(error.mean)) {
        verdict_add(verdict, "error_m", error);
    }
    if (isfinite(error.mean) && strcmp(s->compared, "truth.csv") == 0) { /* another filter's estimate is no truth */
        verdict_add(verdict, "nees", stats_mean(runs, REPLAY_NEES));
    }
    verdict_add(verdict, "rejected", stats_mean(runs, REPLAY_REJECTED));
    verdict_add(verdict, "restarts", stats_mean(runs, REPLAY_RESTARTS));
    verdict_add(verdict, "resampled_share", stats_mean(runs, REPLAY_RESAMPLED));
    verdict_add(verdict, "ess_share", stats_mean(runs, REPLAY_ESS));
    verdict_add(verdict, "arena_bytes", (figure_t){stats_mean(runs, REPLAY_ARENA).mean, MISSING});
    verdict_add(verdict, "positions", (figure_t){scored.mean, MISSING});
    if (isfinite(error.mean)) {
        text_add(&verdict->notes, "error_m: against %s.\n", s->compared);
    } else {
        text_add(&verdict->notes, "No error: neither truth.csv nor nav.csv has north_m and east_m at these times.\n");
    }
    text_add(&verdict->notes,
             "Run k flies the filter with seed + k: anywhere else the same seed gives the same bits.\n");
}
