/* The calls that make a filter cycle, in a file of their own: instructions are counted from the beginning to the end of
 * these functions (instructions.py), so they must be there. */
#include "calls.h"

pfl_status_t call_predict(pfl_t *f, uint64_t t_us, const void *u)
{
    return pfl_predict(f, t_us, u);
}

pfl_status_t call_update(pfl_t *f, uint16_t sensor, uint64_t t_us, const void *z)
{
    return pfl_update(f, sensor, t_us, z);
}

pfl_status_t call_estimate(pfl_t *f, float *mean, float *cov)
{
    return pfl_estimate(f, mean, cov);
}
