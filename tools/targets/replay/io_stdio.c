/* io.h by a C library: the host, and the other Linux machines under user emulation. */
#include "io.h"

#include <stddef.h>
#include <stdio.h>

static FILE *handle[IO_FILES];

int io_open(void)
{
    handle[IO_TAPE] = fopen("tape.in", "rb");
    handle[IO_OUT] = fopen("tape.out", "wb");
    handle[IO_TICKS] = fopen("tape.ticks", "wb");
    return (handle[IO_TAPE] == NULL || handle[IO_OUT] == NULL || handle[IO_TICKS] == NULL) ? -1 : 0;
}

uint32_t io_read(io_file_t file, void *bytes, uint32_t count)
{
    return (uint32_t)fread(bytes, 1u, count, handle[file]);
}

uint32_t io_write(io_file_t file, const void *bytes, uint32_t count)
{
    return (uint32_t)fwrite(bytes, 1u, count, handle[file]);
}

void io_close(void)
{
    for (int k = 0; k < (int)IO_FILES; k++) {
        (void)fclose(handle[k]);
    }
}

void io_text(const char *text)
{
    (void)fputs(text, stdout);
}

uint32_t *io_stack_bottom(void)
{
    return NULL;
}
