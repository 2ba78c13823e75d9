/* The figures of `wind`: medians over the seeds, and the acceptance that the project set itself. */
#include "wind.h"

#include <math.h>

#define ACCEPTED_PARTICLES 300u /* and more: with 100 the 95 % region is a little small */

static metric_t *add(verdict_t *verdict, const char *name, table_t runs, size_t column)
{
    return verdict_add(verdict, name, runs.n > 1u ? stats_median(runs, column) : stats_mean(runs, column));
}

static void accept(metric_t *metric, double lo, double hi)
{
    metric->lo = lo;
    metric->hi = hi;
}

void wind_judge(const plan_t *plan, table_t runs, verdict_t *verdict)
{
    const wind_study_t *s = plan->own;
    metric_t *rms = add(verdict, "wind_rms_mps", runs, WIND_RMS);
    metric_t *end = NULL;
    metric_t *covered = NULL;

    add(verdict, "airspeed_scale", runs, WIND_SCALE);
    add(verdict, "outage_30s_m", runs, WIND_END_30);
    end = add(verdict, "outage_60s_m", runs, WIND_END_60);
    covered = add(verdict, "covered", runs, WIND_COVERED);
    add(verdict, "ahead_5s_straight_m", runs, WIND_AHEAD);
    add(verdict, "ahead_5s_m", runs, WIND_AHEAD + 1u);
    add(verdict, "ahead_10s_straight_m", runs, WIND_AHEAD + 2u);
    add(verdict, "ahead_10s_m", runs, WIND_AHEAD + 3u);
    if (s->px4 && !s->bootstrap) {
        add(verdict, "loiter_5s_straight_m", runs, WIND_ORBIT);
        add(verdict, "loiter_5s_turn_m", runs, WIND_ORBIT + 1u);
        add(verdict, "loiter_5s_waypoint_m", runs, WIND_ORBIT + 2u);
        add(verdict, "loiter_10s_straight_m", runs, WIND_ORBIT + 3u);
        add(verdict, "loiter_10s_turn_m", runs, WIND_ORBIT + 4u);
        add(verdict, "loiter_10s_waypoint_m", runs, WIND_ORBIT + 5u);
    }
    if (!s->bootstrap && s->particles >= ACCEPTED_PARTICLES) {
        accept(rms, 0.0, 0.9);
        accept(end, 0.0, s->px4 ? 75.0 : 35.0);
        accept(covered, 0.90, 0.98);
    }
    text_add(&verdict->notes,
             "Medians over the runs. Batch fit over the whole flight: wind (%.2f, %.2f) m/s, scale %.3f.\n",
             s->batch_wind_mps[0], s->batch_wind_mps[1], s->batch_scale);
    text_add(&verdict->notes,
             "Outages begin every 20 s from 60 s on; `covered`: fixes of all outages, 0 to 60 s, in the "
             "95 %% region of the predicted position.\n");
}
