/* state.h: where a body is and how it moves, as plain data and as a file. */
#ifndef FLESH_STATE_H
#define FLESH_STATE_H

#include "flesh/status.h"

#ifdef __cplusplus
extern "C" {
#endif

/* {t, x, v}: owned by the caller, passed along. */
typedef struct flesh_state {
  double t;      /* s */
  double *x, *v; /* [3*n] m, m/s */
} flesh_state;

/* A state file: rows `x y z vx vy vz`, one per node, '#' comments; a first comment `# t <seconds>`
 * gives the time (else 0). Fills the caller's state->x, v [3*nodes]. FLESH_ERR_FILE, with file and
 * line, when a number is missing, wrong or not finite or the rows are not as many as nodes.
 * Further errors: FLESH_ERR_ARGUMENT. */
FLESH_API int flesh_state_read(const char *path, int nodes, flesh_state *state);
/* Writes it so that it reads back bit for bit, whole or not at all. FLESH_ERR_NONFINITE, nothing
 * written, when a number is not finite. Further errors: FLESH_ERR_ARGUMENT. */
FLESH_API int flesh_state_write(const char *path, int nodes, const flesh_state *state);

#ifdef __cplusplus
}
#endif
#endif
