/* What a call answers. Every function that can fail returns one of these, and says in its description which. */
#ifndef PFLIGHT_STATUS_H
#define PFLIGHT_STATUS_H

#ifdef __cplusplus
extern "C" {
#endif

/* Zero: done. Positive: done, with something to know. Negative: refused, and nothing was changed. */
typedef enum {
    PFL_OK = 0,
    PFL_DEFERRED = 1,    /* measurement fused; the cycle budget was spent before moments and resampling, which
                            follow with the next call that needs them */
    PFL_QUARANTINED = 2, /* predict done; particles that came out non-finite carry no weight from now on */

    PFL_REJECTED = -1,       /* measurement refused by its gate, or impossible for every particle */
    PFL_ERR_ARG = -2,        /* null pointer or value out of its stated range */
    PFL_ERR_MEMORY = -3,     /* arena null, misaligned or too small */
    PFL_ERR_CONFIG = -4,     /* a field of the configuration is out of range or not finite */
    PFL_ERR_ABI = -5,        /* configuration made for another version of the headers */
    PFL_ERR_TIME = -6,       /* time stamp before, or (update) different from, the filter's time */
    PFL_ERR_GAP = -7,        /* time step longer than dt_max_us allows */
    PFL_ERR_SENSOR = -8,     /* no such sensor */
    PFL_ERR_NONFINITE = -9,  /* a callback produced NaN or infinity */
    PFL_ERR_LOGLIK = -10,    /* a log-likelihood above PFL_LOGLIK_MAX: zero must be a perfect match */
    PFL_ERR_BUDGET = -11,    /* cycle budget spent before the measurement was in: not fused */
    PFL_ERR_BUSY = -12,      /* called from inside one of the filter's own callbacks */
    PFL_ERR_CORRUPT = -13,   /* not a live filter, or a damaged snapshot */
    PFL_ERR_SELF_TEST = -14, /* this build does not compute the known answers */
    PFL_ERR_NO_DRAW = -15    /* needs the draw callback, and the configuration has none */
} pfl_status_t;

/* Short English text for a status; a fixed string, never null, also for values outside the enumeration. O(1). */
const char *pfl_status_string(pfl_status_t status);

#ifdef __cplusplus
}
#endif

#endif
