/* tet_kernel.h: what effects do with the tets of a body, several side by side: one source, compiled
 * once per instruction set. */
#ifndef FLESH_ELEMENT_TET_KERNEL_H
#define FLESH_ELEMENT_TET_KERNEL_H

#include <stdint.h>

#include "flesh/body.h"
#include "flesh/material.h"

/* The potentials whose values, gradients and matrices kernels compute. */
typedef enum flesh_kernel {
  /* V(x) and its derivatives by x; of terms the sizes |psi| and |psi_I| I_C. The second scaled, its
   * tets' negative eigenvalues treated as `filter` says. */
  FLESH_KERNEL_ELASTIC,
  /* scale v.K v/2 with K the same matrix, negative eigenvalues clamped, and its derivatives by v. */
  FLESH_KERNEL_STIFFNESS,
  /* scale D, D the sum of volume * (shear dev E : dev E + bulk/2 (tr E)^2 + spin W : W), E and W symmetric and skew
   * parts of G; the forces of P = F S, and scale times their derivatives by v plus scale_x times those by x. At rest
   * (x NULL) F = I and G = F'; else G = F^T F', with a frozen state as viscous_kernel.c says, and spin = 0. */
  FLESH_KERNEL_VISCOUS,
  /* r [the mesh's tets] = the mean of J less 1, 0 where it is not held; no sums. None of elements without means. */
  FLESH_KERNEL_GAPS,
  /* The energy of fibres (fibre_forms.h) at `activation` and its derivatives by x, the second scaled and filtered as
   * above; of terms the sizes |W| and |T| I. Of tets that hold fibres alone. */
  FLESH_KERNEL_FIBRE,
  /* scale v.M v/2 with the consistent mass M, and its derivatives by v. */
  FLESH_KERNEL_MASS,
  FLESH_KERNEL_COUNT
} flesh_kernel;

/* The most nodes of a tile, and the most pairs of different nodes: of tets with four nodes, with ten. */
enum { FLESH_TILE_NODES = 512, FLESH_TILE_PAIRS = 1536, FLESH_TILE_PAIRS_10 = 3072 };

/* Tiles are runs of batches. Kernels hold a tile's positions, forces and blocks by themselves, near and without gaps:
 * each is fetched from the body's once, and added to them once. */
typedef struct flesh_tiles {
  int count;
  const int *batch;      /* [count+1] first batch of each */
  const int *node_first; /* [count+1] first of its nodes in node */
  const int *node;       /* the mesh's numbers of the tiles' nodes */
  const int *pair_first; /* [count+1] how many pairs of different nodes those before have */
  const uint16_t *degree; /* of the tiles' nodes: how many of the tile's pairs they are in */
  const uint16_t *star;   /* eight times these pairs' numbers, node by node; the tile's first is at 2 * pair_first */
  const int *block; /* of each tile first its pairs of different nodes, then its nodes with themselves, as flesh_cells
                       names them; the tile's first is at pair_first + node_first */
  const int *fresh; /* [count][2] how many of its pairs of different nodes, and of its nodes, the first, no tile before
                       has */
  const uint16_t *nodes; /* [batches][lanes][4 or 10] four times each node's number in its tile */
  const uint16_t *pairs; /* [batches][lanes][6 or 45] eight times each pair's (01 02 03 ... 12 13 ...); that of pairs
                            where lanes are not used */
  const uint8_t *turned; /* of each tile's pairs, from pair_first on: the mesh's number of the first node is the larger
                            one, so that the body's block is the transposed one; NULL for tets of four nodes */
} flesh_tiles;

/* The part of the volume term that is a function of the mean of J over a tet: `share` U(J) - `local` W(J), with U =
 * (J-1)^2/2, (log J)^2/2 or a user's own, and W = x^4/(2 (x^2 + d^2)), x = J - 1, d = FLESH_LOCAL_RANGE. W is as good as
 * nothing while J is near 1, and x^2/2 where it is not: a point that strays far from 1 bears more of the term itself, so
 * that it cannot collapse while the tet's mean is right. W'' is at most 5/4. */
#define FLESH_LOCAL_RANGE 0.3
typedef struct flesh_volume_share {
  double share;    /* Pa, not negative */
  double local;    /* Pa; at most 4/5 of it, unless the mean is held at 1, where W = 0 */
  double moderate; /* Pa, the part of it that is no stiffer than the rest of the form */
  flesh_volume_term term;
  int held; /* the mean is held at 1 by the tets' multipliers; the share is a penalty */
} flesh_volume_share;

/* `local` of the mean: 0 where it is held, so that the penalty stays convex however small it is. */
static inline double flesh_local_of_mean(const flesh_volume_share *share) { return share->held ? 0 : share->local; }

/* Tets in batches of at most as many as the kernels have lanes, of one material each. */
typedef struct flesh_batches {
  int count, lanes, nodes_per_tet;
  int shapes_per_tet; /* 1; one for each point of quadrature where tets are curved */
  flesh_tiles tiles;
  const int *first;     /* [count+1] first tet of each */
  const int *material;  /* [count] index into materials */
  /* [count][shapes_per_tet][10][lanes]: gradients g_1, g_2, g_3 of shape functions, volume, negative where the nodes
   * wind the other way; lanes that are not used repeat the last tet with no volume; NULL: masses. Of ten nodes: those of
   * the corners of the straight tet, or of the virtual corners (tet10_lanes.h) at the point */
  const double *shapes;
  /* [count][shapes_per_tet][4][lanes]: g_1.a, g_2.a, g_3.a of the fibre's direction a, and the volume, 0 of lanes that
   * are not used; NULL: no fibres */
  const double *fibres;
  int masses_per_tet; /* 1; 55 where tets are curved */
  /* [tets] rho V/20, of ten nodes rho V/420, kg; or [tets][55] the integrals of rho N_a N_b, a <= b; NULL: shapes or
   * fibres */
  const double *masses;
  const int *nodes;     /* [tets][nodes_per_tet]: corners, ascending, and those on the edges 01 02 03 12 13 23 */
  const flesh_material *materials;
  const flesh_volume_share *volume_shares; /* of the materials; NULL where no mean is taken */
  const int *tet; /* [tets] the mesh's number of each; NULL where no mean is held */
} flesh_batches;

/* The second Piola-Kirchhoff stress 2 shear dev(sym G) + bulk tr(G) I + 2 spin skew(G) for the rate
 * G, Pa s. */
typedef struct flesh_viscous {
  double shear, bulk, spin;
} flesh_viscous;

/* The point at which a kernel is evaluated, and the options of that. */
typedef struct flesh_tet_point {
  const double *x; /* [3*n] positions, of F; NULL, where a kernel takes it: at rest, F = I */
  const double *v; /* [3*n] velocities, of kernels of rates; of fibres, whose tension depends on speeds then, or NULL */
  /* [3*n] of kernels of rates: the frozen state of flesh_point; NULL: x and v themselves. v_frozen NULL: at rest */
  const double *x_frozen, *v_frozen;
  double scale_x;  /* of matrices, of what changes with x beside what changes with v */
  double scale;    /* of forces and energies of rates, and of matrices */
  flesh_eigenvalue_filter filter;      /* of matrices */
  int assign;                   /* matrices are not added to what was there before */
  const flesh_viscous *viscous; /* of every material, of the viscous kernel */
  const struct flesh_fibre_constants *fibre; /* of all tets, of the kernel of fibres */
  double activation;            /* of them */
  /* 1/s, of fibres where v is given: what velocities change by when positions change by 1 in a step; 0: not known */
  double ratio;
  const double *multipliers;    /* [the mesh's tets] Pa, of means that are held; NULL: 0 */
  double penalty;               /* times their shares; 0 counts as 1 */
  const double *excess;         /* Pa, of every material, taken off d2 psi/dJ2 in matrices; NULL: nothing */
} flesh_tet_point;

/* Everything for one tile, batch by batch, which is the order of the additions. Returns FLESH_OK, FLESH_UNDEFINED or
 * FLESH_NONFINITE. */
typedef struct flesh_tet_kernel {
  /* r += the gradient unless r is NULL; sums[0] += its potential and sums[1] += the size of the terms
   * of that unless `sums` is NULL. The same bits whether the other is asked for or not. */
  int (*residual_kernel)(const flesh_batches *batches, int tile, const flesh_tet_point *at, double *r, double *sums);
  /* values += the matrix, or, where `at` says so, values = it for pairs that no tile before has; `slots` are those of
   * all tiles' pairs. */
  int (*hessian_kernel)(const flesh_batches *batches, int tile, const flesh_tet_point *at, const int *slots,
                      double *values);
  /* rows [tets][nodes_per_tet][3] of the tile's tets: b of each tet's stiff term b b^T in that matrix; 0: it has none.
   * NULL: no tet ever has. */
  void (*rows_kernel)(const flesh_batches *batches, int tile, const flesh_tet_point *at, float *rows);
} flesh_tet_kernel;

typedef struct flesh_tet_kernels {
  int lanes;
  const flesh_tet_kernel *of[FLESH_KERNEL_COUNT]; /* NULL: nothing to do */
} flesh_tet_kernels;

/* Mass kernels of tets of four and of ten nodes (mass.c), which all instruction sets share. */
extern const flesh_tet_kernel flesh_mass4, flesh_mass10;

/* The kernels of every element, by its number. */
extern const flesh_tet_kernels flesh_kernels_portable[], flesh_kernels_avx2[], flesh_kernels_avx512[];

#endif
