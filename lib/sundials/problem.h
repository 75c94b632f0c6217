/* problem.h: a Newton iteration and the data of its SUNDIALS matrices, for the callbacks, the linear solver and the owner
 * of KINSOL. */
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
  int staged; /* 1: it has a stage */
  double *room[3]; /* [n] each, for vectors of N_VNew_Parallel; NULL: the system is on one rank */
  int zeroed; /* 1: to SUNDIALS the SUNMatrix is 0 until the next assembly; K itself is unchanged */
};

/* Make a problem in two halves, as flesh_newton_init_local and flesh_newton_init_collective do, with a solver for
 * subdomains (none: no nonlinear elimination). Destroy the problem also if one of them fails. */
int flesh_problem_create_local(const flesh_system *system, const flesh_solver_options *options,
                               flesh_stage_solver solver, flesh_problem **problem);
int flesh_problem_create_collective(const flesh_system *system, int status, flesh_problem *problem);
/* Makes a problem whose `newton` is initialised later, and possibly cleared and initialised again. */
int flesh_problem_create_empty(flesh_problem **problem);
/* Whether J is the view of the problem's K made by flesh_sunmatrix_create. */
int flesh_problem_owns_matrix(const flesh_problem *problem, SUNMatrix J);
/* Do what flesh_vector_read, _open and _close do, with the problem's `room` of that number. */
const double *flesh_problem_read(const flesh_problem *problem, N_Vector v, int partial, int room);
double *flesh_problem_open(const flesh_problem *problem, N_Vector v, int room);
void flesh_problem_close(const flesh_problem *problem, N_Vector v, const double *written);

#endif
