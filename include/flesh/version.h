/* version.h: the version of the library.
 *
 * Of MAJOR.MINOR.PATCH the first changes where programs must be compiled anew, and with it the name
 * that they load, libflesh.so.MAJOR; while it is 0, MINOR does so too. test/tree/abi.txt lists what
 * a version exports. What returns no status cannot fail. */
#ifndef FLESH_VERSION_H
#define FLESH_VERSION_H

#include "flesh/status.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Of the headers. */
#define FLESH_VERSION_MAJOR 0
#define FLESH_VERSION_MINOR 2
#define FLESH_VERSION_PATCH 0
#define FLESH_VERSION_STRING "0.2.0"

/* Of the library that is loaded, "MAJOR.MINOR.PATCH": FLESH_VERSION_STRING where it goes with the
 * headers. Never NULL; lasts as long as the program. */
FLESH_API const char *flesh_version(void);

#ifdef __cplusplus
}
#endif
#endif
