/* state.h: states of some of the nodes, as a rank has them, read from rows of a file that is never in memory as a whole. */
#ifndef FLESH_SYSTEM_STATE_H
#define FLESH_SYSTEM_STATE_H

#include "base/file.h"
#include "flesh/state.h"

/* Checks a state. FLESH_ERR_ARGUMENT where it is NULL, lacks x, v or an array whose count is not 0, or has the same array
 * as x and v. */
int flesh_state_check(const char *function, const flesh_state *state);

/* Checks the state of a public function that returns a status. */
#define FLESH_NEED_STATE(state)                                              \
  do {                                                                       \
    const int flesh_need_status = flesh_state_check(__func__, state);        \
    if (flesh_need_status) return flesh_need_status;                         \
  } while (0)

/* Reads a state of `nodes` nodes like flesh_state_read, but keeps only the nodes numbers [count], ascending. */
int flesh_state_read_some(const char *path, int nodes, int count, const int *numbers, flesh_state *state);

/* Write parts of the file of flesh_state_write: the head, then the rows of all nodes in their order. */
void flesh_state_write_head(flesh_file *file, double t);
void flesh_state_write_rows(flesh_file *file, int nodes, const double *x, const double *v);

#endif
