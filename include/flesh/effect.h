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
 * Where a shift is 0, the unknown does not move what the force depends on, which is then constant along u: its potential
 * is r . x / shift.x, up to a constant. In statics (1, 0, 0) v and a are 0, and so are potential, Jacobian and residual
 * of inertia and damping. An effect whose force is not 0 there (a wind on a body at rest, a dead load) adds r . x /
 * shift.x where shift.v is 0: 0 in its place would let r and phi disagree. Where all shifts are 0 phi is 0.
 *
 * What cannot be written as a potential (the normal force behind friction, a damping matrix that depends on the shape, a
 * load that follows the surface) is lagged: evaluated at an earlier state, point->lagged, which residual, Jacobian and
 * potential treat as constants, so that they stay symmetric and consistent. IDA and the right-hand side of an ODE lag
 * nothing: there the lagged state is the point's own, and the effect is evaluated without approximation.
 *
 * What has no potential in a step only because x and v change together (a stress that depends on the rate of a strain)
 * is frozen instead: evaluated at point->frozen, on the line along which the unknown moves the point. Methods of order 2
 * repeat a solve with the state frozen at the last solution until that is the frozen state: then nothing is
 * approximated. Backward Euler freezes the start of its step, at rest, so that rates become differences over the step.
 *
 * Functions that return no status cannot fail. README.md beside this file says who reads what an effect says. */
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

/* The memory and the measurements of the run that evaluates, for the library's own effects. */
struct flesh_environment;

/* A point at which effects are evaluated, made by flesh_point_at; its arrays are borrowed. `lagged` is where the forces
 * last balanced: at the step's start, for methods that balance before a step's end (midpoint, HHT) before it, in later
 * stages of Runge-Kutta at the one before; in statics the last load increment, at rest. `frozen` is where x - frozen.x =
 * shift.x w, v - frozen.v = shift.v w for a w [3*n]. Where nothing is lagged or frozen both are the point itself. */
typedef struct flesh_point {
  double t, load;          /* s; in [0,1], scales external loads, below 1 while a static solve raises its load */
  const double *x, *v, *a; /* [3*n] each; m, m/s, m/s^2 */
  flesh_lagged lagged;
  flesh_frozen frozen;
  /* [tets] Pa, the mesh's order: pressures by which an effect enforces constraints (flesh_effect_constraints); NULL: all
   * 0. `penalty` multiplies the effect's penalty for a gap. */
  const double *multipliers;
  double penalty;
  /* Internal variables (flesh_effect_internal), constant within a step: those of all effects, one after the other, in a
   * point handed to a flesh_system_ function, which hands each effect its own. NULL: all 0, as they begin. */
  const double *internal;
  flesh_threads *threads; /* whom an effect may hand work to; results must not depend on their number. NULL: none */
  const struct flesh_environment *environment; /* NULL: none */
} flesh_point;

/* The point at t and x, v, a [3*n] with full loads, a penalty of 1, nothing lagged or frozen and neither multipliers,
 * internal variables nor threads, which may then be set. Cannot fail. */
FLESH_API flesh_point flesh_point_at(double t, const double *x, const double *v, const double *a);
/* The memory that the run keeps for the effect at hand (flesh_effect_barrier.remember); NULL: nothing, or there
 * is no run. Cannot fail. */
FLESH_API void *flesh_point_near(const flesh_point *point);

/* How a change of the unknown u moves the point: dx = x du, dv = v du, da = a du; and what becomes of negative
 * eigenvalues of the cells' Jacobians: FLESH_FILTER_NONE, _CLAMP or _ABSOLUTE. Backward Euler (1, 1/h, 1/h^2), IDA (1,
 * cj, cj^2), statics (1, 0, 0). */
typedef struct flesh_shift {
  double x, v, a;
  flesh_eigenvalue_filter filter;
} flesh_shift;

typedef struct flesh_effect flesh_effect;

/* An effect's role in a body; X(name, text). The library finds effects by it, never by their names, so that an effect
 * of your own is taken as the built-in one of its role. Several effects may share a role: they are summed. An INERTIA is
 * a mass (residual M a, energy v.Mv/2), ELASTICITY the body's own stress, a LOAD acts from outside and is scaled by
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
  /* It does no external work: it depends on x and v alone, or only dissipates. That of effects without this trait is the
   * change of their energy with t at fixed x or, without an energy, the work of their forces (flesh_energy_balance). */
  FLESH_IS_PASSIVE = 1,
  /* The lagged part is a function of the shape (a load on a moving surface, a damping matrix; not friction, which
   * depends on the path): a static solve is repeated from its result until the lagged state no longer changes, a step of
   * a method of order 2 once, so that it keeps that order. */
  FLESH_IS_FOLLOWER_LOAD = 2,
  /* Something is frozen: methods of order 2 repeat their solves until the frozen state no longer changes. */
  FLESH_FREEZES = 4,
  /* The potential is a function of x, divided by shift.x, and expensive enough to be stored for an unchanged x. */
  FLESH_DEPENDS_ON_POSITION_ONLY = 8,
  /* Residual, potential and energy are sums over the body's tets, or their faces, of what follows from the nodes of
   * each: parts of a body may then be computed by themselves and added up. */
  FLESH_IS_SUM_OVER_TETS = 16
} flesh_trait;

/* For effects that depend on time explicitly: without inertia a scene that has one is a sequence of equilibria. */
typedef struct flesh_effect_time {
  /* Next time after t at which the effect is not smooth (a keyframe, a release), or INFINITY: after -INFINITY that says
   * that it never changes. NULL: it changes smoothly at all times. */
  double (*next_event)(const flesh_effect *effect, double t);
  /* For effects of something that moves (an obstacle): its displacement between two times at the nodes' positions in
   * `point`, into dx [3*n], which comes with zeros. Returns 0, with dx untouched, where nothing moves. Its work is that
   * of the forces at `point` along dx. NULL: nothing moves. */
  int (*carry)(const flesh_effect *effect, const flesh_point *point, double t_from, double t_to, double *dx);
} flesh_effect_time;

/* For effects that keep bodies out of places: obstacles, contact. What such an effect finds out about nearness belongs
 * to a run, as the effect is const: a memory that operations get by flesh_point_near or as `near`, which one thread uses
 * at a time. Without one (NULL) each operation searches. `internal` are the effect's internal variables, NULL: all 0.
 * Results may depend on a memory by what `follow` tells it alone. */
typedef struct flesh_effect_barrier {
  /* The fraction of the straight step from x_from [3*n] at t_from to x_to at t_to after which a node touches (solves
   * take 0.9 of it). NULL: none, as of forces finite at the surface; then `push_out` and `tunnelled` are not called. */
  double (*max_feasible_step)(const flesh_effect *effect, void *near, const double *internal, double t_from,
                              const double *x_from, double t_to, const double *x_to);
  /* Moves the nodes of x_to [3*n] that cannot get there from x_from to where they can. NULL: none. */
  void (*push_out)(const flesh_effect *effect, double t_from, const double *x_from, double t_to, double *x_to);
  /* Whether a body that was at x_from must have gone through something to be at x_to one step later, although its
   * iterates found a way around. NULL: never. */
  int (*tunnelled)(const flesh_effect *effect, double t_from, const double *x_from, double t_to, const double *x_to);
  /* FLESH_ERR_ARGUMENT, with the node, where the body cannot be at x [3*n]. NULL: everywhere. */
  int (*check)(const flesh_effect *effect, const double *internal, double t, const double *x);
  /* For effects that act only within some distance: neither their forces, also those by the lagged state, nor their
   * limits of steps reach farther. How much farther than this distance the whole body, at x [3*n], is away at time t, a
   * lower bound, m; <= 0: no farther, or not known. The effect is not evaluated while body and obstacle have moved less
   * than that. NULL: it always is. */
  double (*clearance)(const flesh_effect *effect, double t, const double *x);
  /* How far the obstacle moves between two times at any position within the box from `low` to `high`, an upper bound, m.
   * Beside `clearance` only; NULL: it does not move. */
  double (*approach)(const flesh_effect *effect, double t_from, double t_to, const double low[3], const double high[3]);
  /* An empty memory. Returns new. NULL: the effect has none, nor the operations that follow. FLESH_ERR_MEMORY. */
  int (*remember)(const flesh_effect *effect, flesh_threads *threads, void **near);
  void (*forget)(void *near); /* destroys it; NULL-safe */
  /* For effects that couple nodes which come near each other, as the body moves: cells of all pairs that the Jacobian at
   * `point` couples, beside those of `cells`, and of some that may come soon; borrowed until the next call with this
   * memory. K's pattern grows by them. *near_cells: NULL where K (NULL: none) has all pairs of now. FLESH_ERR_MEMORY. */
  int (*coupled)(const flesh_effect *effect, const flesh_point *point, const flesh_block_matrix *K,
                 const flesh_cells **near_cells);
  /* The run is at x [3*n] at time t: a step that was accepted has led there or, where `accepted` is 0, another begins,
   * mostly at the last one's end. *changed: whether the effect's energy at x is another from now on. NULL: results do
   * not depend on all that. FLESH_UNDEFINED where a place is not finite; FLESH_ERR_MEMORY. */
  int (*follow)(void *near, int accepted, double t, const double *x, int *changed);
} flesh_effect_barrier;

/* For effects that enforce constraints exactly, by a multiplier of each tet (flesh_point.multipliers): their potential
 * has multiplier * gap + penalty per volume beside the rest. At most one effect of a system may have this. */
typedef struct flesh_effect_constraints {
  /* How far the constraints are from being met at point->x, into gaps [tets], no unit; 0 for tets without one. */
  int (*gaps)(const flesh_effect *effect, const flesh_point *point, double *gaps);
  /* The penalty's second derivative by the gap, where that is 0 and point->penalty is 1, into stiffness [tets], Pa; 0
   * for tets without a constraint. */
  void (*stiffness)(const flesh_effect *effect, double *stiffness);
} flesh_effect_constraints;

/* For effects with internal variables: what they remember of the path that led here, such as damage, a plastic strain or
 * the slip of friction. They are real numbers, all 0 at first, and belong to the state (flesh_state.internal): constant
 * within a step (flesh_point.internal), and updated at its end, where it is accepted. Statics repeats an equilibrium
 * until that changes nothing. FLESH_METHOD_IDA and ODE problems, which keep no steps, refuse such effects. */
typedef struct flesh_effect_internal {
  /* How many; does not change. */
  int (*count)(const flesh_effect *effect);
  /* At the end of a step, `point`: updates internal [count], which comes as point->internal; *changed becomes 1 where
   * forces or energy at the point are others than before. An energy that falls by it counts as dissipated. */
  int (*update)(const flesh_effect *effect, const flesh_point *point, double *internal, int *changed);
  /* A sentence on what they say of a run at its end, for result.json and the program; "" or NULL: nothing. */
  void (*tell)(const flesh_effect *effect, const double *internal, size_t size, char *text);
} flesh_effect_internal;

/* Figures that are written about an effect. */
typedef struct flesh_effect_figures {
  /* Bytes of `data` and what it owns. NULL: not given. */
  size_t (*memory)(const flesh_effect *effect);
  /* Columns <effect>_<name> of histories; ended by NULL. NULL: none. */
  const char *const *report_names;
  /* Their values, at the end of a step. Beside `report_names` only. */
  void (*report)(const flesh_effect *effect, const flesh_point *point, double *values);
  /* For effects whose force is that of a stress in the tets, a function of the shape and of time, beside the elastic
   * one: fibres that pull. Adds the Kirchhoff stress tau = P F^T = J sigma [9], row by row, Pa, at a place of tet `tet`
   * of the mesh where the deformation gradient is F [9], at full load. Frames, probes and pictures show it as part of
   * the stress, whatever the effect's role. NULL: no stress. */
  void (*stress)(const flesh_effect *effect, double t, int tet, const double F[9], double tau[9]);
} flesh_effect_figures;

/* A kind of effect. Members that it does not need are NULL or 0: a dead load has a name, a role, a residual, a potential
 * and `destroy`. Operations that return a status return FLESH_OK, FLESH_UNDEFINED or FLESH_NONFINITE (recoverable: what
 * was added is then discarded by the caller), or a negative status, which ends the step, and whose sentence names it. */
typedef struct flesh_effect_operations {
  const char *name; /* as in a scene; for messages and columns only */
  flesh_role role;
  unsigned traits; /* flesh_trait, or'ed */
  /* The nodes coupled by the Jacobian; NULL when only diagonal blocks are written or none. */
  const flesh_cells *(*cells)(const flesh_effect *effect);
  int (*residual)(const flesh_effect *effect, const flesh_point *point, double *r);
  /* `slots`: pair k of the cells' has the block K->values + 9*slots[k], which is pair p of cell c for k = c*m + p where
   * the cells ask for all; the diagonal block of node i is at 9*row_start[i]. Blocks of what `barrier` couples are found
   * by their row and column. */
  int (*jacobian)(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                  flesh_block_matrix *K, const int *slots);
  /* Adds to *phi, and to *magnitude the sum of the absolute values of the terms (what rounding is measured against).
   * NULL: the effect has none. */
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
  const struct flesh_effect_private *library; /* of the library's own effects; NULL: none */
} flesh_effect_operations;

struct flesh_effect {
  const flesh_effect_operations *operations;
  void *data;      /* the effect's own, freed by operations->destroy */
  int nodes, tets; /* of the mesh that it was made for: the lengths of its arrays */
};

/* A new effect of a kind of your own, for systems on `mesh` or on one with as many nodes and tets: others refuse it.
 * `operations` is borrowed (static const, usually), `data` is taken: freed by operations->destroy, also when this fails;
 * not at all where that is NULL. FLESH_ERR_ARGUMENT for a role that does not exist. Further errors: FLESH_ERR_MEMORY. */
FLESH_API int flesh_effect_create(const flesh_effect_operations *operations, const flesh_mesh *mesh, void *data,
                                  flesh_effect **effect);
/* NULL-safe; sets *effect to NULL. */
FLESH_API void flesh_effect_destroy(flesh_effect **effect);

#ifdef __cplusplus
}
#endif
#endif
