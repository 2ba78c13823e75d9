/* port/null: no counter, and nothing that fails because of it. */
#include "pflight/port.h"
#include "unity.h"

void setUp(void)
{
}

void tearDown(void)
{
}

void test_there_is_no_counter(void)
{
    TEST_ASSERT_EQUAL_UINT32(0u, pfl_port_cycles());
    TEST_ASSERT_EQUAL_HEX32(0u, pfl_port_cycles_mask());
    TEST_ASSERT_EQUAL_UINT32(0u, pfl_port_cycles_hz());
}

void test_self_test_passes_and_changes_nothing(void)
{
    TEST_ASSERT_TRUE(pfl_port_self_test());
    TEST_ASSERT_EQUAL_UINT32(0u, pfl_port_cycles());
    TEST_ASSERT_EQUAL_HEX32(0u, pfl_port_cycles_mask());
}

void test_fault_hook_returns(void)
{
    pfl_port_fault(-1);
    pfl_port_fault(INT32_MIN);
}
