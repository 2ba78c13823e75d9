/* Semihosting, by hand: what an image under emulation has instead of an operating system. The trap of Armv7-M and
 * Armv8-M, and that of RISC-V; operation in the first argument register, a block of words in the second, the answer in
 * the first. Give QEMU -semihosting-config enable=on,target=native: the image then reaches the host's files, so run
 * only images that you built. */
#ifndef PFLIGHT_PORT_QEMU_SEMIHOSTING_H
#define PFLIGHT_PORT_QEMU_SEMIHOSTING_H

#include <stdint.h>

/* Operations ("Semihosting for AArch32 and AArch64", Arm; the RISC-V ones are the same). */
#define SH_OPEN 0x01u
#define SH_CLOSE 0x02u
#define SH_WRITE0 0x04u
#define SH_WRITE 0x05u
#define SH_READ 0x06u
#define SH_EXIT_EXTENDED 0x20u /* SH_EXIT (0x18) can say 0 or 1 only */
#define SH_APPLICATION_EXIT 0x20026u

/* Modes of SH_OPEN. */
#define SH_READ_BINARY 1u
#define SH_WRITE_BINARY 5u

#if defined(__riscv)
static inline int32_t sh_call(uint32_t operation, const void *block)
{
    register uint32_t a0 __asm__("a0") = operation;
    register const void *a1 __asm__("a1") = block;
    /* The three instructions that mark the trap: uncompressed, and within one page. */
    __asm__ volatile(
        ".balign 16\n .option push\n .option norvc\n slli x0, x0, 0x1f\n ebreak\n srai x0, x0, 7\n .option pop"
        : "+r"(a0)
        : "r"(a1)
        : "memory");
    return (int32_t)a0;
}
#else
static inline int32_t sh_call(uint32_t operation, const void *block)
{
    register uint32_t r0 __asm__("r0") = operation;
    register const void *r1 __asm__("r1") = block;
    __asm__ volatile("bkpt 0xAB" : "+r"(r0) : "r"(r1) : "memory");
    return (int32_t)r0;
}
#endif

/* Zero-terminated text to QEMU's semihosting console. */
static inline void sh_print(const char *text)
{
    (void)sh_call(SH_WRITE0, text);
}

/* Ends QEMU with this exit status. */
static inline void sh_exit(int32_t status)
{
    const uint32_t block[2] = {SH_APPLICATION_EXIT, (uint32_t)status};
    (void)sh_call(SH_EXIT_EXTENDED, block);
}

/* A handle, or -1. The path is relative to QEMU's working folder. */
static inline int32_t sh_open(const char *path, uint32_t mode)
{
    uint32_t length = 0u;
    while (path[length] != '\0') {
        length++;
    }
    const uint32_t block[3] = {(uint32_t)(uintptr_t)path, mode, length};
    return sh_call(SH_OPEN, block);
}

/* Bytes read. */
static inline uint32_t sh_read(int32_t handle, void *bytes, uint32_t count)
{
    const uint32_t block[3] = {(uint32_t)handle, (uint32_t)(uintptr_t)bytes, count};
    return count - (uint32_t)sh_call(SH_READ, block); /* which answers the bytes not read */
}

/* Bytes written. */
static inline uint32_t sh_write(int32_t handle, const void *bytes, uint32_t count)
{
    const uint32_t block[3] = {(uint32_t)handle, (uint32_t)(uintptr_t)bytes, count};
    return count - (uint32_t)sh_call(SH_WRITE, block);
}

static inline void sh_close(int32_t handle)
{
    const uint32_t block[1] = {(uint32_t)handle};
    (void)sh_call(SH_CLOSE, block);
}

#endif
