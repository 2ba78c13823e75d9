/* Words in and out of the player's files, and structures out of words. */
#ifndef TARGETS_WORDS_H
#define TARGETS_WORDS_H

#include "io.h"
#include "tape.h"

/* A word of the tape; 0 behind its end, and then words_ended(). */
uint32_t words_next(void);
float words_next_float(void);
uint64_t words_next_u64(void);
bool words_ended(void);

/* Fills a structure. Routes share one place: the last one read is valid. */
void words_next_type(const type_t *type, void *structure, float sharpen);

void words_put(io_file_t file, uint32_t word); /* IO_OUT or IO_TICKS */
void words_put_float(float x);                 /* to IO_OUT; a NaN as one and the same */
void words_put_type(const type_t *type, const void *structure);
bool words_flush(void);

/* 64-bit FNV-1a over the bits of floats, as tools/runner/hash.h has it. */
#define WORDS_HASH_START UINT64_C(0xCBF29CE484222325)
uint64_t words_hash(uint64_t hash, const float *x, uint32_t n);

#endif
