/* Implementation of fault_support.h. */
#include "fault_support.h"

#include "unity.h"

#include <string.h>

static void near_z(void *user, const void *z, const pfl_batch_t *p)
{
    (void)user;
    for (uint32_t i = 0u; i < p->n; i++) {
        PFL_STATE(p, 0)[i] = *(const float *)z + PFL_NOISE(p, 0)[i];
        PFL_STATE(p, 1)[i] = PFL_NOISE(p, 1)[i];
    }
}

void ft_configure(ft_t *t)
{
    memset(t, 0, sizeof *t);
    t->config = ut_linear_config(FT_N);
    t->sensors[0].loglik = ut_linear_loglik;
    t->sensors[0].gate = 9.0f;
    t->sensors[0].timeout_us = 1000000u;
    t->sensors[0].redraw = near_z;
    t->sensors[1].loglik = ut_linear_loglik;
    t->config.sensors = t->sensors;
    t->config.sensor_count = 2u;
    t->config.ess_ratio = 0.5f;
    t->watch.keep = pfl_watch_keep;
    t->watch.reinject = 0.3f;
    t->config.watch = &t->watch;
}

void ft_start(ft_t *t)
{
    t->f = ut_filter(&t->config);
    t->now_us = 0u;
}

pfl_status_t ft_cycle(ft_t *t, float z)
{
    t->now_us += FT_STEP_US;
    const pfl_status_t moved = pfl_predict(t->f, t->now_us, NULL);
    TEST_ASSERT_TRUE(moved >= PFL_OK);
    return pfl_update(t->f, 0u, t->now_us, &z);
}

void ft_cycles(ft_t *t, uint32_t n, float z)
{
    for (uint32_t k = 0u; k < n; k++) {
        (void)ft_cycle(t, z);
    }
}

float ft_finite_mean(pfl_t *f)
{
    float mean[2] = {0.0f};
    float cov[4] = {0.0f};
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_estimate(f, mean, cov));
    TEST_ASSERT_TRUE(ut_finite(mean[0]) && ut_finite(mean[1]));
    for (uint32_t k = 0u; k < 4u; k++) {
        TEST_ASSERT_TRUE(ut_finite(cov[k]));
    }
    const pfl_health_t h = ft_health(f);
    TEST_ASSERT_TRUE(ut_finite(h.ess) && ut_finite(h.test_ratio) && ut_finite(h.best_loglik));
    return mean[0];
}

pfl_health_t ft_health(const pfl_t *f)
{
    pfl_health_t h;
    memset(&h, 0, sizeof h);
    TEST_ASSERT_EQUAL_INT(PFL_OK, pfl_health(f, &h));
    return h;
}
