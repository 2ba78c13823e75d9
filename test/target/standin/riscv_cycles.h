/* Stand-in for the cycle counter of RISC-V: PFL_PORT_READ_CYCLES_H of port/riscv. */
#include "platforms.h"

#define PFL_PORT_READ_CYCLES() standin_counter()
