/* private.h: what only the library's own effects have beside their operations (flesh/effect.h). */
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
  int count[2];        /* nodes of either group */
  const int *nodes[2]; /* [count] each, of the mesh; borrowed from the effect */
  double gap;          /* m, between the surfaces of the groups at rest */
  int variable;        /* the effect's internal variable that is not 0 once the bond is broken; -1: it never breaks */
} flesh_bond;

/* For effects that hold surfaces together (welds, joints): features that a bond holds do not touch each other until it
 * is broken and they have come apart. */
typedef struct flesh_effect_bonds {
  int (*count)(const flesh_effect *effect);
  void (*get)(const flesh_effect *effect, int k, flesh_bond *bond); /* 0 <= k < count */
} flesh_effect_bonds;

/* For effects that ranks can share out (flesh/ranks.h) though they are no sum over tets: what acts on nodes or faces. Of
 * one with internal variables every rank has all of them, and updates them to the same bits. */
enum { FLESH_RANK_SUMS = 4 };
typedef struct flesh_rank_numbers { /* over all ranks; 0 where a rank writes none */
  double sums[FLESH_RANK_SUMS], largest[FLESH_RANK_SUMS];
} flesh_rank_numbers;
typedef struct flesh_effect_ranks {
  /* A new effect of the same kind on `body`, that of the part: what of `whole`, the effect on the whole body, is for
   * this rank to compute, so that those of all ranks add up to it. It may have nothing to act on. It lives no longer
   * than `whole`. Errors: FLESH_ERR_ARGUMENT where it cannot be shared out, FLESH_ERR_MEMORY. */
  int (*restrict_to_part)(const flesh_effect *whole, const struct flesh_rank_part *part, const flesh_body *body,
                          flesh_effect **restricted);
  /* Cells of `whole` that tie nodes of several ranks together, which are then nodes of the part
   * (flesh_rank_part_create_for): of each cell the rank that owns its first node has all nodes or, where *everywhere
   * becomes 1, all ranks have. NULL, or count 0: the part's tets have all nodes that are needed. */
  const flesh_cells *(*cells)(const flesh_effect *whole, int *everywhere);
  /* This rank's part of sums [sum_count] that are needed at a point, and then come as point->sums. NULL, 0: none. */
  int sum_count;
  void (*sum)(const flesh_effect *effect, const flesh_point *point, double *sums);
  /* Numbers of the body that a part has not (a count of nodes, a mean): `count` writes this rank's, `take` gets those
   * of all, once, before the system is finished; it may change the kind. Both or neither. */
  void (*count)(const flesh_effect *restricted, flesh_rank_numbers *numbers);
  void (*take)(flesh_effect *restricted, const flesh_rank_numbers *numbers);
  /* flesh_effect_figures.report of all ranks, likewise; FLESH_RANK_SUMS values at most. NULL: each has it by itself. */
  void (*report_part)(const flesh_effect *effect, const flesh_point *point, flesh_rank_numbers *numbers);
  void (*report_whole)(const flesh_effect *effect, const flesh_rank_numbers *numbers, double *values);
} flesh_effect_ranks;

/* Arguments of a residual beside those by which its Jacobian is: lagged.x, lagged.v, frozen.x, frozen.v; and the
 * point's own v and x by effects that freeze, whose Jacobian is that of both together. */
typedef enum flesh_argument {
  FLESH_LAGGED_X, FLESH_LAGGED_V, FLESH_FROZEN_X, FLESH_FROZEN_V, FLESH_OWN_V, FLESH_OWN_X, FLESH_ARGUMENTS
} flesh_argument;

/* For effects that lag or freeze: what sensitivities need beside the Jacobian, which else takes many differences. An
 * effect has one of the three. */
typedef struct flesh_effect_partials {
  /* y [3*n] += scale times the derivative of the residual by `argument`, times w [3*n], or the transposed one; nothing
   * where the residual does not depend on it. Has a value wherever the residual has one. */
  void (*multiply)(const flesh_effect *effect, const flesh_point *point, flesh_argument argument, int transposed,
                   double scale, const double *w, double *y);
  unsigned reads; /* bits of the arguments that `multiply` has: the residual depends on no others */
  /* For a sum over tets: a new effect of the same tets on `torn`, in which no two share a node (mesh/torn.h), so that a
   * few differences have the derivatives of all tets. Its materials are those of `body`; NULL: its own. It lives no longer
   * than this one, `body` and `torn`. */
  int (*tear)(const flesh_effect *effect, const flesh_body *body, const flesh_mesh *torn, flesh_effect **torn_effect);
  /* For what couples few nodes, which differ from place to place: adds the blocks of the derivative of the residual by
   * `argument`. FLESH_UNDEFINED where there is none; the errors of `add`. */
  int (*couple)(const flesh_effect *effect, const flesh_point *point, flesh_argument argument, flesh_block_add add, void *to);
} flesh_effect_partials;

/* Members that an effect does not need are NULL. */
typedef struct flesh_effect_private {
  /* Residual and potential in one pass, for effects where that costs less than both: adds to r,
   * *phi and *magnitude the same bits as `residual` and `potential`, which must be there too. NULL:
   * those two are called. */
  int (*evaluate)(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                  double *r, double *phi, double *magnitude);
  /* 1: its residual is a symmetric matrix times v, as long as what is lagged stays: a product with the matrix is a
   * residual. */
  int linear_in_v;
  /* Does what `jacobian` does, but overwrites K's blocks of the cells' pairs, instead of adding to them: for one effect
   * of a system, called before the others, so that K need not be cleared. NULL: K is cleared. */
  int (*jacobian_assign)(const flesh_effect *effect, const flesh_point *point,
                         const flesh_shift *shift, flesh_block_matrix *K, const int *slots);
  /* For effects whose Jacobian contains one stiff term of every cell: describes their rows, without
   * values, and writes the values [rows.count][nodes_per_row][3] of those in the matrix that
   * `jacobian` gives there. NULL, both: none. */
  void (*stiff_rows)(const flesh_effect *effect, flesh_stiff_rows *rows);
  void (*stiff_values)(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                       float *values);
  /* For effects that are a sum over their cells, which are tets: a new effect of the cells `chosen`
   * [count], ascending, alone; they are the tets of `mesh` in this order. It lives no longer than
   * this one and `mesh`. NULL: where few nodes are solved for alone, a quadratic model stands for
   * the effect. */
  int (*restrict_to_cells)(const flesh_effect *effect, int count, const int *chosen,
                           const flesh_mesh *mesh, flesh_effect **restricted);
  /* For the same effects: a cell's nodes in the order in which meshes have those of a tet. Returns 4 or 10. */
  int (*cell_nodes)(const flesh_effect *effect, int cell, int nodes[10]);
  /* The vector instructions that it works with, on which the last bits of its results depend.
   * NULL: those of the program. */
  flesh_instructions (*instructions)(const flesh_effect *effect);
  /* For effects whose materials resist changes of volume: lambda/mu of the stiffest, and a new effect with materials of no
   * more than this ratio (system/softened.h), which lives no longer than this one. NULL, both: none. */
  double (*stiffness_ratio)(const flesh_effect *effect);
  int (*soften)(const flesh_effect *effect, double ratio, flesh_effect **softened);
  /* Whether another effect of this kind has the same residual at every point, bit by bit. NULL: nobody knows. */
  int (*is_same)(const flesh_effect *effect, const flesh_effect *other);
  const flesh_effect_partials *partials;
  const flesh_effect_ranks *ranks;
  const flesh_effect_bonds *bonds;
  /* A solve is about to make its matrix at `point`, with memory: the effect predicts its forces there, by those at
   * lagged.x or by what it predicted last in the solve that begins there. Until the next prediction `jacobian` at this
   * place may have secants to these forces for derivatives; it has derivatives where they are the forces at x, at all
   * other places, and without memory. Where it fails it predicts nothing, and `jacobian` says why. NULL: it always has
   * derivatives. */
  void (*predict)(const flesh_effect *effect, const flesh_point *point);
  /* Bytes, zero at first, that a run keeps for `predict` (flesh_environment.predicted). NULL: the effect has its own. */
  size_t (*predictions)(const flesh_effect *effect);
  /* The rest is for barriers with a memory. */
  /* Whether the effect neither is felt at x0 + shift u (x0 and u [3*nodes]; u NULL: at x0) nor limits a straight way
   * between any two places of this x0 for which it says so, until it has searched again. With u, x0 is that of the last
   * call without. NULL: it always may. */
  int (*is_far)(void *near, const double *x0, double shift, const double *u);
  /* Corrects x [3*n], from where a solve may begin whose step begins at x_from, so that what touches there keeps its gaps, as
   * far as a few corrections node by node go. Returns whether x has changed. Collective, where `team` is not NULL. */
  int (*keep_gaps)(void *near, const struct flesh_team *team, const double *internal, const double *x_from, double *x);
  /* flesh_effect_barrier.tunnelled with the memory and what comes with it, for what this rank has of it. Collective, where
   * `team` is not NULL. */
  int (*tunnelled)(void *near, const struct flesh_team *team, const double *internal, const double *x_from,
                   const double *x_to);
  /* Saves or loads what `follow` has told (flesh_integrator_save). */
  int (*archive)(void *near, struct flesh_archive *archive);
  /* Adds what the memory knows of surfaces that begin crossed and are let apart. */
  void (*separation)(const void *near, struct flesh_separation *separation);
  /* Tells a new effect which bonds [count] the other effects of its system have, once, before its internal variables are
   * counted; each `variable` is an index into flesh_environment.all_internal. On ranks the effect of the whole body is
   * told. Errors: FLESH_ERR_MEMORY. */
  int (*take_bonds)(flesh_effect *effect, int count, const flesh_bond *bonds);
} flesh_effect_private;

/* Never NULL: what an effect has not is NULL in it. */
static inline const flesh_effect_private *flesh_effect_private_of(const flesh_effect *effect)
{
  static const flesh_effect_private none = {0};
  return effect->operations->library ? effect->operations->library : &none;
}

#endif
