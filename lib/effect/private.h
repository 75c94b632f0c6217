/* private.h: operations that only the library's own effects have, besides those of flesh/effect.h. */
#ifndef FLESH_EFFECT_PRIVATE_H
#define FLESH_EFFECT_PRIVATE_H

#include "flesh/effect.h"
#include "linear/block_matrix.h"

struct flesh_archive;
struct flesh_rank_part;
struct flesh_separation;
struct flesh_team;

/* Two groups of nodes that an effect holds together. */
typedef struct flesh_bond {
  int count[2];        /* numbers of nodes of the two groups */
  const int *nodes[2]; /* [count] nodes of the mesh; borrowed from the effect */
  double gap;          /* m, distance of the groups' surfaces at rest */
  int variable;        /* index of the effect's internal variable that becomes non-zero when the bond breaks; -1: it
                        * never breaks */
} flesh_bond;

/* For effects that hold surfaces together (welds, joints): features held by a bond do not touch each other until it is
 * broken and they have come apart. */
typedef struct flesh_effect_bonds {
  int (*count)(const flesh_effect *effect);
  void (*get)(const flesh_effect *effect, int k, flesh_bond *bond); /* 0 <= k < count */
} flesh_effect_bonds;

/* For effects that ranks can share (flesh/ranks.h) although they are no sum over tets, because they act on nodes or
 * faces. If such an effect has internal variables, every rank has all of them and updates them to the same bits. */
enum { FLESH_RANK_SUMS = 4 };
typedef struct flesh_rank_numbers { /* reduced over all ranks; 0 if a rank writes none */
  double sums[FLESH_RANK_SUMS], largest[FLESH_RANK_SUMS];
} flesh_rank_numbers;
typedef struct flesh_effect_ranks {
  /* Creates the share of `whole`, the effect on the whole body, that this rank computes: an effect of the same kind on
   * `body`, that of the part. The shares of all ranks add up to `whole`; a share may have nothing to act on. It must
   * not outlive `whole`. FLESH_ERR_ARGUMENT if the effect cannot be shared, FLESH_ERR_MEMORY. */
  int (*restrict_to_part)(const flesh_effect *whole, const struct flesh_rank_part *part, const flesh_body *body,
                          flesh_effect **restricted);
  /* Returns cells of `whole` that couple nodes of several ranks, so that these nodes become part of the ranks' parts
   * (flesh_rank_part_create_for): all nodes of a cell belong to the part of the rank that owns the cell's first node
   * or, if *everywhere is set to 1, to all parts. NULL, or count 0: the nodes of the part's tets suffice. */
  const flesh_cells *(*cells)(const flesh_effect *whole, int *everywhere);
  /* Computes this rank's share of sums [sum_count] that are needed at a point; their totals arrive in
   * flesh_environment.sums. NULL, 0: none. */
  int sum_count;
  void (*sum)(const flesh_effect *effect, const flesh_point *point, double *sums);
  /* Exchange of numbers of the body that a part does not know (a count of nodes, a mean): `count` writes this rank's,
   * `take` receives those of all ranks, once, before the system is finished; `take` may change the effect's operations.
   * Both or neither. */
  void (*count)(const flesh_effect *restricted, flesh_rank_numbers *numbers);
  void (*take)(flesh_effect *restricted, const flesh_rank_numbers *numbers);
  /* flesh_effect_figures.report over all ranks, in the same way, of at most FLESH_RANK_SUMS values. NULL: each rank
   * computes the report alone. */
  void (*report_part)(const flesh_effect *effect, const flesh_point *point, flesh_rank_numbers *numbers);
  void (*report_whole)(const flesh_effect *effect, const flesh_rank_numbers *numbers, double *values);
} flesh_effect_ranks;

/* Arguments of a residual that its Jacobian does not cover: lagged.x, lagged.v, frozen.x, frozen.v; and the point's own
 * v and x separately, for effects with a frozen state, whose Jacobian covers both together. */
typedef enum flesh_argument {
  FLESH_LAGGED_X, FLESH_LAGGED_V, FLESH_FROZEN_X, FLESH_FROZEN_V, FLESH_OWN_V, FLESH_OWN_X, FLESH_ARGUMENTS
} flesh_argument;

/* For effects with a lagged or frozen state: derivatives that sensitivities need besides the Jacobian and that would
 * otherwise take many differences. An effect has one of the three. */
typedef struct flesh_effect_partials {
  /* Adds to y [3*n] scale times the derivative of the residual by `argument`, or its transpose, times w [3*n]; nothing
   * if the residual does not depend on it. Defined wherever the residual is. */
  void (*multiply)(const flesh_effect *effect, const flesh_point *point, flesh_argument argument, int transposed,
                   double scale, const double *w, double *y);
  unsigned reads; /* bits of the arguments that `multiply` supports; the residual depends on no others */
  /* For a sum over tets: creates an effect of the same tets on the mesh `torn`, in which no two tets share a node
   * (mesh/torn.h), so that a few differences give the derivatives of all tets. Its materials are those of `body`; NULL:
   * its own. It must not outlive this effect, `body` and `torn`. */
  int (*tear)(const flesh_effect *effect, const flesh_body *body, const flesh_mesh *torn, flesh_effect **torn_effect);
  /* For effects that couple few nodes, which differ from point to point: calls `add` for the blocks of the derivative
   * of the residual by `argument`. FLESH_UNDEFINED if there is none; errors of `add`. */
  int (*couple)(const flesh_effect *effect, const flesh_point *point, flesh_argument argument, flesh_block_add add, void *to);
} flesh_effect_partials;

/* Members that an effect does not need are NULL. */
typedef struct flesh_effect_private {
  /* Computes residual and potential in one pass, for effects where that costs less than both: adds the same bits to r,
   * *phi and *magnitude as `residual` and `potential`, which must exist too. NULL: those two are called. */
  int (*evaluate)(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                  double *r, double *phi, double *magnitude);
  /* 1: the residual is a symmetric matrix times v while the lagged state is fixed, so a product with the matrix is a
   * residual. */
  int linear_in_v;
  /* Like `jacobian`, but overwrites K's blocks of the cells' pairs instead of adding to them. It is called for one
   * effect of a system, before the others, so that K need not be cleared. NULL: K is cleared. */
  int (*jacobian_assign)(const flesh_effect *effect, const flesh_point *point,
                         const flesh_shift *shift, flesh_block_matrix *K, const int *slots);
  /* For effects whose Jacobian contains one stiff rank-one term per cell: stiff_rows describes the rows without values,
   * and stiff_values writes the values [rows.count][nodes_per_row][3] of those in the matrix that `jacobian` computes
   * there. NULL, both: none. */
  void (*stiff_rows)(const flesh_effect *effect, flesh_stiff_rows *rows);
  void (*stiff_values)(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                       float *values);
  /* For effects that are a sum over their cells, which are tets: creates an effect of only the cells `chosen` [count],
   * ascending, which are the tets of `mesh` in this order. It must not outlive this effect and `mesh`. NULL: a
   * quadratic model replaces the effect in solves for few nodes. */
  int (*restrict_to_cells)(const flesh_effect *effect, int count, const int *chosen,
                           const flesh_mesh *mesh, flesh_effect **restricted);
  /* For the same effects: lists a cell's nodes in the mesh's order of a tet's nodes. Returns 4 or 10. */
  int (*cell_nodes)(const flesh_effect *effect, int cell, int nodes[10]);
  /* Returns the instruction set that the effect uses, on which the last bits of its results depend. NULL: that of the
   * program. */
  flesh_instructions (*instructions)(const flesh_effect *effect);
  /* For effects with nearly incompressible materials: stiffness_ratio returns lambda/mu of the stiffest, and soften
   * creates an effect with materials of at most this ratio (system/softened.h), which must not outlive this one. NULL,
   * both: none. */
  double (*stiffness_ratio)(const flesh_effect *effect);
  int (*soften)(const flesh_effect *effect, double ratio, flesh_effect **softened);
  /* Whether another effect of this kind has the same residual at every point, bit by bit. NULL: unknown. */
  int (*is_same)(const flesh_effect *effect, const flesh_effect *other);
  const flesh_effect_partials *partials;
  const flesh_effect_ranks *ranks;
  const flesh_effect_bonds *bonds;
  /* Called when a solve is about to compute its matrix at `point`, with memory: the effect predicts its forces there,
   * from those at lagged.x or from its last prediction in the solve that began there. Until the next prediction,
   * `jacobian` at this point may use secants to these forces instead of derivatives. It uses derivatives if the
   * predicted forces are those at x, at all other points, and without memory. If it fails it predicts nothing, and
   * `jacobian` reports the error. NULL: it always uses derivatives. */
  void (*predict)(const flesh_effect *effect, const flesh_point *point);
  /* Returns the bytes, zero at first, that a run keeps for `predict` (flesh_environment.predicted). NULL: the effect
   * keeps its own. */
  size_t (*predictions)(const flesh_effect *effect);
  /* The members below are for barriers with a memory. */
  /* Whether the effect exerts no force at x0 + shift u (x0 and u [3*nodes]; at x0 if u is NULL), and limits no straight
   * step between any two such points of the same x0, until it has searched again. With u, x0 must be that of the last
   * call without u. NULL: it may always do so. */
  int (*is_far)(void *near, const double *x0, double shift, const double *u);
  /* Corrects x [3*n], from which a solve may begin whose step starts at x_from, so that features that touch there keep
   * their gaps, as far as a few node-by-node corrections achieve it. Returns whether x has changed. Collective unless
   * `team` is NULL. */
  int (*keep_gaps)(void *near, const struct flesh_team *team, const double *internal, const double *x_from, double *x);
  /* flesh_effect_barrier.tunnelled with memory, for this rank's share. Collective unless `team` is NULL. */
  int (*tunnelled)(void *near, const struct flesh_team *team, const double *internal, const double *x_from,
                   const double *x_to);
  /* Saves or loads the state set by `follow` (flesh_integrator_save). */
  int (*archive)(void *near, struct flesh_archive *archive);
  /* Adds the numbers of initially intersecting surfaces that are allowed to separate. */
  void (*separation)(const void *near, struct flesh_separation *separation);
  /* Tells a new effect the bonds [count] of all other effects of its system, once, before its internal variables are
   * counted; each `variable` is an index into flesh_environment.all_internal. On ranks the effect of the whole body is
   * told. FLESH_ERR_MEMORY. */
  int (*take_bonds)(flesh_effect *effect, int count, const flesh_bond *bonds);
} flesh_effect_private;

/* Returns the effect's private operations, never NULL: missing ones are NULL in it. */
static inline const flesh_effect_private *flesh_effect_private_of(const flesh_effect *effect)
{
  static const flesh_effect_private none = {0};
  return effect->operations->library ? effect->operations->library : &none;
}

#endif
