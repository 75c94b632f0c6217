/* state.h: states of which a rank has some nodes: rows of a file that is never in memory as a whole. */
#ifndef FLESH_SYSTEM_STATE_H
#define FLESH_SYSTEM_STATE_H

#include "base/file.h"
#include "flesh/state.h"

/* FLESH_ERR_ARGUMENT where the state is NULL, lacks x, v or an array of which it has a count, or has one array as both x
 * and v. */
int flesh_state_check(const char *function, const flesh_state *state);

/* Checks the state of a public function that returns a status. */
#define FLESH_NEED_STATE(state)                                              \
  do {                                                                       \
    const int flesh_need_status = flesh_state_check(__func__, state);        \
    if (flesh_need_status) return flesh_need_status;                         \
  } while (0)

/* flesh_state_read of a state of `nodes` nodes, of which `count` are wanted: numbers [count], rising. */
int flesh_state_read_some(const char *path, int nodes, int count, const int *numbers, flesh_state *state);

/* Parts of the file that flesh_state_write writes: the head, then the rows of all nodes in their order. */
void flesh_state_write_head(flesh_file *file, double t);
void flesh_state_write_rows(flesh_file *file, int nodes, const double *x, const double *v);

#endif
