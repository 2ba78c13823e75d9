/* Stand-in for NuttX's header: what port/nuttx takes from it. */
#ifndef STANDIN_NUTTX_CLOCK_H
#define STANDIN_NUTTX_CLOCK_H

#include <time.h>

clock_t perf_gettime(void);
unsigned long perf_getfreq(void);

#endif
