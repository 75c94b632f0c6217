/* integrator.h: time stepping and statics. An integrator owns its KINSOL; states are plain data.
 * Functions that return no status cannot fail. */
#ifndef FLESH_INTEGRATOR_H
#define FLESH_INTEGRATOR_H

#include <stddef.h>

#include "flesh/contact.h"
#include "flesh/solver.h"
#include "flesh/state.h"
#include "flesh/system.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Methods, ROW(NAME, name, text, order, doc): the one list from which the enum, the names in a scene and their docs
 * are made. */
#define FLESH_METHOD_LIST(ROW)                                                                     \
  ROW(BACKWARD_EULER, backward_euler, "backward-euler", 1, "strong damping, robust")               \
  ROW(STATIC, static, "static", 0, "solves for equilibrium")                                       \
  ROW(BDF2, bdf2, "bdf2", 2, "damps fast oscillations")                                            \
  ROW(MIDPOINT, midpoint, "midpoint", 2,                                                           \
      "conserves linear and angular momentum, and the energy of resolved motion; no damping, so "  \
      "violent motion needs short steps")                                                          \
  ROW(NEWMARK, newmark, "newmark", 2,                                                              \
      "the trapezoidal rule with the default beta and gamma; no damping, like midpoint")           \
  ROW(HHT, hht, "hht", 2, "newmark with damping of fast oscillations, set by alpha")               \
  ROW(GENERALIZED_ALPHA, generalized_alpha, "generalized-alpha", 2,                                \
      "like hht, with damping set by spectral_radius and less damping of resolved motion")         \
  ROW(RUNGE_KUTTA, runge_kutta, "runge-kutta", 3,                                                  \
      "diagonally implicit Runge-Kutta methods (table), whose stages are solved like steps of "    \
      "backward Euler; with a tolerance the local error sets the steps")                           \
  ROW(IDA, ida, "ida", 0,                                                                          \
      "IDA's variable steps and orders up to max_order; errors of stiff bodies without "           \
      "constraints may be tens of tolerances")

typedef enum flesh_method {
#define FLESH_METHOD_ENUM(NAME, name, text, order, doc) FLESH_METHOD_##NAME,
  FLESH_METHOD_LIST(FLESH_METHOD_ENUM)
#undef FLESH_METHOD_ENUM
} flesh_method;

/* Return the method's name in a scene ("backward-euler"), and its order of accuracy in time (0: statics, and ida,
 * which chooses it); NULL and 0 for an unknown method. Cannot fail. */
FLESH_API const char *flesh_method_name(flesh_method method);
FLESH_API int flesh_method_order(flesh_method method);

/* Parameters of the methods, each of which reads only its own: ROW(name, default, least, most, the range as text,
 * doc), all of them keys of a scene's `time`. The least may depend on other options. */
#define FLESH_METHOD_OPTION_LIST(ROW)                                                              \
  ROW(alpha, -0.1, -1. / 3, 0, "[-1/3, 0]",                                                        \
      "parameter of hht (Hilber, Hughes & Taylor 1977), in [-1/3, 0]: a smaller value damps fast " \
      "oscillations more; gamma = 1/2 - alpha, beta = (1 - alpha)^2/4")                            \
  ROW(gamma, 1/2, 0.5, 1, "[1/2, 1]",                                                              \
      "parameter of newmark, in [1/2, 1]; above 1/2 it damps and is of first order")               \
  ROW(beta, 1/4, options->gamma / 2, 1, "[gamma/2, 1]",                                            \
      "parameter of newmark, in [gamma/2, 1]")                                                     \
  ROW(spectral_radius, 0.8, 0, 1, "[0, 1]",                                                        \
      "parameter of generalized-alpha (Chung & Hulbert 1993), in [0, 1]: fraction of infinitely "  \
      "fast oscillations that remains after a step; 1: no damping")

/* Butcher tables of runge-kutta, ROW(NAME, name, doc): all are L-stable and stiffly accurate, with an explicit first
 * stage and an embedded method that estimates the error. */
#define FLESH_TABLE_LIST(ROW)                                                                      \
  ROW(AUTO, "auto", "esdirk324 when steps are hard to solve or stiff parts fly, else esdirk325")   \
  ROW(ESDIRK325, "esdirk325", "ESDIRK3(2)5L[2]SA (Kennedy & Carpenter 2016): order 3, four "       \
                              "solves a step; the most accurate")                                  \
  ROW(ESDIRK324, "esdirk324", "ESDIRK3(2)4L[2]SA (Kennedy & Carpenter 2016): order 3, three "      \
                              "solves a step; more damping of unresolved motion")                  \
  ROW(TRBDF2, "trbdf2", "TR-BDF2 (Bank et al. 1985; Hosea & Shampine 1996): order 2, two solves "  \
                        "a step")

typedef enum flesh_table {
#define FLESH_TABLE_ENUM(NAME, name, doc) FLESH_TABLE_##NAME,
  FLESH_TABLE_LIST(FLESH_TABLE_ENUM)
#undef FLESH_TABLE_ENUM
} flesh_table;

typedef struct flesh_method_options {
#define FLESH_METHOD_OPTION(name, ...) double name;
  FLESH_METHOD_OPTION_LIST(FLESH_METHOD_OPTION)
#undef FLESH_METHOD_OPTION
  flesh_table table; /* table of runge-kutta */
} flesh_method_options;
/* Fills in the defaults. Cannot fail. */
FLESH_API void flesh_method_options_default(flesh_method_options *options);
/* Returns FLESH_ERR_ARGUMENT when a value is out of its range. */
FLESH_API int flesh_method_options_check(const flesh_method_options *options);

/* Facts known about a step that could not be taken. */
typedef struct flesh_failure {
  int status;   /* status of the last attempt */
  double t, h;  /* s, start and length of the last attempt */
  int halvings; /* number of times that the step had been halved */
  double residual, target; /* N, 2-norms over the free dofs */
  int worst_tet; /* tet with the smallest J at the last iterate, or -1 */
  double worst_J, worst_position[3];
  int worst_node; /* node with the largest residual (ida: largest local error) at the last iterate, or -1 */
  int order;      /* ida: order of the last attempt; else 0 */
  /* The largest |mean of J - 1| of incompressible tets, if the forces balance but the tets do not keep their volumes;
   * else 0. */
  double volume_gap;
  double load; /* in equilibria the last factor of the loads that was tried; else 0 */
} flesh_failure;

/* One internal step of a method that chooses its steps by an error estimate. */
typedef struct flesh_internal_step {
  double t, h; /* s, end and length of the step */
  int order;
  int rejected, convergence_failures; /* rejected attempts before it: by the error, and for lack of convergence */
  const flesh_state *state;           /* state at t, valid during the call */
} flesh_internal_step;

typedef struct flesh_adaptive_options {
  /* 1: methods that estimate their error (all methods of fixed steps except midpoint) choose their own steps by it,
   * within the steps that the caller asks for; with RUNGE_KUTTA this is `method: adaptive` of a scene. 0, the default:
   * they take fixed steps, and only IDA, which always chooses its steps, reads the members below. */
  int control;
  /* Target for the error of positions, as a fraction of the body's longest side L; (0, 1). With q = max_order, IDA
   * gets the absolute local tolerances e L for positions and e V for velocities (flesh_ida_tolerances), e =
   * tolerance^(1 + 1/q): local errors decrease as h^(q+1), but their sum only as h^q. */
  double tolerance;
  /* 1 to 5. Orders above 2 are not A-stable: energy may grow, and steps become short at loose tolerances. */
  int max_order;
  double max_step; /* s; INFINITY: no limit */
  int max_steps;   /* maximum number of internal steps in one flesh_integrator_step */
  /* Called after every internal step; may be NULL. A negative status ends flesh_integrator_step with it. */
  int (*observe)(void *data, const flesh_internal_step *step);
  void *observe_data;
} flesh_adaptive_options;
/* Sets the defaults: no error control of methods of fixed steps, tolerance 1e-4, order 2, no limit of a step's
 * length, 100 000 steps. */
FLESH_API void flesh_adaptive_options_default(flesh_adaptive_options *options);

typedef struct flesh_integrator flesh_integrator;

/* Creates an integrator; borrows `system`, which must be finished. Returns new. Errors: FLESH_ERR_ARGUMENT,
 * FLESH_ERR_MEMORY, FLESH_ERR_SUNDIALS. */
FLESH_API int flesh_integrator_create(const flesh_system *system, flesh_method method,
                                      const flesh_solver_options *options,
                                      flesh_integrator **integrator);
FLESH_API void flesh_integrator_destroy(flesh_integrator **integrator);
/* Replaces the default options and restarts the method. FLESH_ERR_ARGUMENT as flesh_method_options_check. */
FLESH_API int flesh_integrator_set_method_options(flesh_integrator *integrator,
                                                  const flesh_method_options *options);
FLESH_API flesh_method flesh_integrator_method(const flesh_integrator *integrator);

/* Takes the state from t to t+h and adds to *stats (may be NULL). A step whose solve fails is retried in parts. In
 * statics it finds the equilibrium at t+h, and raises the load in increments if the solve with the full load fails.
 *
 * Methods of order 2 split the step at events (flesh_system_next_event) within it and restart there; they also restart
 * when the caller passes a state other than the one returned last. Their constrained dofs follow the prescribed motion
 * with its own velocity. Where a method balances forces before the end of the step (midpoint, HHT, generalized-alpha,
 * the first step of BDF2) and an obstacle bars that end, backward Euler takes the step instead (flesh_solve_stats:
 * impact_steps). Backward Euler extrapolates its last steps for the first iterates of a slow motion; another integrator
 * that continues from a state therefore agrees to the solver's tolerance, not bitwise.
 *
 * On failure (FLESH_ERR_SOLVE; of error control and IDA also FLESH_ERR_INTEGRATOR) the state is that of the last
 * success, t included. A start within an obstacle fails so; flesh_system_check, which flesh_run calls first, says
 * where. FLESH_ERR_NONFINITE, with the node, for a state that is not finite and is not the one returned last.
 * FLESH_ERR_ENERGY: see flesh_integrator_set_max_energy_gain. Further errors: FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY,
 * FLESH_ERR_SUNDIALS, fatal ones of effects, and what `stop` and `observe` return. */
FLESH_API int flesh_integrator_step(flesh_integrator *integrator, flesh_state *state, double h,
                                    flesh_solve_stats *stats);

/* Replaces the default options of methods that estimate their error and restarts the integrator. FLESH_ERR_ARGUMENT
 * when a value is out of its range, or when `control` is 1 for a method that does not estimate its error. Further
 * errors: FLESH_ERR_MEMORY. */
FLESH_API int flesh_integrator_set_adaptive(flesh_integrator *integrator,
                                            const flesh_adaptive_options *options);

/* Sets a function `stop` that is called during a step: between the internal steps of ida, else before every Newton
 * iteration and within long PCG solves. If it returns a negative status, the step ends with it, and the state is that
 * of the last finished part of the step. Derivatives of a recorded motion call it before each step (sensitivity.h).
 * It may be called often and must be quick. NULL: not called. */
FLESH_API void flesh_integrator_set_stop(flesh_integrator *integrator, int (*stop)(void *data),
                                         void *data);

/* Returns a warning about the steps so far, as a sentence, although none failed (spurious energy); NULL if there is
 * none. Owned by the integrator. */
FLESH_API const char *flesh_integrator_warning(const flesh_integrator *integrator);

/* Balance of a motion's energy E, kinetic and potential, with the external work W of loads, prescribed motions,
 * moving obstacles and follower loads (dE/dt <= dW/dt; Belytschko, Liu & Moran 2000, section 6.2.3;
 * lib/time/energy_watch.c has the discrete balance of each method). Since dissipation only lowers it, E - W must not
 * rise: its rise above its smallest value so far is the excess, which is spurious energy. In statics all members are
 * 0. */
typedef struct flesh_energy_balance {
  int begun;       /* 1: there is a first state */
  double supplied; /* J, W since the first state */
  double released; /* J, energy dissipated by changes of internal variables (something broke) */
  double excess;   /* J, present excess */
  /* Largest excess, minus the allowance for rounding and the solves' tolerance, as a fraction of `scale`; the same
   * excess, J; and the times, s, at which E - W was smallest before it and at which the excess was largest. */
  double gain, largest, t_least, t_largest;
  double scale;   /* J, largest energy above the lowest potential so far, without the excess */
  double t_since; /* s, time at which E - W was smallest */
  /* Last report of an excess of more than a twentieth: the tet with the smallest J and its centre, and the fastest
   * node; -1: there was no report. */
  int worst_tet, fastest_node;
  double worst_J, worst_position[3], fastest_position[3], fastest_speed;
} flesh_energy_balance;
/* Returns the balance since creation; owned by the integrator. */
FLESH_API const flesh_energy_balance *flesh_integrator_energy_balance(
    const flesh_integrator *integrator);

/* Sets the gain (as in flesh_energy_balance) above which a step ends with FLESH_ERR_ENERGY and a sentence that says
 * where and when; positive, INFINITY: no limit; 1/2 by default. Without error control, all steps of methods of order
 * 2 and 3 together may gain a fiftieth of it; a step that would gain more is halved, and at last taken by backward
 * Euler, as is a first step in which the force at its start would carry a node farther than an edge. Further errors:
 * FLESH_ERR_ARGUMENT. */
FLESH_API int flesh_integrator_set_max_energy_gain(flesh_integrator *integrator, double gain);

/* Returns the progress of separating contact; zeros and NaN if no effect separates surfaces. */
FLESH_API flesh_separation flesh_integrator_separation(const flesh_integrator *integrator);

/* Returns the energies of the effects [effects], J, at the state to which the last step has led; NULL if they are not
 * known there. Owned by the integrator, valid until the next step. */
FLESH_API const double *flesh_integrator_energies(const flesh_integrator *integrator,
                                                  const flesh_state *state);

/* Returns the progress of the current step, for `stop`. */
FLESH_API flesh_progress flesh_integrator_progress(const flesh_integrator *integrator);

/* Returns the last failed step; owned by the integrator. Cannot fail. */
FLESH_API const flesh_failure *flesh_integrator_failure(const flesh_integrator *integrator);

/* Saves an integrator's memory between steps as bytes: the history of its method, the data of first iterates, matrices
 * and factors that are reused, the energy balance, the integrator's own pressures, the memory of recovery, and counts.
 * The state is not part of it. Another integrator of the same system, method and options that loads the bytes and gets
 * the state continues bitwise identically, except from within IDA's steps (flesh_integrator_saves_all).
 *
 * Writes the bytes to data [*size]; NULL: only sets *size. FLESH_ERR_ARGUMENT if `room`, the size of `data` in bytes,
 * is too small. Further errors: FLESH_ERR_MEMORY. */
FLESH_API int flesh_integrator_save(const flesh_integrator *integrator, size_t room, void *data,
                                    size_t *size);
/* Loads what flesh_integrator_save wrote. Call it between steps, after setting the options, which are not saved.
 * FLESH_ERR_FILE, with nothing changed, if the data are no saved memory, are cut off or damaged (by their checksum),
 * or come from another version of the library or another kind of machine; FLESH_ERR_ARGUMENT, with nothing changed,
 * for another method, mesh, or other effects, solvers or instructions. If the sentence says that the integrator is
 * lost, and after FLESH_ERR_MEMORY, it must be destroyed. */
FLESH_API int flesh_integrator_load(flesh_integrator *integrator, const void *data, size_t size);
/* Returns whether the memory that would be saved now is all that the next step depends on. It is 0 while IDA steps,
 * as IDA's history can be read but not restored: an integrator that loads it starts IDA anew from the state, with
 * order 1, and the motion agrees within flesh_adaptive_options.tolerance. Cannot fail. */
FLESH_API int flesh_integrator_saves_all(const flesh_integrator *integrator);

/* Returns the KINSOL memory (of KINCreate) inside an integrator, for KINSet... and KINGet... functions; the
 * integrator owns it. A setting holds for all later steps, except KINSetFuncNormTol, which every solve sets from
 * newton_tolerance, and KINSetNumMaxIters, which is set when a solve must continue to a smaller residual with fewer
 * than 300 of max_newton iterations left. Do not replace the system function, its user data, the linear solver or the
 * Jacobian. Steps of FLESH_METHOD_IDA do not use it. */
FLESH_API void *flesh_integrator_kinsol(const flesh_integrator *integrator);

/* Returns the IDA memory (of IDACreate) inside an integrator of FLESH_METHOD_IDA, for IDASet... and IDAGet...
 * functions, NULL for other methods; the integrator owns it. A setting holds for all later steps, except tolerances,
 * the initial step and the stop time, which every start sets; flesh_integrator_set_adaptive overwrites the maximal
 * order and step and the bounds within which IDA keeps a step. Do not replace the residual, its user data, the linear
 * solver or the Jacobian. */
FLESH_API void *flesh_integrator_ida(const flesh_integrator *integrator);

#ifdef __cplusplus
}
#endif
#endif
