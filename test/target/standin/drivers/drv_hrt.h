/* Stand-in for PX4's header: what port/px4 takes from it. */
#ifndef STANDIN_DRV_HRT_H
#define STANDIN_DRV_HRT_H

#include <stdint.h>

typedef uint64_t hrt_abstime;
#ifdef __cplusplus
extern "C" {
#endif

hrt_abstime hrt_absolute_time(void);

#ifdef __cplusplus
}
#endif

#endif
