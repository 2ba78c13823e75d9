/* Kernels of the library, each alone in a function kernel_NAME that a counter can find from outside: under callgrind on
 * the host, by the plugin of tools/targets on emulated machines. Each works on KERNEL_N elements. */
#ifndef BENCHMARK_KERNELS_H
#define BENCHMARK_KERNELS_H

#include "pflight/pflight.h"

#define KERNEL_N 1024u
#define KERNEL_STATES 9u
#define KERNEL_NOISES 6u
#define KERNEL_DT_S 0.1f

/* What kernels read and write; filled anew, with the same values, before each of them. */
typedef struct {
    float in[2][KERNEL_N]; /* normals times 4; positive numbers */
    float out[2][KERNEL_N];
    float x[KERNEL_STATES][KERNEL_N]; /* states about 10 */
    float noise[KERNEL_NOISES * PFL_BATCH];
    float mean[PFL_STATES_MAX];
    uint32_t bits[KERNEL_N];
    pfl_rng_t rng;
    pfl_t *filter; /* null where the kernel needs none */
} kernel_data_t;

extern kernel_data_t kernel_data;

typedef struct {
    const char *name;
    void (*run)(void);
    void (*prepare)(void); /* null: nothing more than the filling */
} kernel_t;

/* Defines kernel_NAME, never inlined; its body follows. */
#define KERNEL(name)                                                                                                   \
    void kernel_##name(void);                                                                                          \
    __attribute__((noinline)) void kernel_##name(void)

extern const kernel_t kernels_math[], kernels_models[], kernels_sensors[], kernels_recordings[], kernels_per_particle[],
    kernels_filter[];
extern const uint32_t kernels_math_count, kernels_models_count, kernels_sensors_count, kernels_recordings_count,
    kernels_per_particle_count, kernels_filter_count;

#endif
