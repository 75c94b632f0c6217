/* ida_failure.c: reports steps of IDA that fail. */
#include <stdio.h>

#include "base/error.h"
#include "parallel/body_figures.h"
#include "sundials/compatibility.h"
#include "time/ida.h"

/* Finds the node with the largest weighted local error (or Newton correction) of the last attempt; on ranks by its
 * number in the whole body, the last one of equals. */
static int worst_node(flesh_ida_steps *self)
{
  if (IDAGetEstLocalErrors(self->ida, self->errors)) return -1;
  return flesh_evaluation_worst_node(self->evaluation, 2, N_VGetArrayPointer(self->errors),
                                     N_VGetArrayPointer(self->atol));
}

void flesh_ida_steps_record_failure(flesh_ida_steps *self, double t, const double *x, int status)
{
  flesh_failure *f = &self->failure;
  *f = (flesh_failure){.status = status, .t = t, .worst_node = -1};
  if (self->running) {
    IDAGetCurrentStep(self->ida, &f->h);
    IDAGetCurrentOrder(self->ida, &f->order);
    f->worst_node = worst_node(self);
  }
  f->worst_tet = flesh_body_worst_tet(flesh_system_mesh(self->system), self->team, x, &f->worst_J, f->worst_position);
}

int flesh_ida_steps_fail(flesh_ida_steps *self, double t, const double *x, int status, const char *cause)
{
  const flesh_failure *f = &self->failure;
  char attempt[64] = "", node[48] = "";
  flesh_ida_steps_record_failure(self, t, x, status);
  if (self->running) {
    snprintf(attempt, sizeof attempt, " with h = %.3g s and order %d", f->h, f->order);
    snprintf(node, sizeof node, "largest error at node %d; ", f->worst_node);
  }
  self->running = 0;
  return flesh_fail(FLESH_ERR_INTEGRATOR, "at t = %.9g s%s: %s; %ssmallest J = %.3g in tet %d at (%.4g, %.4g, %.4g)",
                    f->t, attempt, cause, node, f->worst_J, f->worst_tet, f->worst_position[0],
                    f->worst_position[1], f->worst_position[2]);
}

int flesh_ida_steps_fail_start(flesh_ida_steps *self, const flesh_state *state, int status)
{
  char cause[160];
  self->running = 0;
  snprintf(cause, sizeof cause, "the motion cannot start: %s", flesh_status_text(status));
  return flesh_ida_steps_fail(self, state->t, state->x, status, cause);
}

int flesh_ida_steps_fail_by_flag(flesh_ida_steps *self, int flag)
{
  const double t = self->t_internal, *x = self->problem->evaluation.x; /* order of the last attempt */
  if (self->problem->refused < 0) { /* fatal; the sentence is recorded already */
    self->running = 0;
    return self->problem->refused;
  }
  switch (flag) {
  case IDA_ERR_FAIL:
    return flesh_ida_steps_fail(self, t, x, FLESH_NOT_CONVERGED,
                                "the error test failed again and again down to this step");
  case IDA_CONV_FAIL:
  case IDA_LSOLVE_FAIL:
  case IDA_LSETUP_FAIL:
    return flesh_ida_steps_fail(self, t, x, FLESH_NOT_CONVERGED,
                                "Newton's iterations failed again and again down to this step");
  case IDA_REP_RES_ERR:
  case IDA_FIRST_RES_FAIL:
  case IDA_RES_FAIL:
    return flesh_ida_steps_fail(self, t, x, self->problem->refused ? self->problem->refused : FLESH_NONFINITE,
                "the residual had no value down to this step");
  case IDA_MEM_FAIL:
    return flesh_fail(FLESH_ERR_MEMORY, "IDA ran out of memory");
  case IDA_ILL_INPUT:
  case IDA_TOO_MUCH_ACC:
    return flesh_ida_steps_fail(self, t, x, FLESH_NOT_CONVERGED, "the tolerance is below what rounding allows");
  }
  self->running = 0;
  return flesh_fail(FLESH_ERR_SUNDIALS, "IDA stopped at t = %.9g s with its status %d", t, flag);
}
