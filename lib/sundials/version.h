/* version.h: whether the SUNDIALS that is loaded is the one that this was compiled for. */
#ifndef FLESH_SUNDIALS_VERSION_H
#define FLESH_SUNDIALS_VERSION_H

/* FLESH_OK, or FLESH_ERR_SUNDIALS with words. Whatever makes objects of SUNDIALS asks first: minor releases share a
 * soname and not the layout of structs, so that a loader takes either. */
int flesh_sundials_check(void);

#endif
