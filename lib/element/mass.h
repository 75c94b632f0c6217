/* mass.h: a body's mass matrix, lumped or consistent, for the effects that multiply by it. */
#ifndef FLESH_ELEMENT_MASS_H
#define FLESH_ELEMENT_MASS_H

#include <stddef.h>

#include "element/tet_batches.h"
#include "flesh/block_matrix.h"

typedef struct flesh_mass_matrix {
  int nodes;
  double *lumped;  /* [nodes] kg; NULL: consistent */
  flesh_tets tets; /* with masses, consistent only */
} flesh_mass_matrix;

/* Makes a lumped or consistent matrix, as body->mass says. FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY; cleared after an
 * error. */
int flesh_mass_matrix_create(const flesh_body *body, flesh_mass_matrix *mass);
void flesh_mass_matrix_clear(flesh_mass_matrix *mass);

/* Returns the cells of the tets, as in flesh_tets; NULL for a lumped matrix. */
const flesh_cells *flesh_mass_matrix_cells(const flesh_mass_matrix *mass);

/* Adds scale M x to y unless y is NULL, and sets *half_square to scale x.M x / 2 unless that is NULL; each has the same
 * bits whether the other is wanted or not, and for any number of threads. */
void flesh_mass_matrix_apply(const flesh_mass_matrix *mass, double scale, flesh_threads *threads, const double *x,
                             double *y, double *half_square);

/* Implements `evaluate` of an effect r = rate M x with x = shift * u. */
void flesh_mass_matrix_evaluate(const flesh_mass_matrix *mass, double rate, flesh_threads *threads, const double *x,
                                const flesh_contribution *to);

/* Adds scale M to K; `slots` as in flesh_effect_operations.jacobian for the cells, not read for a lumped matrix. */
void flesh_mass_matrix_add(const flesh_mass_matrix *mass, double scale, flesh_threads *threads,
                           flesh_block_matrix *K, const int *slots);

/* Returns whether both have the same numbers in the same order. */
int flesh_mass_matrices_are_same(const flesh_mass_matrix *mass, const flesh_mass_matrix *other);

/* Returns the bytes that the matrix holds. */
size_t flesh_mass_matrix_memory(const flesh_mass_matrix *mass);

#endif
