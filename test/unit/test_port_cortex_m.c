/* port/cortex_m against fake registers: which counter is chosen, how it counts, and what is left alone. */
#include "fake_cortex_m.h"
#include "pflight/port.h"
#include "unity.h"

#include <string.h>

#define CPU_HZ 168000000u
#define SYSTICK_MASK 0x00FFFFFFu

void setUp(void)
{
    memset(&fake, 0, sizeof fake);
    fake.dwt_present = true;
    fake.step = 7u;
}

void tearDown(void)
{
    TEST_ASSERT_EQUAL_UINT32(0u, fake.bad_accesses);
}

/* The choice is a static of the port: bring it to "none" first, as after a reset. */
static void forget_choice(void)
{
    const fake_cortex_m_t wanted = fake;

    fake.dwt_stuck = true;
    fake.systick_stuck = true;
    (void)pfl_port_self_test();
    fake = wanted;
}

static void expect_no_counter(void)
{
    TEST_ASSERT_EQUAL_HEX32(0u, pfl_port_cycles_mask());
    TEST_ASSERT_EQUAL_UINT32(0u, pfl_port_cycles_hz());
    TEST_ASSERT_EQUAL_UINT32(0u, pfl_port_cycles());
    TEST_ASSERT_EQUAL_UINT32(0u, pfl_port_cycles());
}

void test_no_counter_and_no_register_access_before_the_self_test(void)
{
    forget_choice();
    expect_no_counter();
    TEST_ASSERT_EQUAL_UINT32(0u, fake.reads);
    TEST_ASSERT_EQUAL_UINT32(0u, fake.writes);
}

void test_dwt_is_chosen_and_systick_left_alone(void)
{
    forget_choice();
    TEST_ASSERT_TRUE(pfl_port_self_test());
    TEST_ASSERT_EQUAL_HEX32(0xFFFFFFFFu, pfl_port_cycles_mask());
    TEST_ASSERT_EQUAL_UINT32(CPU_HZ, pfl_port_cycles_hz());
    TEST_ASSERT_EQUAL_HEX32(0u, fake.csr);

    const uint32_t first = pfl_port_cycles();
    TEST_ASSERT_EQUAL_UINT32(7u, pfl_port_cycles() - first);
}

void test_dwt_counts_across_the_32_bit_wrap(void)
{
    forget_choice();
    fake.cyccnt = 0xFFFFFFF8u;
    TEST_ASSERT_TRUE(pfl_port_self_test());
    TEST_ASSERT_EQUAL_HEX32(0xFFFFFFFFu, pfl_port_cycles_mask());

    fake.cyccnt = 0xFFFFFFF0u;
    const uint32_t before = pfl_port_cycles();
    fake.step = 20u;
    TEST_ASSERT_EQUAL_UINT32(20u, pfl_port_cycles() - before);
}

void test_dwt_enable_keeps_other_bits_and_the_count(void)
{
    forget_choice();
    fake.demcr = 0x00010001u;
    fake.dwt_ctrl = 0x40000000u;
    fake.cyccnt = 1000000u;
    TEST_ASSERT_TRUE(pfl_port_self_test());
    TEST_ASSERT_EQUAL_HEX32(0x01010001u, fake.demcr);
    TEST_ASSERT_EQUAL_HEX32(0x40000001u, fake.dwt_ctrl);
    TEST_ASSERT_TRUE(pfl_port_cycles() > 1000000u);
}

void test_dwt_behind_a_lock_is_unlocked(void)
{
    forget_choice();
    fake.dwt_needs_unlock = true;
    TEST_ASSERT_TRUE(pfl_port_self_test());
    TEST_ASSERT_EQUAL_HEX32(0xFFFFFFFFu, pfl_port_cycles_mask());
}

static void expect_systick(void)
{
    TEST_ASSERT_TRUE(pfl_port_self_test());
    TEST_ASSERT_EQUAL_HEX32(SYSTICK_MASK, pfl_port_cycles_mask());
    TEST_ASSERT_EQUAL_UINT32(CPU_HZ, pfl_port_cycles_hz());
    TEST_ASSERT_EQUAL_HEX32(SYSTICK_MASK, fake.rvr);
    TEST_ASSERT_EQUAL_HEX32(5u, fake.csr); /* enabled, core clock, no interrupt */
}

void test_stuck_dwt_falls_back_to_systick(void)
{
    forget_choice();
    fake.dwt_stuck = true;
    expect_systick();
}

void test_absent_dwt_falls_back_to_systick(void)
{
    forget_choice();
    fake.dwt_present = false;
    expect_systick();
}

void test_backward_dwt_falls_back_to_systick(void)
{
    forget_choice();
    fake.dwt_backward = true;
    expect_systick();
}

void test_systick_counts_up_and_wraps_at_24_bits(void)
{
    forget_choice();
    fake.dwt_stuck = true;
    expect_systick();

    uint32_t last = pfl_port_cycles();
    fake.step = 0x00123457u;
    for (int i = 0; i < 100; ++i) { /* several periods */
        const uint32_t now = pfl_port_cycles();

        TEST_ASSERT_EQUAL_HEX32(0u, now & ~SYSTICK_MASK);
        TEST_ASSERT_EQUAL_HEX32(0x00123457u, (now - last) & SYSTICK_MASK);
        last = now;
    }
    fake.cvr = 3u; /* 3 -> 0 -> 0xFFFFFF: the wrap itself, count by count */
    fake.step = 1u;
    last = pfl_port_cycles();
    for (int i = 0; i < 6; ++i) {
        const uint32_t now = pfl_port_cycles();

        TEST_ASSERT_EQUAL_HEX32(1u, (now - last) & SYSTICK_MASK);
        last = now;
    }
}

void test_systick_of_an_operating_system_is_left_alone(void)
{
    forget_choice();
    fake.dwt_stuck = true;
    fake.csr = 7u;
    fake.rvr = 168000u - 1u;
    TEST_ASSERT_FALSE(pfl_port_self_test());
    expect_no_counter();
    TEST_ASSERT_EQUAL_HEX32(7u, fake.csr);
    TEST_ASSERT_EQUAL_HEX32(168000u - 1u, fake.rvr);
}

void test_systick_on_a_foreign_clock_is_left_alone(void)
{
    forget_choice();
    fake.dwt_stuck = true;
    fake.csr = 1u;
    fake.rvr = SYSTICK_MASK;
    TEST_ASSERT_FALSE(pfl_port_self_test());
    expect_no_counter();
    TEST_ASSERT_EQUAL_HEX32(1u, fake.csr);
}

void test_second_self_test_does_not_restart_systick(void)
{
    forget_choice();
    fake.dwt_stuck = true;
    expect_systick();
    fake.cvr = 0x00800000u;
    expect_systick();
    TEST_ASSERT_TRUE(fake.cvr > 0x007FFF00u);
}

void test_both_stuck_is_no_counter_in_bounded_time(void)
{
    forget_choice();
    fake.dwt_stuck = true;
    fake.systick_stuck = true;
    TEST_ASSERT_FALSE(pfl_port_self_test());
    TEST_ASSERT_TRUE(fake.reads < 5000u);
    expect_no_counter();
}

void test_fault_hook_returns(void)
{
    pfl_port_fault(-1);
    pfl_port_fault(INT32_MAX);
}
