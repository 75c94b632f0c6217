/* sunlinsol.h: what flesh's SUNLinearSolver objects have in common. */
#ifndef FLESH_SUNDIALS_SUNLINSOL_H
#define FLESH_SUNDIALS_SUNLINSOL_H

#include <stddef.h>
#include <sundials/sundials_linearsolver.h>

/* First member of every such solver's content. */
typedef struct flesh_linear_solver_report {
  SUNLinearSolver_Type type;
  int last_flag;   /* a flesh_status */
  int iterations;  /* of the last solve; direct solvers: 0 */
  double residual; /* at its end */
} flesh_linear_solver_report;

/* A solver with a zeroed content of `size` bytes, and the operations that read its report. Returns new. */
int flesh_sunlinsol_make(size_t size, SUNLinearSolver_Type type, SUNContext context, SUNLinearSolver *solver);

/* Keeps the status and returns it as IDA, CVODE and ARKODE know it: they take what they do not know for success,
 * whatever its sign. */
int flesh_sunlinsol_flag(flesh_linear_solver_report *report, int status);

#endif
