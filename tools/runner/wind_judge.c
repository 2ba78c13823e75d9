/* The figures of `wind`: medians over the seeds, and the acceptance that the project set itself. */
#include "wind.h"

#include <math.h>

#define ACCEPTED_PARTICLES 300u /* and more: with 100 the 95 % region is a little small */

void wind_judge(const plan_t *plan, table_t runs, verdict_t *verdict)
{
    const wind_study_t *s = plan->own;
    metric_t *rms = verdict_add_typical(verdict, "wind_rms_mps", runs, WIND_RMS);
    metric_t *end = NULL;
    metric_t *covered = NULL;

    verdict_add_typical(verdict, "airspeed_scale", runs, WIND_SCALE);
    verdict_add_typical(verdict, "outage_30s_m", runs, WIND_END_30);
    end = verdict_add_typical(verdict, "outage_60s_m", runs, WIND_END_60);
    covered = verdict_add_typical(verdict, "covered", runs, WIND_COVERED);
    verdict_add_typical(verdict, "ahead_5s_straight_m", runs, WIND_AHEAD);
    verdict_add_typical(verdict, "ahead_5s_m", runs, WIND_AHEAD + 1u);
    verdict_add_typical(verdict, "ahead_10s_straight_m", runs, WIND_AHEAD + 2u);
    verdict_add_typical(verdict, "ahead_10s_m", runs, WIND_AHEAD + 3u);
    if (s->px4 && !s->bootstrap) {
        verdict_add_typical(verdict, "loiter_5s_straight_m", runs, WIND_ORBIT);
        verdict_add_typical(verdict, "loiter_5s_turn_m", runs, WIND_ORBIT + 1u);
        verdict_add_typical(verdict, "loiter_5s_waypoint_m", runs, WIND_ORBIT + 2u);
        verdict_add_typical(verdict, "loiter_10s_straight_m", runs, WIND_ORBIT + 3u);
        verdict_add_typical(verdict, "loiter_10s_turn_m", runs, WIND_ORBIT + 4u);
        verdict_add_typical(verdict, "loiter_10s_waypoint_m", runs, WIND_ORBIT + 5u);
    }
    if (!s->bootstrap && s->particles >= ACCEPTED_PARTICLES) {
        metric_accept(rms, 0.0, 0.9);
        metric_accept(end, 0.0, s->px4 ? 75.0 : 35.0);
        metric_accept(covered, 0.90, 0.98);
    }
    text_add(&verdict->notes,
             "Medians over the runs. Batch fit over the whole flight: wind (%.2f, %.2f) m/s, scale %.3f.\n",
             s->batch_wind_mps[0], s->batch_wind_mps[1], s->batch_scale);
    text_add(&verdict->notes,
             "Outages begin every 20 s from 60 s on; `covered`: fixes of all outages, 0 to 60 s, in the "
             "95 %% region of the predicted position.\n");
}
