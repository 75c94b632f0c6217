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

/* ROW(NAME, name, text, order, doc): the one list from which the enum, the names in a scene and
 * their docs are made. */
#define FLESH_METHOD_LIST(ROW)                                                                     \
  ROW(BACKWARD_EULER, backward_euler, "backward-euler", 1, "damps much, robust")                   \
  ROW(STATIC, static, "static", 0, "solves for equilibrium")                                       \
  ROW(BDF2, bdf2, "bdf2", 2, "damps fast oscillations")                                            \
  ROW(MIDPOINT, midpoint, "midpoint", 2,                                                           \
      "keeps both momenta, and the energy of what the step resolves; damps nothing, so that "      \
      "violent motion needs short steps")                                                          \
  ROW(NEWMARK, newmark, "newmark", 2,                                                              \
      "the trapezoidal rule unless beta and gamma say otherwise; damps nothing, like midpoint")    \
  ROW(HHT, hht, "hht", 2, "Newmark's with a damping of fast oscillations that alpha sets")         \
  ROW(GENERALIZED_ALPHA, generalized_alpha, "generalized-alpha", 2,                                \
      "hht's with a damping that spectral_radius sets, and less of it where steps resolve the motion") \
  ROW(RUNGE_KUTTA, runge_kutta, "runge-kutta", 3,                                                  \
      "diagonally implicit Runge-Kutta methods of several stages (table), each solved as a step "  \
      "of backward Euler; with a tolerance their local error chooses the steps")                   \
  ROW(IDA, ida, "ida", 0,                                                                          \
      "IDA's variable steps and orders up to max_order; stiff bodies that nothing holds may err "  \
      "by tens of tolerances")

typedef enum flesh_method {
#define FLESH_METHOD_ENUM(NAME, name, text, order, doc) FLESH_METHOD_##NAME,
  FLESH_METHOD_LIST(FLESH_METHOD_ENUM)
#undef FLESH_METHOD_ENUM
} flesh_method;

/* The method's name in a scene ("backward-euler"), and its order of accuracy in time (0: statics, and ida, which
 * chooses it); NULL and 0 for an unknown method. Cannot fail. */
FLESH_API const char *flesh_method_name(flesh_method method);
FLESH_API int flesh_method_order(flesh_method method);

/* The parameters of the methods, each of which reads its own only: ROW(name, default, least, most,
 * the range as text, doc), all keys of a scene's `time`. The least may depend on other options. */
#define FLESH_METHOD_OPTION_LIST(ROW)                                                              \
  ROW(alpha, -0.1, -1. / 3, 0, "[-1/3, 0]",                                                        \
      "of hht (Hilber, Hughes & Taylor 1977), in [-1/3, 0]: the smaller, the more fast "           \
      "oscillations are damped; gamma = 1/2 - alpha, beta = (1 - alpha)^2/4")                      \
  ROW(beta, 1/4, options->gamma / 2, 1, "[gamma/2, 1]", "of newmark, in [gamma/2, 1]")             \
  ROW(gamma, 1/2, 0.5, 1, "[1/2, 1]",                                                              \
      "of newmark, in [1/2, 1]; above 1/2 it damps and is of first order")                         \
  ROW(spectral_radius, 0.8, 0, 1, "[0, 1]",                                                        \
      "of generalized-alpha (Chung & Hulbert 1993), in [0, 1]: the share that a step leaves of "   \
      "infinitely fast oscillations; 1 damps nothing")

/* ROW(NAME, name, doc): the Butcher tables of runge-kutta, all L-stable and stiffly accurate, with an explicit first
 * stage and an embedded method for their error. */
#define FLESH_TABLE_LIST(ROW)                                                                      \
  ROW(AUTO, "auto", "esdirk325 where steps are easy to solve, esdirk324 where they are hard")      \
  ROW(ESDIRK325, "esdirk325", "ESDIRK3(2)5L[2]SA (Kennedy & Carpenter 2016): order 3, four "       \
                              "solves a step; the most accurate")                                  \
  ROW(ESDIRK324, "esdirk324", "ESDIRK3(2)4L[2]SA (Kennedy & Carpenter 2016): order 3, three "      \
                              "solves a step; damps more where steps do not resolve the motion")   \
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
  flesh_table table; /* of runge-kutta */
} flesh_method_options;
/* Fills in the defaults. Cannot fail. */
FLESH_API void flesh_method_options_default(flesh_method_options *options);
/* FLESH_ERR_ARGUMENT when a value is out of its range. */
FLESH_API int flesh_method_options_check(const flesh_method_options *options);

/* Everything known when a step could not be taken. */
typedef struct flesh_failure {
  int status;   /* of the last attempt */
  double t, h;  /* s; where it was tried last */
  int halvings; /* how often the step had been halved */
  double residual, target; /* 2-norms over the free dofs, N */
  int worst_tet; /* smallest J at the last iterate, or -1 */
  double worst_J, worst_position[3];
  int worst_node; /* largest residual at the last iterate (ida: local error), or -1 */
  int order;      /* ida: of the last attempt; else 0 */
  /* The largest |mean of J - 1| of incompressible tets, if the forces balance but these do not keep their volumes; else
   * 0. */
  double volume_gap;
  double load; /* in equilibria the factor of the loads that was tried last; else 0 */
} flesh_failure;

/* One internal step of a method whose steps its error chooses. */
typedef struct flesh_internal_step {
  double t, h; /* s; its end and length */
  int order;
  int rejected, convergence_failures; /* attempts thrown away before it */
  const flesh_state *state;           /* at t; lasts as long as the call */
} flesh_internal_step;

typedef struct flesh_adaptive_options {
  /* 1: methods that estimate their error (all of fixed steps but midpoint) choose their own steps by it within those
   * that are asked of them. IDA's always do. */
  int control;
  /* The error of positions to aim at, as a share of the body's longest side L; (0, 1). With q =
   * max_order, IDA is given the absolute local tolerances e L for positions and e V for
   * velocities (flesh_ida_tolerances), e = tolerance^(1 + 1/q): local errors fall with h^(q+1), but
   * what they add up to only with h^q. */
  double tolerance;
  /* 1 to 5; above 2 not A-stable: energy may grow, and steps become short at loose tolerances. */
  int max_order;
  double max_step; /* s; INFINITY: no limit */
  int max_steps;   /* internal ones in one flesh_integrator_step */
  /* Told of every internal step; may be NULL. A negative status ends flesh_integrator_step with
   * it. */
  int (*observe)(void *data, const flesh_internal_step *step);
  void *observe_data;
} flesh_adaptive_options;
/* No control of methods of fixed steps, 1e-4, order 2, no limit of a step, 100 000 steps. */
FLESH_API void flesh_adaptive_options_default(flesh_adaptive_options *options);

typedef struct flesh_integrator flesh_integrator;

/* Borrows `system`, which must be finished. Returns new.
 * Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY, FLESH_ERR_SUNDIALS. */
FLESH_API int flesh_integrator_create(const flesh_system *system, flesh_method method,
                                      const flesh_solver_options *options,
                                      flesh_integrator **integrator);
FLESH_API void flesh_integrator_destroy(flesh_integrator **integrator);
/* Replaces the defaults; FLESH_ERR_ARGUMENT as flesh_method_options_check. Restarts the method. */
FLESH_API int flesh_integrator_set_method_options(flesh_integrator *integrator,
                                                  const flesh_method_options *options);
FLESH_API flesh_method flesh_integrator_method(const flesh_integrator *integrator);

/* Takes the state from t to t+h (retried in parts when a solve fails; statics: equilibrium at t+h,
 * the load raised in increments when the full one fails), adding to *stats (may be NULL). Methods
 * of order 2 split the step at events (flesh_system_next_event) within it and restart there; so
 * they do when the caller passes another state than the one returned last. Their constrained dofs
 * follow the prescribed motion with its own velocity. Where a method balances before the end of the
 * step (midpoint, HHT, generalized-alpha, the first step of BDF2) and an obstacle bars that end, backward Euler takes
 * the step instead (flesh_solve_stats: impact_steps). Backward Euler extrapolates its last steps for
 * the first iterates of a slow motion; another integrator that continues from a state therefore
 * agrees to the solver's tolerance, not in every bit. On failure (FLESH_ERR_SOLVE) the state is that of
 * the last success, t included. FLESH_ERR_NONFINITE, with the node, for another state than the one returned last that is
 * not finite. */
FLESH_API int flesh_integrator_step(flesh_integrator *integrator, flesh_state *state, double h,
                                    flesh_solve_stats *stats);

/* Replaces the defaults of methods that estimate their error. FLESH_ERR_ARGUMENT when a
 * value is out of its range, or where `control` is wanted of a method of steps that does not estimate its error; further
 * FLESH_ERR_MEMORY. The integrator starts anew. */
FLESH_API int flesh_integrator_set_adaptive(flesh_integrator *integrator,
                                            const flesh_adaptive_options *options);

/* `stop` is asked while a step is made: between the internal steps of ida, else
 * before every Newton iteration and within long PCG solves. A negative status ends the step with
 * it, the state being that of the last part that was finished. Derivatives of a recorded motion ask it
 * before each step (sensitivity.h). It may be asked often and must be quick. NULL: not asked. */
FLESH_API void flesh_integrator_set_stop(flesh_integrator *integrator, int (*stop)(void *data),
                                         void *data);

/* A warning about the steps so far although none failed, as a sentence (spurious energy); NULL when
 * there is none. Owned by the integrator. */
FLESH_API const char *flesh_integrator_warning(const flesh_integrator *integrator);

/* The balance of a motion's energy E, kinetic and potential, with the external work W of loads,
 * prescribed motions, moving obstacles and follower loads (dE/dt <= dW/dt; Belytschko, Liu &
 * Moran 2000, section 6.2.3; lib/time/energy_watch.c has the discrete balance of each
 * method). Since dissipation only lowers it, E - W must not rise: its rise above its least value
 * so far is the excess, spurious energy. In statics all figures are 0. */
typedef struct flesh_energy_balance {
  int begun;       /* there is a first state */
  double supplied; /* J, W since the first state */
  double released; /* J that changes of internal variables have dissipated (something broke) */
  double excess;   /* J, now */
  /* The largest excess, less what rounding and the solves' tolerance allow, as a fraction of
   * `scale`; that excess, J; and the times, s, at which E - W was least before and when it was that
   * large. */
  double gain, largest, t_least, t_largest;
  double scale;   /* J, the most energy above the lowest potential so far, without the excess */
  double t_since; /* s, when E - W was least */
  /* The last report of an excess of more than a twentieth: the tet with the smallest J and its middle, and the fastest
   * node; -1: there was none. */
  int worst_tet, fastest_node;
  double worst_J, worst_position[3], fastest_position[3], fastest_speed;
} flesh_energy_balance;
/* Since creation; owned by the integrator. */
FLESH_API const flesh_energy_balance *flesh_integrator_energy_balance(
    const flesh_integrator *integrator);

/* The gain (as in flesh_energy_balance) from which on a step ends with FLESH_ERR_ENERGY and says
 * where and when; positive, INFINITY: never. 1/2 by default. Steps of methods of order 2 and 3 whose errors do not
 * choose their lengths may gain a fiftieth of it in all; a step that would gain more is taken in halves, and at last by
 * backward Euler, as is a first step in which the force at its start would carry a node farther than an edge.
 * Further errors: FLESH_ERR_ARGUMENT. */
FLESH_API int flesh_integrator_set_max_energy_gain(flesh_integrator *integrator, double gain);

/* Zeros and NaN where nothing is let apart. */
FLESH_API flesh_separation flesh_integrator_separation(const flesh_integrator *integrator);

/* Energies of the effects [effects], J, at the state that the last step has led to; NULL where they
 * are not known there. Owned by the integrator, valid until the next step. */
FLESH_API const double *flesh_integrator_energies(const flesh_integrator *integrator,
                                                  const flesh_state *state);

/* The progress of a step under way, for `stop`. */
FLESH_API flesh_progress flesh_integrator_progress(const flesh_integrator *integrator);

/* The last failed step; owned by the integrator. Cannot fail. */
FLESH_API const flesh_failure *flesh_integrator_failure(const flesh_integrator *integrator);

/* Saves an integrator's memory between steps as bytes: the history of its method, what first iterates go on from,
 * matrices and factors that serve again, the watch over the energy, pressures of its own, the memory of recovery, and
 * counts. The state is not part of it. Another integrator of the same system, method and options that loads them, with
 * the state, goes on with the same bits; but not from within IDA's steps (flesh_integrator_saves_all).
 *
 * Writes them to data [*size]; NULL: only *size is found. FLESH_ERR_ARGUMENT where `room` bytes are too few. Further
 * errors: FLESH_ERR_MEMORY. */
FLESH_API int flesh_integrator_save(const flesh_integrator *integrator, size_t room, void *data,
                                    size_t *size);
/* Takes over what was saved; to be called between steps, after the options are set, which are no part
 * of it. FLESH_ERR_FILE, with nothing changed, for what is no saved history, is cut off or damaged (a
 * checksum says so), or comes from another version of the library or another kind of machine;
 * FLESH_ERR_ARGUMENT, with nothing changed, for another method, mesh, other effects, solvers or
 * instructions. Where the sentence says that the integrator is lost, and after FLESH_ERR_MEMORY, it must be
 * destroyed. */
FLESH_API int flesh_integrator_load(flesh_integrator *integrator, const void *data, size_t size);
/* Whether what would be saved now is all that the next step depends on. 0 while IDA steps, which gives its
 * history but does not take it back: a loaded integrator starts IDA anew from the state, with order 1, and the motion
 * agrees within flesh_adaptive_options.tolerance. Cannot fail. */
FLESH_API int flesh_integrator_saves_all(const flesh_integrator *integrator);

/* The KINSOL memory (of KINCreate) inside an integrator, for KINSet... and KINGet... functions; it
 * stays the integrator's. A setting holds for all later steps, except KINSetFuncNormTol, which
 * every solve sets from newton_tolerance, and KINSetNumMaxIters where a solve that must continue to
 * a smaller residual has fewer than 300 of max_newton left. Do not replace the system function, its
 * user data, the linear solver or the Jacobian. Steps of FLESH_METHOD_IDA do not use it. */
FLESH_API void *flesh_integrator_kinsol(const flesh_integrator *integrator);

/* The IDA memory (of IDACreate) inside an integrator of FLESH_METHOD_IDA, for IDASet... and
 * IDAGet... functions, NULL for other methods; it stays the integrator's. A setting holds for all
 * later steps, except tolerances, the initial step and the stop time, which every start sets;
 * flesh_integrator_set_adaptive overwrites the maximal order and step and the bounds of a kept step.
 * Do not replace the residual, its user data, the linear solver or the Jacobian. */
FLESH_API void *flesh_integrator_ida(const flesh_integrator *integrator);

#ifdef __cplusplus
}
#endif
#endif
