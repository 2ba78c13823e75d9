/* Stand-in for PX4's module.h: what port/px4's module takes from it, and runs "start" at once. */
#pragma once

#include <drivers/drv_hrt.h>

#define PX4_OK 0
#define PX4_ERROR (-1)
#define __EXPORT __attribute__((visibility("default")))
#define PX4_INFO(...) standin_say(__VA_ARGS__)
#define PX4_WARN(...) standin_say(__VA_ARGS__)
#define PRINT_MODULE_DESCRIPTION(text) standin_say(text)
#define PRINT_MODULE_USAGE_NAME(name, category) standin_say(name)
#define PRINT_MODULE_USAGE_COMMAND(name) standin_say(name)
#define PRINT_MODULE_USAGE_DEFAULT_COMMANDS() standin_say("stop, status")

inline void standin_say(const char *, ...)
{
}

template <class T> struct StandinPointer {
    T *pointer = nullptr;
    void store(T *to)
    {
        pointer = to;
    }
};

static constexpr int task_id_is_work_queue = -2;

template <class T> class ModuleBase {
  public:
    virtual ~ModuleBase() = default;
    virtual int print_status()
    {
        return 0;
    }
    static int main(int argc, char *argv[])
    {
        return T::task_spawn(argc - 1, argv + 1);
    }
    bool should_exit() const
    {
        return false;
    }
    void exit_and_cleanup()
    {
    }

  protected:
    static StandinPointer<T> _object;
    static int _task_id;
};

template <class T> StandinPointer<T> ModuleBase<T>::_object;
template <class T> int ModuleBase<T>::_task_id = -1;
