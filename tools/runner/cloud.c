/* What a scenario takes out of a filter of the library for tables and plots: see cloud.h. */
#include "cloud.h"

uint32_t cycle_ns(uint32_t cycles)
{
    return (uint32_t)((double)cycles * 1e9 / (double)pfl_port_cycles_hz());
}

cycle_t cycle_of(const pfl_health_t *health)
{
    return (cycle_t){health->ess, health->resampled, cycle_ns(health->cycles_resample)};
}

void cloud_take(text_t *cloud, const char *set, double t_s, const pfl_t *filter, uint16_t x_state, uint16_t y_state)
{
    pfl_view_t view;

    if (cloud == NULL || pfl_particles(filter, &view, NULL) != PFL_OK) {
        return;
    }
    /* Evenly spread over the array: after a resampling, copies of one particle stand anywhere in it. */
    const uint32_t points = view.n < CLOUD_POINTS ? view.n : CLOUD_POINTS;
    for (uint32_t j = 0u; j < points; j++) {
        const size_t i = (size_t)((uint64_t)j * view.n / points);
        text_add(cloud, "%s,%.9g,%.6g,%.6g\n", set, t_s, (double)PFL_STATE(&view, x_state)[i],
                 (double)PFL_STATE(&view, y_state)[i]);
    }
}
