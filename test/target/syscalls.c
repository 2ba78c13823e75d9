/* What newlib needs of a machine, by semihosting: standard output, a heap, an end. For the unit tests on the target. */
#include "../../port/qemu/semihosting.h"

#include <errno.h>
#include <stddef.h>
#include <sys/stat.h>

extern char board_heap_start[], board_heap_end[];

int _write(int file, const char *bytes, int count);
int _read(int file, char *bytes, int count);
void *_sbrk(ptrdiff_t more);
int _close(int file);
int _fstat(int file, struct stat *status);
int _isatty(int file);
int _lseek(int file, int offset, int whence);
int _kill(int process, int signal);
int _getpid(void);
void _exit(int status);

int _write(int file, const char *bytes, int count)
{
    char text[65];
    int at = 0;

    (void)file;
    while (at < count) {
        int n = 0;
        while (n < 64 && at < count) {
            text[n++] = bytes[at++];
        }
        text[n] = '\0';
        sh_print(text);
    }
    return count;
}

void *_sbrk(ptrdiff_t more)
{
    static char *top = board_heap_start;
    char *before = top;

    if (more > board_heap_end - top) {
        errno = ENOMEM;
        return (void *)-1;
    }
    top += more;
    return before;
}

int _fstat(int file, struct stat *status)
{
    (void)file;
    status->st_mode = S_IFCHR;
    return 0;
}

int _isatty(int file)
{
    (void)file;
    return 1;
}

void _exit(int status)
{
    sh_exit(status);
    for (;;) {
    }
}

int _read(int file, char *bytes, int count)
{
    (void)file;
    (void)bytes;
    (void)count;
    return 0;
}

int _close(int file)
{
    (void)file;
    return -1;
}

int _lseek(int file, int offset, int whence)
{
    (void)file;
    (void)offset;
    (void)whence;
    return 0;
}

int _kill(int process, int signal)
{
    (void)process;
    _exit(signal);
}

int _getpid(void)
{
    return 1;
}
