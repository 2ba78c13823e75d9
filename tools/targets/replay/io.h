/* What the player needs of its machine: three files, a line of text, an end, and its stack. By semihosting on bare
 * metal (io_semihosting.c), by a C library under an operating system (io_stdio.c). */
#ifndef TARGETS_IO_H
#define TARGETS_IO_H

#include <stdint.h>

typedef enum { IO_TAPE = 0, IO_OUT, IO_TICKS, IO_FILES } io_file_t; /* tape.in, tape.out, tape.ticks */

/* 0, or -1 when one cannot be opened. */
int io_open(void);
uint32_t io_read(io_file_t file, void *bytes, uint32_t count);
uint32_t io_write(io_file_t file, const void *bytes, uint32_t count);
void io_close(void);
void io_text(const char *text);

/* The lowest word of the stack that may be painted; null where the stack is not ours. */
uint32_t *io_stack_bottom(void);

#endif
