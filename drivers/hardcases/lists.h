/* lists.h: the comma lists of the battery's command line. */
#ifndef FLESH_HARDCASES_LISTS_H
#define FLESH_HARDCASES_LISTS_H

#include "cli/lists.h"
#include "hardcases/hardcases.h"

enum { FLESH_HARDCASES_LIST_LIMIT = 64 };

/* How many of each there are, and their values. */
typedef struct flesh_hardcases_lists {
  int energies, poissons, steps, solvers, elements, bodies;
  flesh_energy energy[FLESH_HARDCASES_LIST_LIMIT];
  flesh_constants constants[FLESH_HARDCASES_LIST_LIMIT];
  double poisson[FLESH_HARDCASES_LIST_LIMIT], step[FLESH_HARDCASES_LIST_LIMIT];
  flesh_hardcases_solver solver[FLESH_HARDCASES_SOLVER_LIMIT];
  flesh_element element[FLESH_ELEMENT_COUNT];
  flesh_hardcases_body body[FLESH_HARDCASES_LIST_LIMIT];
  char files[FLESH_HARDCASES_LIST_LIMIT][FLESH_LIST_ITEM];
} flesh_hardcases_lists;

/* The lists as given; of meshes NULL for none. */
typedef struct flesh_hardcases_request {
  const char *energies, *poissons, *steps, *solvers, *elements, *meshes, *cases, *share;
} flesh_hardcases_request;

/* Reads all but the cases. FLESH_ERR_ARGUMENT with what would be valid. */
int flesh_hardcases_read_lists(const flesh_hardcases_request *asked, flesh_hardcases_lists *lists);

#endif
