/* tets.h: forces of a body torn into its tets, with two values of a constant in each tet. */
#ifndef FLESH_SENSITIVITY_TETS_H
#define FLESH_SENSITIVITY_TETS_H

#include "flesh/sensitivity.h"
#include "sensitivity/coupling.h"

typedef struct flesh_varied_tets {
  const flesh_tet_parameter *parameter; /* borrowed */
  flesh_torn_body torn_body;
  flesh_system *systems[2];
  double *r[2]; /* [3*nodes of the torn body] their residuals */
} flesh_varied_tets;

/* Tears the bodies of a parameter, with those of `effects` (NULL: none) that depend on their materials besides elasticity.
 * Clear it also after a failure. FLESH_ERR_ARGUMENT for bodies of different meshes; FLESH_ERR_MEMORY. */
int flesh_varied_tets_open(const flesh_tet_parameter *parameter, const flesh_system *effects, flesh_varied_tets *varied);
void flesh_varied_tets_clear(flesh_varied_tets *varied);
/* Finds both residuals at a point of the whole body. FLESH_ERR_SOLVE where one has no value. */
int flesh_varied_tets_set(flesh_varied_tets *varied, const flesh_point *point);
/* Subtracts lambda [3*n] . dr/dp of each tet from gradient [tets]. */
void flesh_varied_tets_add(const flesh_varied_tets *varied, const double *lambda, double *gradient);

#endif
