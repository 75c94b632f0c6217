/* version.c: compares the loaded SUNDIALS with its headers. */
#include "sundials/version.h"

#include <sundials/sundials_version.h>

#include "base/error.h"
#include "flesh/sundials_abi.h"

int flesh_sundials_check(void)
{
  int major = 0, minor = 0, patch = 0;
  char label[32] = "";
  const int failed = SUNDIALSGetVersionNumber(&major, &minor, &patch, label, sizeof label);
  if (!failed && major == SUNDIALS_VERSION_MAJOR && minor == SUNDIALS_VERSION_MINOR) return FLESH_OK;
  return flesh_fail(FLESH_ERR_SUNDIALS,
                    "the loaded SUNDIALS is %d.%d.%d, but flesh was built with %s; start the program with the "
                    "folder of that version's libraries first in LD_LIBRARY_PATH",
                    major, minor, patch, FLESH_SUNDIALS_VERSION);
}
