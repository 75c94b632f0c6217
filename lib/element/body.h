/* body.h: checks of a body. */
#ifndef FLESH_ELEMENT_BODY_H
#define FLESH_ELEMENT_BODY_H

#include "base/error.h"
#include "flesh/body.h"

/* Begins a constructor of effects: FLESH_NEED for its arguments, among them the body, and for `effect`, which becomes
 * NULL; then checks the body. */
#define FLESH_NEED_BODY(...)                                                              \
  do {                                                                                    \
    FLESH_NEED({effect, "effect"});                                                       \
    *effect = NULL;                                                                       \
    FLESH_NEED(__VA_ARGS__);                                                              \
    const int flesh_body_status = flesh_body_check(body);                                 \
    if (flesh_body_status) return flesh_body_status;                                      \
  } while (0)

/* Fails with FLESH_ERR_ARGUMENT for a body without a mesh, with a mass or an element that is unknown or does not fit
 * the mesh, with a tet that has no material or one whose constants are not numbers, or with parts that are not runs of
 * tets or that overlap. Densities are checked by the code that reads them. */
int flesh_body_check(const flesh_body *body);

/* Fails with FLESH_ERR_ARGUMENT if there are no densities, or one is not positive and finite. */
int flesh_body_check_density(const flesh_body *body);

#endif
