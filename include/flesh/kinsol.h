/* kinsol.h: flesh's residual, Jacobian, preconditioner and linear solver with SUNDIALS' own signatures, for a program
 * that owns its KINSOL.
 *
 * The unknown u [3*n] moves the point from a base: x = x0 + sx u, v = v0 + sv u, a = a0 + sa u. A stage gives the base
 * and the factors sx, sv, sa; a flesh_problem holds the stage and all work space and is the callbacks' `user_data`:
 *
 *   flesh_problem_create(system, &options, &problem);
 *   flesh_problem_set_stage(problem, &stage);
 *   KINInit(kin, flesh_kinsol_residual, u);
 *   KINSetUserData(kin, problem);
 *   flesh_sunmatrix_create(problem, context, &A);
 *   flesh_sunlinsol_create(problem, context, &solver);
 *   KINSetLinearSolver(kin, solver, A);
 *   KINSetJacFn(kin, flesh_kinsol_jacobian);
 *   KINSetMaxSetupCalls(kin, 1);          KINSetMaxNewtonStep(kin, 1e300);
 *   KINSetEtaForm(kin, KIN_ETACONSTANT);  KINSetEtaConstValue(kin, 1e-2);
 *   KINSetFuncNormTol(kin, 1e-6);         in N, for the largest component of r; by default 6e-6
 *   KINSol(kin, u, KIN_NONE, ones, ones);
 *
 * Constrained dofs are evaluated at their prescribed positions, whatever their entries in u, so any u is a valid start;
 * flesh_problem_start gives u = 0 with the prescribed entries.
 *
 * (By default KINSOL reuses a Jacobian for ten iterations and limits steps by |u|, which starts at zero: hence
 * MaxSetupCalls and MaxNewtonStep.) Use serial, OpenMP or Pthreads N_Vectors of length 3*n; the callbacks refuse others
 * with FLESH_ERR_ARGUMENT and a sentence in flesh_error_text(). For a system of a part of a body
 * (flesh_system_set_part), use vectors of N_VNew_Parallel with 3 numbers for each of the part's own nodes on this rank,
 * and a global length of 3 for each node of the whole body. Everything here is then collective, and a SUNSparseMatrix is
 * not supported. With several ranks serial vectors are refused.
 *
 * The callbacks' user_data is the problem, or any struct whose first member is a pointer to it:
 *
 *   struct mine { flesh_problem *problem; ... } mine = {problem, ...};
 *   KINSetUserData(kin, &mine);
 *
 * Functions that return no status cannot fail. */
#ifndef FLESH_KINSOL_H
#define FLESH_KINSOL_H

#include "flesh/sundials_abi.h" /* before the headers that it checks */

#include <sundials/sundials_linearsolver.h>
#include <sundials/sundials_matrix.h>
#include <sundials/sundials_nvector.h>
#include <sundials/sundials_types.h>
#include <sundials/sundials_version.h>

#include "flesh/solver.h"
#include "flesh/system.h"

#ifdef __cplusplus
extern "C" {
#endif

#if SUNDIALS_VERSION_MAJOR >= 7
typedef sunbooleantype flesh_sunboolean;
#else
typedef booleantype flesh_sunboolean;
#endif

typedef struct flesh_problem flesh_problem;

/* Creates a problem; borrows `system` (finished), copies `options`. Returns new. Errors: FLESH_ERR_ARGUMENT,
 * FLESH_ERR_MEMORY, FLESH_ERR_SUNDIALS. */
FLESH_API int flesh_problem_create(const flesh_system *system, const flesh_solver_options *options,
                                   flesh_problem **problem);
FLESH_API void flesh_problem_destroy(flesh_problem **problem);

/* Sets the stage, finds the dofs that are constrained at its time, and clears cached data. Errors:
 * FLESH_ERR_ARGUMENT. */
FLESH_API int flesh_problem_set_stage(flesh_problem *problem, const flesh_stage *stage);

/* Sets u [3*n], including a part's ghosts, to 0, and the entries of constrained dofs to those of their prescribed
 * positions. */
FLESH_API void flesh_problem_start(const flesh_problem *problem, double *u);

/* Sets the frozen state to the point of u, for stages with frozen_at_solution. Repeat solve and freeze until the
 * residual right after freezing at the solution is small enough. Does nothing if no effect freezes. */
FLESH_API void flesh_problem_freeze(flesh_problem *problem, const double *u);

/* Returns the counts since creation, which the caller may zero. Owned by the problem. The linear solver of
 * flesh_sunlinsol_create counts Newton iterations and related events (newton, linear, direct, backtracks, subdomains,
 * watchdog_steps): with a linear solver of your own they stay 0, and KINGetNumNonlinSolvIters and KINGetNumLinIters
 * have the counts. */
FLESH_API flesh_solve_stats *flesh_problem_stats(flesh_problem *problem);

/* A KINSysFn: computes r(u); rows of constrained dofs are (u - prescribed) times a typical stiffness. > 0 if an
 * energy is undefined or a number is not finite (< 0 with FLESH_LINE_SEARCH_NONE, which makes no second attempt).
 * Errors: FLESH_UNDEFINED, FLESH_NONFINITE, FLESH_ERR_ARGUMENT. */
FLESH_API int flesh_kinsol_residual(N_Vector u, N_Vector r, void *problem);

/* A KINLsJacFn: writes dr/du at u into a matrix of flesh_sunmatrix_create or a square SUNSparseMatrix (CSC or CSR)
 * with room for flesh_problem_entries() entries (-1: too many for SUNDIALS' 32-bit indices). w1, w2 are not used.
 * Errors: FLESH_UNDEFINED, FLESH_NONFINITE, FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
FLESH_API int flesh_kinsol_jacobian(N_Vector u, N_Vector r, SUNMatrix J, void *problem, N_Vector w1,
                                    N_Vector w2);
FLESH_API sunindextype flesh_problem_entries(const flesh_problem *problem);

/* A KINLsJacTimesVecFn: computes Jv = (dr/du) v with the matrix of the last Jacobian or preconditioner set-up at u.
 * FLESH_NOT_POSITIVE where v.Jv <= 0 although v is not 0, so that a PCG stops instead of dividing by it. GMRES also
 * stops there, unless the eigenvalue filter's name ends in ALWAYS or difference quotients replace this function.
 * Errors: FLESH_ERR_ARGUMENT. */
FLESH_API int flesh_kinsol_jacobian_times(N_Vector v, N_Vector Jv, N_Vector u,
                                          flesh_sunboolean *new_u, void *problem);

/* A KINLsPrecSetupFn, which assembles at u and factors, and a KINLsPrecSolveFn, which computes z = P^-1 z. For
 * SUNLinSol_PCG and other solvers that take no matrix. Errors: FLESH_NOT_POSITIVE, FLESH_ERR_ARGUMENT,
 * FLESH_ERR_MEMORY. */
FLESH_API int flesh_kinsol_preconditioner_setup(N_Vector u, N_Vector uscale, N_Vector fval,
                                                N_Vector fscale, void *problem);
FLESH_API int flesh_kinsol_preconditioner_solve(N_Vector u, N_Vector uscale, N_Vector fval,
                                                N_Vector fscale, N_Vector z, void *problem);

/* Solves K p = b for `count` right-hand sides b [count][3*n], each overwritten by its p. K = dr/du is the exact
 * derivative at u [3*n], without an eigenvalue filter or secants of contact; lagged and frozen states are constant in
 * it. K is symmetric: p is an adjoint as well as a tangent. On constrained dofs b is not read, and p is 0. Each solve
 * goes on until ||b - K p||_2 <= tolerance ||b||_2, tolerance in [1e-13, 1), by the options' linear solver; if K is
 * indefinite, or conjugate gradients do not reach the tolerance, by KLU. u NULL: uses the K of the previous call and
 * its factors. FLESH_ERR_SOLVE if K is singular. Further errors: FLESH_ERR_ARGUMENT,
 * FLESH_ERR_MEMORY, FLESH_UNDEFINED, FLESH_NONFINITE. */
FLESH_API int flesh_problem_solve(flesh_problem *problem, const double *u, int count, double *b, double tolerance);

/* Creates the library's block matrix as a SUNMatrix with all operations except SUNMatMatvecSetup (products need
 * none): a view, whose values belong to the problem; clones have memory of their own. Freed by SUNMatDestroy; the
 * problem must outlive it. Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
FLESH_API int flesh_sunmatrix_create(flesh_problem *problem, SUNContext context, SUNMatrix *matrix);

/* Creates the linear solver of the options (PCG, KLU, CHOLMOD) as a SUNLinearSolver of type matrix-iterative, for use
 * with the matrix above. With FLESH_LINE_SEARCH_POTENTIAL the step that it returns is already scaled by a line search
 * on the potential: use KIN_NONE, as KIN_LINESEARCH would shorten the step once more and may then fail. Use
 * KIN_LINESEARCH with FLESH_LINE_SEARCH_RESIDUAL, and with linear solvers of your own; it decreases |r|, which is slow
 * where a slender body bends far (hundreds of iterations where the potential needs twenty). Freed by SUNLinSolFree; the
 * problem must outlive it. Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
FLESH_API int flesh_sunlinsol_create(flesh_problem *problem, SUNContext context,
                                     SUNLinearSolver *solver);

#ifdef __cplusplus
}
#endif
#endif
