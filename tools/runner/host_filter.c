/* See host_filter.h. */
#include "host_filter.h"

#include <stdlib.h>

pfl_t *host_filter(const pfl_config_t *config, void **arena, failure_t *failure)
{
    const size_t bytes = pfl_arena_bytes(config);
    pfl_t *filter = NULL;

    *arena = malloc(bytes + 1u); /* 0 bytes are those of a configuration that pfl_init refuses */
    if (*arena == NULL) {
        (void)fail(failure, EXIT_HARNESS, "no memory for %lu particles", (unsigned long)config->particles);
        return NULL;
    }
    const pfl_status_t status = pfl_init(*arena, bytes, config, 0u, &filter);
    if (status != PFL_OK) {
        (void)fail(failure, EXIT_HARNESS, "pfl_init: %s", pfl_status_string(status));
        return NULL;
    }
    return filter;
}
