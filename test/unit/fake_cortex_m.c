/* The behaviour behind fake_cortex_m.h, after the Armv7-M manual: what is read, what moves, what is ignored. */
#include "fake_cortex_m.h"

#define TRCENA (1u << 24)
#define NOCYCCNT (1u << 25)
#define SYSTICK_RANGE 0x00FFFFFFu

fake_cortex_m_t fake;

static uint32_t read_cyccnt(void)
{
    const bool runs = (fake.demcr & TRCENA) != 0u && (fake.dwt_ctrl & 1u) != 0u && fake.dwt_present;

    if (fake.dwt_stuck || !runs) {
        return 0u;
    }
    fake.cyccnt = fake.dwt_backward ? fake.cyccnt - fake.step : fake.cyccnt + fake.step;
    return fake.cyccnt;
}

static uint32_t read_cvr(void)
{
    if (!fake.systick_stuck && (fake.csr & 1u) != 0u) {
        const uint32_t period = fake.rvr + 1u;

        fake.cvr = (fake.cvr + period - fake.step % period) % period;
    }
    return fake.cvr;
}

uint32_t fake_read(uint32_t address)
{
    ++fake.reads;
    switch (address) {
    case 0xE000E010u:
        return fake.csr;
    case 0xE000E014u:
        return fake.rvr;
    case 0xE000E018u:
        return read_cvr();
    case 0xE0001000u:
        return fake.dwt_ctrl | (fake.dwt_present ? 0u : NOCYCCNT);
    case 0xE0001004u:
        return read_cyccnt();
    case 0xE000EDFCu:
        return fake.demcr;
    default:
        ++fake.bad_accesses;
        return 0u;
    }
}

void fake_write(uint32_t address, uint32_t value)
{
    ++fake.writes;
    switch (address) {
    case 0xE000E010u:
        fake.csr = value;
        break;
    case 0xE000E014u:
        fake.rvr = value & SYSTICK_RANGE;
        break;
    case 0xE000E018u:
        fake.cvr = 0u; /* any write clears it */
        break;
    case 0xE0001000u:
        if (!fake.dwt_stuck && (!fake.dwt_needs_unlock || fake.dwt_unlocked)) {
            fake.dwt_ctrl = value;
        }
        break;
    case 0xE0001FB0u:
        fake.dwt_unlocked = (value == 0xC5ACCE55u);
        break;
    case 0xE000EDFCu:
        fake.demcr = value;
        break;
    default:
        ++fake.bad_accesses;
        break;
    }
}
