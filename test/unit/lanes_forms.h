/* What test_lanes.c compares: the kernels of lanes.h for scalar cores and for two widths of vectors. */
#ifndef LANES_FORMS_H
#define LANES_FORMS_H

#include <stddef.h>
#include <stdint.h>

typedef struct {
    uint32_t width;
    float (*weight_of)(float e);
    void (*weigh)(float *rows, float *w, const float *s, float top, uint32_t n);
    void (*product)(float *row, const float *w, const float *x, const float *centre, uint32_t n);
    void (*products)(float *rows, const float *w, const float *x, uint32_t stride, const float *centres, uint32_t n);
    float (*sum)(const float *x, size_t stride, uint32_t columns, uint32_t n);
} lanes_form_t;

extern const lanes_form_t lanes_scalar;
extern const lanes_form_t lanes_four;
extern const lanes_form_t lanes_eight;

#endif
