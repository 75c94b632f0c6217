/* kinsol.h: flesh's residual, Jacobian, preconditioner and linear solver with SUNDIALS' own
 * signatures, for a program that owns its KINSOL.
 *
 * The unknown u [3*n] moves the point from a base: x = x0 + sx u, v = v0 + sv u, a = a0 + sa u. A
 * stage says from where and how; a flesh_problem holds the stage and all work space and is the
 * callbacks' `user_data`:
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
 *   KINSol(kin, u, KIN_NONE, ones, ones);
 *
 * Constrained dofs are evaluated at their prescribed positions, whatever their entries in u, so any
 * u is a valid start; flesh_problem_start gives u = 0 with the prescribed entries.
 *
 * (KINSOL would reuse a Jacobian for ten iterations and cap steps by |u|, which starts at zero:
 * hence MaxSetupCalls and MaxNewtonStep.) Serial, OpenMP and Pthreads N_Vectors of length 3*n
 * serve; the callbacks refuse others with FLESH_ERR_ARGUMENT and a sentence in flesh_error_text().
 * Where the system is that of a part of a body (flesh_system_set_part), vectors of N_VNew_Parallel
 * serve, with 3 numbers for each of the part's own nodes on this rank and for each node of the whole
 * in all; everything here is collective then, and there is no SUNSparseMatrix. Serial vectors are
 * refused where there are several ranks.
 *
 * The callbacks' user_data is the problem, or any struct whose first member is a pointer to it:
 *
 *   struct mine { flesh_problem *problem; ... } mine = {problem, ...};
 *   KINSetUserData(kin, &mine); Functions that return no status cannot fail. */
#ifndef FLESH_KINSOL_H
#define FLESH_KINSOL_H

#include "flesh/sundials_abi.h" /* before what it judges */

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

/* Borrows `system` (finished), copies `options`. Returns new.
 * Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY, FLESH_ERR_SUNDIALS. */
FLESH_API int flesh_problem_create(const flesh_system *system, const flesh_solver_options *options,
                                   flesh_problem **problem);
FLESH_API void flesh_problem_destroy(flesh_problem **problem);

/* Sets the stage, finds the dofs that are constrained at its time, and clears what was cached.
 * Errors: FLESH_ERR_ARGUMENT. */
FLESH_API int flesh_problem_set_stage(flesh_problem *problem, const flesh_stage *stage);

/* u [3*n], of a part's ghosts too, = 0 but for the constrained dofs, which take their prescribed
 * places. */
FLESH_API void flesh_problem_start(const flesh_problem *problem, double *u);

/* For stages with frozen_at_solution: the frozen state becomes the point of u. Repeat solve and
 * freeze until the residual is small enough right after freezing at the solution. Does nothing
 * where no effect freezes. */
FLESH_API void flesh_problem_freeze(flesh_problem *problem, const double *u);

/* Counts since creation; the caller may zero them. Owned by the problem. Newton iterations and what
 * belongs to them (newton, linear, direct, backtracks, subdomains, watchdog_steps) are counted by
 * the linear solver of flesh_sunlinsol_create: with one of your own they stay 0, and
 * KINGetNumNonlinSolvIters and KINGetNumLinIters have the counts. */
FLESH_API flesh_solve_stats *flesh_problem_stats(flesh_problem *problem);

/* KINSysFn: r(u); rows of constrained dofs are (u - prescribed) times a typical stiffness. > 0
 * where an energy is undefined or a number not finite (< 0 with FLESH_LINE_SEARCH_NONE, which
 * makes no second attempt). Errors: FLESH_UNDEFINED, FLESH_NONFINITE, FLESH_ERR_ARGUMENT. */
FLESH_API int flesh_kinsol_residual(N_Vector u, N_Vector r, void *problem);

/* KINLsJacFn: dr/du at u into a matrix of flesh_sunmatrix_create or a square SUNSparseMatrix (CSC
 * or CSR) with room for flesh_problem_entries() entries (-1: too many for SUNDIALS' 32-bit
 * indices). w1, w2 are not used.
 * Errors: FLESH_UNDEFINED, FLESH_NONFINITE, FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
FLESH_API int flesh_kinsol_jacobian(N_Vector u, N_Vector r, SUNMatrix J, void *problem, N_Vector w1,
                                    N_Vector w2);
FLESH_API sunindextype flesh_problem_entries(const flesh_problem *problem);

/* KINLsJacTimesVecFn: Jv = (dr/du) v with the matrix of the last Jacobian or preconditioner set-up
 * at u. FLESH_NOT_POSITIVE where v.Jv <= 0 although v is not 0, so that a PCG stops instead of dividing by
 * it. GMRES stops there, too; with an eigenvalue filter that is ALWAYS on, or difference quotients in its
 * stead, it goes on. Errors: FLESH_ERR_ARGUMENT. */
FLESH_API int flesh_kinsol_jacobian_times(N_Vector v, N_Vector Jv, N_Vector u,
                                          flesh_sunboolean *new_u, void *problem);

/* KINLsPrecSetupFn and KINLsPrecSolveFn: assembles at u and factors; z = P^-1 z. For SUNLinSol_PCG
 * and others that take no matrix.
 * Errors: FLESH_NOT_POSITIVE, FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
FLESH_API int flesh_kinsol_preconditioner_setup(N_Vector u, N_Vector uscale, N_Vector fval,
                                                N_Vector fscale, void *problem);
FLESH_API int flesh_kinsol_preconditioner_solve(N_Vector u, N_Vector uscale, N_Vector fval,
                                                N_Vector fscale, N_Vector z, void *problem);

/* Solves K p = b for `count` right-hand sides b [count][3*n], which become p, K = dr/du being the derivative itself at
 * u [3*n], without an eigenvalue filter or secants of contact; lagged and frozen states are constant in it. K is
 * symmetric: p is an adjoint as well as a tangent. Of constrained dofs b is not read, and p is 0. Until ||b - K p||_2 <=
 * tolerance ||b||_2 for each, tolerance in [1e-13, 1), by the options' linear solver; where K is indefinite, or
 * conjugate gradients do not get there, by KLU. u NULL: with the K, and what was factored of it, of the call before.
 * FLESH_ERR_ARGUMENT; FLESH_ERR_SOLVE where K is singular; FLESH_UNDEFINED, FLESH_NONFINITE. */
FLESH_API int flesh_problem_solve(flesh_problem *problem, const double *u, int count, double *b, double tolerance);

/* The library's block matrix as a SUNMatrix with all operations except SUNMatMatvecSetup (products
 * need none), a view: the values live in the problem; clones have memory of their own. Freed by
 * SUNMatDestroy; the problem must outlive it.
 * Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
FLESH_API int flesh_sunmatrix_create(flesh_problem *problem, SUNContext context, SUNMatrix *matrix);

/* The linear solver of the options (PCG, KLU, CHOLMOD) as a SUNLinearSolver of type
 * matrix-iterative, for use with the matrix above. With FLESH_LINE_SEARCH_POTENTIAL the step it
 * returns is already scaled by a line search on the potential: take KIN_NONE, as KIN_LINESEARCH would
 * shorten it once more, and may fail by that; KIN_LINESEARCH goes with FLESH_LINE_SEARCH_RESIDUAL. Freed by
 * SUNLinSolFree; the problem must outlive it. Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
FLESH_API int flesh_sunlinsol_create(flesh_problem *problem, SUNContext context,
                                     SUNLinearSolver *solver);

#ifdef __cplusplus
}
#endif
#endif
