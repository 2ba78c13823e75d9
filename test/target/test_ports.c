/* A port against the stand-in of its platform: the counter is the platform's, to 32 bits, across their wrap; the
 * self-test tells one that moves from one that stands or runs backward. test/checks/ports builds it once a port.
 * EXPECTED_HZ is the rate that the stand-in gives. Exit status: the number of the failed line, 0 for none. */
#include "standin/platforms.h"

#include "pflight/port.h"

#include <stdio.h>

static int32_t hooked;

void pfl_port_fault(int32_t status) /* replaces the port's weak one */
{
    hooked = status;
}

static int failures;

static void expect(int holds, const char *what)
{
    if (!holds) {
        (void)printf("FAILED: %s\n", what);
        failures++;
    }
}

int main(void)
{
    standin_stride = 7u;
    expect(pfl_port_self_test(), "a counter that moves passes");
    expect(pfl_port_cycles_mask() == 0xFFFFFFFFu, "the mask is that of 32 bits");
    expect(pfl_port_cycles_hz() == EXPECTED_HZ, "the rate is the platform's");
    const uint32_t before = pfl_port_cycles();
    expect(pfl_port_cycles() - before == 7u, "the count is the platform's");
    standin_count = 0xFFFFFFFEu;
    expect(pfl_port_self_test(), "a wrap is no step back");
    standin_stride = 0u;
    expect(!pfl_port_self_test(), "a counter that stands fails");
    standin_stride = 0xC0000000u;
    expect(!pfl_port_self_test(), "a counter that runs backward fails");
    pfl_port_fault(-7);
    expect(hooked == -7, "the application's hook replaces the weak one");
    return failures;
}
