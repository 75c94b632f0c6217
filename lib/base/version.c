/* version.c: the version of the library that is loaded. */
#include "flesh/version.h"

const char *flesh_version(void) { return FLESH_VERSION_STRING; }
