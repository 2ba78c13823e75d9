/* The kernels of lanes.h in one of their forms, as functions of their own: a source defines PFL_VECTOR_LANES and
 * FORM(name), then includes this. */
#include "../../lib/src/lanes.h"

#include "lanes_forms.h"

static float weight_of(float e)
{
    return pfl_weight_of(e);
}

static void weigh(float *rows, float *w, const float *s, float top, uint32_t n)
{
    pfl_lanes_weigh(rows, w, s, top, n);
}

static void product(float *row, const float *w, const float *x, const float *centre, uint32_t n)
{
    pfl_lanes_product(row, w, x, centre, n);
}

static void products(float *rows, const float *w, const float *x, uint32_t stride, const float *centres, uint32_t n)
{
    pfl_lanes_products(rows, w, x, stride, centres, n);
}

static float sum(const float *x, size_t stride, uint32_t columns, uint32_t n)
{
    return pfl_lanes_sum(x, stride, columns, n);
}

const lanes_form_t FORM = {PFL_VECTOR_LANES, weight_of, weigh, product, products, sum};
