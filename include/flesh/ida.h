/* ida.h: flesh's residual, Jacobian and linear solver with SUNDIALS' own signatures, for a program
 * that owns its IDA.
 *
 * The unknown is y = (x, v) [2*3*n], positions before velocities, and F(t, y, y') has the rows
 *
 *   of a free dof          x' - v                                  [m/s]
 *                          r(t, x, v, a = v')                      [N], the sum of all effects
 *   of a constrained dof   x - (prescribed position at t)          [m]
 *                          v - (prescribed velocity at t)          [m/s]
 *
 * The effects are evaluated with the prescribed position, velocity and acceleration themselves, so
 * a constrained dof's entries of y are read nowhere else: the free dofs obey an ordinary
 * differential equation, the constrained rows are algebraic (index 1) and nothing depends on them,
 * and the Jacobian stays symmetric. Newton's convergence and the error test of IDA are in the units
 * of y, so the force rows need no scaling by the mass.
 *
 * At events prescribed motions, loads or the set of constrained dofs change abruptly (a keyframe, a
 * release). One start is valid up to the next event; there, or when the state was changed from
 * outside, start again:
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
 *   flesh_ida_get_state(problem, t, y, &state);  IDA_TSTOP_RETURN: go on at flesh_ida_start
 *
 * The reference path is A = SUNSparseMatrix(2N, 2N, flesh_ida_entries(problem), CSC_MAT, context)
 * with N = 3*n and solver = SUNLinSol_KLU(y, A, context); the rest stays as it is. Orders above 2
 * are not A-stable: on undamped bodies they take many more steps at loose tolerances and may gain
 * energy. Velocities belong into the error test (do not suppress them).
 *
 * user_data and vectors as in kinsol.h: the problem or a struct whose first member points to it;
 * serial, OpenMP or Pthreads, of length 2*3*n. Of a part of a body (flesh_system_set_part) they are
 * those of N_VNew_Parallel: on a rank x of the part's own nodes, then v of these, 2*3 numbers for
 * each node of the whole in all; everything here is collective then, but for creating and freeing
 * matrices and solvers, and there is no SUNSparseMatrix. Functions that return no status cannot fail. */
#ifndef FLESH_IDA_H
#define FLESH_IDA_H

#include "flesh/sundials_abi.h" /* before what it judges */

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

/* Borrows `system` (finished, with inertia), copies `options`, of which linear_tolerance,
 * max_linear, linear_solver, preconditioner, eigenvalue_filter (a filter that is ALWAYS on clamps
 * negative eigenvalues; with all others the Hessian is the true one) and threads are read; all
 * are checked: begin with flesh_solver_options_default. Returns new.
 * Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY, FLESH_ERR_SUNDIALS. */
FLESH_API int flesh_ida_problem_create(const flesh_system *system,
                                       const flesh_solver_options *options,
                                       flesh_ida_problem **problem);
FLESH_API void flesh_ida_problem_destroy(flesh_ida_problem **problem);

/* A serial vector of 2*3*n for y, to be cloned for the others: SUNDIALS' own, but with a vectorised
 * norm (SUNDIALS' takes a quarter of a run's time). Of a part of a body it has x and v of ghosts,
 * too, and its weighted norms, maximum norm, product and minimum are those of all ranks: what IDA
 * needs. Returns new, freed by N_VDestroy.
 * Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
FLESH_API int flesh_ida_vector_create(const flesh_ida_problem *problem, SUNContext context,
                                      N_Vector *y);

/* Starts from the state: constrained dofs take their prescribed places and velocities (a jump of
 * theirs moves the free dofs by M_ff du_f = -M_fc du_c, the limit of a short step; nothing with
 * lumped mass), y = (x, v) and y' = (v, a) with M a = -r(t, x, v, 0). FLESH_UNDEFINED or
 * FLESH_NONFINITE where r has no value. Further errors: FLESH_ERR_ARGUMENT, FLESH_ERR_NONFINITE
 * (the state, with its node). */
FLESH_API int flesh_ida_start(flesh_ida_problem *problem, const flesh_state *state, N_Vector y,
                              N_Vector yp);

/* Time of the next event, up to which the start is valid; INFINITY if there is none. */
FLESH_API double flesh_ida_event(const flesh_ida_problem *problem);

/* atol = (tolerance L, tolerance V), and for constrained dofs so large that no error test depends on
 * them. L [m] is the body's longest side. V [m/s] is L per period of the body's slowest bending,
 * estimated by Rayleigh's quotient of a bent shape at rest; without elasticity sqrt(L |applied load| /
 * mass), without loads L per second. To be called after each start. FLESH_ERR_ARGUMENT for a tolerance that is not
 * positive and finite. */
FLESH_API int flesh_ida_tolerances(const flesh_ida_problem *problem, double tolerance,
                                   N_Vector atol);

/* Fills the caller's state from y at t, constrained dofs exactly. FLESH_ERR_ARGUMENT behind the event, too: y has been
 * integrated there without it. */
FLESH_API int flesh_ida_get_state(flesh_ida_problem *problem, double t, N_Vector y,
                                  flesh_state *state);

/* IDAResFn. > 0 where an energy is undefined or a number not finite.
 * Errors: FLESH_UNDEFINED, FLESH_NONFINITE, FLESH_ERR_ARGUMENT. */
FLESH_API int flesh_ida_residual(sunrealtype t, N_Vector y, N_Vector yp, N_Vector r, void *problem);

/* IDALsJacFn: dF/dy + cj dF/dy' into a matrix of flesh_ida_sunmatrix_create (condensed: K + cj C
 * + cj^2 M) or a 2*3*n square SUNSparseMatrix (CSC) with room for flesh_ida_entries() entries (-1:
 * too many for SUNDIALS' 32-bit indices). w1, w2, w3 are not used.
 * Errors: FLESH_UNDEFINED, FLESH_NONFINITE, FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
FLESH_API int flesh_ida_jacobian(sunrealtype t, sunrealtype cj, N_Vector y, N_Vector yp, N_Vector r,
                                 SUNMatrix J, void *problem, N_Vector w1, N_Vector w2, N_Vector w3);
FLESH_API sunindextype flesh_ida_entries(const flesh_ida_problem *problem);

/* For solvers that take no matrix (SUNLinSol_SPGMR and the like). IDALsPrecSetupFn and
 * IDALsPrecSolveFn: assembles and factors; one half eliminated as in flesh_ida_sunlinsol_create, by
 * one application of the options' preconditioner or a direct solve. IDALsJacTimesVecFn: Jv with the
 * matrix of the last preconditioner set-up, and its cj.
 * Errors: FLESH_NOT_POSITIVE, FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
FLESH_API int flesh_ida_preconditioner_setup(sunrealtype t, N_Vector y, N_Vector yp, N_Vector r,
                                             sunrealtype cj, void *problem);
FLESH_API int flesh_ida_preconditioner_solve(sunrealtype t, N_Vector y, N_Vector yp, N_Vector r,
                                             N_Vector right, N_Vector z, sunrealtype cj,
                                             sunrealtype delta, void *problem);
FLESH_API int flesh_ida_jacobian_times(sunrealtype t, N_Vector y, N_Vector yp, N_Vector r,
                                       N_Vector v, N_Vector Jv, sunrealtype cj, void *problem,
                                       N_Vector w1, N_Vector w2);

/* J as a SUNMatrix with all operations except SUNMatMatvecSetup (products need none), a view of what
 * the problem holds (condensed); clones have memory of their own. Freed by SUNMatDestroy; the problem must outlive it.
 * Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
FLESH_API int flesh_ida_sunmatrix_create(flesh_ida_problem *problem, SUNContext context,
                                         SUNMatrix *matrix);

/* A SUNLinearSolver of type direct that eliminates one half: (K + cj C + cj^2 M) dv/cj = b2 - K
 * b1/cj, dx = (dv + b1)/cj, cj being that of the last Jacobian, by the options' PCG, KLU or
 * CHOLMOD. > 0, so that IDA shortens its step, where the matrix is not positive definite. Freed
 * by SUNLinSolFree; the problem must outlive it. Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
FLESH_API int flesh_ida_sunlinsol_create(flesh_ida_problem *problem, SUNContext context,
                                         SUNLinearSolver *solver);

/* Counts since creation; the caller may zero them. Owned by the problem. */
FLESH_API flesh_solve_stats *flesh_ida_stats(flesh_ida_problem *problem);

#ifdef __cplusplus
}
#endif
#endif
