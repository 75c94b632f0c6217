/* state.h: a body's position and motion, as plain data and as a file. */
#ifndef FLESH_STATE_H
#define FLESH_STATE_H

#include "flesh/status.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A state {t, x, v, multipliers, internal variables}, owned by the caller. */
typedef struct flesh_state {
  double t;      /* s */
  double *x, *v; /* [3*n] m, m/s */
  /* [multiplier_count] Pa, pressures by which incompressible tets keep their volumes, in the mesh's order
   * (flesh_system_multiplier_count; 0 for other tets). NULL, with a count of 0: the integrator keeps its own, which
   * are 0 at first. */
  double *multipliers;
  int multiplier_count;
  /* [internal_count] internal variables of the effects, which remember the path that led here, one effect after the
   * other (flesh_system_internal_count). NULL, with a count of 0: the integrator keeps its own, which are 0 at
   * first. */
  double *internal;
  int internal_count;
} flesh_state;

/* Reads a state file: rows `x y z vx vy vz`, one per node, and '#' comments. A first comment `# t <seconds>` gives
 * the time (else 0). Comments after the rows, `# multipliers <count>` and `# <Pa>` for each tet, give the
 * multipliers, read if state->multipliers is not NULL, and 0 if the file has none; `# internal <count>` and `#
 * <number>` likewise give the internal variables. Fills the caller's state->x, v [3*nodes]. FLESH_ERR_FILE, with file
 * and line, when a number is missing, wrong or not finite, or when the count of rows, multipliers or internal
 * variables is wrong, and when the file cannot be opened. Further errors: FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
FLESH_API int flesh_state_read(const char *path, int nodes, flesh_state *state);
/* Writes a state file that reads back bitwise the same; a partial file is never left. FLESH_ERR_NONFINITE, with
 * nothing written, when a number is not finite; FLESH_ERR_FILE when writing fails. Further errors:
 * FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
FLESH_API int flesh_state_write(const char *path, int nodes, const flesh_state *state);

#ifdef __cplusplus
}
#endif
#endif
