/* ode.h: the equations of motion as y' = f(t, y) with SUNDIALS' own signatures, for a program that owns its CVODE or
 * ARKODE.
 *
 * The unknown is y = (x, v) [2*3*n], positions before velocities, and f has the rows
 *
 *   of a free dof          x' = v                                  [m/s]
 *                          v' = -M^-1 r(t, x, v, a = 0)            [m/s^2]
 *   of a constrained dof   x' = prescribed velocity at t
 *                          v' = prescribed acceleration at t
 *
 * r is the sum of all effects; prescribed values of constrained dofs are read from the system, never from y. M = dr/da
 * is computed at the start and must not change with t, x and v, as holds for all effects of the library. M^-1 is a
 * division for lumped mass and a linear solve for consistent mass, both on the free dofs only.
 *
 * As with ida.h, a start is valid up to the next event:
 *
 *   flesh_ode_problem_create(system, &options, &problem);
 *   y = N_VNew_Serial(2*3*n, context);                  atol = N_VClone(y);
 *   flesh_ode_start(problem, &state, y);
 *   flesh_ode_tolerances(problem, 1e-6, atol);
 *   CVodeInit(cvode, flesh_ode_rhs, state.t, y);            later: CVodeReInit(cvode, state.t, y)
 *   CVodeSVtolerances(cvode, 0.0, atol);                absolute: rtol |x| depends on the origin
 *   CVodeSetUserData(cvode, problem);
 *   flesh_ode_sunmatrix_create(problem, context, &A);
 *   flesh_ode_sunlinsol_create(problem, context, &solver);
 *   CVodeSetLinearSolver(cvode, solver, A);             CVodeSetJacFn(cvode, flesh_ode_jacobian);
 *   CVodeSetStopTime(cvode, flesh_ode_event(problem));  where that is finite
 *   CVode(cvode, t_out, y, &t, CV_NORMAL);              as often as wanted, without a new start
 *   flesh_ode_get_state(problem, t, y, &state);  CV_TSTOP_RETURN: repeat from flesh_ode_start
 *
 * Matrix-free solvers, such as SUNLinSol_SPGMR(y, SUN_PREC_LEFT, 20, context), take
 *
 *   CVodeSetLinearSolver(cvode, solver, NULL);
 *   CVodeSetPreconditioner(cvode, flesh_ode_preconditioner_setup, flesh_ode_preconditioner_solve);
 *   CVodeSetJacTimes(cvode, flesh_ode_jacobian_times_setup, flesh_ode_jacobian_times);
 *
 * ARKODE: ERKStepCreate(flesh_ode_rhs, ...) for explicit steps, ARKStepCreate(NULL, flesh_ode_rhs, ...) for implicit
 * ones, with the same functions in the slots named ARKStepSet... or ARKodeSet.... Explicit methods are stable for steps
 * of at most about the time that sound takes through the smallest tet. Implicit methods need
 * ARKodeSetNonlinCRDown(arkode, 1), before 7.1 ARKStepSetNonlinCRDown: SUNDIALS 6.4 to 7.5 keeps a rate of convergence
 * of Newton's iteration from earlier stages, which may fall to 0.3 of itself in every iteration. If stages were easy, as
 * in a free fall, the rate becomes so small that later stages end at their first iterate, which ARKODE's error test does
 * not notice: errors were hundreds of tolerances. CVODE's and IDA's error tests measure the iteration's own correction.
 *
 * MRIStep and implicit-explicit methods take f as a sum of two terms: use two problems on two systems, each with some of
 * the effects and both with inertia and all constraints. As x' = v is in both terms, a function around flesh_ode_rhs
 * must set the x' of one to 0.
 *
 * SPRKStep (SUNDIALS from 6.6 on) takes a function for v' and one for x': both are flesh_ode_rhs, with the other half
 * set to 0. If no force depends on velocities its steps are symplectic: the error of the energy stays of their order for
 * all time.
 *
 * user_data and vectors are as in kinsol.h: user_data is the problem or a struct whose first member points to it;
 * vectors are serial, OpenMP or Pthreads, of length 2*3*n. For a part of a body (flesh_system_set_part) vectors are
 * those of N_VNew_Parallel: each rank has x of the part's own nodes, then v of these, and the global length is 2*3
 * for each node of the whole body. Everything here is then collective, except creating and freeing matrices and
 * solvers, and a SUNSparseMatrix is not supported. Functions that return no status cannot fail. */
#ifndef FLESH_ODE_H
#define FLESH_ODE_H

#include "flesh/sundials_abi.h" /* before the headers that it checks */

#include <sundials/sundials_linearsolver.h>
#include <sundials/sundials_matrix.h>
#include <sundials/sundials_nvector.h>
#include <sundials/sundials_types.h>

#include "flesh/kinsol.h"
#include "flesh/state.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The callbacks' `user_data`, or the first member of the struct that is their `user_data`. */
typedef struct flesh_ode_problem flesh_ode_problem;

/* Creates a problem for a finished system with inertia, which is borrowed, and options, which are copied. Of the
 * options, linear_tolerance, max_linear, linear_solver, preconditioner, eigenvalue_filter (a filter whose name ends
 * in ALWAYS clamps negative eigenvalues in the matrix and the preconditioner, not in products) and threads are used,
 * but all are checked: begin with flesh_solver_options_default. Returns new. Errors: FLESH_ERR_ARGUMENT,
 * FLESH_ERR_MEMORY, FLESH_ERR_SUNDIALS. */
FLESH_API int flesh_ode_problem_create(const flesh_system *system,
                                       const flesh_solver_options *options,
                                       flesh_ode_problem **problem);
FLESH_API void flesh_ode_problem_destroy(flesh_ode_problem **problem);

/* Makes a vector y as flesh_ida_vector_create does. Returns new, freed by N_VDestroy.
 * Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
FLESH_API int flesh_ode_vector_create(const flesh_ode_problem *problem, SUNContext context,
                                      N_Vector *y);

/* Starts from the state: y = (x, v), where constrained dofs take their prescribed positions and velocities as in
 * flesh_ida_start. FLESH_UNDEFINED or FLESH_NONFINITE if r has no value. Further errors: FLESH_ERR_ARGUMENT,
 * FLESH_ERR_MEMORY, FLESH_ERR_NONFINITE. */
FLESH_API int flesh_ode_start(flesh_ode_problem *problem, const flesh_state *state, N_Vector y);

/* Returns the time of the next event, up to which the start is valid; INFINITY if there is none. */
FLESH_API double flesh_ode_event(const flesh_ode_problem *problem);

/* Sets the tolerances of y as flesh_ida_tolerances does. Errors: FLESH_ERR_ARGUMENT. */
FLESH_API int flesh_ode_tolerances(const flesh_ode_problem *problem, double tolerance,
                                   N_Vector atol);

/* Fills the caller's state from y at t; constrained dofs get their exact values. FLESH_ERR_ARGUMENT also for a t
 * after the event: y was then integrated past it. */
FLESH_API int flesh_ode_get_state(flesh_ode_problem *problem, double t, N_Vector y,
                                  flesh_state *state);

/* A CVRhsFn and ARKRhsFn: computes f(t, y). > 0 if an energy is undefined or a number is not finite. Errors:
 * FLESH_UNDEFINED, FLESH_NONFINITE, FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
FLESH_API int flesh_ode_rhs(sunrealtype t, N_Vector y, N_Vector ydot, void *problem);

/* A CVLsJacFn and ARKLsJacFn: writes df/dy into a matrix of flesh_ode_sunmatrix_create, for any mass, or into a 2*3*n
 * square SUNSparseMatrix (CSC) with room for flesh_ode_entries() entries, for SUNLinSol_KLU. FLESH_ERR_ARGUMENT for a
 * SUNSparseMatrix if the mass couples dofs (consistent mass), as df/dy is then full. The entries are -1 if they are
 * too many for SUNDIALS' 32-bit indices. fy, w1, w2 and w3 are not used. Further errors: FLESH_UNDEFINED,
 * FLESH_NONFINITE, FLESH_ERR_MEMORY. */
FLESH_API int flesh_ode_jacobian(sunrealtype t, N_Vector y, N_Vector fy, SUNMatrix J, void *problem,
                                 N_Vector w1, N_Vector w2, N_Vector w3);
FLESH_API sunindextype flesh_ode_entries(const flesh_ode_problem *problem);

/* Creates df/dy, stored as K = dr/dx, C = dr/dv and the mass, as a SUNMatrix with all operations except
 * SUNMatMatvecSetup (products need none), so that CVODE and ARKODE keep a copy of it and compute I - gamma df/dy from
 * it when only gamma has changed. It owns memory for two block matrices. Freed by SUNMatDestroy; the problem must
 * outlive it. Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
FLESH_API int flesh_ode_sunmatrix_create(flesh_ode_problem *problem, SUNContext context,
                                         SUNMatrix *matrix);

/* Creates a SUNLinearSolver for that matrix, which eliminates one half: (M + gamma C + gamma^2 K) w = gamma M b2 -
 * gamma^2 K b1, v = w/gamma, x = w + b1, by the options' PCG (type matrix-iterative: to the tolerance that CVODE or
 * ARKODE asks for, in its weighted norm, with iterations reported), KLU or CHOLMOD (type direct). A solve returns >
 * 0, so that the step is shortened, if the matrix is not positive definite or PCG does not converge. Freed by
 * SUNLinSolFree; the problem must outlive it, and must not be used by a preconditioner meanwhile. Errors:
 * FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
FLESH_API int flesh_ode_sunlinsol_create(flesh_ode_problem *problem, SUNContext context,
                                         SUNLinearSolver *solver);

/* A CVLsJacTimesSetupFn and ARKLsJacTimesSetupFn, which assembles at (t, y), and a CVLsJacTimesVecFn and
 * ARKLsJacTimesVecFn, which computes Jv = (df/dy) v there. fy and tmp are not used. Errors: FLESH_UNDEFINED,
 * FLESH_NONFINITE, FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
FLESH_API int flesh_ode_jacobian_times_setup(sunrealtype t, N_Vector y, N_Vector fy, void *problem);
FLESH_API int flesh_ode_jacobian_times(N_Vector v, N_Vector Jv, sunrealtype t, N_Vector y,
                                       N_Vector fy, void *problem, N_Vector tmp);

/* A CVLsPrecSetupFn and ARKLsPrecSetupFn, and a CVLsPrecSolveFn and ARKLsPrecSolveFn: approximate solves with I -
 * gamma df/dy, one half eliminated, (M + gamma C + gamma^2 K) dv = ..., by one application of the options'
 * preconditioner, or a direct solve if the options name one. > 0 if that matrix is not positive definite. Left or
 * right. Errors: FLESH_NOT_POSITIVE, FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
FLESH_API int flesh_ode_preconditioner_setup(sunrealtype t, N_Vector y, N_Vector fy,
                                             flesh_sunboolean jok, flesh_sunboolean *jcur,
                                             sunrealtype gamma, void *problem);
FLESH_API int flesh_ode_preconditioner_solve(sunrealtype t, N_Vector y, N_Vector fy, N_Vector r,
                                             N_Vector z, sunrealtype gamma, sunrealtype delta,
                                             int lr, void *problem);

/* Returns the counts since creation, which the caller may zero. Owned by the problem. */
FLESH_API flesh_solve_stats *flesh_ode_stats(flesh_ode_problem *problem);

#ifdef __cplusplus
}
#endif
#endif
