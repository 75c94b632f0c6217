/* body.h: what a body must have. */
#ifndef FLESH_ELEMENT_BODY_H
#define FLESH_ELEMENT_BODY_H

#include "base/error.h"
#include "flesh/body.h"

/* Begins a constructor of effects: FLESH_NEED for its arguments, body among them, and for `effect`, which is NULL from here
 * on; the body must be one that effects can be made of. */
#define FLESH_NEED_BODY(...)                                                              \
  do {                                                                                    \
    FLESH_NEED({effect, "effect"});                                                       \
    *effect = NULL;                                                                       \
    FLESH_NEED(__VA_ARGS__);                                                              \
    const int flesh_body_status = flesh_body_check(body);                                 \
    if (flesh_body_status) return flesh_body_status;                                      \
  } while (0)

/* FLESH_ERR_ARGUMENT where the body has no mesh, a mass or an element that is none or does not fit the mesh, a tet without a
 * material or with one whose constants are no numbers, or parts that are not runs of its tets, each tet in one at most.
 * Densities are checked by those who read them. */
int flesh_body_check(const flesh_body *body);

/* FLESH_ERR_ARGUMENT where there are no densities, or a tet's is not positive and finite. */
int flesh_body_check_density(const flesh_body *body);

#endif
