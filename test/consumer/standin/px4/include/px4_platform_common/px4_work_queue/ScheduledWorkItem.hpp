/* Stand-in for PX4's work queue: it remembers the one item there is. */
#pragma once

namespace px4 {
struct wq_config_t {
    const char *name;
};
namespace wq_configurations {
static constexpr wq_config_t nav_and_controllers{"wq:nav_and_controllers"};
}
class ScheduledWorkItem;
} // namespace px4

namespace standin {
extern px4::ScheduledWorkItem *item;
}

namespace px4 {
class ScheduledWorkItem {
public:
    ScheduledWorkItem(const char *, const wq_config_t &) { standin::item = this; }
    virtual ~ScheduledWorkItem() = default;
    virtual void Run() = 0;
};
} // namespace px4
