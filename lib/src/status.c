/* The texts of the statuses. */
#include "pflight/status.h"

const char *pfl_status_string(pfl_status_t status)
{
    switch (status) {
    case PFL_OK:
        return "ok";
    case PFL_DEFERRED:
        return "measurement fused, moments or resampling deferred by the cycle budget";
    case PFL_QUARANTINED:
        return "predict done, non-finite particles lost their weight";
    case PFL_REJECTED:
        return "measurement rejected";
    case PFL_ERR_ARG:
        return "argument null or out of range";
    case PFL_ERR_MEMORY:
        return "memory null, misaligned or too small";
    case PFL_ERR_CONFIG:
        return "configuration out of range or not finite";
    case PFL_ERR_ABI:
        return "configuration for another version of the headers";
    case PFL_ERR_TIME:
        return "time stamp does not fit the filter's time";
    case PFL_ERR_GAP:
        return "time step too long";
    case PFL_ERR_SENSOR:
        return "no such sensor";
    case PFL_ERR_NONFINITE:
        return "a callback produced NaN or infinity";
    case PFL_ERR_LOGLIK:
        return "log-likelihood above zero";
    case PFL_ERR_BUDGET:
        return "cycle budget spent, measurement not fused";
    case PFL_ERR_BUSY:
        return "called from inside a callback of the same filter";
    case PFL_ERR_CORRUPT:
        return "not a live filter or a damaged snapshot";
    case PFL_ERR_SELF_TEST:
        return "self-test failed: this build does not compute the known answers";
    case PFL_ERR_NO_DRAW:
        return "the configuration has no draw callback";
    default:
        return "unknown status";
    }
}
