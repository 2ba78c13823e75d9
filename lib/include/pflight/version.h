/* The version of these sources. docs/versioning.md says what a change of each number promises. */
#ifndef PFLIGHT_VERSION_H
#define PFLIGHT_VERSION_H

/* As one number to compare, and its parts. */
#define PFL_VERSION_MAJOR 0
#define PFL_VERSION_MINOR 1
#define PFL_VERSION_PATCH 0
#define PFL_VERSION "0.1.0" /* the three */
#define PFL_VERSION_NUMBER                                                                                             \
    ((PFL_VERSION_MAJOR * 10000) + (PFL_VERSION_MINOR * 100) + PFL_VERSION_PATCH) /* to compare */

#endif
