/* The figures of `terrain` and their acceptance: every seed on the ground after 200 s and staying there, and the error from
 * then on, with no more particles than are said. The plain filter is there to be compared with; nothing is asked of it. */
#include "terrain.h"

#include <math.h>
#include <string.h>

#define SEEDS_FOR_MEDIAN 20u
#define MARGINAL_PARTICLES 500u
#define OTHER_PARTICLES 2000u
#define ADAPTIVE_SAVES 3.0 /* particles, once the aircraft is found */

static void accept(metric_t *metric, bool judged, double lo, double hi)
{
    if (judged) {
        metric_accept(metric, lo, hi);
    }
}

void terrain_judge(const plan_t *plan, table_t runs, verdict_t *verdict)
{
    const terrain_study_t *s = plan->own;
    const uint32_t most = s->filter == TERRAIN_RB ? MARGINAL_PARTICLES : OTHER_PARTICLES;
    const bool enough = s->adaptive ? s->particles == OTHER_PARTICLES : s->particles <= most;
    const bool judged = s->as_they_come && s->filter != TERRAIN_PLAIN && enough && runs.n >= SEEDS_FOR_MEDIAN;

    accept(verdict_add(verdict, "converged_share", stats_mean(runs, TERRAIN_CONVERGED)), judged, 1.0, 1.0);
    accept(verdict_add(verdict, "rmse_after_200s_m_median", stats_median(runs, TERRAIN_RMSE)), judged, 0.0,
           s->second ? 17.0 : 15.0);
    verdict_add(verdict, "error_after_200s_m_worst", stats_largest(runs, TERRAIN_WORST));
    verdict_add(verdict, "settled_s_median", stats_median(runs, TERRAIN_SETTLED_S));
    accept(verdict_add(verdict, "particles_after_200s_mean", stats_mean(runs, TERRAIN_PARTICLES)),
           judged && s->adaptive, 0.0, (double)s->particles / ADAPTIVE_SAVES);
    verdict_add(verdict, "resampled_share", stats_mean(runs, TERRAIN_RESAMPLED));
    text_add(&verdict->notes,
             "The heights are real, the flight is simulated. Converged: within 60 m from t = 200 s to the "
             "end. settled_s: since when, or the end of the flight.\n");
    if (s->filter == TERRAIN_PLAIN) {
        text_add(&verdict->notes,
                 "The plain filter is not judged: it is what the others are compared with. It takes the "
                 "whole likelihood from the start, whatever power says, and has no kernel step.\n");
    }
}
