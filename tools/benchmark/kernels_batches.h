/* Calls of a model and of a sensor as the filter makes them: in batches. */
#ifndef BENCHMARK_KERNELS_BATCHES_H
#define BENCHMARK_KERNELS_BATCHES_H

#include "kernels.h"

static void move(pfl_predict_fn predict, const void *model, const void *u)
{
    union {
        const void *in;
        void *user;
    } pointer = {model}; /* models do not write to theirs */
    for (uint32_t first = 0u; first < KERNEL_N; first += PFL_BATCH) {
        const pfl_batch_t batch = {&kernel_data.x[0][first], KERNEL_N, kernel_data.noise, first, PFL_BATCH};
        predict(pointer.user, u, KERNEL_DT_S, &batch);
    }
}

static void weigh(pfl_loglik_fn loglik, const void *sensor, const void *z)
{
    union {
        const void *in;
        void *user;
    } pointer = {sensor};
    for (uint32_t first = 0u; first < KERNEL_N; first += PFL_BATCH) {
        const pfl_view_t view = {&kernel_data.x[0][first], KERNEL_N, first, PFL_BATCH};
        loglik(pointer.user, z, &view, &kernel_data.out[0][first]);
    }
}

#endif
