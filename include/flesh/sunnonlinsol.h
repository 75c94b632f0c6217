/* sunnonlinsol.h: flesh's Newton as a SUNNonlinearSolver, for a program that owns its IDA, ARKODE (ARKStep or, with
 * functions of that name, MRIStep) or CVODE.
 *
 * Every implicit step or stage of these integrators solves for y = (x, v) with
 *
 *   x = x^ + g v,   v = v^ + g a,   r(t, x, v, a) = 0,
 *
 * where x^ and v^ are known and g is 1/cj for IDA, gamma for ARKODE and CVODE. This is a step of backward Euler of
 * length g, and its solution is a minimum of the potential
 *
 *   |x - x^ - g v^|^2_M / (2 g^2) + Psi(x)
 *
 * (Ortiz & Stainier 1999). SUNDIALS' own Newton (SUNNonlinSol_Newton) does not use the potential. This solver finds the
 * minimum as flesh's own methods do: line search, filter of negative eigenvalues, steps that stay clear of obstacles,
 * accelerators, kept matrices, as the options of the problem say. It replaces SUNMatrix, SUNLinearSolver and Jacobian,
 * and needs no other calls:
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
 * Accuracy of a solution: the residual's norm is at most that which, with the mass alone, leaves an error of the
 * tolerance that the integrator passes, in its weighted norm. That tolerance is a fraction of a step's tolerance;
 * IDASetNonlinConvCoef, ARKStepSetNonlinConvCoef and CVodeSetNonlinConvCoef set the fraction. The weights must be those
 * of tolerances of positions and velocities. The options' newton_tolerance is not read.
 *
 * A failed solve returns SUN_NLS_CONV_RECVR, and the integrator shortens its step; a fatal status ends the integration,
 * and flesh_error_text() says why. Newton iterations are counted by the integrator (...GetNumNonlinSolvIters) and in the
 * problem's statistics.
 *
 * Lagged forces (friction, follower loads) use the last accepted state; the path from it to every stage is clear of
 * obstacles. For IDA and CVODE the solver knows this state: the last solution from which the integrator continued.
 * ARKODE's stages do not tell it, hence flesh_ode_accept. Lagged quantities are late by a step, an error of order 1
 * that no error test sees. A method whose last stage is the end of the step (ESDIRK, SDIRK, BDF) is clear of
 * obstacles at every accepted state. */
#ifndef FLESH_SUNNONLINSOL_H
#define FLESH_SUNNONLINSOL_H

#include "flesh/ida.h"
#include "flesh/ode.h"

#include <sundials/sundials_nonlinearsolver.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Types of ARKStepGetNonlinearSystemData, since 7.1 ARKodeGetNonlinearSystemData, and of CVodeGetNonlinearSystemData.
 * The program passes these functions, so that flesh links neither library. */
typedef int (*flesh_arkode_system_data)(void *arkode, sunrealtype *t, N_Vector *zpred, N_Vector *z,
                                        N_Vector *Fi, sunrealtype *gamma, N_Vector *sdata,
                                        void **user_data);
typedef int (*flesh_cvode_system_data)(void *cvode, sunrealtype *t, N_Vector *ypred, N_Vector *yn,
                                       N_Vector *fn, sunrealtype *gamma, sunrealtype *rl1,
                                       N_Vector *zn1, void **user_data);

/* Create a SUNNonlinearSolver of type ROOTFIND for the steps of an IDA, the stages of an ARKStep or the steps of a
 * CVODE (BDF, Adams), with work space and a KINSOL of its own. Vectors are those of ida.h and ode.h, on ranks too,
 * where every call is collective. A solver can be used by one integrator at a time. Returns new, freed by
 * SUNNonlinSolFree after the integrator; the problem, whose options are copied, must outlive it. Errors:
 * FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY, FLESH_ERR_SUNDIALS. */
FLESH_API int flesh_ida_sunnonlinsol_create(flesh_ida_problem *problem, SUNContext context,
                                            SUNNonlinearSolver *solver);
FLESH_API int flesh_arkode_sunnonlinsol_create(flesh_ode_problem *problem,
                                               flesh_arkode_system_data data, SUNContext context,
                                               SUNNonlinearSolver *solver);
FLESH_API int flesh_cvode_sunnonlinsol_create(flesh_ode_problem *problem,
                                              flesh_cvode_system_data data, SUNContext context,
                                              SUNNonlinearSolver *solver);

/* Replaces the weighted norm of y and of its clones, in which the integrator measures its errors e = (e_x, e_v), by a
 * norm of positions alone, the displacement to which the error leads within the last implicit step,
 *
 *   |e_x + g e_v|_M / (tolerance sqrt(3 |M|)),
 *
 * for vectors of flesh_ida_vector_create or flesh_ode_vector_create, before they are cloned. Fast modes of small
 * amplitude count little in it. Use it for motions that steps should follow only as far as they resolve them:
 * impacts, and bodies that recover from a tangle. It does not bound errors of velocities: orders above 2 of IDA and
 * CVODE may gain energy with it. The solver must outlive the integrator. Borrows y. Errors: FLESH_ERR_ARGUMENT. */
FLESH_API int flesh_sunnonlinsol_position_norm(SUNNonlinearSolver solver, N_Vector y);

/* An ARKPostProcessFn: tells the problem that a step that ends at y has been accepted. A solver that is not told
 * fails after some steps, with a sentence. Errors: FLESH_ERR_ARGUMENT. */
FLESH_API int flesh_ode_accept(sunrealtype t, N_Vector y, void *problem);

#ifdef __cplusplus
}
#endif
#endif
