/* sensitivity.h: how results depend on what was put in: exact derivatives of an equilibrium by parameters, and
 * adjoints.
 *
 * A parameter p is given by systems that differ in it, so that anything that makes a system may be one: constants of
 * materials, density, loads and their amplitudes, damping, contact, prescribed motions, rest positions of nodes, an
 * effect of your own. With the residual r(x; p) = 0 and K = dr/dx, a tangent is dx/dp = -K^-1 dr/dp; a quantity Q(x)
 * has the gradient dQ/dp = -lambda . dr/dp with one adjoint K lambda = dQ/dx for all parameters. K is the derivative
 * itself, and what effects lag (follower loads, damping by the current stiffness) belongs to it: lambda <- K^-1 (dQ/dx
 * - K_lag^T lambda) until it stands still. Derivatives by p and by a lagged state are differences of the residual at a
 * fixed state, in which nothing is solved; they are as exact as p is smooth.
 *
 * Functions that return no status cannot fail. */
#ifndef FLESH_SENSITIVITY_H
#define FLESH_SENSITIVITY_H

#include "flesh/integrator.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A parameter: finished systems with the same nodes, tets and constrained dofs at p - 2 difference, p - difference, p
 * + difference and p + 2 difference; borrowed. The outer two may be NULL: central differences of the second order are
 * exact where the residual is at most quadratic in p, as it is in Young's modulus, a density, a load, damping, a
 * muscle's peak stress; for others, as Poisson's ratio, the thickness of contact or a rest position, all four are of
 * the fourth order. A difference of 1e-6 of p serves: a residual has kinks, where contact begins or an eigenvalue is
 * clamped, which a wider one would cross, and leaves round-off below 1e-7. */
typedef struct flesh_parameter {
  const flesh_system *systems[4];
  double difference;
} flesh_parameter;

/* A quantity Q of a state, by its derivatives: dQ/dx [3*n], and weights [3*n] of the residual, of which a reaction is
 * the sum over constrained dofs (weight 1 on those, 0 elsewhere). Either may be NULL; borrowed. */
typedef struct flesh_quantity {
  const double *by_x, *of_residual;
} flesh_quantity;

typedef struct flesh_sensitivity flesh_sensitivity;

/* Sensitivities of equilibria of a finished system, which is borrowed; solves go by `options` until a residual is
 * `tolerance` of its right-hand side, in [1e-13, 1). Returns new.
 * FLESH_ERR_ARGUMENT also for a system that ranks share out. Further errors: FLESH_ERR_MEMORY, FLESH_ERR_SUNDIALS. */
FLESH_API int flesh_sensitivity_create(const flesh_system *system, const flesh_solver_options *options, double tolerance,
                                       flesh_sensitivity **sensitivity);
FLESH_API void flesh_sensitivity_destroy(flesh_sensitivity **sensitivity);

/* Linearises and factors at an equilibrium, which is copied: state->t, x, multipliers and internal variables.
 * `lagged`: what the equilibrium's solve lagged (friction: the state before the step; NULL: the equilibrium itself, as
 * statics have it that repeat a solve for follower loads); a lagged state that is given is constant.
 * FLESH_ERR_ARGUMENT where the free forces are more than a hundredth of the largest effect's: it is no equilibrium.
 * FLESH_ERR_SOLVE where K is singular. */
FLESH_API int flesh_sensitivity_set(flesh_sensitivity *sensitivity, const flesh_state *state,
                                    const flesh_lagged *lagged);

/* force [3*n] = dr/dp, N per unit of p, with what p moves of constrained dofs. No solve.
 * Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_SOLVE. */
FLESH_API int flesh_sensitivity_force(flesh_sensitivity *sensitivity, const flesh_parameter *parameter, double *force);
/* dx [3*n] = dx/dp, constrained dofs included. One solve. Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_SOLVE. */
FLESH_API int flesh_sensitivity_tangent(flesh_sensitivity *sensitivity, const flesh_parameter *parameter, double *dx);
/* dx [3*n], the change of the equilibrium, 0 on constrained dofs, for a change `force` [3*n] of the residual, of which
 * constrained dofs are not read: -K^-1 force. One solve. Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_SOLVE. */
FLESH_API int flesh_sensitivity_respond(flesh_sensitivity *sensitivity, const double *force, double *dx);
/* lambda [3*n], 0 on constrained dofs, with dQ = -lambda . dr for any change dr [3*n] of the free residual: a change of
 * a force, or the residual of another discretisation. One solve. Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_SOLVE. */
FLESH_API int flesh_sensitivity_adjoint(flesh_sensitivity *sensitivity, const flesh_quantity *quantity, double *lambda);
/* gradient [count] = dQ/dp of all parameters [count] by one adjoint; what Q says of p itself is the caller's to add.
 * Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_SOLVE. */
FLESH_API int flesh_sensitivity_gradient(flesh_sensitivity *sensitivity, const flesh_quantity *quantity, int count,
                                         const flesh_parameter *parameters, double *gradient);

/* A constant of the material of each single tet, as of a map of stiffness: bodies whose materials differ in it
 * alone, on one mesh or equal ones, tet t by difference[t] [tets] from bodies[0] to bodies[1]; 0: of that tet it is
 * no parameter. Borrowed. */
typedef struct flesh_tet_parameter {
  const flesh_body *bodies[2];
  const double *difference;
} flesh_tet_parameter;

/* forces [tets][nodes][3] = dr/dp for the constant p of each tet, at that tet's nodes, which alone feel it: of four
 * nodes in a mesh of order 1, of ten at order 2, corners and then those of flesh_mesh_tet_edges; N per unit of p.
 * With the adjoint lambda of a quantity, dQ/dp of a tet is the sum over its nodes of -lambda . forces; a change dp of
 * all tets is answered by flesh_sensitivity_respond to the sum of forces dp. No solve: a thousand tets take two
 * residuals. `state`: t, x, multipliers. Exact as differences of the second order are.
 * FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY; FLESH_ERR_SOLVE where a body has no forces there. */
FLESH_API int flesh_tet_forces(const flesh_tet_parameter *parameter, const flesh_state *state, double *forces);

/* A recorded motion. */
typedef struct flesh_trajectory flesh_trajectory;

/* States that are enough for a thousand steps, each of which a gradient then takes two or three times more. */
enum { FLESH_TRAJECTORY_STATES = 40 };

/* Records the steps that the integrator takes from now on, of a motion or of equilibria whose friction lags the one
 * before, whose states follow each other, in memory of so many `states` (x and v of the body: 6 n numbers; at least 20)
 * and 16 bytes for each step: the unknowns of the last steps, and checkpoints from which a gradient takes the others
 * again, with the same bits. For that the integrator's solvers forget what they have learned whenever 16 states are
 * full: with methods of one stage every 20 steps. Its solves are those of the integrator's options, until a residual is
 * `tolerance` of its right-hand side, in [1e-13, 1). Borrows the integrator, whose options stay as they are; it may be
 * destroyed before the trajectory where all parts are kept. Steps that errors choose are taken as they were chosen. A
 * step ends with FLESH_ERR_ARGUMENT where it has no sensitivities: a tangle was removed; internal variables change other
 * than by something that breaks; another state than the last step's end. Returns new. FLESH_ERR_ARGUMENT also for ida.
 * Further errors: FLESH_ERR_MEMORY, FLESH_ERR_SUNDIALS. */
FLESH_API int flesh_trajectory_create(flesh_integrator *integrator, double tolerance, int states,
                                      flesh_trajectory **trajectory);
FLESH_API void flesh_trajectory_destroy(flesh_trajectory **trajectory);

typedef struct flesh_trajectory_costs {
  int parts;    /* of steps that are recorded */
  int repeated; /* parts that gradients have taken again */
  size_t bytes; /* of recorded parts and checkpoints at the same time, at most */
} flesh_trajectory_costs;
/* Cannot fail. */
FLESH_API flesh_trajectory_costs flesh_trajectory_get_costs(const flesh_trajectory *trajectory);

/* Values of a function q of the state over a motion: the last one; the integral over time by the trapezoidal rule, at
 * the first state and those to which calls of flesh_integrator_step have led; the mean, that integral over the time. */
typedef enum flesh_over { FLESH_AT_END, FLESH_INTEGRAL, FLESH_MEAN } flesh_over;

/* Called with the time of a state, from the last one to the first, and what there is so far of the derivatives of Q by
 * its x and v [3*n] through later states, to which it adds those by what Q reads of it; another status than 0 ends the
 * pass. */
typedef int (*flesh_adjoint_visit)(void *data, double t, double *by_x, double *by_v);

/* A quantity of a motion by the derivatives of q, by_x and by_v [3*n] (NULL: 0; borrowed): at the last state or, over
 * time, those of a linear q. Of another q `visit`, unless it is NULL, adds those at each state that counts to zeros. */
typedef struct flesh_motion_quantity {
  const double *by_x, *by_v;
  flesh_over over;
  flesh_adjoint_visit visit;
  void *data;
} flesh_motion_quantity;

/* The discrete adjoint of all recorded steps: gradient [count] = dQ/dp, and by_start [6*n] (NULL: not wanted) the
 * derivatives by x and v of the first state; dofs that a method of order 2 constrains jump from there. One linear solve
 * for each solve of a stage; as exact as the steps were solved. A parameter that moves a time of the motion at which
 * what is prescribed or a load turns, begins or ends has derivatives by backward Euler only. While steps are taken
 * again, the integrator's memory of the run's end is saved (flesh_integrator_save); afterwards it is there again.
 * FLESH_ERR_ARGUMENT also where no step is recorded, or the integrator is gone but parts are not kept; FLESH_ERR_MEMORY,
 * FLESH_ERR_SOLVE. */
FLESH_API int flesh_trajectory_gradient(flesh_trajectory *trajectory, const flesh_motion_quantity *quantity, int count,
                                        const flesh_parameter *parameters, double *gradient, double *by_start);

/* gradient [tets] = dQ/dp for the constant p of each tet, by one adjoint of all recorded steps, for a Q of all states:
 * `visit` is called once for the first one and for those to which calls of flesh_integrator_step have led. A tet bears
 * on elasticity and on damping by its stiffness. Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY, FLESH_ERR_SOLVE, and
 * what `visit` returns. */
FLESH_API int flesh_trajectory_tet_gradient(flesh_trajectory *trajectory, const flesh_tet_parameter *parameter,
                                            flesh_adjoint_visit visit, void *data, double *gradient);

/* The tangent of all recorded steps: dx and dv [3*n], the derivatives of the last state by the parameter. One linear
 * solve for each solve of a stage: for few parameters and many quantities. Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY,
 * FLESH_ERR_SOLVE. */
FLESH_API int flesh_trajectory_tangent(flesh_trajectory *trajectory, const flesh_parameter *parameter, double *dx,
                                       double *dv);

/* Called with the derivatives dx and dv [3*n] by parameter k of the state at time t, borrowed; a status other than 0
 * ends the pass. */
typedef int (*flesh_tangent_visit)(void *data, int k, double t, const double *dx, const double *dv);
/* The tangents of all recorded steps by parameters [count], as flesh_trajectory_tangent, at every state: `visit` is
 * called for each parameter at the first one and at those to which calls of flesh_integrator_step have led. They share
 * what is factored, and take some 50 vectors [3*n] each. `start` [count][6*n]: derivatives of x and v of the first
 * state; NULL: 0. Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY, FLESH_ERR_SOLVE, and what `visit` returns. */
FLESH_API int flesh_trajectory_tangents(flesh_trajectory *trajectory, int count, const flesh_parameter *parameters,
                                        const double *start, flesh_tangent_visit visit, void *data);

#ifdef __cplusplus
}
#endif
#endif
