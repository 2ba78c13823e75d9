/*
 * The port contract without a cycle counter: times read 0 and budgets are off. It runs on any machine and
 * is the file to copy when you write a port of your own.
 */
#include "pflight/port.h"

uint32_t pfl_port_cycles(void)
{
    return 0u;
}

uint32_t pfl_port_cycles_mask(void)
{
    return 0u;
}

uint32_t pfl_port_cycles_hz(void)
{
    return 0u;
}

/* Weak where the compiler knows the word, so that an application can hook faults without a port of its own. */
#if defined(__GNUC__)
__attribute__((weak))
#endif
void pfl_port_fault(int32_t status)
{
    (void)status;
}

/* No counter is promised, so none can fail. */
bool pfl_port_self_test(void)
{
    return true;
}
