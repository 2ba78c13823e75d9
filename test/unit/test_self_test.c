/* The power-on test and the texts of the statuses. */
#include "support.h"

#include "pflight/status.h"

#include "unity.h"

#include <fenv.h>
#include <string.h>

void setUp(void)
{
}

void tearDown(void)
{
    ut_arenas_end();
}

void test_the_known_answers_are_computed(void)
{
    void *arena = ut_arena(PFL_SELF_TEST_BYTES);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_self_test(arena, PFL_SELF_TEST_BYTES));
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_self_test(arena, PFL_SELF_TEST_BYTES)); /* whatever was in it */
}

/* Another rounding mode, as a careless interrupt handler leaves it, gives other bits. */
void test_a_wrong_rounding_mode_is_seen(void)
{
#if defined(FE_UPWARD) && defined(FE_DOWNWARD) && defined(FE_TOWARDZERO)
    static const int modes[] = {FE_UPWARD, FE_DOWNWARD, FE_TOWARDZERO};
    void *arena = ut_arena(PFL_SELF_TEST_BYTES);
    for (uint32_t k = 0u; k < 3u; k++) {
        TEST_ASSERT_EQUAL_INT(0, fesetround(modes[k]));
        const pfl_status_t status = pfl_self_test(arena, PFL_SELF_TEST_BYTES);
        TEST_ASSERT_EQUAL_INT(0, fesetround(FE_TONEAREST));
        TEST_ASSERT_EQUAL_INT(PFL_ERR_SELF_TEST, status);
    }
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_self_test(arena, PFL_SELF_TEST_BYTES));
#endif /* the C library of a small core has no such call */
}

void test_it_leaves_no_filter_behind(void)
{
    void *arena = ut_arena(PFL_SELF_TEST_BYTES);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_self_test(arena, PFL_SELF_TEST_BYTES));
    TEST_ASSERT_FALSE(pfl_invariants_hold((const pfl_t *)arena));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_CORRUPT, pfl_predict((pfl_t *)arena, 1u, NULL));
}

void test_bad_memory_is_refused_untouched(void)
{
    unsigned char *arena = (unsigned char *)ut_arena(PFL_SELF_TEST_BYTES + 8u);
    TEST_ASSERT_EQUAL_INT(PFL_ERR_MEMORY, pfl_self_test(NULL, PFL_SELF_TEST_BYTES));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_MEMORY, pfl_self_test(arena, PFL_SELF_TEST_BYTES - 1u));
    TEST_ASSERT_EQUAL_INT(PFL_ERR_MEMORY, pfl_self_test(arena, 0u));
    for (size_t offset = 1u; offset < 8u; offset++) {
        TEST_ASSERT_EQUAL_INT(PFL_ERR_MEMORY, pfl_self_test(arena + offset, PFL_SELF_TEST_BYTES));
    }
    TEST_ASSERT_TRUE(ut_untouched(arena, PFL_SELF_TEST_BYTES + 8u));
}

void test_every_status_has_a_text_of_its_own(void)
{
    const char *unknown = pfl_status_string((pfl_status_t)100);
    TEST_ASSERT_NOT_NULL(unknown);
    for (int a = (int)PFL_ERR_NO_DRAW; a <= (int)PFL_QUARANTINED; a++) {
        const char *text = pfl_status_string((pfl_status_t)a);
        TEST_ASSERT_NOT_NULL(text);
        TEST_ASSERT_TRUE(strlen(text) > 0u);
        TEST_ASSERT_TRUE(strcmp(text, unknown) != 0);
        TEST_ASSERT_TRUE(text == pfl_status_string((pfl_status_t)a)); /* fixed */
        for (int b = (int)PFL_ERR_NO_DRAW; b < a; b++) {
            TEST_ASSERT_TRUE(strcmp(text, pfl_status_string((pfl_status_t)b)) != 0);
        }
    }
}

void test_values_outside_the_enumeration_have_a_text(void)
{
    for (int k = -200; k < 200; k++) {
        TEST_ASSERT_NOT_NULL(pfl_status_string((pfl_status_t)k));
    }
}

void test_positive_is_done_and_negative_refused(void)
{
    TEST_ASSERT_EQUAL_INT(0, PFL_OK);
    TEST_ASSERT_TRUE((PFL_DEFERRED > 0) && (PFL_QUARANTINED > 0));
    TEST_ASSERT_TRUE((PFL_REJECTED < 0) && (PFL_ERR_ARG < 0) && (PFL_ERR_NO_DRAW < 0));
}
