/* The one counter behind the stand-ins, and how fast it moves: by the stride with each read; 0 stands still. */
#ifndef STANDIN_PLATFORMS_H
#define STANDIN_PLATFORMS_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

extern uint64_t standin_count;
extern uint32_t standin_stride;
uint32_t standin_counter(void);
uint64_t standin_micros64(void);

#ifdef __cplusplus
}
#endif

#endif
