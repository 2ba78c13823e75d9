/* Implementation of fault_port.h. */
#include "fault_port.h"

#include "pflight/port.h"

fault_port_t fault_port;

void fault_port_reset(void)
{
    const fault_port_t fresh = {.step = 10u, .mask = 0xFFFFFFFFu, .width = 0xFFFFFFFFu, .jump_at = 0xFFFFFFFFu};
    fault_port = fresh;
}

uint32_t pfl_port_cycles(void)
{
    fault_port.count += fault_port.step;
    fault_port.count += (fault_port.reads == fault_port.jump_at) ? fault_port.jump : 0u;
    fault_port.reads++;
    return fault_port.count & fault_port.width;
}

uint32_t pfl_port_cycles_mask(void)
{
    return fault_port.mask;
}

uint32_t pfl_port_cycles_hz(void)
{
    return 0u;
}

void pfl_port_fault(int32_t status)
{
    fault_port.faults += (status != 0) ? 1u : 0u;
}

bool pfl_port_self_test(void)
{
    return fault_port.mask != 0u;
}
