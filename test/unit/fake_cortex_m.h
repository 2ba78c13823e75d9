/*
 * Fake Cortex-M debug and SysTick registers, so that port/cortex_m runs on the host. Every read of a running
 * counter moves it on by `step`, which makes the tests independent of time.
 */
#ifndef FAKE_CORTEX_M_H
#define FAKE_CORTEX_M_H

#include <stdbool.h>
#include <stdint.h>

typedef struct {
    bool dwt_present;      /* false: DWT_CTRL.NOCYCCNT reads 1 */
    bool dwt_stuck;        /* the counter reads 0 whatever is written, as in QEMU */
    bool dwt_backward;     /* a broken counter that runs down */
    bool dwt_needs_unlock; /* Cortex-M7: writes are ignored until the lock is opened */
    bool dwt_unlocked;
    bool systick_stuck;
    uint32_t step; /* counts per read */
    uint32_t demcr, dwt_ctrl, cyccnt;
    uint32_t csr, rvr, cvr;
    uint32_t reads, writes, bad_accesses;
} fake_cortex_m_t;

extern fake_cortex_m_t fake;

uint32_t fake_read(uint32_t address);
void fake_write(uint32_t address, uint32_t value);

#define PFL_PORT_READ(address) fake_read(address)
#define PFL_PORT_WRITE(address, value) fake_write((address), (value))

#endif
