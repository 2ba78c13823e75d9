/* Stand-in for uORB: every look finds the sample that the test wrote. */
#pragma once
#include "topics/vehicle_air_data.h"
namespace standin {
extern vehicle_air_data_s air_data;
}
namespace uORB {
class SubscriptionCallbackWorkItem {
public:
    template <class T> SubscriptionCallbackWorkItem(T *, int) {}
    bool registerCallback() { return true; }
    void unregisterCallback() {}
    bool update(void *to)
    {
        *static_cast<vehicle_air_data_s *>(to) = standin::air_data;
        return true;
    }
};
} // namespace uORB
