/* lists.h: the comma lists of the battery's command line. */
#ifndef FLESH_HARDCASES_LISTS_H
#define FLESH_HARDCASES_LISTS_H

#include "hardcases/hardcases.h"

enum { FLESH_HARDCASES_LIST_LIMIT = 64, FLESH_HARDCASES_ITEM_SIZE = 1024 };

/* How many of each there are, and their values. */
typedef struct flesh_hardcases_lists {
  int energies, poissons, steps, solvers, elements, bodies;
  flesh_energy energy[FLESH_HARDCASES_LIST_LIMIT + 1];
  flesh_constants constants[FLESH_HARDCASES_LIST_LIMIT + 1];
  double poisson[FLESH_HARDCASES_LIST_LIMIT + 1], step[FLESH_HARDCASES_LIST_LIMIT + 1];
  flesh_hardcases_solver solver[FLESH_HARDCASES_LIST_LIMIT + 1];
  flesh_element element[FLESH_HARDCASES_LIST_LIMIT + 1];
  flesh_hardcases_body body[FLESH_HARDCASES_LIST_LIMIT + 1];
  char files[FLESH_HARDCASES_LIST_LIMIT + 1][FLESH_HARDCASES_ITEM_SIZE];
} flesh_hardcases_lists;

/* Calls `take` with every item of a comma list, the value of `option`. */
int flesh_hardcases_split(const char *option, const char *text, int (*take)(void *data, const char *item), void *data);

/* Each adds an item to the lists `data`; FLESH_ERR_ARGUMENT with what would be valid. */
int flesh_hardcases_take_energy(void *data, const char *item);
int flesh_hardcases_take_poisson(void *data, const char *item);
int flesh_hardcases_take_step(void *data, const char *item);
int flesh_hardcases_take_solver(void *data, const char *item);
int flesh_hardcases_take_element(void *data, const char *item);
int flesh_hardcases_take_body(void *data, const char *item);

#endif
