/* What the paper and the scenario's page say of `standoff`, setting by setting. The limits are the page's, and hold for
 * 200 runs; rows without a limit are there to compare with. */
#include "standoff.h"

#include <string.h>

#define NONE MISSING

/* Settings as standoff_key writes them. */
#define GUIDED(law, seen) " " law " " seen " zoh"
#define DEFAULT_LOOP GUIDED("lvfg", "inout")
#define PF "pf cv 200"
#define PF_MULTI "pf-multi cv 200"
#define CPF(n, tries, fallback) "cpf cv " n " tries=" tries " " fallback DEFAULT_LOOP
#define MULTI(n, tries, fallback) "cpf-multi cv " n " tries=" tries " " fallback DEFAULT_LOOP
#define PAIR(law, seen) "cpf-multi cv 200 tries=4 slide" GUIDED(law, seen)

static const standoff_reference_t references[] = {
    /* settings, figure, paper; truth of the paper: reference, limit; calm truth: reference, limit */
    {PF DEFAULT_LOOP, STANDOFF_POSITION, 7.29, 7.47, 8.6, 7.55, 8.7},
    {PF DEFAULT_LOOP, STANDOFF_POSITION_OUT, 12.90, 12.94, NONE, 12.46, NONE},
    {PF DEFAULT_LOOP, STANDOFF_VELOCITY, 1.79, 1.96, NONE, NONE, NONE},
    {PF DEFAULT_LOOP, STANDOFF_VELOCITY_OUT, 2.39, 2.36, NONE, NONE, NONE},
    {PF DEFAULT_LOOP, STANDOFF_DISTANCE, 13.34, 12.70, NONE, 14.9, NONE},
    {PF DEFAULT_LOOP, STANDOFF_LOSS, 0.20, 0.098, NONE, NONE, NONE},
    {PF_MULTI DEFAULT_LOOP, STANDOFF_POSITION, NONE, 6.50, NONE, NONE, NONE},

    {CPF("200", "4", "slide"), STANDOFF_POSITION, 3.94, 3.81, 4.1, 3.10, 3.3},
    {CPF("200", "4", "slide"), STANDOFF_POSITION_OUT, 6.04, 6.68, 7.5, 4.12, 4.6},
    {CPF("200", "4", "slide"), STANDOFF_VELOCITY, 1.29, 1.15, 1.22, 0.77, 0.85},
    {CPF("200", "4", "slide"), STANDOFF_VELOCITY_OUT, 1.64, 1.34, NONE, NONE, NONE},
    {CPF("200", "4", "slide"), STANDOFF_DISTANCE, 8.84, 9.65, NONE, 12.2, NONE},
    {CPF("200", "4", "slide"), STANDOFF_LOSS, 0.13, 0.008, 0.03, NONE, 0.02},
    {CPF("200", "4", "slide"), STANDOFF_DRAWS, NONE, 1.47, NONE, NONE, NONE},
    {CPF("200", "4", "slide"), STANDOFF_FALLBACK, NONE, 0.11, NONE, NONE, NONE},
    {CPF("200", "4", "slide"), STANDOFF_WANTED_OUT, NONE, 58.0, NONE, NONE, NONE},
    {CPF("200", "4", "slide"), STANDOFF_POSITION_PF, NONE, NONE, 0.58, NONE, 0.48},

    /* Table III; LVFG with outages is Table II's third column too */
    {PAIR("lvfg", "inout"), STANDOFF_POSITION, 2.38, 3.23, 3.45, 2.51, 2.7},
    {PAIR("lvfg", "inout"), STANDOFF_POSITION_OUT, 4.25, 6.22, 6.9, 4.02, 4.5},
    {PAIR("lvfg", "inout"), STANDOFF_VELOCITY, 1.05, 1.10, 1.15, 0.73, 0.80},
    {PAIR("lvfg", "inout"), STANDOFF_VELOCITY_OUT, 1.43, 1.31, NONE, NONE, NONE},
    {PAIR("lvfg", "inout"), STANDOFF_DISTANCE, 6.78, 8.08, 8.5, 8.9, 9.3},
    {PAIR("lvfg", "inout"), STANDOFF_PHASE, 12.04, 13.76, 15.2, 15.8, 17.6},
    {PAIR("lvfg", "inout"), STANDOFF_LOSS, 0.01, 0.0, 0.02, NONE, 0.02},
    {PAIR("lvfg", "inout"), STANDOFF_LOSS_ANY, NONE, 0.03, NONE, NONE, NONE},
    {PAIR("lvfg", "inout"), STANDOFF_EFFORT_SPEED, NONE, 324.0, NONE, NONE, NONE},
    {PAIR("lvfg", "inout"), STANDOFF_EFFORT_TURN, NONE, 29.2, NONE, NONE, NONE},
    {PAIR("lvfg", "inout"), STANDOFF_CLOSEST, NONE, 37.0, NONE, NONE, NONE},
    {PAIR("lvfg", "inout"), STANDOFF_WANTED_OUT, NONE, 55.0, NONE, NONE, NONE},
    {PAIR("lvfg", "inout"), STANDOFF_POSITION_CPF, NONE, NONE, 1.0, NONE, 1.0}, /* the order, in every seed */
    {PAIR("lvfg", "in"), STANDOFF_POSITION, NONE, 1.80, NONE, NONE, NONE},
    {PAIR("lvfg", "in"), STANDOFF_DISTANCE, NONE, 5.04, NONE, NONE, NONE},
    {PAIR("lvfg", "in"), STANDOFF_PHASE, NONE, 11.8, NONE, NONE, NONE},
    {PAIR("lvfg", "in"), STANDOFF_LOSS, NONE, 0.0, NONE, NONE, NONE},
    {PAIR("lvfg", "in"), STANDOFF_LOSS_ANY, NONE, 0.0, NONE, NONE, NONE},
    {PAIR("lvfg", "in"), STANDOFF_EFFORT_SPEED, NONE, 322.0, NONE, NONE, NONE},
    {PAIR("lvfg", "in"), STANDOFF_EFFORT_TURN, NONE, 34.6, NONE, NONE, NONE},
    {PAIR("lvfg", "in"), STANDOFF_CLOSEST, NONE, 51.0, NONE, NONE, NONE},
    {PAIR("nmpc", "in"), STANDOFF_POSITION, NONE, 1.71, NONE, NONE, NONE},
    {PAIR("nmpc", "in"), STANDOFF_DISTANCE, NONE, 3.30, 3.5, NONE, 3.2},
    {PAIR("nmpc", "in"), STANDOFF_PHASE, NONE, 29.7, NONE, NONE, NONE},
    {PAIR("nmpc", "in"), STANDOFF_LOSS, NONE, 0.0, NONE, NONE, NONE},
    {PAIR("nmpc", "in"), STANDOFF_LOSS_ANY, NONE, 0.0, NONE, NONE, NONE},
    {PAIR("nmpc", "in"), STANDOFF_EFFORT_SPEED, NONE, 66.0, NONE, NONE, NONE},
    {PAIR("nmpc", "in"), STANDOFF_EFFORT_TURN, NONE, 35.1, NONE, NONE, NONE},
    {PAIR("nmpc", "in"), STANDOFF_CLOSEST, NONE, 8.0, NONE, NONE, NONE},
    {PAIR("nmpc", "inout"), STANDOFF_POSITION, NONE, 3.18, NONE, NONE, NONE},
    {PAIR("nmpc", "inout"), STANDOFF_DISTANCE, NONE, 6.64, 6.9, NONE, 6.6},
    {PAIR("nmpc", "inout"), STANDOFF_PHASE, NONE, 38.0, NONE, NONE, NONE},
    {PAIR("nmpc", "inout"), STANDOFF_LOSS, NONE, 0.010, NONE, NONE, NONE},
    {PAIR("nmpc", "inout"), STANDOFF_LOSS_ANY, NONE, 0.090, NONE, NONE, NONE},
    {PAIR("nmpc", "inout"), STANDOFF_EFFORT_SPEED, NONE, 57.0, NONE, NONE, NONE},
    {PAIR("nmpc", "inout"), STANDOFF_EFFORT_TURN, NONE, 30.8, NONE, NONE, NONE},
    {PAIR("nmpc", "inout"), STANDOFF_CLOSEST, NONE, 7.0, NONE, NONE, NONE},
    {PAIR("lvfg+", "in"), STANDOFF_POSITION, NONE, 1.90, NONE, NONE, NONE},
    {PAIR("lvfg+", "in"), STANDOFF_DISTANCE, NONE, 2.78, NONE, NONE, NONE},
    {PAIR("lvfg+", "in"), STANDOFF_PHASE, NONE, 7.5, NONE, NONE, NONE},
    {PAIR("lvfg+", "in"), STANDOFF_LOSS, NONE, 0.0, NONE, NONE, NONE},
    {PAIR("lvfg+", "in"), STANDOFF_LOSS_ANY, NONE, 0.0, NONE, NONE, NONE},
    {PAIR("lvfg+", "in"), STANDOFF_EFFORT_SPEED, NONE, 249.0, NONE, NONE, NONE},
    {PAIR("lvfg+", "in"), STANDOFF_EFFORT_TURN, NONE, 33.0, NONE, NONE, NONE},
    {PAIR("lvfg+", "in"), STANDOFF_CLOSEST, NONE, 54.0, NONE, NONE, NONE},
    {PAIR("lvfg+", "inout"), STANDOFF_POSITION, NONE, 3.41, NONE, NONE, NONE},
    {PAIR("lvfg+", "inout"), STANDOFF_DISTANCE, NONE, 5.84, 6.2, NONE, 5.8},
    {PAIR("lvfg+", "inout"), STANDOFF_PHASE, NONE, 9.1, 10.0, NONE, 8.8},
    {PAIR("lvfg+", "inout"), STANDOFF_LOSS, NONE, 0.002, NONE, NONE, NONE},
    {PAIR("lvfg+", "inout"), STANDOFF_LOSS_ANY, NONE, 0.024, NONE, NONE, NONE},
    {PAIR("lvfg+", "inout"), STANDOFF_EFFORT_SPEED, NONE, 252.0, NONE, NONE, NONE},
    {PAIR("lvfg+", "inout"), STANDOFF_EFFORT_TURN, NONE, 28.1, NONE, NONE, NONE},
    {PAIR("lvfg+", "inout"), STANDOFF_CLOSEST, NONE, 54.0, NONE, NONE, NONE},
    {PAIR("nmpc+", "in"), STANDOFF_POSITION, NONE, 1.76, NONE, NONE, NONE},
    {PAIR("nmpc+", "in"), STANDOFF_DISTANCE, NONE, 3.24, NONE, NONE, NONE},
    {PAIR("nmpc+", "in"), STANDOFF_PHASE, NONE, 8.6, NONE, NONE, NONE},
    {PAIR("nmpc+", "in"), STANDOFF_LOSS, NONE, 0.0, NONE, NONE, NONE},
    {PAIR("nmpc+", "in"), STANDOFF_LOSS_ANY, NONE, 0.0, NONE, NONE, NONE},
    {PAIR("nmpc+", "in"), STANDOFF_EFFORT_SPEED, NONE, 178.0, NONE, NONE, NONE},
    {PAIR("nmpc+", "in"), STANDOFF_EFFORT_TURN, NONE, 36.5, NONE, NONE, NONE},
    {PAIR("nmpc+", "in"), STANDOFF_CLOSEST, NONE, 51.0, NONE, NONE, NONE},
    {PAIR("nmpc+", "inout"), STANDOFF_POSITION, NONE, 3.16, NONE, NONE, NONE},
    {PAIR("nmpc+", "inout"), STANDOFF_DISTANCE, NONE, 6.54, 6.8, NONE, 6.4},
    {PAIR("nmpc+", "inout"), STANDOFF_PHASE, NONE, 11.4, 13.0, NONE, 11.2},
    {PAIR("nmpc+", "inout"), STANDOFF_LOSS, NONE, 0.005, NONE, NONE, NONE},
    {PAIR("nmpc+", "inout"), STANDOFF_LOSS_ANY, NONE, 0.085, NONE, NONE, NONE},
    {PAIR("nmpc+", "inout"), STANDOFF_EFFORT_SPEED, NONE, 180.0, NONE, NONE, NONE},
    {PAIR("nmpc+", "inout"), STANDOFF_EFFORT_TURN, NONE, 32.1, NONE, NONE, NONE},
    {PAIR("nmpc+", "inout"), STANDOFF_CLOSEST, NONE, 15.0, NONE, NONE, NONE},
    {"cpf-multi cv 200 tries=4 slide lvfg inout euler", STANDOFF_POSITION, NONE, 3.35, NONE, NONE, NONE},
    {"cpf-multi cv 200 tries=4 slide lvfg inout euler", STANDOFF_DISTANCE, NONE, 9.31, NONE, NONE, NONE},
    {"cpf-multi cv 200 tries=4 slide lvfg inout euler", STANDOFF_PHASE, NONE, 15.4, NONE, NONE, NONE},

    /* other models; the last is the goal beyond the page */
    {"cpf road 200" DEFAULT_LOOP, STANDOFF_POSITION, NONE, 3.80, 4.1, 2.64, 2.9},
    {"cpf-multi road 200" DEFAULT_LOOP, STANDOFF_POSITION, NONE, 3.19, 3.45, 2.15, 2.35},
    {"cpf-multi lane 200" DEFAULT_LOOP, STANDOFF_POSITION_EKF, NONE, NONE, 1.03, NONE, 1.03},
    {"ekf" DEFAULT_LOOP, STANDOFF_POSITION, NONE, 3.57, NONE, 2.25, NONE},
    {"ekf-multi" DEFAULT_LOOP, STANDOFF_POSITION, NONE, 3.00, NONE, 1.78, NONE},

    /* the paper's Figure 5, a plot, and the position error with it */
    {CPF("25", "4", "slide"), STANDOFF_POSITION, NONE, 4.94, NONE, NONE, NONE},
    {CPF("25", "4", "slide"), STANDOFF_WANTED_OUT, NONE, 45.0, NONE, NONE, NONE},
    {CPF("50", "4", "slide"), STANDOFF_POSITION, NONE, 4.00, NONE, NONE, NONE},
    {CPF("50", "4", "slide"), STANDOFF_WANTED_OUT, NONE, 50.0, NONE, NONE, NONE},
    {CPF("100", "4", "slide"), STANDOFF_POSITION, NONE, 3.82, NONE, NONE, NONE},
    {CPF("100", "4", "slide"), STANDOFF_WANTED_OUT, NONE, 54.0, NONE, NONE, NONE},
    {CPF("800", "4", "slide"), STANDOFF_POSITION, NONE, 3.73, NONE, NONE, NONE},
    {CPF("800", "4", "slide"), STANDOFF_WANTED_OUT, NONE, 64.0, NONE, NONE, NONE},
    {MULTI("25", "4", "slide"), STANDOFF_POSITION, NONE, 4.57, NONE, NONE, NONE},
    {MULTI("25", "4", "slide"), STANDOFF_WANTED_OUT, NONE, 41.0, NONE, NONE, NONE},
    {MULTI("50", "4", "slide"), STANDOFF_POSITION, NONE, 3.56, NONE, NONE, NONE},
    {MULTI("50", "4", "slide"), STANDOFF_WANTED_OUT, NONE, 46.0, NONE, NONE, NONE},
    {MULTI("100", "4", "slide"), STANDOFF_POSITION, NONE, 3.22, NONE, NONE, NONE},
    {MULTI("100", "4", "slide"), STANDOFF_WANTED_OUT, NONE, 51.0, NONE, NONE, NONE},
    {MULTI("800", "4", "slide"), STANDOFF_POSITION, NONE, 3.11, NONE, NONE, NONE},
    {MULTI("800", "4", "slide"), STANDOFF_WANTED_OUT, NONE, 60.0, NONE, NONE, NONE},
    {CPF("100", "1", "slide"), STANDOFF_POSITION, NONE, 3.85, 4.3, NONE, 3.4},
    {MULTI("100", "1", "slide"), STANDOFF_POSITION, NONE, 3.25, 3.7, NONE, 2.95},

    /* bounded tries and what follows them, one UAV and two */
    {CPF("200", "1", "slide"), STANDOFF_POSITION, NONE, 3.74, NONE, 3.14, NONE},
    {CPF("200", "1", "slide"), STANDOFF_VELOCITY, NONE, 1.13, NONE, NONE, NONE},
    {CPF("200", "1", "slide"), STANDOFF_FALLBACK, NONE, 0.25, NONE, NONE, NONE},
    {CPF("200", "16", "slide"), STANDOFF_POSITION, NONE, 3.75, NONE, 3.10, NONE},
    {CPF("200", "16", "slide"), STANDOFF_DRAWS, NONE, 2.5, NONE, NONE, NONE},
    {CPF("200", "64", "slide"), STANDOFF_POSITION, NONE, 3.76, NONE, 3.12, NONE},
    {CPF("200", "64", "slide"), STANDOFF_DRAWS, NONE, 5.8, NONE, NONE, NONE},
    {CPF("200", "64", "slide"), STANDOFF_FALLBACK, NONE, 0.062, NONE, NONE, NONE},
    {MULTI("200", "1", "slide"), STANDOFF_POSITION, NONE, 3.18, NONE, NONE, NONE},
    {MULTI("200", "16", "slide"), STANDOFF_POSITION, NONE, 3.17, NONE, NONE, NONE},
    {MULTI("200", "64", "slide"), STANDOFF_POSITION, NONE, 3.11, NONE, NONE, NONE},
    {CPF("200", "1", "bounce"), STANDOFF_POSITION, NONE, 3.74, NONE, NONE, NONE},
    {CPF("200", "1", "bounce"), STANDOFF_VELOCITY, NONE, 1.92, NONE, NONE, NONE},
    {CPF("200", "1", "bounce"), STANDOFF_FALLBACK, NONE, 0.37, NONE, NONE, NONE},
    {CPF("200", "64", "bounce"), STANDOFF_POSITION, NONE, 3.72, NONE, NONE, NONE},
    {CPF("200", "64", "bounce"), STANDOFF_VELOCITY, NONE, 1.60, NONE, NONE, NONE},
    {CPF("200", "1", "clamp"), STANDOFF_POSITION, NONE, 4.69, NONE, NONE, NONE},
    {CPF("200", "1", "clamp"), STANDOFF_VELOCITY, NONE, 4.98, NONE, NONE, NONE},
    {CPF("200", "1", "clamp"), STANDOFF_FALLBACK, NONE, 0.90, NONE, NONE, NONE},
    {CPF("200", "64", "clamp"), STANDOFF_POSITION, NONE, 4.28, NONE, NONE, NONE},
    {CPF("200", "64", "clamp"), STANDOFF_VELOCITY, NONE, 4.03, NONE, NONE, NONE},
    {CPF("200", "1", "weight"), STANDOFF_POSITION, NONE, 3.88, NONE, NONE, NONE},
    {CPF("200", "1", "weight"), STANDOFF_VELOCITY, NONE, 1.23, NONE, NONE, NONE},
    {CPF("200", "64", "weight"), STANDOFF_POSITION, NONE, 3.70, NONE, NONE, NONE},
    {CPF("200", "1", "keep"), STANDOFF_POSITION, NONE, 6.85, NONE, NONE, NONE},
    {CPF("200", "1", "keep"), STANDOFF_VELOCITY, NONE, 1.83, NONE, NONE, NONE},
    {CPF("200", "64", "keep"), STANDOFF_POSITION, NONE, 5.71, NONE, NONE, NONE},
    {CPF("200", "64", "keep"), STANDOFF_VELOCITY, NONE, 1.59, NONE, NONE, NONE},
};

const standoff_reference_t *standoff_reference(const char *key, unsigned figure)
{
    for (size_t i = 0u; i < sizeof references / sizeof references[0]; i++) {
        if (references[i].figure == figure && strcmp(references[i].key, key) == 0) {
            return &references[i];
        }
    }
    return NULL;
}
