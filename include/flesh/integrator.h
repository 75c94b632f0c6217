/* integrator.h: time stepping and statics. An integrator owns its KINSOL; states are plain data. */
#ifndef FLESH_INTEGRATOR_H
#define FLESH_INTEGRATOR_H

#include <stddef.h>

#include "flesh/solver.h"
#include "flesh/system.h"

#ifdef __cplusplus
extern "C" {
#endif

/* {t, x, v}: owned by the caller, passed along. x, v [3*n]. */
typedef struct flesh_state {
  double t;
  double *x, *v;
} flesh_state;

typedef enum flesh_method { FLESH_METHOD_BACKWARD_EULER, FLESH_METHOD_STATIC } flesh_method;

/* Everything known when a step could not be taken. */
typedef struct flesh_failure {
  int status;       /* of the last attempt */
  double t, h;      /* where it was tried last */
  int halvings;     /* how deep */
  double residual, target;
  int worst_tet;    /* smallest J at the last iterate, or -1 */
  double worst_J, worst_position[3];
  int worst_node;   /* largest residual at the last iterate, or -1 */
} flesh_failure;

typedef struct flesh_integrator flesh_integrator;

/* Borrows `system`, which must be finished. Returns new. */
FLESH_API int flesh_integrator_create(const flesh_system *system, flesh_method method,
                                      const flesh_solver_options *options,
                                      flesh_integrator **integrator);
FLESH_API void flesh_integrator_destroy(flesh_integrator **integrator);
FLESH_API flesh_method flesh_integrator_method(const flesh_integrator *integrator);

/* Takes the state from t to t+h (backward Euler: retried in halves when a solve fails; statics:
 * equilibrium at t+h, the load raised in increments when the full one fails), adding to *stats (may
 * be NULL). On failure (FLESH_ERR_SOLVE) the state is that of the last success, t included. */
FLESH_API int flesh_integrator_step(flesh_integrator *integrator, flesh_state *state, double h,
                                    flesh_solve_stats *stats);

/* Of the last failed step. */
FLESH_API const flesh_failure *flesh_integrator_failure(const flesh_integrator *integrator);

/* Bytes held by the integrator by now. */
FLESH_API size_t flesh_integrator_memory(const flesh_integrator *integrator);

#ifdef __cplusplus
}
#endif
#endif
