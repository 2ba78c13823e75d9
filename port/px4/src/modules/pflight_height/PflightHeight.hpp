/* Height and climb rate from the barometer by a particle filter: a module to start your own from. */
#pragma once

#include "pflight/pflight.h"

#include <px4_platform_common/module.h>
#include <px4_platform_common/px4_work_queue/ScheduledWorkItem.hpp>
#include <uORB/Publication.hpp>
#include <uORB/SubscriptionCallback.hpp>
#include <uORB/topics/debug_key_value.h>
#include <uORB/topics/vehicle_air_data.h>

class PflightHeight : public ModuleBase<PflightHeight>, public px4::ScheduledWorkItem
{
public:
	PflightHeight();

	static int task_spawn(int argc, char *argv[]);
	static int custom_command(int argc, char *argv[]);
	static int print_usage(const char *reason = nullptr);
	int print_status() override;

	bool init();

private:
	static constexpr uint16_t particles = 200;

	static void climb(void *user, const void *u, float dt_s, const pfl_batch_t *p);
	static void barometer(void *user, const void *z, const pfl_view_t *p, float *ll);

	void Run() override;
	void publish();

	uORB::SubscriptionCallbackWorkItem _air_data_sub{this, ORB_ID(vehicle_air_data)};
	uORB::Publication<debug_key_value_s> _height_pub{ORB_ID(debug_key_value)};

	pfl_config_t _config{};
	pfl_sensor_t _sensor{};
	pfl_t *_filter{nullptr};
	pfl_status_t _status{PFL_ERR_ARG};
	union {
		uint64_t align;
		uint8_t bytes[PFL_ARENA_BYTES(particles, 2, 1)];
	} _arena;
};
