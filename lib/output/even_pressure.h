/* even_pressure.h: pressures of tet10-mean as a continuous field, without the checkerboards of one number per tet. */
#ifndef FLESH_OUTPUT_EVEN_PRESSURE_H
#define FLESH_OUTPUT_EVEN_PRESSURE_H

#include "output/tet_stress.h"

typedef struct flesh_even_pressure {
  const flesh_body *body;
  const struct flesh_team *team;
  double *p;      /* [tets] Pa, in: means over the tets; out: of the field, unless one of the four nodes is left out */
  double *q;      /* [nodes] out: the field at corners, Pa; NaN at nodes that are left out or on edges */
  double *volume; /* [nodes] m^3 of the tets around; 0: left out, as not all of them are tet10-mean of one material */
  double *change; /* [nodes] work space; the four arrays are one block */
} flesh_even_pressure;

/* Allocates the arrays and chooses the nodes. Borrows everything but the result; collective. FLESH_ERR_MEMORY. The
 * caller calls flesh_even_pressure_clear in any case. */
int flesh_even_pressure_open(const flesh_tet_stress *stress, const struct flesh_team *team, flesh_even_pressure *even);
void flesh_even_pressure_clear(flesh_even_pressure *even);

/* Fits continuous, linear pressures to the means over tets, by least squares. Collective. */
void flesh_even_pressure_find(flesh_even_pressure *even);

#endif
