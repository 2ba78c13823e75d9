/* See PflightHeight.hpp. It runs on a work queue, once for each barometer sample, and publishes debug_key_value. */
#include "PflightHeight.hpp"

#include <string.h>

PflightHeight::PflightHeight() : ScheduledWorkItem("pflight_height", px4::wq_configurations::nav_and_controllers)
{
	_sensor.loglik = barometer;
	_config.abi = PFL_ABI;
	_config.particles = particles;
	_config.states = 2;
	_config.noises = 1;
	_config.sensor_count = 1;
	_config.ess_ratio = 0.5f;
	_config.sensors = &_sensor;
	_config.predict = climb;
}

void PflightHeight::climb(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
	for (uint32_t i = 0; i < p->n; i++) {
		PFL_STATE(p, 0)[i] += dt_s * PFL_STATE(p, 1)[i];
		PFL_STATE(p, 1)[i] += dt_s * PFL_NOISE(p, 0)[i];
	}
}

void PflightHeight::barometer(void *user, const void *z, const pfl_view_t *p, float *ll)
{
	const float height_m = *static_cast<const float *>(z);

	for (uint32_t i = 0; i < p->n; i++) {
		const float error = (p->x[i] - height_m) * 2.f; // sigma 0.5 m
		ll[i] = -0.5f * error * error;
	}
}

bool PflightHeight::init()
{
	// Does this build keep the bits? PX4's own flags do not, the module's CMakeLists.txt sees to it.
	_status = pfl_self_test(&_arena, sizeof(_arena));

	return (_status == PFL_OK) && _air_data_sub.registerCallback();
}

void PflightHeight::Run()
{
	if (should_exit()) {
		_air_data_sub.unregisterCallback();
		exit_and_cleanup();
		return;
	}

	vehicle_air_data_s air_data;

	if (!_air_data_sub.update(&air_data)) {
		return;
	}

	if (_filter == nullptr) {
		_status = pfl_init(&_arena, sizeof(_arena), &_config, air_data.timestamp_sample, &_filter);
	}

	if (_filter != nullptr) {
		_status = pfl_predict(_filter, air_data.timestamp_sample, nullptr);

		if (_status >= PFL_OK) {
			_status = pfl_update(_filter, 0, air_data.timestamp_sample, &air_data.baro_alt_meter);
		}

		publish();
	}
}

void PflightHeight::publish()
{
	float mean[2];

	if (pfl_estimate(_filter, mean, nullptr) == PFL_OK) {
		debug_key_value_s height{};
		height.timestamp = hrt_absolute_time();
		strncpy(height.key, "pfl_h", sizeof(height.key) - 1);
		height.value = mean[0];
		_height_pub.publish(height);
	}
}

int PflightHeight::task_spawn(int argc, char *argv[])
{
	PflightHeight *instance = new PflightHeight();

	if (instance == nullptr) {
		return PX4_ERROR;
	}

	_object.store(instance);
	_task_id = task_id_is_work_queue;

	if (instance->init()) {
		return PX4_OK;
	}

	delete instance;
	_object.store(nullptr);
	_task_id = -1;
	return PX4_ERROR;
}

int PflightHeight::custom_command(int argc, char *argv[])
{
	return print_usage("unknown command");
}

int PflightHeight::print_status()
{
	PX4_INFO("%s", pfl_status_string(_status));
	return 0;
}

int PflightHeight::print_usage(const char *reason)
{
	if (reason != nullptr) {
		PX4_WARN("%s", reason);
	}

	PRINT_MODULE_DESCRIPTION("Height and climb rate from the barometer by a particle filter.");
	PRINT_MODULE_USAGE_NAME("pflight_height", "estimator");
	PRINT_MODULE_USAGE_COMMAND("start");
	PRINT_MODULE_USAGE_DEFAULT_COMMANDS();
	return 0;
}

extern "C" __EXPORT int pflight_height_main(int argc, char *argv[])
{
	return PflightHeight::main(argc, argv);
}
