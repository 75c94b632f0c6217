/* sensitivity.h: sensitivities of results to the inputs: exact derivatives of equilibria and motions with respect to
 * parameters, and adjoints.
 *
 * A parameter p is given by systems that differ in it, so that anything from which a system is made may be a parameter:
 * constants of materials, density, loads and their amplitudes, damping, contact, prescribed motions, rest positions of
 * nodes, an effect of your own. With the residual r(x; p) = 0 and K = dr/dx, a tangent is dx/dp = -K^-1 dr/dp; a
 * quantity Q(x) has the gradient dQ/dp = -lambda . dr/dp with one adjoint K lambda = dQ/dx for all parameters. K is the
 * exact derivative, including that of lagged quantities (follower loads, damping by the current stiffness): lambda <-
 * K^-1 (dQ/dx - K_lag^T lambda) is iterated until it converges. Derivatives with respect to p and to a lagged state are
 * differences of the residual at a fixed state, without a solve; they are as exact as p is smooth.
 *
 * Functions that return no status cannot fail. */
#ifndef FLESH_SENSITIVITY_H
#define FLESH_SENSITIVITY_H

#include "flesh/integrator.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A parameter p: finished systems with the same nodes, tets and constrained dofs at p - 2 difference, p - difference,
 * p + difference and p + 2 difference; borrowed. The outer two may be NULL: central differences of second order are
 * exact if the residual is at most quadratic in p, as for Young's modulus, a density, a load, damping, a muscle's
 * peak stress. For other parameters, such as Poisson's ratio, the thickness of contact or a rest position, all four
 * give fourth order. A difference of 1e-6 of p is appropriate: it leaves round-off below 1e-7, and a larger one would
 * cross kinks of the residual, where contact begins or an eigenvalue is clamped. Results have no derivative with
 * respect to a thickness that equals a pair's distance at rest: a larger one excludes the pair from contact. */
typedef struct flesh_parameter {
  const flesh_system *systems[4];
  double difference;
} flesh_parameter;

/* A quantity Q of a state, given by its derivatives: dQ/dx [3*n], and weights [3*n] of the residual (a reaction is
 * the residual's sum over constrained dofs: weight 1 on those, 0 elsewhere). Either may be NULL; borrowed. */
typedef struct flesh_quantity {
  const double *by_x, *of_residual;
} flesh_quantity;

typedef struct flesh_sensitivity flesh_sensitivity;

/* Creates sensitivities of equilibria of a finished system, which is borrowed. Solves use `options` and end when the
 * residual is `tolerance` times the right-hand side, tolerance in [1e-13, 1). Returns new. FLESH_ERR_ARGUMENT also
 * for a system that several ranks share. Further errors: FLESH_ERR_MEMORY, FLESH_ERR_SUNDIALS. */
FLESH_API int flesh_sensitivity_create(const flesh_system *system, const flesh_solver_options *options, double tolerance,
                                       flesh_sensitivity **sensitivity);
FLESH_API void flesh_sensitivity_destroy(flesh_sensitivity **sensitivity);

/* Linearises and factors at an equilibrium, which is copied: state->t, x, multipliers and internal variables.
 * `lagged` is the lagged state of the equilibrium's solve (for friction, the state before the step), which counts as
 * constant. NULL: the equilibrium itself, as in statics that repeat a solve for follower loads. FLESH_ERR_ARGUMENT if
 * the free forces are more than a hundredth of the largest effect's, so that it is no equilibrium; FLESH_ERR_SOLVE if
 * K is singular or the residual has no value. Further errors: FLESH_ERR_MEMORY. */
FLESH_API int flesh_sensitivity_set(flesh_sensitivity *sensitivity, const flesh_state *state,
                                    const flesh_lagged *lagged);

/* Computes force [3*n] = dr/dp, N per unit of p, including the effect of constrained dofs that p moves. No solve.
 * Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_SOLVE. */
FLESH_API int flesh_sensitivity_force(flesh_sensitivity *sensitivity, const flesh_parameter *parameter, double *force);
/* Computes dx [3*n] = dx/dp, constrained dofs included. One solve. Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_SOLVE. */
FLESH_API int flesh_sensitivity_tangent(flesh_sensitivity *sensitivity, const flesh_parameter *parameter, double *dx);
/* Computes dx [3*n] = -K^-1 force, the change of the equilibrium for a change `force` [3*n] of the residual. On
 * constrained dofs `force` is not read, and dx is 0. One solve. Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_SOLVE. */
FLESH_API int flesh_sensitivity_respond(flesh_sensitivity *sensitivity, const double *force, double *dx);
/* Computes the adjoint lambda [3*n], 0 on constrained dofs, with dQ = -lambda . dr for any change dr [3*n] of the
 * free residual: a change of a force, or the residual of another discretisation. One solve. Errors:
 * FLESH_ERR_ARGUMENT, FLESH_ERR_SOLVE. */
FLESH_API int flesh_sensitivity_adjoint(flesh_sensitivity *sensitivity, const flesh_quantity *quantity, double *lambda);
/* Computes gradient [count] = dQ/dp for all parameters [count] by one adjoint; if Q also depends on p directly, the
 * caller adds that derivative. Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_SOLVE. */
FLESH_API int flesh_sensitivity_gradient(flesh_sensitivity *sensitivity, const flesh_quantity *quantity, int count,
                                         const flesh_parameter *parameters, double *gradient);

/* A material constant of each single tet, for example for a map of stiffness. The materials of the two bodies, on one
 * mesh or equal ones, differ only in this constant, for tet t by difference[t] [tets] from bodies[0] to bodies[1]; 0:
 * the tet's constant is no parameter. Borrowed. */
typedef struct flesh_tet_parameter {
  const flesh_body *bodies[2];
  const double *difference;
} flesh_tet_parameter;

/* Computes forces [tets][nodes][3] = dr/dp for the constant p of each tet, at the tet's nodes, the only ones it acts
 * on: four in a mesh of order 1, ten at order 2 (corners, then those of flesh_mesh_tet_edges); N per unit of p. With
 * the adjoint lambda of a quantity, dQ/dp of a tet is the sum over its nodes of -lambda . forces. For a change dp of
 * all tets, flesh_sensitivity_respond to the sum of forces dp gives the change of the equilibrium. No solve: a
 * thousand tets take two residuals. `state`: t, x, multipliers. Exact to second order in the differences.
 * FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY; FLESH_ERR_SOLVE if a body's forces are undefined at the state. */
FLESH_API int flesh_tet_forces(const flesh_tet_parameter *parameter, const flesh_state *state, double *forces);

/* A recorded motion. */
typedef struct flesh_trajectory flesh_trajectory;

/* Number of states that suffices for a thousand steps: a gradient then takes each step another two or three times. */
enum { FLESH_TRAJECTORY_STATES = 40 };

/* Records the steps that the integrator takes from now on: of a motion, or of successive equilibria whose friction
 * lags the previous one. Each step must begin where the last one ended. The record takes memory for `states` states (x
 * and v of the body: 6 n numbers; at least 20) and 16 bytes per step: it holds the unknowns of the last steps, and
 * checkpoints from which a gradient repeats the others, bitwise the same. For that the integrator's solvers discard
 * what they have learned whenever 16 states are full: every 20 steps with methods of one stage. Linear solves use the
 * integrator's options and end when the residual is `tolerance` times the right-hand side, tolerance in [1e-13, 1).
 * Borrows the integrator, whose options must not change; it may be destroyed before the trajectory if all parts of the
 * steps are kept. With error control, steps are repeated with the lengths first chosen, and momenta of free bodies are
 * not corrected, as they are without a record. A step ends with FLESH_ERR_ARGUMENT if it has no sensitivities: a
 * tangle was removed; contact is still ignored between bodies that intersect at the start; internal variables change
 * other than by something that breaks; the state is not the last step's end. Returns new. FLESH_ERR_ARGUMENT also for
 * ida. Further errors: FLESH_ERR_MEMORY, FLESH_ERR_SUNDIALS. */
FLESH_API int flesh_trajectory_create(flesh_integrator *integrator, double tolerance, int states,
                                      flesh_trajectory **trajectory);
FLESH_API void flesh_trajectory_destroy(flesh_trajectory **trajectory);

typedef struct flesh_trajectory_costs {
  int parts;    /* number of recorded parts of steps */
  int repeated; /* number of parts that gradients have repeated */
  size_t bytes; /* largest size of recorded parts and checkpoints together */
} flesh_trajectory_costs;
/* Returns the costs of the recording and its gradients. Cannot fail. */
FLESH_API flesh_trajectory_costs flesh_trajectory_get_costs(const flesh_trajectory *trajectory);

/* The value Q of a function q of the state over a motion: the last value; the integral over time by the trapezoidal
 * rule, at the first state and the ends of calls of flesh_integrator_step; the mean, that integral divided by the
 * time. */
typedef enum flesh_over { FLESH_AT_END, FLESH_INTEGRAL, FLESH_MEAN } flesh_over;

/* Called for each state, from the last one to the first, with its time and the derivatives by_x and by_v [3*n] of Q
 * with respect to its x and v through later states. The function adds the derivatives of the terms of Q that read
 * this state. A status other than 0 ends the pass. */
typedef int (*flesh_adjoint_visit)(void *data, double t, double *by_x, double *by_v);

/* A quantity Q of a motion, given by the derivatives by_x and by_v [3*n] of q (NULL: 0; borrowed): at the last state
 * or, over time, those of a linear q. For a nonlinear q set `visit` (else NULL): it adds the derivatives at each
 * state that counts to zeros. */
typedef struct flesh_motion_quantity {
  const double *by_x, *by_v;
  flesh_over over;
  flesh_adjoint_visit visit;
  void *data;
} flesh_motion_quantity;

/* Computes the discrete adjoint of all recorded steps: gradient [count] = dQ/dp, and by_start [6*n] (NULL: not
 * wanted) the derivatives with respect to x and v of the first state; with methods of order 2, constrained dofs jump
 * from there to their prescribed motion. One linear solve for each solve of a stage; as exact as the steps were
 * solved. For a parameter that moves a time at which a prescribed motion or a load turns, begins or ends, only
 * backward Euler has derivatives. While steps are repeated, the integrator's memory at the end of the run is saved
 * (flesh_integrator_save); it is restored afterwards. FLESH_ERR_ARGUMENT also if no step is recorded, or if the
 * integrator is gone but not all parts are kept; FLESH_ERR_MEMORY, FLESH_ERR_SOLVE. */
FLESH_API int flesh_trajectory_gradient(flesh_trajectory *trajectory, const flesh_motion_quantity *quantity, int count,
                                        const flesh_parameter *parameters, double *gradient, double *by_start);

/* Computes gradient [tets] = dQ/dp for the constant p of each tet, by one adjoint of all recorded steps, for a Q of
 * all states: `visit` is called once for the first state and for each end of a call of flesh_integrator_step. A tet's
 * constant affects elasticity and damping by its stiffness. Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY,
 * FLESH_ERR_SOLVE, and those of `visit`. */
FLESH_API int flesh_trajectory_tet_gradient(flesh_trajectory *trajectory, const flesh_tet_parameter *parameter,
                                            flesh_adjoint_visit visit, void *data, double *gradient);

/* Computes the tangent of all recorded steps: dx and dv [3*n], the derivatives of the last state with respect to the
 * parameter. One linear solve for each solve of a stage: use it for few parameters and many quantities. Errors:
 * FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY, FLESH_ERR_SOLVE. */
FLESH_API int flesh_trajectory_tangent(flesh_trajectory *trajectory, const flesh_parameter *parameter, double *dx,
                                       double *dv);

/* Called with the derivatives dx and dv [3*n], borrowed, of the state at time t with respect to parameter k; a status
 * other than 0 ends the pass. */
typedef int (*flesh_tangent_visit)(void *data, int k, double t, const double *dx, const double *dv);
/* Computes the tangents of all recorded steps with respect to parameters [count], as flesh_trajectory_tangent does,
 * at every state: `visit` is called for each parameter at the first state and at each end of a call of
 * flesh_integrator_step. The tangents share factorisations, and take some 50 vectors [3*n] each. `start`
 * [count][6*n]: derivatives of x and v of the first state; NULL: 0. Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY,
 * FLESH_ERR_SOLVE, and those of `visit`. */
FLESH_API int flesh_trajectory_tangents(flesh_trajectory *trajectory, int count, const flesh_parameter *parameters,
                                        const double *start, flesh_tangent_visit visit, void *data);

#ifdef __cplusplus
}
#endif
#endif
