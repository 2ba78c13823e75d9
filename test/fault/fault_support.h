/* What the tests of the fault matrix share: a linear filter under watch, and its cycles. The rows have the names of the
 * matrix in docs/survival.md. */
#ifndef PFL_FAULT_SUPPORT_H
#define PFL_FAULT_SUPPORT_H

#include "support.h"

#include "core.h"

#define FT_N 96u
#define FT_STEP_US 100000u
#define FT_CONFIG_BYTES                                                                                                \
    (offsetof(pfl_config_t, user) + sizeof(void *)) /* with a name: 32-bit machines pad behind them */

typedef struct {
    pfl_watch_t watch;
    pfl_sensor_t sensors[2];
    pfl_config_t config;
    pfl_t *f;
    uint64_t now_us;
} ft_t;

/* A filter of FT_N particles, whose sensors 0 and 1 see its position with unit variance; watched, gated. Change the
 * configuration in between, if at all. */
void ft_configure(ft_t *t);
void ft_start(ft_t *t);

/* One cycle with z on sensor 0; the status of the update. */
pfl_status_t ft_cycle(ft_t *t, float z);
void ft_cycles(ft_t *t, uint32_t n, float z);

/* Every number out of the filter is finite; its mean of the position. */
float ft_finite_mean(pfl_t *f);

pfl_health_t ft_health(const pfl_t *f);

#endif
