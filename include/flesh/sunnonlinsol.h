/* sunnonlinsol.h: flesh's Newton as a SUNNonlinearSolver, for a program that owns its IDA, ARKODE
 * (ARKStep or, with functions of that name, MRIStep) or CVODE.
 *
 * Every implicit step or stage of these integrators asks for y = (x, v) with
 *
 *   x = x^ + g v,   v = v^ + g a,   r(t, x, v, a) = 0,
 *
 * where x^ and v^ are known and g is 1/cj of IDA, gamma of ARKODE and CVODE. That is a step of
 * backward Euler of length g, and its solution is a minimum of the potential
 *
 *   |x - x^ - g v^|^2_M / (2 g^2) + Psi(x)
 *
 * (Ortiz & Stainier 1999). SUNDIALS' own Newton (SUNNonlinSol_Newton) knows nothing of the potential.
 * This solver finds the minimum as flesh's own methods do: line search, filter of negative
 * eigenvalues, steps that stay clear of obstacles, accelerators, kept matrices, as the options of
 * the problem say. It takes the place of SUNMatrix, SUNLinearSolver and Jacobian, and needs no
 * other calls:
 *
 *   IDA     flesh_ida_sunnonlinsol_create(problem, context, &solver);
 *           IDASetNonlinearSolver(ida, solver);
 *   ARKODE  flesh_arkode_sunnonlinsol_create(problem, ARKStepGetNonlinearSystemData, context, &solver);
 *           ARKStepSetNonlinearSolver(arkode, solver);
 *           ARKStepSetDeduceImplicitRhs(arkode, 1);   f of a stage from its solution
 *           ARKStepSetPostprocessStepFn(arkode, flesh_ode_accept);
 *   CVODE   flesh_cvode_sunnonlinsol_create(problem, CVodeGetNonlinearSystemData, context, &solver);
 *           CVodeSetNonlinearSolver(cvode, solver);
 *
 * The rest is as in ida.h and ode.h. Since SUNDIALS 7.1, ARKODE's functions are called ARKode....
 *
 * How exact a solution is: the residual's norm is at most what leaves, in the mass alone, an error
 * of the tolerance that the integrator passes, in its weighted norm. The tolerance is a share of
 * that of a step, which IDASetNonlinConvCoef, ARKStepSetNonlinConvCoef and CVodeSetNonlinConvCoef
 * set. The weights have to be those of tolerances of positions and velocities. The options'
 * newton_tolerance is not read.
 *
 * Where a solve fails, it returns SUN_NLS_CONV_RECVR, and the integrator makes its step shorter;
 * a fatal status ends the integration, and flesh_error_text() says why. Newton iterations are
 * counted by the integrator (...GetNumNonlinSolvIters) and in the problem's statistics.
 *
 * Forces that are lagged (friction, follower loads) see the last accepted state, from where
 * obstacles also leave the way to every stage free. For IDA and CVODE the solver knows it: the last
 * solution that the integrator went on from. Stages of ARKODE do not tell, hence flesh_ode_accept.
 * What is lagged is off by a step, which no error test sees: an error of order 1. Where there are
 * obstacles, a method whose last stage is the end of the step (ESDIRK, SDIRK, BDF) keeps out of
 * them at every accepted state. */
#ifndef FLESH_SUNNONLINSOL_H
#define FLESH_SUNNONLINSOL_H

#include "flesh/ida.h"
#include "flesh/ode.h"

#include <sundials/sundials_nonlinearsolver.h>

#ifdef __cplusplus
extern "C" {
#endif

/* ARKStepGetNonlinearSystemData, since 7.1 ARKodeGetNonlinearSystemData; and
 * CVodeGetNonlinearSystemData. The program passes them, so that flesh links neither library. */
typedef int (*flesh_arkode_system_data)(void *arkode, sunrealtype *t, N_Vector *zpred, N_Vector *z,
                                        N_Vector *Fi, sunrealtype *gamma, N_Vector *sdata,
                                        void **user_data);
typedef int (*flesh_cvode_system_data)(void *cvode, sunrealtype *t, N_Vector *ypred, N_Vector *yn,
                                       N_Vector *fn, sunrealtype *gamma, sunrealtype *rl1,
                                       N_Vector *zn1, void **user_data);

/* A SUNNonlinearSolver of type ROOTFIND for the steps of an IDA, the stages of an ARKStep or the
 * steps of a CVODE (BDF, Adams), with work space and a KINSOL of its own. Vectors are those of
 * ida.h and ode.h, on ranks too, where every call is collective. Serves one integrator at a time.
 * Returns new, freed by SUNNonlinSolFree after the integrator; the problem, whose options it
 * copies, must outlive it. Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY, FLESH_ERR_SUNDIALS. */
FLESH_API int flesh_ida_sunnonlinsol_create(flesh_ida_problem *problem, SUNContext context,
                                            SUNNonlinearSolver *solver);
FLESH_API int flesh_arkode_sunnonlinsol_create(flesh_ode_problem *problem,
                                               flesh_arkode_system_data data, SUNContext context,
                                               SUNNonlinearSolver *solver);
FLESH_API int flesh_cvode_sunnonlinsol_create(flesh_ode_problem *problem,
                                              flesh_cvode_system_data data, SUNContext context,
                                              SUNNonlinearSolver *solver);

/* Makes the weighted norm of y and of its clones, in which the integrator judges its errors
 * e = (e_x, e_v), one of positions alone: where the error leads within the last implicit step,
 *
 *   |e_x + g e_v|_M / (tolerance sqrt(3 |M|)),
 *
 * for vectors of flesh_ida_vector_create or flesh_ode_vector_create, before they are cloned. Fast
 * modes of small amplitude count for little in it. It is for motions that are to be followed as far
 * as steps resolve them: impacts, and bodies that come back from a tangle. It bounds no velocities:
 * orders above 2 of IDA and CVODE may gain energy by it. The solver must outlive the integrator.
 * Borrows y. Errors: FLESH_ERR_ARGUMENT. */
FLESH_API int flesh_sunnonlinsol_position_norm(SUNNonlinearSolver solver, N_Vector y);

/* ARKPostProcessFn: tells the problem that a step has been accepted that ends at y. A solver that
 * is not told fails after some steps, with a sentence. Errors: FLESH_ERR_ARGUMENT. */
FLESH_API int flesh_ode_accept(sunrealtype t, N_Vector y, void *problem);

#ifdef __cplusplus
}
#endif
#endif
