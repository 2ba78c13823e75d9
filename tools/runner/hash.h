/* 64-bit FNV-1a over the bits of estimates: two runs computed the same when their hashes are the same. */
#ifndef RUNNER_HASH_H
#define RUNNER_HASH_H

#include <stddef.h>
#include <stdint.h>

#define HASH_START UINT64_C(0xCBF29CE484222325)

/* Each number goes in as its bytes from the lowest to the highest, on any machine. */
uint64_t hash_floats(uint64_t hash, const float *x, size_t n);
uint64_t hash_u64(uint64_t hash, uint64_t x);

#endif
