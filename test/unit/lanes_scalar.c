/* lanes.h with one float in a register. */
#define PFL_VECTOR_LANES 1
#define FORM lanes_scalar
#include "lanes_form.h"
