/* port/posix: a nanosecond counter of 32 bits that moves forward, and a fault hook that can be replaced. */
#include "pflight/port.h"
#include "unity.h"

#include <stdint.h>

static int32_t last_fault;
static uint32_t faults;

/* Replaces the weak hook of the port, as an application does. */
void pfl_port_fault(int32_t status)
{
    last_fault = status;
    ++faults;
}

void setUp(void)
{
    last_fault = 0;
    faults = 0u;
}

void tearDown(void)
{
}

void test_mask_and_frequency(void)
{
    TEST_ASSERT_EQUAL_HEX32(0xFFFFFFFFu, pfl_port_cycles_mask());
    TEST_ASSERT_EQUAL_UINT32(1000000000u, pfl_port_cycles_hz());
}

void test_self_test_passes_repeatedly(void)
{
    for (int i = 0; i < 10; ++i) {
        TEST_ASSERT_TRUE(pfl_port_self_test());
    }
}

void test_counter_moves_and_never_steps_back(void)
{
    uint32_t last = pfl_port_cycles();
    uint32_t moved = 0u;

    for (int i = 0; i < 100000; ++i) {
        const uint32_t now = pfl_port_cycles();

        TEST_ASSERT_TRUE(now - last < 0x80000000u);
        moved += (now != last) ? 1u : 0u;
        last = now;
    }
    TEST_ASSERT_TRUE(moved > 0u);
}

void test_application_hook_replaces_the_weak_one(void)
{
    pfl_port_fault(-7);
    TEST_ASSERT_EQUAL_INT32(-7, last_fault);
    TEST_ASSERT_EQUAL_UINT32(1u, faults);
}
