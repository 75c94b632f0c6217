/* version.h: the version of the library.
 *
 * In MAJOR.MINOR.PATCH, MAJOR changes when programs must be recompiled, MINOR when functions are added. While MAJOR
 * is 0, MINOR stands for MAJOR and PATCH for MINOR. The soname, the name that programs load, follows:
 * libflesh.so.MAJOR, and libflesh.so.0.MINOR while MAJOR is 0. test/tree/abi.txt lists what a version exports.
 * Functions that return no status cannot fail. */
#ifndef FLESH_VERSION_H
#define FLESH_VERSION_H

#include "flesh/status.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Version of the headers. */
#define FLESH_VERSION_MAJOR 0
#define FLESH_VERSION_MINOR 3
#define FLESH_VERSION_PATCH 0
#define FLESH_VERSION_STRING "0.3.0"

/* Returns the version of the loaded library, "MAJOR.MINOR.PATCH": FLESH_VERSION_STRING if it goes with the headers.
 * Never NULL; lasts as long as the program. */
FLESH_API const char *flesh_version(void);

#ifdef __cplusplus
}
#endif
#endif
