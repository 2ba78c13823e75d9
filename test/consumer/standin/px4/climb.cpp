/* The module follows a barometer that climbs at 2 m/s: "start", then a sample every 100 ms as the work queue would. */
#include "PflightHeight.hpp"

#include <stdio.h>

extern "C" int pflight_height_main(int argc, char *argv[]);

namespace standin {
vehicle_air_data_s air_data;
debug_key_value_s published;
px4::ScheduledWorkItem *item;
} // namespace standin

int main()
{
    char start[] = "start";
    char *argv[] = {start, start, nullptr};

    if (pflight_height_main(2, argv) != PX4_OK) {
        return 1;
    }
    for (uint32_t k = 1; k <= 100; k++) {
        standin::air_data.timestamp_sample = k * 100000ull;
        standin::air_data.baro_alt_meter = 0.2f * static_cast<float>(k);
        standin::item->Run();
    }
    const float height_m = standin::published.value;
    printf("%s %.2f\n", standin::published.key, static_cast<double>(height_m));
    return (height_m > 19.f && height_m < 21.f) ? 0 : 1;
}
