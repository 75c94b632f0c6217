/* linear_solver.h: kinds of linear solvers and preconditioners.
 * Functions that return no status cannot fail. */
#ifndef FLESH_LINEAR_SOLVER_H
#define FLESH_LINEAR_SOLVER_H

#include "flesh/status.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum flesh_linear_solver {
  FLESH_LINEAR_PCG,
  FLESH_LINEAR_KLU,
  FLESH_LINEAR_CHOLMOD /* only where built in */
} flesh_linear_solver;

typedef enum flesh_preconditioner {
  /* Two-level, or IC on meshes of a few hundred nodes, with the volume projection when that takes less work. */
  FLESH_PRECONDITIONER_AUTO,
  FLESH_PRECONDITIONER_TWO_LEVEL, /* IC, plus displacements that are trilinear in the cells of a grid */
  FLESH_PRECONDITIONER_IC,        /* incomplete Cholesky on 3x3 blocks, no fill */
  FLESH_PRECONDITIONER_JACOBI, /* inverse of the diagonal blocks */
  FLESH_PRECONDITIONER_NONE,
  /* Projects the stiff volume terms of nearly incompressible ten-node tets out, and preconditions the rest as AUTO
   * does. The same as AUTO without such terms, and with IDA, CVODE and ARKODE. */
  FLESH_PRECONDITIONER_VOLUME_PROJECTION
} flesh_preconditioner;

/* Returns the kind's name in a scene. NULL: no such kind. */
FLESH_API const char *flesh_preconditioner_name(flesh_preconditioner kind);

#ifdef __cplusplus
}
#endif
#endif
