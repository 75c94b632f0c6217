/* ida.h: flesh's residual, Jacobian and linear solver with SUNDIALS' own signatures, for a program that owns its IDA.
 *
 * The unknown is y = (x, v) [2*3*n], positions before velocities, and F(t, y, y') has the rows
 *
 *   of a free dof          x' - v                                  [m/s]
 *                          r(t, x, v, a = v')                      [N], the sum of all effects
 *   of a constrained dof   x - (prescribed position at t)          [m]
 *                          v - (prescribed velocity at t)          [m/s]
 *
 * The effects are evaluated with the prescribed position, velocity and acceleration, so a constrained dof's entries of y
 * are read only in its own rows: the free dofs obey an ordinary differential equation, the constrained rows are
 * algebraic (index 1) and nothing depends on them, and the Jacobian stays symmetric. IDA tests Newton's convergence and
 * the error in the units of y, so the force rows need no scaling by the mass.
 *
 * At an event, prescribed motions, loads or the set of constrained dofs change abruptly (a keyframe, a release). A start
 * is valid up to the next event; start again there, or when the state was changed from outside:
 *
 *   flesh_ida_problem_create(system, &options, &problem);
 *   flesh_ida_vector_create(problem, context, &y);     yp = N_VClone(y);  atol = N_VClone(y);
 *   flesh_ida_start(problem, &state, y, yp);           consistent y'; no IDACalcIC
 *   flesh_ida_tolerances(problem, 1e-6, atol);
 *   IDAInit(ida, flesh_ida_residual, state.t, y, yp);  later: IDAReInit(ida, state.t, y, yp)
 *   IDASVtolerances(ida, 0.0, atol);                   absolute: rtol |x| depends on the origin
 *   IDASetUserData(ida, problem);                      IDASetMaxOrd(ida, 2);
 *   flesh_ida_sunmatrix_create(problem, context, &A);
 *   flesh_ida_sunlinsol_create(problem, context, &solver);
 *   IDASetLinearSolver(ida, solver, A);                IDASetJacFn(ida, flesh_ida_jacobian);
 *   IDASetStopTime(ida, flesh_ida_event(problem));     where that is finite
 *   IDASolve(ida, t_out, &t, y, yp, IDA_NORMAL);       as often as wanted, without a new start
 *   flesh_ida_get_state(problem, t, y, &state);  IDA_TSTOP_RETURN: repeat from flesh_ida_start
 *
 * The reference solution uses A = SUNSparseMatrix(2N, 2N, flesh_ida_entries(problem), CSC_MAT, context) with N = 3*n and
 * solver = SUNLinSol_KLU(y, A, context); the rest is the same. Orders above 2 are not A-stable: on undamped bodies they
 * take many more steps at loose tolerances and may gain energy. Keep velocities in the error test (do not suppress
 * them).
 *
 * user_data and vectors are as in kinsol.h: user_data is the problem or a struct whose first member points to it;
 * vectors are serial, OpenMP or Pthreads, of length 2*3*n. For a part of a body (flesh_system_set_part) vectors are
 * those of N_VNew_Parallel: each rank has x of the part's own nodes, then v of these, and the global length is 2*3
 * for each node of the whole body. Everything here is then collective, except creating and freeing matrices and
 * solvers, and a SUNSparseMatrix is not supported. Functions that return no status cannot fail. */
#ifndef FLESH_IDA_H
#define FLESH_IDA_H

#include "flesh/sundials_abi.h" /* before the headers that it checks */

#include <sundials/sundials_linearsolver.h>
#include <sundials/sundials_matrix.h>
#include <sundials/sundials_nvector.h>
#include <sundials/sundials_types.h>

#include "flesh/solver.h"
#include "flesh/state.h"
#include "flesh/system.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The callbacks' `user_data`: the system, all work space, and the constraints between two events. */
typedef struct flesh_ida_problem flesh_ida_problem;

/* Creates a problem for a finished system with inertia, which is borrowed, and options, which are copied. Of the
 * options, linear_tolerance, max_linear, linear_solver, preconditioner, eigenvalue_filter (a filter whose name ends
 * in ALWAYS clamps negative eigenvalues; with all others the Hessian is the true one) and threads are used, but all
 * are checked: begin with flesh_solver_options_default. Returns new. Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY,
 * FLESH_ERR_SUNDIALS. */
FLESH_API int flesh_ida_problem_create(const flesh_system *system,
                                       const flesh_solver_options *options,
                                       flesh_ida_problem **problem);
FLESH_API void flesh_ida_problem_destroy(flesh_ida_problem **problem);

/* Creates a vector of length 2*3*n for y, to be cloned for the others: a serial vector of SUNDIALS, but with a
 * vectorised norm (that of SUNDIALS takes a quarter of a run's time). For a part of a body it also has x and v of
 * ghosts, and its weighted norms, maximum norm, product and minimum, which IDA needs, are over all ranks. Returns
 * new, freed by N_VDestroy. Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
FLESH_API int flesh_ida_vector_create(const flesh_ida_problem *problem, SUNContext context,
                                      N_Vector *y);

/* Starts from the state: constrained dofs take their prescribed positions and velocities, y = (x, v) and y' = (v, a)
 * with M a = -r(t, x, v, 0). If constrained dofs jump, the free dofs move by M_ff du_f = -M_fc du_c, the limit of a
 * short step; with lumped mass they do not move. FLESH_UNDEFINED or FLESH_NONFINITE if r has no value. Further
 * errors: FLESH_ERR_ARGUMENT, FLESH_ERR_NONFINITE (the state is not finite; the sentence names the node). */
FLESH_API int flesh_ida_start(flesh_ida_problem *problem, const flesh_state *state, N_Vector y,
                              N_Vector yp);

/* Returns the time of the next event, up to which the start is valid; INFINITY if there is none. */
FLESH_API double flesh_ida_event(const flesh_ida_problem *problem);

/* Sets atol = (tolerance L, tolerance V), with values for constrained dofs so large that no error test depends on
 * them. L [m] is the body's longest side. V [m/s] is L per period of the body's slowest bending, estimated by
 * Rayleigh's quotient of a bent shape at rest; without elasticity V = sqrt(L |applied load| / mass), without loads L
 * per second. Call it after each start. FLESH_ERR_ARGUMENT for a tolerance that is not positive and finite. */
FLESH_API int flesh_ida_tolerances(const flesh_ida_problem *problem, double tolerance,
                                   N_Vector atol);

/* Fills the caller's state from y at t; constrained dofs get their exact values. FLESH_ERR_ARGUMENT also for a t
 * after the event: y was then integrated past it. */
FLESH_API int flesh_ida_get_state(flesh_ida_problem *problem, double t, N_Vector y,
                                  flesh_state *state);

/* An IDAResFn: computes F(t, y, y'). > 0 if an energy is undefined or a number is not finite. Errors:
 * FLESH_UNDEFINED, FLESH_NONFINITE, FLESH_ERR_ARGUMENT. */
FLESH_API int flesh_ida_residual(sunrealtype t, N_Vector y, N_Vector yp, N_Vector r, void *problem);

/* An IDALsJacFn: writes dF/dy + cj dF/dy' into a matrix of flesh_ida_sunmatrix_create (condensed: K + cj C + cj^2 M)
 * or into a 2*3*n square SUNSparseMatrix (CSC) with room for flesh_ida_entries() entries (-1: too many for SUNDIALS'
 * 32-bit indices). w1, w2, w3 are not used. Errors: FLESH_UNDEFINED, FLESH_NONFINITE, FLESH_ERR_ARGUMENT,
 * FLESH_ERR_MEMORY. */
FLESH_API int flesh_ida_jacobian(sunrealtype t, sunrealtype cj, N_Vector y, N_Vector yp, N_Vector r,
                                 SUNMatrix J, void *problem, N_Vector w1, N_Vector w2, N_Vector w3);
FLESH_API sunindextype flesh_ida_entries(const flesh_ida_problem *problem);

/* Functions for solvers that take no matrix (SUNLinSol_SPGMR and the like). The IDALsPrecSetupFn and IDALsPrecSolveFn
 * assemble and factor; they eliminate one half as flesh_ida_sunlinsol_create does, by one application of the options'
 * preconditioner or a direct solve. The IDALsJacTimesVecFn computes Jv with the matrix, and the cj, of the last
 * preconditioner set-up. Errors: FLESH_NOT_POSITIVE, FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
FLESH_API int flesh_ida_preconditioner_setup(sunrealtype t, N_Vector y, N_Vector yp, N_Vector r,
                                             sunrealtype cj, void *problem);
FLESH_API int flesh_ida_preconditioner_solve(sunrealtype t, N_Vector y, N_Vector yp, N_Vector r,
                                             N_Vector right, N_Vector z, sunrealtype cj,
                                             sunrealtype delta, void *problem);
FLESH_API int flesh_ida_jacobian_times(sunrealtype t, N_Vector y, N_Vector yp, N_Vector r,
                                       N_Vector v, N_Vector Jv, sunrealtype cj, void *problem,
                                       N_Vector w1, N_Vector w2);

/* Creates J as a SUNMatrix with all operations except SUNMatMatvecSetup (products need none): a view of the problem's
 * matrix (condensed); clones have memory of their own. Freed by SUNMatDestroy; the problem must outlive it. Errors:
 * FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
FLESH_API int flesh_ida_sunmatrix_create(flesh_ida_problem *problem, SUNContext context,
                                         SUNMatrix *matrix);

/* Creates a SUNLinearSolver of type direct that eliminates one half: (K + cj C + cj^2 M) dv/cj = b2 - K b1/cj, dx =
 * (dv + b1)/cj, with the cj of the last Jacobian, by the options' PCG, KLU or CHOLMOD. A solve returns > 0, so that
 * IDA shortens its step, if the matrix is not positive definite. Freed by SUNLinSolFree; the problem must outlive it.
 * Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
FLESH_API int flesh_ida_sunlinsol_create(flesh_ida_problem *problem, SUNContext context,
                                         SUNLinearSolver *solver);

/* Returns the counts since creation, which the caller may zero. Owned by the problem. */
FLESH_API flesh_solve_stats *flesh_ida_stats(flesh_ida_problem *problem);

#ifdef __cplusplus
}
#endif
#endif
