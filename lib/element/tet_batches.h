/* tet_batches.h: the tets of a body in batches for the kernels (tet_kernel.h), processed piece by piece and colour by
 * colour (tet_order.h), with the same bits for any number of threads. */
#ifndef FLESH_ELEMENT_TET_BATCHES_H
#define FLESH_ELEMENT_TET_BATCHES_H

#include <stddef.h>

#include "element/tet_kernel.h"
#include "element/tet_order.h"
#include "flesh/body.h"
#include "flesh/threads.h"

/* Tets with the same number of nodes. */
typedef struct flesh_tet_group {
  flesh_batches batches;
  flesh_element element; /* never AUTO; TET10_MEAN if some material has it */
  const flesh_tet_kernels *kernels;
  flesh_tet_order order;     /* without .tet */
  int *piece_tile;           /* [pieces+1] first tile of each piece */
  int tets, first;           /* first: number of the first one among the cells */
  int first_slot;            /* first of its pairs among those that the cells list */
} flesh_tet_group;

/* The tets of a body in at most two groups: four nodes, then ten. */
typedef struct flesh_tets {
  flesh_cells cells; /* in the order of the batches, which is the same for every effect of the body */
  int group_count;
  flesh_tet_group groups[2];
  flesh_element element; /* of the first group; TET10_MEAN if some group has it */
  flesh_element given;   /* the body's and its materials' elements, borrowed */
  const flesh_element *material_elements;
  flesh_instructions instructions; /* never AUTO */
  int materials;                   /* number of different materials in the batches */
} flesh_tets;

typedef enum flesh_tets_hold { FLESH_TETS_SHAPES, FLESH_TETS_MASSES, FLESH_TETS_FIBRES } flesh_tets_hold;

/* Chosen tets with fibres. */
typedef struct flesh_tets_choice {
  int count;                /* at least 1 */
  const int *tets;          /* [count] ascending, of the mesh; NULL: all */
  const double *directions; /* [3 * the mesh's tets] unit vectors at rest */
} flesh_tets_choice;

/* Makes the batches for body->instructions. FLESH_ERR_ARGUMENT if the machine lacks them; FLESH_ERR_MEMORY. The caller
 * clears `tets`, also after an error. */
int flesh_tets_create(const flesh_body *body, flesh_tets_hold hold, flesh_tets *tets);
/* Like flesh_tets_create, for chosen tets and only FLESH_KERNEL_FIBRE. */
int flesh_tets_create_fibres(const flesh_body *body, const flesh_tets_choice *choice, flesh_tets *tets);
void flesh_tets_clear(flesh_tets *tets);

/* Computes the first order of a kernel for all tets: adds to r [3*n] unless NULL, sets sums [2] unless NULL. */
int flesh_tets_residual(const flesh_tets *tets, flesh_kernel kernel, const flesh_tet_point *at, flesh_threads *threads,
                        double *r, double *sums);

/* Computes the second order of a kernel: adds to values at the slots of the cells. */
int flesh_tets_hessian(const flesh_tets *tets, flesh_kernel kernel, const flesh_tet_point *at, flesh_threads *threads,
                       const int *slots, double *values);

/* Returns the tets whose elastic matrix has stiff rows; NULL: none have. */
const flesh_tet_group *flesh_tets_stiff(const flesh_tets *tets);

/* Writes the stiff rows, [tets of the group][nodes_per_tet][3], in the order of its batches. */
void flesh_tets_rows(const flesh_tets *tets, const flesh_tet_point *at, flesh_threads *threads, float *rows);

/* Returns whether the mean of J is held in some tet. */
int flesh_tets_hold_means(const flesh_tets *tets);

/* Sums to which an effect's `evaluate` adds: r [3*n] unless NULL; *phi and *magnitude unless `shift` is 0. */
typedef struct flesh_contribution {
  double shift, *r, *phi, *magnitude;
} flesh_contribution;

/* Implements `evaluate` for a kernel whose potential depends on velocities; `shift` is that of v. */
int flesh_tets_dissipate(const flesh_tets *tets, flesh_kernel kernel, const flesh_tet_point *at, flesh_threads *threads,
                         const flesh_contribution *to);

/* Returns whether both have the same shapes in the same order and, with_materials, the same materials, so that kernels
 * that read no other data give the same bits. */
int flesh_tets_are_same(const flesh_tets *tets, const flesh_tets *others, int with_materials);

/* Returns the bytes held; 0 if `tets` is cleared or was never made. */
size_t flesh_tets_memory(const flesh_tets *tets);

#endif
