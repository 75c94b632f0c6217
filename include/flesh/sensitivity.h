/* sensitivity.h: exact derivatives of results by parameters: tangents and adjoints of equilibria and of motions.
 *
 * A parameter p is given by systems that differ in it, so that any input of a system may be one: constants of
 * materials, density, loads and their amplitudes, damping, contact, prescribed motions, rest positions of nodes, an
 * effect of your own. With the residual r(x; p) = 0 and K = dr/dx, a tangent is dx/dp = -K^-1 dr/dp; a quantity Q(x)
 * has the gradient dQ/dp = -lambda . dr/dp with one adjoint K lambda = dQ/dx for all parameters. K is the exact
 * derivative, including lagged terms of effects (follower loads, damping by the current stiffness): lambda <- K^-1
 * (dQ/dx - K_lag^T lambda) is repeated until lambda converges. Derivatives by p and by a lagged state are differences
 * of the residual at a fixed state, without a solve; they are as exact as p is smooth.
 *
 * Functions that return no status cannot fail. */
#ifndef FLESH_SENSITIVITY_H
#define FLESH_SENSITIVITY_H

#include "flesh/integrator.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A parameter p: finalized systems with the same nodes, tets and constrained dofs at p - 2 difference, p -
 * difference, p + difference and p + 2 difference; borrowed. The outer two may be NULL: central differences of second
 * order are then used, which are exact where the residual is at most quadratic in p, as in Young's modulus, a
 * density, a load, damping or a muscle's peak stress. For other parameters, such as Poisson's ratio, the thickness of
 * contact or a rest position, all four give fourth order. A difference of 1e-6 p is suitable: a residual has kinks,
 * where contact begins or an eigenvalue is clamped, which a wider one would cross; round-off then stays below 1e-7. */
typedef struct flesh_parameter {
  const flesh_system *systems[4];
  double difference;
} flesh_parameter;

/* A quantity Q of a state, given by its derivatives: dQ/dx [3*n], and weights [3*n] of the residual in Q. A reaction
 * is the sum of the residual over constrained dofs (weight 1 there, 0 elsewhere). Either may be NULL; borrowed. */
typedef struct flesh_quantity {
  const double *by_x, *of_residual;
} flesh_quantity;

typedef struct flesh_sensitivity flesh_sensitivity;

/* Makes the sensitivities of equilibria of a finalized system, which is borrowed. Linear solves use `options` until
 * the residual is `tolerance`, in [1e-13, 1), of the right-hand side. Returns new. FLESH_ERR_ARGUMENT also for a
 * system that is shared out among ranks. Further errors: FLESH_ERR_MEMORY, FLESH_ERR_SUNDIALS. */
FLESH_API int flesh_sensitivity_create(const flesh_system *system, const flesh_solver_options *options, double tolerance,
                                       flesh_sensitivity **sensitivity);
FLESH_API void flesh_sensitivity_destroy(flesh_sensitivity **sensitivity);

/* Linearises and factors at an equilibrium, which is copied: state->t, x, multipliers and internal variables.
 * `lagged`: the lagged state of the equilibrium's solve (for friction, the state before the step), constant in the
 * derivatives; NULL: the equilibrium itself, as in statics, which repeats solves for follower loads.
 * FLESH_ERR_ARGUMENT if the state is no equilibrium: the free forces exceed a hundredth of the largest effect's.
 * FLESH_ERR_SOLVE where K is singular. */
FLESH_API int flesh_sensitivity_set(flesh_sensitivity *sensitivity, const flesh_state *state,
                                    const flesh_lagged *lagged);

/* Computes force [3*n] = dr/dp, N per unit of p, including the motion of constrained dofs with p. No solve. Errors:
 * FLESH_ERR_ARGUMENT, FLESH_ERR_SOLVE. */
FLESH_API int flesh_sensitivity_force(flesh_sensitivity *sensitivity, const flesh_parameter *parameter, double *force);
/* Computes dx [3*n] = dx/dp, constrained dofs included. One solve. Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_SOLVE. */
FLESH_API int flesh_sensitivity_tangent(flesh_sensitivity *sensitivity, const flesh_parameter *parameter, double *dx);
/* Computes dx [3*n] = -K^-1 force, the change of the equilibrium for a change `force` [3*n] of the residual.
 * Constrained dofs of `force` are not read, those of dx are 0. One solve. Errors: FLESH_ERR_ARGUMENT,
 * FLESH_ERR_SOLVE. */
FLESH_API int flesh_sensitivity_respond(flesh_sensitivity *sensitivity, const double *force, double *dx);
/* Computes lambda [3*n], 0 on constrained dofs, with dQ = -lambda . dr for any change dr [3*n] of the free residual,
 * such as a change of a force, or the residual of another discretisation. One solve. Errors: FLESH_ERR_ARGUMENT,
 * FLESH_ERR_SOLVE. */
FLESH_API int flesh_sensitivity_adjoint(flesh_sensitivity *sensitivity, const flesh_quantity *quantity, double *lambda);
/* Computes gradient [count] = dQ/dp of all parameters [count] by one adjoint. Where Q depends on p directly, the
 * caller adds that derivative. Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_SOLVE. */
FLESH_API int flesh_sensitivity_gradient(flesh_sensitivity *sensitivity, const flesh_quantity *quantity, int count,
                                         const flesh_parameter *parameters, double *gradient);

/* A material constant of each single tet, as in a map of stiffness, given by two bodies whose materials differ in it
 * alone, on one mesh or equal ones: by difference[t] [tets] in tet t from bodies[0] to bodies[1]; 0: the constant of
 * that tet is no parameter. Borrowed. */
typedef struct flesh_tet_parameter {
  const flesh_body *bodies[2];
  const double *difference;
} flesh_tet_parameter;

/* Computes forces [tets][nodes][3] = dr/dp, N per unit of p, for the constant p of each tet, at the nodes of that
 * tet: four in a mesh of order 1, ten at order 2, corners and then those of flesh_mesh_tet_edges; other nodes feel
 * none. With the adjoint lambda of a quantity, dQ/dp of a tet is the sum over its nodes of -lambda . forces; the
 * response to a change dp of all tets is flesh_sensitivity_respond of the sum of forces dp. No solve: a thousand tets
 * take two residuals. `state`: t, x, multipliers. As exact as differences of second order. FLESH_ERR_ARGUMENT,
 * FLESH_ERR_MEMORY; FLESH_ERR_SOLVE where a body has no forces there. */
FLESH_API int flesh_tet_forces(const flesh_tet_parameter *parameter, const flesh_state *state, double *forces);

/* A recorded motion. */
typedef struct flesh_trajectory flesh_trajectory;

/* Number of recorded states that is enough for a thousand steps; a gradient then repeats each step two or three
 * times. */
enum { FLESH_TRAJECTORY_STATES = 40 };

/* Records the steps that the integrator takes from now on: of a motion, or of equilibria whose friction lags the one
 * before. Each step must start at the end of the last. Needs memory for `states` states (x and v of the body, 6 n
 * numbers; at least 20) and 16 bytes for each step: it keeps the unknowns of the last steps, and checkpoints from
 * which a gradient repeats the others with the same bits. To that end the integrator's solvers forget what they have
 * learned whenever 16 states are full: every 20 steps with methods of one stage. Linear solves of gradients use the
 * integrator's options until the residual is `tolerance`, in [1e-13, 1), of the right-hand side. Borrows the
 * integrator, whose options stay as they are; it may be destroyed before the trajectory if all parts are kept. Steps
 * chosen by errors are repeated as they were chosen. A step ends with FLESH_ERR_ARGUMENT where it has no
 * sensitivities: a tangle was removed; internal variables change other than by something that breaks; it starts from
 * another state than the last step's end. Returns new. FLESH_ERR_ARGUMENT also for ida. Further errors:
 * FLESH_ERR_MEMORY, FLESH_ERR_SUNDIALS. */
FLESH_API int flesh_trajectory_create(flesh_integrator *integrator, double tolerance, int states,
                                      flesh_trajectory **trajectory);
FLESH_API void flesh_trajectory_destroy(flesh_trajectory **trajectory);

typedef struct flesh_trajectory_costs {
  int parts;    /* number of recorded parts, each a run of steps */
  int repeated; /* number of parts that gradients have repeated */
  size_t bytes; /* largest size of recorded parts and checkpoints at the same time */
} flesh_trajectory_costs;
/* Returns the costs of the recording and its gradients. Cannot fail. */
FLESH_API flesh_trajectory_costs flesh_trajectory_get_costs(const flesh_trajectory *trajectory);

/* How a function q of the state is evaluated over a motion: at its last state; integrated over time by the
 * trapezoidal rule over the first state and those at which calls of flesh_integrator_step ended; or that integral
 * divided by the time. */
typedef enum flesh_over { FLESH_AT_END, FLESH_INTEGRAL, FLESH_MEAN } flesh_over;

/* Called with the time of each state, from the last to the first, and the derivatives of Q by its x and v [3*n] so
 * far, through later states. Adds the direct derivatives of Q by this x and v. A status other than 0 ends the pass. */
typedef int (*flesh_adjoint_visit)(void *data, double t, double *by_x, double *by_v);

/* A quantity Q of a motion, given by the derivatives by_x and by_v [3*n] of q (NULL: 0; borrowed): at the last state
 * or, over time, those of a linear q. For a q that is not linear, `visit` (NULL: none) adds its derivatives at each
 * state that counts, to zeros. */
typedef struct flesh_motion_quantity {
  const double *by_x, *by_v;
  flesh_over over;
  flesh_adjoint_visit visit;
  void *data;
} flesh_motion_quantity;

/* Computes the discrete adjoint of all recorded steps: gradient [count] = dQ/dp, and by_start [6*n] (NULL: not
 * wanted), the derivatives by x and v of the first state; dofs that a method of order 2 constrains jump from there.
 * Takes one linear solve for each solve of a stage; as exact as the steps were solved. For a parameter that moves a
 * time at which a prescribed motion or a load turns, begins or ends, only backward Euler has derivatives. While steps
 * are repeated, the integrator's memory of the run's end is saved (flesh_integrator_save); it is restored afterwards.
 * FLESH_ERR_ARGUMENT also if no step is recorded, or the integrator is gone but parts are not kept; FLESH_ERR_MEMORY,
 * FLESH_ERR_SOLVE. */
FLESH_API int flesh_trajectory_gradient(flesh_trajectory *trajectory, const flesh_motion_quantity *quantity, int count,
                                        const flesh_parameter *parameters, double *gradient, double *by_start);

/* Computes gradient [tets] = dQ/dp for the constant p of each tet, by one adjoint of all recorded steps. Q depends on
 * all states: `visit` is called once for the first one and for each at which a call of flesh_integrator_step ended.
 * The constant acts through elasticity and through damping by the tet's stiffness. Errors: FLESH_ERR_ARGUMENT,
 * FLESH_ERR_MEMORY, FLESH_ERR_SOLVE, and the status of `visit`. */
FLESH_API int flesh_trajectory_tet_gradient(flesh_trajectory *trajectory, const flesh_tet_parameter *parameter,
                                            flesh_adjoint_visit visit, void *data, double *gradient);

/* Computes the tangent of all recorded steps: dx and dv [3*n], the derivatives of the last state by the parameter.
 * Takes one linear solve for each solve of a stage: suited to few parameters and many quantities. Errors:
 * FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY, FLESH_ERR_SOLVE. */
FLESH_API int flesh_trajectory_tangent(flesh_trajectory *trajectory, const flesh_parameter *parameter, double *dx,
                                       double *dv);

/* Called with the derivatives dx and dv [3*n], borrowed, of the state at time t by parameter k; a status other than 0
 * ends the pass. */
typedef int (*flesh_tangent_visit)(void *data, int k, double t, const double *dx, const double *dv);
/* Computes the tangents of all recorded steps by parameters [count], as flesh_trajectory_tangent does, at every
 * state: `visit` is called for each parameter at the first state and at those at which calls of flesh_integrator_step
 * ended. The tangents share factorisations, and take some 50 vectors [3*n] each. `start` [count][6*n]: derivatives of
 * x and v of the first state; NULL: 0. Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY, FLESH_ERR_SOLVE, and the status
 * of `visit`. */
FLESH_API int flesh_trajectory_tangents(flesh_trajectory *trajectory, int count, const flesh_parameter *parameters,
                                        const double *start, flesh_tangent_visit visit, void *data);

#ifdef __cplusplus
}
#endif
#endif
