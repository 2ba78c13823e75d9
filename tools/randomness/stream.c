/* Words without end on standard output, for batteries that read them there; or the fingerprint of their generator:
 *     stream uniform|normal SEED | dieharder -a -g 200
 *     stream uniform|normal SEED fingerprint */
#include "source.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static source_t source;

int main(int argc, char **argv)
{
    uint32_t word[4096];

    if (argc != 3 && argc != 4) {
        (void)fprintf(stderr, "usage: stream uniform|normal SEED [fingerprint]\n");
        return 2;
    }
    const source_kind_t kind = strcmp(argv[1], "normal") == 0 ? SOURCE_NORMAL : SOURCE_UNIFORM;
    const uint64_t seed = strtoull(argv[2], NULL, 10);
    if (argc == 4) {
        (void)printf("%016llx\n", (unsigned long long)source_fingerprint(kind, seed));
        return 0;
    }
    source_start(&source, kind, seed, 0u);
    do {
        for (size_t i = 0u; i < sizeof word / sizeof word[0]; i++) {
            word[i] = source_word(&source);
        }
    } while (fwrite(word, sizeof word, 1u, stdout) == 1u);
    return 0;
}
