/* mass.h: a body's mass matrix, lumped or consistent, for the effects that multiply by it. */
#ifndef FLESH_EFFECT_MASS_H
#define FLESH_EFFECT_MASS_H

#include <stddef.h>

#include "flesh/effects.h"

typedef struct flesh_mass_matrix {
  int nodes;
  double *lumped;    /* [nodes] kg; NULL: consistent */
  flesh_cells cells; /* of the tets, consistent only */
  double *cell_mass; /* [cells] rho V/20, consistent only */
} flesh_mass_matrix;

/* By body->mass. Cleared also when it fails. */
int flesh_mass_matrix_create(const flesh_body *body, flesh_mass_matrix *mass);
void flesh_mass_matrix_clear(flesh_mass_matrix *mass);

/* y += scale M x. */
void flesh_mass_matrix_times(const flesh_mass_matrix *mass, double scale, const double *x, double *y);

/* x.M x / 2. */
double flesh_mass_matrix_half_square(const flesh_mass_matrix *mass, const double *x);

/* K += scale M; `slots` as of flesh_effect_operations.jacobian for the cells of all tets, not read where lumped. */
void flesh_mass_matrix_add(const flesh_mass_matrix *mass, double scale, flesh_threads *threads,
                           flesh_block_matrix *K, const int *slots);

/* Bytes it holds. */
size_t flesh_mass_matrix_memory(const flesh_mass_matrix *mass);

#endif
