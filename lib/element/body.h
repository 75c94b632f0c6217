/* body.h: what a body must have. */
#ifndef FLESH_ELEMENT_BODY_H
#define FLESH_ELEMENT_BODY_H

#include "flesh/body.h"

/* FLESH_ERR_ARGUMENT where a tet's density is not positive and finite. */
int flesh_body_check_density(const flesh_body *body);

#endif
