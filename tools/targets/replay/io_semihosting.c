/* io.h by semihosting: an image on bare metal under emulation. */
#include "io.h"

#include "../../../port/qemu/semihosting.h"

extern uint32_t board_stack_bottom[]; /* of the linker script */

static int32_t handle[IO_FILES];

int io_open(void)
{
    handle[IO_TAPE] = sh_open("tape.in", SH_READ_BINARY);
    handle[IO_OUT] = sh_open("tape.out", SH_WRITE_BINARY);
    handle[IO_TICKS] = sh_open("tape.ticks", SH_WRITE_BINARY);
    return (handle[IO_TAPE] < 0 || handle[IO_OUT] < 0 || handle[IO_TICKS] < 0) ? -1 : 0;
}

uint32_t io_read(io_file_t file, void *bytes, uint32_t count)
{
    return sh_read(handle[file], bytes, count);
}

uint32_t io_write(io_file_t file, const void *bytes, uint32_t count)
{
    return sh_write(handle[file], bytes, count);
}

void io_close(void)
{
    for (int k = 0; k < (int)IO_FILES; k++) {
        sh_close(handle[k]);
    }
}

void io_text(const char *text)
{
    sh_print(text);
}

uint32_t *io_stack_bottom(void)
{
    return board_stack_bottom;
}
