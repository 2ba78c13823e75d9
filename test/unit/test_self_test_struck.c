/* The power-on test while memory changes under it: the mock of the port's counter, which the filter reads at each
 * call, flips a bit of the configuration that the test itself flies with. */
#include "support.h"

#include "Mockport.h"
#include "unity.h"

static unsigned char *arena;
static size_t struck_bit;
static uint32_t struck_at, reads;

static uint32_t striking_counter(int calls)
{
    (void)calls;
    reads++;
    if (reads == struck_at) {
        arena[struck_bit / 8u] ^= (unsigned char)(1u << (struck_bit % 8u));
    }
    return reads;
}

static uint32_t whole_word(int calls)
{
    (void)calls;
    return 0xFFFFFFFFu;
}

static bool well(int calls)
{
    (void)calls;
    return true;
}

static void unheard(int32_t status, int calls)
{
    (void)status;
    (void)calls;
}

void setUp(void)
{
    pfl_port_cycles_Stub(striking_counter);
    pfl_port_cycles_mask_Stub(whole_word);
    pfl_port_self_test_Stub(well);
    pfl_port_fault_Stub(unheard);
    arena = (unsigned char *)ut_arena(PFL_SELF_TEST_BYTES);
}

void tearDown(void)
{
    ut_arenas_end();
}

static pfl_status_t tested(uint32_t at, size_t bit)
{
    reads = 0u;
    struck_at = at;
    struck_bit = bit;
    return pfl_self_test(arena, PFL_SELF_TEST_BYTES);
}

/* The seed is what no call but the first one uses: only the guards can tell that it has changed. */
void test_a_bit_flipped_at_any_moment_of_it_fails_it(void)
{
    const size_t seed = 8u * (PFL_SELF_TEST_BYTES - sizeof(pfl_config_t) + offsetof(pfl_config_t, seed));
    TEST_ASSERT_EQUAL_INT(PFL_OK, tested(0u, seed));
    const uint32_t all = reads;
    TEST_ASSERT_TRUE(all >= 4u * 6u * 2u); /* schemes, steps, calls of each */
    for (uint32_t at = 1u; at <= all; at++) {
        TEST_ASSERT_EQUAL_INT(PFL_ERR_SELF_TEST, tested(at, seed + (at % 64u)));
    }
}
