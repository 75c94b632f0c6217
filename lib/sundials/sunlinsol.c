/* sunlinsol.c: common parts of flesh's SUNLinearSolver objects. */
#include "sundials/sunlinsol.h"

#include <stdlib.h>

#include "base/error.h"
#include "sundials/compatibility.h"

static const flesh_linear_solver_report *report_of(SUNLinearSolver S) { return S->content; }

static SUNLinearSolver_Type solver_type(SUNLinearSolver S) { return report_of(S)->type; }

static int solver_initialize(SUNLinearSolver S)
{
  ((flesh_linear_solver_report *)S->content)->last_flag = 0;
  return 0;
}

static int solver_iterations(SUNLinearSolver S) { return report_of(S)->iterations; }

static sunrealtype solver_residual_norm(SUNLinearSolver S) { return report_of(S)->residual; }

static sunindextype solver_last_flag(SUNLinearSolver S) { return report_of(S)->last_flag; }

static int solver_free(SUNLinearSolver S)
{
  if (!S) return 0;
  free(S->content);
  S->content = NULL;
  SUNLinSolFreeEmpty(S);
  return 0;
}

int flesh_sunlinsol_make(size_t size, SUNLinearSolver_Type type, SUNContext context, SUNLinearSolver *solver)
{
  SUNLinearSolver S = SUNLinSolNewEmpty(context);
  flesh_linear_solver_report *content = calloc(1, size);
  if (!S || !content) {
    free(content);
    if (S) SUNLinSolFreeEmpty(S);
    return flesh_fail(FLESH_ERR_MEMORY, "no memory for a SUNLinearSolver");
  }
  content->type = type;
  S->content = content;
  S->ops->gettype = solver_type;
  S->ops->initialize = solver_initialize;
  S->ops->lastflag = solver_last_flag;
  S->ops->free = solver_free;
  if (type != SUNLINEARSOLVER_DIRECT) {
    S->ops->numiters = solver_iterations;
    S->ops->resnorm = solver_residual_norm;
  }
  *solver = S;
  return FLESH_OK;
}

int flesh_sunlinsol_flag(flesh_linear_solver_report *report, int status)
{
  report->last_flag = status;
  return status == FLESH_OK ? FLESH_SUN_SUCCESS : status > 0 ? SUNLS_CONV_FAIL : FLESH_SUNLS_FATAL;
}

int flesh_sunlinsol_flag_setup(flesh_linear_solver_report *report, int status)
{
  report->ready = !status;
  return flesh_sunlinsol_flag(report, status);
}

int flesh_sunlinsol_ready(const flesh_linear_solver_report *report)
{
  return report->ready ? FLESH_OK : flesh_fail(FLESH_ERR_ARGUMENT, "SUNLinSolSolve needs a set-up that succeeded before it");
}
