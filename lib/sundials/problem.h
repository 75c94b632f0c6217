/* problem.h: a Newton iteration with what its SUNDIALS matrices need: what the callbacks, the linear solver and
 * KINSOL's owner share. */
#ifndef FLESH_SUNDIALS_PROBLEM_H
#define FLESH_SUNDIALS_PROBLEM_H

#include "flesh/kinsol.h"
#include "newton/newton.h"
#include "linear/scalar_view.h"
#include "sundials/vector.h"

struct flesh_problem {
  flesh_user_data head; /* first */
  flesh_newton newton;
  flesh_scalar_view view; /* made when a sparse SUNMatrix is first filled */
  int staged; /* it has a stage */
  double *room[3]; /* [n] each, for vectors of N_VNew_Parallel; NULL: the system is that of one rank */
  int zeroed; /* SUNDIALS wants the SUNMatrix to be 0 until the next assembly; K itself is left alone */
};

/* The two halves of flesh_problem_create, as flesh_newton_init_local and _collective, with what solves subdomains (none:
 * nonlinear elimination is not there). To be destroyed also if one fails. */
int flesh_problem_create_local(const flesh_system *system, const flesh_solver_options *options,
                               flesh_stage_solver solver, flesh_problem **problem);
int flesh_problem_create_collective(const flesh_system *system, int status, flesh_problem *problem);
/* A problem whose `newton` is initialised later, and maybe cleared and initialised again. */
int flesh_problem_create_empty(flesh_problem **problem);
/* Whether J is the view of the problem's K, of flesh_sunmatrix_create. */
int flesh_problem_owns_matrix(const flesh_problem *problem, SUNMatrix J);
/* Like flesh_vector_read, _open and _close, with the problem's room of that number. */
const double *flesh_problem_read(const flesh_problem *problem, N_Vector v, int partial, int room);
double *flesh_problem_open(const flesh_problem *problem, N_Vector v, int room);
void flesh_problem_close(const flesh_problem *problem, N_Vector v, const double *written);

#endif
