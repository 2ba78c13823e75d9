/* FNV-1a: see hash.h. */
#include "hash.h"

#include <string.h>

#define FNV_PRIME UINT64_C(0x00000100000001B3)

static uint64_t hash_bytes(uint64_t hash, uint64_t x, unsigned bytes)
{
    for (unsigned i = 0u; i < bytes; i++) {
        hash = (hash ^ ((x >> (8u * i)) & 0xFFu)) * FNV_PRIME;
    }
    return hash;
}

uint64_t hash_floats(uint64_t hash, const float *x, size_t n)
{
    for (size_t i = 0u; i < n; i++) {
        uint32_t bits;
        memcpy(&bits, &x[i], sizeof bits);
        hash = hash_bytes(hash, bits, 4u);
    }
    return hash;
}

uint64_t hash_u64(uint64_t hash, uint64_t x)
{
    return hash_bytes(hash, x, 8u);
}
