/* effect.h: the contract that everything acting on a body speaks, for those who write an effect.
 *
 * A body moves so that the sum of all effects balances: r(t,x,v,a) = sum of r_e = 0. Vectors are
 * [3*n], three components per node in the mesh's numbering. An effect sees the point (t,x,v,a) and
 * the shift; it never sees a step size, an integrator, SUNDIALS or another effect. It is const once
 * made and may serve several systems and threads at once.
 *
 *   residual   r += r_e(t,x,v,a), a gradient ("+dV/dx"), not a force       [N]
 *   Jacobian   K += shift.x dr/dx + shift.v dr/dv + shift.a dr/da           [N/m]
 *   potential  phi with d phi = r . du for a change du of the unknown, where dx = shift.x du,
 *              dv = shift.v du, da = shift.a du: conservative V(x)/shift.x,
 *              inertia a.Ma/(2 shift.a), damping v.Cv/(2 shift.v); each is
 *              0 when its shift is 0                                        [J]
 *   energy     the physical energy: V(x), or v.Mv/2 for inertia             [J]
 *
 * What cannot be written as a potential (the normal force behind friction, a damping matrix that
 * depends on the shape, a load that follows the surface) is lagged: evaluated at the last accepted
 * state, x_lag and v_lag, which residual, Jacobian and potential treat as constants, so that they
 * stay symmetric and consistent. Where nothing is stepped over (IDA, the right-hand side of an ODE)
 * the lagged state is the point's own and the effect is its continuous self.
 */
#ifndef FLESH_EFFECT_H
#define FLESH_EFFECT_H

#include <stddef.h>

#include "flesh/instructions.h"
#include "flesh/mesh.h"
#include "flesh/status.h"
#include "flesh/threads.h"

#ifdef __cplusplus
extern "C" {
#endif

/* What an effect was asked for, and the processor time that took. A call of `evaluate` counts as
 * one residual and one potential, so that figures do not depend on which effects have it. */
typedef struct flesh_effect_cost {
  long residuals, jacobians, potentials, energies; /* calls */
  double cpu_s;                                    /* of the process, where timed */
} flesh_effect_cost;

/* Owned by whoever evaluates a system (an integrator), not by the effects, which are const. */
typedef struct flesh_costs {
  int timed;                  /* 1: clocks are read around every call */
  flesh_effect_cost *effects; /* of the system's effects, in their order */
} flesh_costs;

/* Where the effects are evaluated. `load` in [0,1] scales the external loads (1 except while a
 * static solve raises its load in increments).
 *
 * x_lag and v_lag are the last accepted state: the start of the step, or the last load increment
 * (at rest), at t_lag. They are x, v and t themselves where nothing is lagged. Effects never see
 * NULL; in a point handed to a flesh_system_ function NULL stands for x (and then t) and v.
 *
 * An effect may hand its work to `threads` (borrowed, or NULL); what it returns must not depend on
 * their number. `costs` is where the flesh_system_ functions count; NULL: nowhere. */
typedef struct flesh_point {
  double t, load;
  const double *x, *v, *a;      /* [3*n] each; m, m/s, m/s^2 */
  const double *x_lag, *v_lag; /* [3*n] each; m, m/s */
  double t_lag;                /* s */
  flesh_threads *threads;
  flesh_costs *costs;
} flesh_point;

/* What a cell's Jacobian may have for negative eigenvalues: themselves, zeros, or their absolute
 * values. */
typedef enum flesh_projected {
  FLESH_PROJECTED_NOT,
  FLESH_PROJECTED_CLAMP,
  FLESH_PROJECTED_ABSOLUTE
} flesh_projected;

/* How the unknown u moves the point, and whether the Jacobian must be positive semi-definite
 * (`project`, a flesh_projected). Backward Euler (1, 1/h, 1/h^2), IDA (1, cj, cj^2), statics (1, 0,
 * 0). */
typedef struct flesh_shift {
  double x, v, a;
  int project;
} flesh_shift;

/* Groups of nodes that an effect couples. Nodes within a cell ascend, so that every pair a <= b of
 * local indices is a block of the upper triangle: pairs (0,0) (0,1) ... (1,1) ..., of which a cell
 * has m = nodes_per_cell * (nodes_per_cell + 1) / 2. */
typedef struct flesh_cells {
  int count, nodes_per_cell;
  const int *nodes; /* [count * nodes_per_cell] */
  /* Pairs whose blocks the effect asks for, pair p of cell c as c*m + p; NULL: all in order. */
  int pair_count;
  const int *pairs; /* [pair_count] */
} flesh_cells;

/* Symmetric matrix of 3x3 blocks, upper triangle by rows: row i holds the blocks (i, column[k]) for
 * row_start[i] <= k < row_end[i], columns ascending, the diagonal block first. Rows lie in memory
 * in an order of their own: neighbours near each other, however the nodes are numbered. */
typedef struct flesh_block_matrix {
  int rows;             /* nodes */
  const int *row_start; /* [rows+1], the last the number of all blocks */
  const int *row_end;   /* [rows] */
  const int *column;    /* [row_start[rows]] */
  double *values;       /* [9 * row_start[rows]], each block row-major */
} flesh_block_matrix;

typedef struct flesh_effect flesh_effect;

/* The operations of a kind of effect; unused ones are NULL. Return FLESH_OK, FLESH_UNDEFINED or
 * FLESH_NONFINITE (recoverable: what was added is then discarded by the caller), or a negative
 * status. */
typedef struct flesh_effect_operations {
  const char *name; /* as in a scene */
  /* 1: a load from outside, scaled by point->load; convergence is measured against it. */
  int external;
  /* 1: what is lagged follows the shape (a load on a moving surface, not friction, whose past
   * matters): a static solve is repeated from its result until the lagged state stands still. */
  int follows;
  /* 1: the potential is a function of x over shift.x, and dear enough to be remembered where x has
   * not changed. */
  int placed;
  /* The nodes coupled by the Jacobian; NULL when only diagonal blocks are written or none. */
  const flesh_cells *(*cells)(const flesh_effect *effect);
  int (*residual)(const flesh_effect *effect, const flesh_point *point, double *r);
  /* `slots`: pair k of the cells' has the block K->values + 9*slots[k], which is pair p of cell c
   * for k = c*m + p where the cells ask for all; the diagonal block of node i is at
   * 9*row_start[i]. */
  int (*jacobian)(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                  flesh_block_matrix *K, const int *slots);
  /* The same, but K's blocks of the cells' pairs become what `jacobian` adds to them, whatever they
   * were: for one effect of a system, called before the others, so that they need not be cleared.
   * NULL: they are. */
  int (*jacobian_anew)(const flesh_effect *effect, const flesh_point *point,
                       const flesh_shift *shift, flesh_block_matrix *K, const int *slots);
  /* Adds to *phi, and to *magnitude the sum of the absolute values of the terms (what rounding is
   * measured against). NULL: the effect has none. */
  int (*potential)(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                   double *phi, double *magnitude);
  /* Residual and potential in one pass, for effects where that is cheaper than both: adds to r,
   * *phi and *magnitude the same bits as `residual` and `potential`, beside which alone it may be.
   * NULL: those two are called. */
  int (*evaluate)(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                  double *r, double *phi, double *magnitude);
  int (*energy)(const flesh_effect *effect, const flesh_point *point, double *energy);
  /* For effects that are a sum over their cells, which are tets: a new effect of the cells `chosen`
   * [count], ascending, alone; they are the tets of `mesh` in this order. It lives no longer than
   * this one and `mesh`. NULL: where few nodes are solved for alone, a quadratic model stands for
   * the effect. */
  int (*part)(const flesh_effect *effect, int count, const int *chosen, const flesh_mesh *mesh,
              flesh_effect **part);
  /* Next time after t at which the effect stops being smooth (a keyframe, a release); INFINITY if
   * none. NULL: smooth in time. */
  double (*next_event)(const flesh_effect *effect, double t);
  /* For effects that bar the way. The share of the straight way from x_from [3*n] at t_from to x_to
   * at t_to that all nodes can go before one of them is stopped; 1: all. NULL: no way is barred. */
  double (*way)(const flesh_effect *effect, double t_from, const double *x_from, double t_to,
                const double *x_to);
  /* Moves the nodes of x_to [3*n] that cannot get there from x_from to where they can. Beside
   * `way` only. */
  void (*clear)(const flesh_effect *effect, double t_from, const double *x_from, double t_to,
                double *x_to);
  /* Whether a body that was at x_from must have gone through something to be at x_to one step
   * later, although its iterates found a way around. Beside `way` only. */
  int (*passed)(const flesh_effect *effect, double t_from, const double *x_from, double t_to,
                const double *x_to);
  /* FLESH_ERR_ARGUMENT, with the node, where the body cannot be at x [3*n]. NULL: everywhere. */
  int (*check)(const flesh_effect *effect, double t, const double *x);
  /* What histories tell of the effect, in columns <effect>_<name>; ended by NULL. */
  const char *const *report_names;
  void (*report)(const flesh_effect *effect, const flesh_point *point, double *values);
  /* The vector instructions that it works with, on which the last bits of its results depend.
   * NULL: those of the program. */
  flesh_instructions (*instructions)(const flesh_effect *effect);
  void (*destroy)(void *data); /* frees `data` */
  /* Bytes of `data` and what it owns. NULL: not told. */
  size_t (*memory)(const flesh_effect *effect);
} flesh_effect_operations;

struct flesh_effect {
  const flesh_effect_operations *operations;
  void *data; /* the effect's own, freed by operations->destroy */
};

/* A new effect of a kind of your own: `operations` is borrowed (static const, usually), `data` is
 * taken: freed by operations->destroy, also when this fails; not at all where that is NULL. */
FLESH_API int flesh_effect_create(const flesh_effect_operations *operations, void *data,
                                  flesh_effect **effect);
/* NULL-safe; sets *effect to NULL. */
FLESH_API void flesh_effect_destroy(flesh_effect **effect);

/* Cells of every tet of the mesh with its nodes ascending, for operations->cells. Freed with
 * flesh_cells_clear. */
FLESH_API int flesh_cells_of_tets(const flesh_mesh *mesh, flesh_cells *cells);
FLESH_API void flesh_cells_clear(flesh_cells *cells);

/* The shifts with which flesh_effect_check_derivatives tries: statics (1,0,0) and backward Euler
 * with h = 1/60 s (1,60,3600). */
enum { FLESH_CHECK_SHIFTS = 2 };

/* Relative errors; 0 is perfect, NaN where the effect lacks the operation. */
typedef struct flesh_derivative_report {
  double potential[FLESH_CHECK_SHIFTS]; /* |d phi - r.du| / sum |r_i du_i| */
  double jacobian[FLESH_CHECK_SHIFTS];  /* |dr - K du| / |K du|; `jacobian_anew` against it */
  double evaluate[FLESH_CHECK_SHIFTS];  /* `evaluate` against residual and potential */
  double asymmetry;                     /* of the diagonal blocks (the others are stored once) */
  double negative; /* most negative curvature of the projected Jacobian found, over its largest
                      curvature; 0 when none */
} flesh_derivative_report;

/* Whether an effect's residual is the gradient of its potential and its Jacobian the derivative of
 * its residual, by differences, and whether `evaluate` and `jacobian_anew` give the same as what
 * they stand for: at (t, x) with random velocities and accelerations (zero for statics), x_lag near
 * x and v_lag random, along random directions that move nodes by a small part of the mesh's mean
 * edge; each error is the best of several step lengths. x [3*nodes] should be generic (not the rest
 * state, where gradients vanish). Returns the effect's status where it cannot be evaluated
 * (FLESH_UNDEFINED: choose another x). */
FLESH_API int flesh_effect_check_derivatives(const flesh_effect *effect, const flesh_mesh *mesh,
                                             double t, const double *x, unsigned long long seed,
                                             flesh_derivative_report *report);

/* Whether every error that was measured is below `tolerance`; 1e-6 is what correct effects pass. */
FLESH_API int flesh_derivative_report_passes(const flesh_derivative_report *report,
                                             double tolerance);

#ifdef __cplusplus
}
#endif
#endif
