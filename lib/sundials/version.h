/* version.h: checks that the loaded SUNDIALS is the one that this library was compiled for. */
#ifndef FLESH_SUNDIALS_VERSION_H
#define FLESH_SUNDIALS_VERSION_H

/* Checks the loaded version. FLESH_OK, or FLESH_ERR_SUNDIALS with a sentence. Call it before making objects of SUNDIALS:
 * minor releases share a soname and not the layout of structs, so that a loader takes either. */
int flesh_sundials_check(void);

#endif
