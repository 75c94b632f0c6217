/* tet_kernel.h: kernels that effects run on the tets of a body, several tets side by side: one source, compiled once
 * per instruction set. */
#ifndef FLESH_ELEMENT_TET_KERNEL_H
#define FLESH_ELEMENT_TET_KERNEL_H

#include <stdint.h>

#include "flesh/body.h"
#include "flesh/material.h"

/* Potentials whose values, gradients and matrices kernels compute. */
typedef enum flesh_kernel {
  /* V(x) and its derivatives by x; the sizes of its terms are |psi| and |psi_I| I_C. The second derivative is scaled,
   * and its tets' negative eigenvalues are treated as `filter` says. */
  FLESH_KERNEL_ELASTIC,
  /* scale v.K v/2 with the same matrix K, negative eigenvalues clamped, and its derivatives by v. */
  FLESH_KERNEL_STIFFNESS,
  /* scale D, where D is the sum of volume * (shear dev E : dev E + bulk/2 (tr E)^2 + spin W : W) and E and W are the
   * symmetric and skew parts of G; the forces of P = F S; and scale times their derivatives by v plus scale_x times
   * those by x. At rest (x NULL) F = I and G = F'; else G = F^T F', or with a frozen state as in viscous_batch.h, and
   * spin = 0. */
  FLESH_KERNEL_VISCOUS,
  /* r [the mesh's tets] = the mean of J minus 1, 0 where it is not held; no sums. Absent for elements without means. */
  FLESH_KERNEL_GAPS,
  /* Energy of fibres (fibre_forms.h) at `activation` and its derivatives by x, the second scaled and filtered as for
   * FLESH_KERNEL_ELASTIC; the sizes of terms are |W| and |T| I. Only for tets made with fibres. */
  FLESH_KERNEL_FIBRE,
  /* scale v.M v/2 with the consistent mass M, and its derivatives by v. */
  FLESH_KERNEL_MASS,
  FLESH_KERNEL_COUNT
} flesh_kernel;

/* Most nodes of a tile, and most pairs of different nodes: for tets with four nodes, and with ten. */
enum { FLESH_TILE_NODES = 512, FLESH_TILE_PAIRS = 1536, FLESH_TILE_PAIRS_10 = 3072 };

/* Tiles are runs of batches. Kernels keep a tile's positions, forces and blocks in a compact copy: each is fetched from
 * the body once, and added to the body once. */
typedef struct flesh_tiles {
  int count;
  const int *batch;      /* [count+1] first batch of each tile */
  const int *node_first; /* [count+1] first of its nodes in `node` */
  const int *node;       /* numbers in the mesh of the tiles' nodes */
  const int *pair_first; /* [count+1] number of pairs of different nodes of the tiles before */
  const uint16_t *degree; /* of the tiles' nodes: number of the tile's pairs that contain the node */
  const uint16_t *star;   /* eight times the indices of these pairs, node by node; a tile's begin at 2 * pair_first */
  const int *block; /* for each tile its pairs of different nodes, then its nodes with themselves, as flesh_cells names
                     * them; a tile's begin at pair_first + node_first */
  const int *fresh; /* [count][2] how many of its pairs of different nodes, and of its nodes, belong to no tile before;
                     * these come first */
  const uint16_t *nodes; /* [batches][lanes][4 or 10] four times each node's index in its tile */
  const uint16_t *pairs; /* [batches][lanes][6 or 45] eight times each pair's index (01 02 03 ... 12 13 ...); in
                          * unused lanes eight times the number of pairs */
  const uint8_t *turned; /* for each tile's pairs, from pair_first on, 1: the first node has the larger number in the
                          * mesh, so that the body's block is the transpose; NULL for tets of four nodes */
} flesh_tiles;

/* The part of the volume term that depends on the mean of J over a tet: `share` U(J) - `local` W(J), with U =
 * (J-1)^2/2, (log J)^2/2 or a user's own, and W = x^4/(2 (x^2 + d^2)), x = J - 1, d = FLESH_LOCAL_RANGE. W is
 * negligible for J near 1, and about x^2/2 far from it: a point whose J is far from 1 then bears more of the volume
 * term itself, so that it cannot collapse while the tet's mean is right. W'' is at most 5/4. */
#define FLESH_LOCAL_RANGE 0.3
typedef struct flesh_volume_share {
  double share;    /* Pa, not negative */
  double local;    /* Pa; at most 4/5 of `share`, unless the mean is held at 1, where W = 0 */
  double moderate; /* Pa, the part of `share` that is no stiffer than the rest of the form */
  flesh_volume_term term;
  int held; /* 1: the tets' multipliers hold the mean at 1, and the share is a penalty */
} flesh_volume_share;

/* Returns `local` for the mean: 0 if it is held, so that the penalty stays convex however small it is. */
static inline double flesh_local_of_mean(const flesh_volume_share *share) { return share->held ? 0 : share->local; }

/* Tets in batches of one material each, with at most as many tets as the kernels have lanes. */
typedef struct flesh_batches {
  int count, lanes, nodes_per_tet;
  int shapes_per_tet; /* 1, or one for each quadrature point if tets are curved */
  flesh_tiles tiles;
  const int *first;     /* [count+1] first tet of each batch */
  const int *material;  /* [count] index into materials */
  /* [count][shapes_per_tet][10][lanes]: gradients g_1, g_2, g_3 of shape functions, and the volume, negative for the
   * opposite winding; unused lanes repeat the last tet with volume 0; NULL: there are masses. For ten nodes these are
   * of the corners of the straight tet, or of the virtual corners (tet10_lanes.h) at the point. */
  const double *shapes;
  /* [count][shapes_per_tet][4][lanes]: g_1.a, g_2.a, g_3.a of the fibre's direction a, and the volume, 0 in unused
   * lanes; NULL: no fibres. */
  const double *fibres;
  int masses_per_tet; /* 1, or 55 if tets are curved */
  /* [tets] rho V/20, for ten nodes rho V/420, kg; or [tets][55] the integrals of rho N_a N_b, a <= b; NULL: there are
   * shapes or fibres. */
  const double *masses;
  const int *nodes;     /* [tets][nodes_per_tet]: corners, in rising order, and those on the edges 01 02 03 12 13 23 */
  const flesh_material *materials;
  const flesh_volume_share *volume_shares; /* [materials]; NULL: no means are used */
  const int *tet; /* [tets] number of each in the mesh; NULL: no mean is held */
} flesh_batches;

/* Constants of the second Piola-Kirchhoff stress 2 shear dev(sym G) + bulk tr(G) I + 2 spin skew(G) for the rate G, Pa
 * s. */
typedef struct flesh_viscous {
  double shear, bulk, spin;
} flesh_viscous;

/* The point at which a kernel is evaluated, and its options. */
typedef struct flesh_tet_point {
  const double *x; /* [3*n] positions, for F; NULL in kernels that allow it: at rest, F = I */
  const double *v; /* [3*n] velocities, for kernels of rates, and for fibres whose tension depends on speed; else NULL */
  /* [3*n] frozen state of flesh_point, for kernels of rates. NULL: x and v themselves; only v_frozen NULL: at rest. */
  const double *x_frozen, *v_frozen;
  double scale_x;  /* factor in matrices of the derivatives by x, beside those by v */
  double scale;    /* factor of forces and energies of rates, and of matrices */
  flesh_eigenvalue_filter filter;      /* for matrices */
  int assign;                   /* 1: matrices replace the previous values instead of being added */
  const flesh_viscous *viscous; /* of every material, for the viscous kernel */
  const struct flesh_fibre_constants *fibre; /* of all tets, for the fibre kernel */
  double activation;            /* of the fibres */
  /* For fibres if v is given, 1/s: change of velocities when positions change by 1 in a step; 0: unknown. */
  double ratio;
  const double *multipliers;    /* [the mesh's tets] Pa, of means that are held; NULL: 0 */
  double penalty;               /* factor of the shares of held means; 0 counts as 1 */
  const double *excess;         /* Pa, of every material: subtracted from d2 psi/dJ2 in matrices; NULL: 0 */
} flesh_tet_point;

/* Functions of a kernel for one tile. Batches are processed in order, which fixes the order of additions. Return
 * FLESH_OK, FLESH_UNDEFINED or FLESH_NONFINITE. */
typedef struct flesh_tet_kernel {
  /* Adds the gradient to r unless NULL, and unless `sums` is NULL, the potential to sums[0] and the size of its terms
   * to sums[1]. Each has the same bits whether the other is wanted or not. */
  int (*residual_kernel)(const flesh_batches *batches, int tile, const flesh_tet_point *at, double *r, double *sums);
  /* Adds the matrix to values or, if at->assign, sets values for pairs that belong to no tile before; `slots` are those
   * of all tiles' pairs. */
  int (*hessian_kernel)(const flesh_batches *batches, int tile, const flesh_tet_point *at, const int *slots,
                      double *values);
  /* Writes rows [tets][nodes_per_tet][3] of the tile's tets: b of each tet's stiff term b b^T in that matrix; 0: there
   * is none. NULL: no tet ever has one. */
  void (*rows_kernel)(const flesh_batches *batches, int tile, const flesh_tet_point *at, float *rows);
} flesh_tet_kernel;

typedef struct flesh_tet_kernels {
  int lanes;
  const flesh_tet_kernel *of[FLESH_KERNEL_COUNT]; /* NULL: nothing to do */
} flesh_tet_kernels;

/* Mass kernels of tets of four and of ten nodes (mass.c), shared by all instruction sets. */
extern const flesh_tet_kernel flesh_mass4, flesh_mass10;

/* Kernels of every element, by its number. */
extern const flesh_tet_kernels flesh_kernels_portable[], flesh_kernels_avx2[], flesh_kernels_avx512[];

#endif
