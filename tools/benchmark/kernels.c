/* Runs each kernel once and prints "NAME HASH" lines, the hash of everything it may have written. Without an operating
 * system too: it prints through tools/targets/replay/io.h. */
#include "kernels.h"

#include "io.h"

#include <string.h>

kernel_data_t kernel_data;

static void fill(void)
{
    kernel_data_t *k = &kernel_data;
    memset(k, 0, sizeof *k);
    pfl_rng_seed(&k->rng, 5u);
    pfl_rng_normals(&k->rng, &k->in[0][0], sizeof k->in / (16u * sizeof(float)));
    pfl_rng_normals(&k->rng, &k->x[0][0], sizeof k->x / (16u * sizeof(float)));
    pfl_rng_normals(&k->rng, k->noise, sizeof k->noise / (16u * sizeof(float)));
    for (uint32_t i = 0u; i < KERNEL_N; i++) {
        k->in[0][i] *= 4.0f;
        k->in[1][i] = 0.01f + (k->in[1][i] * k->in[1][i]);
        for (uint32_t d = 0u; d < KERNEL_STATES; d++) {
            k->x[d][i] = 10.0f + k->x[d][i];
        }
    }
}

static uint32_t mix(uint32_t hash, const void *data, size_t bytes)
{
    const unsigned char *at = (const unsigned char *)data;
    for (size_t i = 0u; (i + 4u) <= bytes; i += 4u) { /* by words: the same on either byte order */
        uint32_t word;
        memcpy(&word, &at[i], sizeof word);
        hash = (hash ^ word) * 0x01000193u;
        hash ^= hash >> 15;
    }
    return hash;
}

static uint32_t hash_all(void)
{
    const kernel_data_t *k = &kernel_data;
    uint32_t hash = mix(0x811C9DC5u, k->out, sizeof k->out);
    hash = mix(hash, k->x, sizeof k->x);
    hash = mix(hash, k->mean, sizeof k->mean);
    hash = mix(hash, k->bits, sizeof k->bits);
    if (k->filter != NULL) {
        pfl_view_t view;
        (void)pfl_particles(k->filter, &view, NULL);
        for (uint32_t d = 0u; d < 4u; d++) {
            hash = mix(hash, PFL_STATE(&view, d), KERNEL_N * sizeof(float));
        }
    }
    return hash;
}

static void say(const char *name, uint32_t hash)
{
    char digits[10];
    for (uint32_t k = 0u; k < 8u; k++) {
        digits[k] = "0123456789abcdef"[(hash >> (28u - (4u * k))) & 15u];
    }
    digits[8] = '\n';
    digits[9] = '\0';
    io_text(name);
    io_text(" ");
    io_text(digits);
}

static void run_all(const kernel_t *kernel, uint32_t count)
{
    for (uint32_t k = 0u; k < count; k++) {
        fill();
        if (kernel[k].prepare != NULL) {
            kernel[k].prepare();
        }
        kernel[k].run();
        say(kernel[k].name, hash_all());
    }
}

int main(void)
{
    run_all(kernels_math, kernels_math_count);
    run_all(kernels_models, kernels_models_count);
    run_all(kernels_sensors, kernels_sensors_count);
    run_all(kernels_recordings, kernels_recordings_count);
    run_all(kernels_per_particle, kernels_per_particle_count);
    run_all(kernels_filter, kernels_filter_count);
    return 0;
}
