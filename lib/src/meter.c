/* Counts the port's cycles over a filter cycle and holds them against the budget. Only differences modulo the
 * counter's width are used; a difference of more than half the width is a counter that jumped back and counts as
 * nothing. Nothing ever waits for the counter. */
#include "core.h"

#include "pflight/port.h"

/*@ requires \valid(f);
    assigns f->meter.used, f->cycles_resample, f->overrun_counted;
    ensures f->meter.used == 0; */
void pfl_meter_begin(pfl_t *f)
{
    f->meter.used = 0u;
    f->cycles_resample = 0u;
    f->overrun_counted = 0u;
}

/*@ requires \valid(f);
    assigns f->meter.since; */
void pfl_meter_resume(pfl_t *f)
{
    if (f->meter.mask != 0u) {
        f->meter.since = pfl_port_cycles();
    }
}

/* Whatever the counter says, the count never falls, and grows by half the counter's range at most. */
/*@ requires \valid(f);
    assigns f->meter.used, f->meter.since;
    ensures \result == f->meter.used;
    ensures \old(f->meter.used) <= f->meter.used <= \old(f->meter.used) + f->meter.mask / 2;
    ensures f->meter.mask == 0 ==> f->meter.used == \old(f->meter.used); */
uint32_t pfl_meter_read(pfl_t *f)
{
    if (f->meter.mask != 0u) {
        const uint32_t now = pfl_port_cycles();
        const uint32_t passed = (now - f->meter.since) & f->meter.mask;
        const uint32_t credible = (passed <= (f->meter.mask >> 1)) ? passed : 0u;
        f->meter.used = ((UINT32_MAX - f->meter.used) > credible) ? (f->meter.used + credible) : UINT32_MAX;
        f->meter.since = now;
    }
    return f->meter.used;
}

/*@ requires \valid(f) && \valid_read(f->config) && \separated(f, f->config);
    assigns f->meter.used, f->meter.since, f->cycles_max, f->overruns, f->overrun_counted, f->watched.event;
    ensures f->cycles_max >= \old(f->cycles_max) && f->cycles_max >= f->meter.used;
    ensures \old(f->overruns) <= f->overruns <= \old(f->overruns) + 1; */
void pfl_meter_pause(pfl_t *f)
{
    (void)pfl_meter_read(f);
    (void)pfl_meter_spent(f);
    f->cycles_max = (f->meter.used > f->cycles_max) ? f->meter.used : f->cycles_max;
}

bool pfl_meter_is_over(pfl_t *f)
{
    const uint32_t budget = f->config->budget_cycles;
    if ((f->meter.mask == 0u) || (pfl_meter_read(f) <= budget)) {
        return false;
    }
    if (f->overrun_counted == 0u) {
        f->overrun_counted = 1u;
        pfl_count(&f->overruns, 1u);
        f->watched.event |= PFL_EVENT_OVERRUN;
    }
    return true;
}
