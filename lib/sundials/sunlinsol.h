/* sunlinsol.h: what flesh's SUNLinearSolver objects have in common. */
#ifndef FLESH_SUNDIALS_SUNLINSOL_H
#define FLESH_SUNDIALS_SUNLINSOL_H

#include <stddef.h>
#include <sundials/sundials_linearsolver.h>

/* First member of every such solver's content. */
typedef struct flesh_linear_solver_report {
  SUNLinearSolver_Type type;
  int last_flag;   /* a flesh_status */
  int ready;       /* the last set-up succeeded; not kept for KINSOL */
  int iterations;  /* of the last solve; direct solvers: 0 */
  double residual; /* at its end */
} flesh_linear_solver_report;

/* A solver with a zeroed content of `size` bytes, and the operations that read its report. Returns new. */
int flesh_sunlinsol_make(size_t size, SUNLinearSolver_Type type, SUNContext context, SUNLinearSolver *solver);

/* Keeps the status and returns it as IDA, CVODE and ARKODE know it: they take what they do not know for success,
 * whatever its sign. */
int flesh_sunlinsol_flag(flesh_linear_solver_report *report, int status);

/* Keeps and returns the status of a set-up likewise. */
int flesh_sunlinsol_flag_setup(flesh_linear_solver_report *report, int status);

/* FLESH_ERR_ARGUMENT, with words, if the last set-up failed or there was none. */
int flesh_sunlinsol_ready(const flesh_linear_solver_report *report);

#endif
