/* effect.h: the interface of everything that acts on a body, for those who write an effect.
 *
 * A body moves so that the sum of all effects balances: r(t,x,v,a) = sum of r_e = 0. Vectors are [3*n], three components
 * per node in the mesh's numbering. An effect gets the point (t,x,v,a) and the shift; it knows no step size, integrator,
 * SUNDIALS or other effect. It is const once made, and belongs to one system, which several runs may use at once.
 *
 *   residual   r += r_e(t,x,v,a), a gradient ("+dV/dx"), not a force       [N]
 *   Jacobian   K += shift.x dr/dx + shift.v dr/dv + shift.a dr/da           [N/m]
 *   potential  phi with d phi = r . du for a change du of the unknown, where dx = shift.x du,
 *              dv = shift.v du, da = shift.a du: conservative V(x)/shift.x,
 *              inertia a.Ma/(2 shift.a), damping v.Cv/(2 shift.v)           [J]
 *   energy     the physical energy: V(x), or v.Mv/2 for inertia             [J]
 *
 * If a shift is 0, a force that depends on that quantity alone is constant along u, and its potential is r . x /
 * shift.x, up to a constant. In statics (1, 0, 0) v and a are 0, and so are potential, Jacobian and residual of inertia
 * and damping. An effect whose force is not 0 there (a wind on a body at rest, a dead load) adds r . x / shift.x where
 * shift.v is 0: a potential of 0 would disagree with r. If all shifts are 0, phi is 0.
 *
 * Quantities that have no potential (the normal force behind friction, a damping matrix that depends on the shape, a
 * load that follows the surface) are lagged: evaluated at an earlier state, point->lagged, which residual, Jacobian and
 * potential treat as constant, so that they stay symmetric and consistent. IDA and the right-hand side of an ODE lag
 * nothing: there the lagged state is the point itself, and the effect is evaluated without approximation.
 *
 * Quantities that have no potential in a step only because x and v change together (a stress that depends on the rate of
 * a strain) are frozen instead: evaluated at point->frozen, on the line along which the unknown moves the point. Methods
 * of order 2 repeat a solve with the last solution frozen until both agree: then nothing is approximated. Backward Euler
 * freezes the start of its step, at rest, so that rates are differences over the step.
 *
 * Functions that return no status cannot fail. README.md in this folder says what reads each member. */
#ifndef FLESH_EFFECT_H
#define FLESH_EFFECT_H

#include <stddef.h>

#include "flesh/block_matrix.h"
#include "flesh/body.h"
#include "flesh/status.h"
#include "flesh/threads.h"

#ifdef __cplusplus
extern "C" {
#endif
/* The lagged and the frozen state (see above): [3*n] each; s, m, m/s. */
typedef struct flesh_lagged {
  double t;
  const double *x, *v;
} flesh_lagged;
typedef struct flesh_frozen {
  const double *x, *v; /* v NULL: the frozen state is at rest */
} flesh_frozen;

/* Memory and counters of the run that evaluates; for the library's own effects. */
struct flesh_environment;

/* A point at which effects are evaluated, made by flesh_point_at; its arrays are borrowed. `lagged` is where the forces
 * last balanced: the step's start, or before it for methods that balance before a step's end (midpoint, HHT); in later
 * stages of Runge-Kutta the previous stage; in statics the last load increment, at rest. `frozen` is on the line x -
 * frozen.x = shift.x w, v - frozen.v = shift.v w for a w [3*n]. If nothing is lagged or frozen, both are the point. */
typedef struct flesh_point {
  double t, load;          /* s; factor in [0,1] of external loads, below 1 while a static solve raises its load */
  const double *x, *v, *a; /* [3*n] each; m, m/s, m/s^2 */
  flesh_lagged lagged;
  flesh_frozen frozen;
  /* [tets] Pa, in the mesh's order: pressures by which an effect enforces constraints (flesh_effect_constraints);
   * NULL: all 0. `penalty` is a factor of the effect's penalty for a gap. */
  const double *multipliers;
  double penalty;
  /* Internal variables (flesh_effect_internal), constant within a step: in a point passed to a flesh_system_ function,
   * those of all effects in a row, of which the system gives each effect its own. NULL: all 0, as at the start. */
  const double *internal;
  flesh_threads *threads; /* threads that an effect may use; results must not depend on their number. NULL: none */
  const struct flesh_environment *environment; /* NULL: none */
} flesh_point;

/* Returns the point at t and x, v, a [3*n] with full loads, a penalty of 1, nothing lagged or frozen, and without
 * multipliers, internal variables and threads, which may be set afterwards. Cannot fail. */
FLESH_API flesh_point flesh_point_at(double t, const double *x, const double *v, const double *a);
/* Returns the memory that the run keeps for the current effect (flesh_effect_barrier.remember); NULL: there is
 * none, or there is no run. Cannot fail. */
FLESH_API void *flesh_point_near(const flesh_point *point);

/* How a change of the unknown u moves the point: dx = x du, dv = v du, da = a du. `filter` says how negative
 * eigenvalues of the cells' Jacobians are treated: FLESH_FILTER_NONE, _CLAMP or _ABSOLUTE. Shifts (x, v, a):
 * backward Euler (1, 1/h, 1/h^2), IDA (1, cj, cj^2), statics (1, 0, 0). */
typedef struct flesh_shift {
  double x, v, a;
  flesh_eigenvalue_filter filter;
} flesh_shift;

typedef struct flesh_effect flesh_effect;

/* An effect's role in a body; X(name, text). The library finds effects by their role, never by their names, so that an
 * effect of your own is treated like a built-in one of the same role. Effects that share a role are summed. INERTIA is a
 * mass (residual M a, energy v.Mv/2), ELASTICITY the body's own stress, a LOAD acts from outside and is scaled by
 * point->load, DAMPING dissipates, CONTACT keeps the body out of obstacles or its surfaces out of each other. */
#define FLESH_ROLE_LIST(X)                                                                                              \
  X(FLESH_ROLE_OTHER, "other") X(FLESH_ROLE_INERTIA, "inertia") X(FLESH_ROLE_ELASTICITY, "elasticity")                  \
  X(FLESH_ROLE_LOAD, "load") X(FLESH_ROLE_DAMPING, "damping") X(FLESH_ROLE_CONTACT, "contact")

typedef enum flesh_role {
#define FLESH_ROLE_ENUM(name, text) name,
  FLESH_ROLE_LIST(FLESH_ROLE_ENUM)
#undef FLESH_ROLE_ENUM
  FLESH_ROLE_COUNT
} flesh_role;

/* Further properties of an effect; or'ed. */
typedef enum flesh_trait {
  /* The effect does no external work: it depends on x and v alone, or only dissipates. Without this trait, external work
   * is the change of energy with t at fixed x, or without an energy the work of the forces (flesh_energy_balance). */
  FLESH_IS_PASSIVE = 1,
  /* The lagged part is a function of the shape (a load on a moving surface, a damping matrix; not friction, which
   * depends on the path). A static solve is repeated from its result until the lagged state no longer changes; a
   * step of a method of order 2 is repeated once, to keep that order. */
  FLESH_IS_FOLLOWER_LOAD = 2,
  /* The effect uses the frozen state: methods of order 2 repeat their solves until that state no longer changes. */
  FLESH_FREEZES = 4,
  /* The potential is a function of x, divided by shift.x, and expensive enough to be stored for an unchanged x. */
  FLESH_DEPENDS_ON_POSITION_ONLY = 8,
  /* Residual, potential and energy are sums over the body's tets, or their faces, of terms that depend only on the
   * nodes of each: parts of a body may be computed separately and added. */
  FLESH_IS_SUM_OVER_TETS = 16
} flesh_trait;

/* Operations of effects that depend explicitly on time. Without inertia, a scene with one is a series of equilibria. */
typedef struct flesh_effect_time {
  /* Returns the next time after t at which the effect is not smooth (a keyframe, a release); INFINITY, or a time that
   * is not after t: none. None after -INFINITY: the effect never changes. NULL: it changes smoothly at all times. */
  double (*next_event)(const flesh_effect *effect, double t);
  /* For effects of something that moves (an obstacle): writes its displacement between two times, at the nodes'
   * positions in `point`, into dx [3*n], which is zero on entry. Returns 0, with dx untouched, if nothing moves.
   * The work of the motion is that of the forces at `point` along dx. NULL: nothing moves. */
  int (*carry)(const flesh_effect *effect, const flesh_point *point, double t_from, double t_to, double *dx);
} flesh_effect_time;

/* Operations of effects that keep bodies out of places: obstacles, contact. As the effect is const, what such an
 * effect finds out about nearness belongs to a run: a memory that operations get by flesh_point_near or as `near`,
 * used by one thread at a time. Without a memory (NULL) each operation searches. `internal` are the effect's
 * internal variables; NULL: all 0. Results may depend on a memory only through the calls of `follow`. */
typedef struct flesh_effect_barrier {
  /* Returns the fraction of the straight step from x_from [3*n] at t_from to x_to at t_to after which a node touches;
   * solves take 0.9 of it. NULL: no limit, as for finite forces; then `push_out` and `tunnelled` are not called. */
  double (*max_feasible_step)(const flesh_effect *effect, void *near, const double *internal, double t_from,
                              const double *x_from, double t_to, const double *x_to);
  /* Moves those nodes of x_to [3*n] that cannot be reached from x_from to places that can. NULL: none are moved. */
  void (*push_out)(const flesh_effect *effect, double t_from, const double *x_from, double t_to, double *x_to);
  /* Returns whether a body that was at x_from must have gone through something to be at x_to one step later,
   * although its iterations found a way around. NULL: never. */
  int (*tunnelled)(const flesh_effect *effect, double t_from, const double *x_from, double t_to, const double *x_to);
  /* Returns FLESH_ERR_ARGUMENT, with the node, if the body cannot be at x [3*n]. NULL: it can be anywhere. */
  int (*check)(const flesh_effect *effect, const double *internal, double t, const double *x);
  /* For effects that act only within some distance: neither their forces (those of the lagged state included) nor
   * their limits of steps reach farther. Returns a lower bound, m, on how much farther than this distance the whole
   * body, at x [3*n], is away at time t; <= 0: no farther, or unknown. The effect is not evaluated while body and
   * obstacle have moved less than that. NULL: it is always evaluated. */
  double (*clearance)(const flesh_effect *effect, double t, const double *x);
  /* Returns an upper bound, m, on how far the obstacle moves between two times at any position within the box from
   * `low` to `high`. Used with `clearance` only; NULL: the obstacle does not move. */
  double (*approach)(const flesh_effect *effect, double t_from, double t_to, const double low[3], const double high[3]);
  /* Creates an empty memory. Returns new. NULL: no memory, and none of the operations below. FLESH_ERR_MEMORY. */
  int (*remember)(const flesh_effect *effect, flesh_threads *threads, void **near);
  void (*forget)(void *near); /* destroys the memory; NULL-safe */
  /* For effects that couple nodes which come near each other: sets *near_cells to the cells of all pairs that the
   * Jacobian at `point` couples beside those of `cells`, and of some that may come soon; borrowed until the next call
   * with this memory. K's pattern grows by them. NULL if K (NULL: none) has all pairs. FLESH_ERR_MEMORY. */
  int (*coupled)(const flesh_effect *effect, const flesh_point *point, const flesh_block_matrix *K,
                 const flesh_cells **near_cells);
  /* Tells the memory that the run is at x [3*n] at time t: an accepted step has led there or, if `accepted` is 0, a
   * step begins there, mostly at the last one's end. *changed: whether the effect's energy at x is different from
   * now on. NULL: results do not depend on these calls. FLESH_UNDEFINED if a place is not finite; FLESH_ERR_MEMORY. */
  int (*follow)(void *near, int accepted, double t, const double *x, int *changed);
} flesh_effect_barrier;

/* Operations of effects that enforce constraints exactly, by a multiplier for each tet (flesh_point.multipliers):
 * their potential contains multiplier * gap + penalty per volume. At most one effect of a system may have them. */
typedef struct flesh_effect_constraints {
  /* Writes the violations of the constraints at point->x into gaps [tets], no unit; 0 for tets without a constraint. */
  int (*gaps)(const flesh_effect *effect, const flesh_point *point, double *gaps);
  /* Writes the penalty's second derivative with respect to the gap, at gap 0 and point->penalty 1, into stiffness
   * [tets], Pa; 0 for tets without a constraint. */
  void (*stiffness)(const flesh_effect *effect, double *stiffness);
} flesh_effect_constraints;

/* Operations of effects with internal variables, which remember the path that led here, such as damage, a plastic strain
 * or the slip of friction. They are real numbers, all 0 at first, belong to the state (flesh_state.internal), are
 * constant within a step (flesh_point.internal) and updated at its end if it is accepted. Statics repeats an equilibrium
 * until that changes nothing. FLESH_METHOD_IDA and ODE problems, which keep no steps, refuse such effects. */
typedef struct flesh_effect_internal {
  /* Returns the number of internal variables, which does not change. */
  int (*count)(const flesh_effect *effect);
  /* Updates internal [count], which equals point->internal on entry, at the end of a step, `point`; sets *changed to 1
   * if forces or energy there differ from before. An energy that falls by the update counts as dissipated. */
  int (*update)(const flesh_effect *effect, const flesh_point *point, double *internal, int *changed);
  /* Writes a sentence about the variables at the end of a run, for result.json and the program; "" or NULL: nothing. */
  void (*tell)(const flesh_effect *effect, const double *internal, size_t size, char *text);
} flesh_effect_internal;

/* Quantities of an effect that are written to files and reports. */
typedef struct flesh_effect_figures {
  /* Returns the size of `data` and what it owns, in bytes. NULL: not given. */
  size_t (*memory)(const flesh_effect *effect);
  /* Names of the columns <effect>_<name> of histories, ended by NULL. NULL: none. */
  const char *const *report_names;
  /* Computes the columns' values at the end of a step. Used with `report_names` only. */
  void (*report)(const flesh_effect *effect, const flesh_point *point, double *values);
  /* For effects whose force is that of a stress in the tets beside the elastic one, as of fibres that pull; the
   * stress is a function of the shape and of time. Adds the Kirchhoff stress tau = P F^T = J sigma [9], row by row,
   * Pa, at a place of tet `tet` of the mesh where the deformation gradient is F [9], at full load. Frames, probes
   * and pictures include it in the stress, whatever the effect's role. NULL: no stress. */
  void (*stress)(const flesh_effect *effect, double t, int tet, const double F[9], double tau[9]);
} flesh_effect_figures;

/* A kind of effect. Members that it does not need are NULL or 0: a dead load has a name, a role, a residual, a potential
 * and `destroy`. Operations that return a status return FLESH_OK, FLESH_UNDEFINED or FLESH_NONFINITE (recoverable: the
 * caller then discards what was added), or a negative status, which ends the step; its sentence names the effect. */
typedef struct flesh_effect_operations {
  const char *name; /* for messages and columns only; not empty, without commas, quotation marks and line breaks */
  flesh_role role;
  unsigned traits; /* flesh_trait, or'ed */
  /* Returns the nodes that the Jacobian couples; NULL when it writes only diagonal blocks or none. */
  const flesh_cells *(*cells)(const flesh_effect *effect);
  int (*residual)(const flesh_effect *effect, const flesh_point *point, double *r);
  /* Adds the Jacobian to K. Pair k of the cells has the block K->values + 9*slots[k]; if the cells ask for all
   * pairs, pair p of cell c is k = c*m + p. The diagonal block of node i is at 9*row_start[i]. The blocks of pairs
   * that `barrier` couples are found by their row and column. */
  int (*jacobian)(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                  flesh_block_matrix *K, const int *slots);
  /* Adds the potential to *phi, and the sum of the absolute values of its terms to *magnitude, against which
   * rounding is measured. NULL: the effect has no potential. */
  int (*potential)(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                   double *phi, double *magnitude);
  int (*energy)(const flesh_effect *effect, const flesh_point *point, double *energy);
  void (*destroy)(void *data); /* frees `data` */
  /* Optional tables; borrowed, NULL: none. */
  const flesh_effect_time *time;
  const flesh_effect_barrier *barrier;
  const flesh_effect_internal *internal;
  const flesh_effect_constraints *constraints;
  const flesh_effect_figures *figures;
  const struct flesh_effect_private *library; /* for the library's own effects; NULL: none */
} flesh_effect_operations;

struct flesh_effect {
  const flesh_effect_operations *operations;
  void *data;      /* the effect's own, freed by operations->destroy */
  int nodes, tets; /* counts of the mesh that it was made for, which are the lengths of its arrays */
};

/* Creates an effect of your own for systems on `mesh` or a mesh with as many nodes and tets; others refuse it. Borrows
 * `operations` (usually static const) and takes ownership of `data`, freed by operations->destroy (NULL: never), also
 * when this function fails. FLESH_ERR_ARGUMENT for a role or name that is invalid. Further errors: FLESH_ERR_MEMORY. */
FLESH_API int flesh_effect_create(const flesh_effect_operations *operations, const flesh_mesh *mesh, void *data,
                                  flesh_effect **effect);
/* NULL-safe; sets *effect to NULL. */
FLESH_API void flesh_effect_destroy(flesh_effect **effect);

#ifdef __cplusplus
}
#endif
#endif
