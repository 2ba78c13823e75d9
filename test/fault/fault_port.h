/* A port whose counter a test dictates. */
#ifndef PFL_FAULT_PORT_H
#define PFL_FAULT_PORT_H

#include <stdint.h>

typedef struct {
    uint32_t count; /* what the counter reads */
    uint32_t step;  /* grows by this at each read */
    uint32_t mask;  /* that the port tells; what it reads is cut to `width` */
    uint32_t width;
    uint32_t reads;
    uint32_t faults;
    uint32_t jump_at; /* read at which it jumps */
    uint32_t jump;    /* by this */
} fault_port_t;

extern fault_port_t fault_port;

void fault_port_reset(void);

#endif
