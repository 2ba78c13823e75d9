/* Words without end on standard output, for batteries that read them there:
 *     stream uniform|normal SEED | dieharder -a -g 200 */
#include "source.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static source_t source;

int main(int argc, char **argv)
{
    uint32_t word[4096];

    if (argc != 3) {
        (void)fprintf(stderr, "usage: stream uniform|normal SEED\n");
        return 2;
    }
    source_start(&source, strcmp(argv[1], "normal") == 0 ? SOURCE_NORMAL : SOURCE_UNIFORM, strtoull(argv[2], NULL, 10),
                 0u);
    do {
        for (size_t i = 0u; i < sizeof word / sizeof word[0]; i++) {
            word[i] = source_word(&source);
        }
    } while (fwrite(word, sizeof word, 1u, stdout) == 1u);
    return 0;
}
