/* memcpy, memmove, memset and strlen of the bare-metal images: a word at a time where both sides allow it. Compilers turn loops
 * into calls of these, so this file is built with -fno-tree-loop-distribute-patterns. */
#include <stddef.h>
#include <stdint.h>

void *memcpy(void *to, const void *from, size_t n);
void *memmove(void *to, const void *from, size_t n);
void *memset(void *to, int value, size_t n);
size_t strlen(const char *text);

void *memcpy(void *to, const void *from, size_t n)
{
    unsigned char *t = (unsigned char *)to;
    const unsigned char *f = (const unsigned char *)from;
    if ((((uintptr_t)t | (uintptr_t)f) & 3u) == 0u) {
        uint32_t *tw = (uint32_t *)to;
        const uint32_t *fw = (const uint32_t *)from;
        for (; n >= 16u; n -= 16u) {
            tw[0] = fw[0];
            tw[1] = fw[1];
            tw[2] = fw[2];
            tw[3] = fw[3];
            tw += 4;
            fw += 4;
        }
        for (; n >= 4u; n -= 4u) {
            *tw++ = *fw++;
        }
        t = (unsigned char *)tw;
        f = (const unsigned char *)fw;
    }
    while (n > 0u) {
        *t++ = *f++;
        n--;
    }
    return to;
}

void *memmove(void *to, const void *from, size_t n)
{
    unsigned char *t = (unsigned char *)to;
    const unsigned char *f = (const unsigned char *)from;
    if ((uintptr_t)to <= (uintptr_t)from) {
        return memcpy(to, from, n);
    }
    while (n > 0u) {
        n--;
        t[n] = f[n];
    }
    return to;
}

void *memset(void *to, int value, size_t n)
{
    unsigned char *t = (unsigned char *)to;
    const uint32_t byte = (uint32_t)value & 0xFFu;
    if (((uintptr_t)t & 3u) == 0u) {
        uint32_t *tw = (uint32_t *)to;
        const uint32_t word = byte * 0x01010101u;
        for (; n >= 4u; n -= 4u) {
            *tw++ = word;
        }
        t = (unsigned char *)tw;
    }
    while (n > 0u) {
        *t++ = (unsigned char)byte;
        n--;
    }
    return to;
}

size_t strlen(const char *text)
{
    size_t n = 0u;
    while (text[n] != '\0') {
        n++;
    }
    return n;
}
