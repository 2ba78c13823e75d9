/* What newlib needs of a machine, by semihosting: files to read, a console, a heap, an end. Paths are relative to QEMU's
 * working folder, or absolute. */
#include "../../../port/qemu/semihosting.h"

#include <errno.h>
#include <stddef.h>
#include <string.h>
#include <sys/stat.h>

#define SH_SEEK 0x0Au
#define SH_FLEN 0x0Cu
#define FILES_FROM 3 /* 0 to 2 are the console */
#define FILES_MAX 8

extern char board_heap_start[], board_heap_end[];

typedef struct {
    int32_t handle;
    int32_t at, length;
    int open;
} opened_t;

static opened_t opened[FILES_MAX];

int _open(const char *path, int flags, int mode);
int _write(int file, const char *bytes, int count);
int _read(int file, char *bytes, int count);
void *_sbrk(ptrdiff_t more);
int _close(int file);
int _fstat(int file, struct stat *status);
int _stat(const char *path, struct stat *status);
int _isatty(int file);
int _lseek(int file, int offset, int whence);
int _kill(int process, int signal);
int _getpid(void);
int _unlink(const char *path);
int _link(const char *from, const char *to);
int mkdir(const char *path, mode_t mode);
long sysconf(int name);
void _exit(int status) __attribute__((noreturn));

static opened_t *find(int file)
{
    const int k = file - FILES_FROM;

    return k >= 0 && k < FILES_MAX && opened[k].open ? &opened[k] : NULL;
}

int _open(const char *path, int flags, int mode)
{
    (void)flags;
    (void)mode;
    for (int k = 0; k < FILES_MAX; k++) {
        if (!opened[k].open) {
            const int32_t handle = sh_open(path, SH_READ_BINARY);
            const uint32_t block[1] = {(uint32_t)handle};
            if (handle < 0) {
                errno = ENOENT;
                return -1;
            }
            opened[k] = (opened_t){handle, 0, sh_call(SH_FLEN, block), 1};
            return FILES_FROM + k;
        }
    }
    errno = EMFILE;
    return -1;
}

int _read(int file, char *bytes, int count)
{
    opened_t *f = find(file);

    if (f == NULL || count <= 0) {
        return 0;
    }
    const int got = (int)sh_read(f->handle, bytes, (uint32_t)count);
    f->at += got;
    return got;
}

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

int _lseek(int file, int offset, int whence)
{
    opened_t *f = find(file);

    if (f == NULL) {
        return 0;
    }
    const int32_t wanted = offset + (whence == 0 ? 0 : (whence == 1 ? f->at : f->length));
    const uint32_t block[2] = {(uint32_t)f->handle, (uint32_t)wanted};
    if (wanted < 0 || wanted > f->length || sh_call(SH_SEEK, block) != 0) {
        errno = EINVAL;
        return -1;
    }
    f->at = wanted;
    return wanted;
}

int _close(int file)
{
    opened_t *f = find(file);

    if (f != NULL) {
        sh_close(f->handle);
        f->open = 0;
    }
    return f != NULL ? 0 : -1;
}

int _fstat(int file, struct stat *status)
{
    memset(status, 0, sizeof *status);
    status->st_mode = find(file) != NULL ? S_IFREG : S_IFCHR;
    status->st_size = find(file) != NULL ? find(file)->length : 0;
    return 0;
}

int _isatty(int file)
{
    return find(file) == NULL;
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

void _exit(int status)
{
    sh_exit(status);
    for (;;) {
    }
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

/* Nothing that a run needs: files are only read. */

int _stat(const char *path, struct stat *status)
{
    (void)path;
    (void)status;
    return -1;
}

int _unlink(const char *path)
{
    (void)path;
    return -1;
}

int _link(const char *from, const char *to)
{
    (void)from;
    (void)to;
    return -1;
}

int mkdir(const char *path, mode_t mode)
{
    (void)path;
    (void)mode;
    return -1;
}

long sysconf(int name)
{
    (void)name;
    return 1;
}
