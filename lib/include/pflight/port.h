/*
 * The port contract: the five functions through which the library meets a machine.
 *
 * They are bound at link time. Exactly one folder of port/ (or your own file) defines all five; nothing
 * else in the library knows an address, a clock or an operating system. port/null is the shortest
 * example, and a correct choice where no cycle counter is wanted.
 *
 * All five are called by the library in the context of the task that called the library, never from an
 * interrupt and never from a thread of its own. Filters in several tasks may call them at the same time,
 * and a task of higher priority may interrupt a call and make the same call, so every implementation must
 * be re-entrant. None may block, allocate, or call back into pflight.
 */
#ifndef PFLIGHT_PORT_H
#define PFLIGHT_PORT_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/*
 * A free-running counter that counts up modulo pfl_port_cycles_mask() + 1.
 *
 * Called by the library at the start and the end of each filter call and once per batch of particles
 * where a budget is set, hence it should cost a few instructions. The application may call it anywhere,
 * interrupts included. The library takes differences only, `(later - earlier) & mask`, and counts one of
 * more than half the range as nothing (a counter that jumped back), so choose a counter whose period is
 * more than twice the longest time between two batches.
 *
 * returns  the count, within 0 .. pfl_port_cycles_mask(); 0 always where there is no usable counter.
 */
/*@ assigns \nothing; */
uint32_t pfl_port_cycles(void);

/*
 * The range of the counter: 0xFFFFFFFF for 32 bits, 0x00FFFFFF for the 24 bits of SysTick, and so on;
 * always one less than a power of two. 0 = there is no usable counter: times read 0 and budgets are off.
 *
 * Called by pfl_init(), after the self-test. The value may change only inside pfl_port_self_test(), which
 * may find the counter dead and choose another.
 */
uint32_t pfl_port_cycles_mask(void);

/*
 * How many counts the counter makes in a second of real time; 0 = unknown or no counter.
 *
 * Used for reports in microseconds only: budgets are in counts. Callable from anywhere.
 */
uint32_t pfl_port_cycles_hz(void);

/*
 * The fault hook: called once when a library call is about to return a status of the fault class.
 *
 * status   the pfl_status_t of that call, as an integer.
 *
 * It must return; the caller gets the status either way, with the filter already in a consistent state.
 * A good hook sets a flag or records a trace event. It must not call pflight.
 */
/*@ assigns \nothing; */
void pfl_port_fault(int32_t status);

/*
 * Chooses, starts and tests the counter. Called by pfl_init() for every filter; the application may call it
 * too. It may write to the hardware, but as other filters may be running it never sets back a counter that
 * counts already.
 *
 * returns  true when the counter moves, forward, within its mask. false where there is no usable counter
 *          although the port promises one: filters then run without times and budgets. A port that
 *          promises none returns true with mask 0. The time it takes is bounded: it waits for a number of
 *          reads, never for a clock.
 */
bool pfl_port_self_test(void);

#ifdef __cplusplus
}
#endif

#endif
