/* lanes.h with eight floats in a register. */
#define PFL_VECTOR_LANES 8
#define FORM lanes_eight
#include "lanes_form.h"
