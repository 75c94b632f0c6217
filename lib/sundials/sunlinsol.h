/* sunlinsol.h: common parts of flesh's SUNLinearSolver objects. */
#ifndef FLESH_SUNDIALS_SUNLINSOL_H
#define FLESH_SUNDIALS_SUNLINSOL_H

#include <stddef.h>
#include <sundials/sundials_linearsolver.h>

/* First member of every such solver's content. */
typedef struct flesh_linear_solver_report {
  SUNLinearSolver_Type type;
  int last_flag;   /* a flesh_status */
  int ready;       /* 1: the last set-up succeeded; not kept for KINSOL */
  int iterations;  /* iterations of the last solve; direct solvers: 0 */
  double residual; /* residual at its end */
} flesh_linear_solver_report;

/* Makes a solver with a zeroed content of `size` bytes, and the operations that read its report. Returns new. */
int flesh_sunlinsol_make(size_t size, SUNLinearSolver_Type type, SUNContext context, SUNLinearSolver *solver);

/* Keeps the status and returns a code that IDA, CVODE and ARKODE know: they take unknown codes for success, whatever their
 * sign. */
int flesh_sunlinsol_flag(flesh_linear_solver_report *report, int status);

/* Keeps and returns the status of a set-up in the same way. */
int flesh_sunlinsol_flag_setup(flesh_linear_solver_report *report, int status);

/* Checks that the last set-up succeeded. FLESH_ERR_ARGUMENT, with a sentence, if it failed or there was none. */
int flesh_sunlinsol_ready(const flesh_linear_solver_report *report);

#endif
