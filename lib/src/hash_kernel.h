/* The hash of the guards: no change of a single word stays unseen, and one of several hardly ever. It is compared only
 * with hashes of the same build, so each form of it may be what its machine is quick at. */
#ifndef PFL_HASH_KERNEL_H
#define PFL_HASH_KERNEL_H

#include "bits.h"

/* One to one in `word`, and in `hash`. */
static inline uint32_t pfl_hash_step(uint32_t hash, uint32_t word)
{
    const uint32_t mixed = (hash ^ word) * 0x9E3779B1u;
    return (mixed << 13) | (mixed >> 19);
}

#if PFL_VECTOR_LANES > 1
typedef uint32_t pfl_words_t __attribute__((vector_size(4 * PFL_VECTOR_LANES), aligned(4), may_alias));

/* The same step in lanes, which are then added, each by an odd factor of its own. */
static inline uint32_t pfl_hash_vectors(const unsigned char *at, size_t vectors)
{
    static const uint32_t factors[8] = {0x9E3779B1u, 0x85EBCA77u, 0xC2B2AE3Du, 0x27D4EB2Fu,
                                        0x165667B1u, 0xD3A2646Du, 0xFD7046C5u, 0xB55A4F09u};
    pfl_words_t sum = {0u};
    for (size_t k = 0u; k < vectors; k++) {
        sum = (sum ^ *(const pfl_words_t *)(const void *)&at[k * sizeof sum]) * 0x9E3779B1u;
        sum = (sum << 13) | (sum >> 19);
    }
    sum *= *(const pfl_words_t *)(const void *)factors;
    uint32_t total = 0u;
    for (uint32_t lane = 0u; lane < PFL_VECTOR_LANES; lane++) {
        total += sum[lane];
    }
    return total;
}
#endif

static inline uint32_t pfl_hash_kernel(uint32_t hash, const void *bytes, size_t words)
{
    const unsigned char *at = (const unsigned char *)bytes;
    size_t left = words;
#if PFL_VECTOR_LANES > 1
    const size_t vectors = words / PFL_VECTOR_LANES;
    if (vectors > 0u) { /* no words at all may be at no address */
        hash = pfl_hash_step(hash, pfl_hash_vectors(at, vectors));
        at += vectors * sizeof(pfl_words_t);
        left -= vectors * PFL_VECTOR_LANES;
    }
#endif
    for (; left > 0u; left--) {
        uint32_t word;
        PFL_LOAD_WORD(word, (const void *)at);
        hash = pfl_hash_step(hash, word);
        at += 4;
    }
    return hash;
}

#endif
