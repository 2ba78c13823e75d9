/* lanes.h with four floats in a register. */
#define PFL_VECTOR_LANES 4
#define FORM lanes_four
#include "lanes_form.h"
