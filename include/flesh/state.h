/* state.h: where a body is and how it moves, as plain data and as a file. */
#ifndef FLESH_STATE_H
#define FLESH_STATE_H

#include "flesh/status.h"

#ifdef __cplusplus
extern "C" {
#endif

/* {t, x, v, multipliers, internal variables}: owned by the caller, passed along. */
typedef struct flesh_state {
  double t;      /* s */
  double *x, *v; /* [3*n] m, m/s */
  /* [multiplier_count] Pa: the pressures with which incompressible tets keep their volumes, in the
   * mesh's order (flesh_system_multiplier_count; 0 for the others). NULL, with a count of 0: an
   * integrator keeps its own, which begin with 0. */
  double *multipliers;
  int multiplier_count;
  /* [internal_count] what effects remember of the path that led here, one after the other
   * (flesh_system_internal_count). NULL, with a count of 0: as above, and observers see them as 0. */
  double *internal;
  int internal_count;
} flesh_state;

/* A state file: rows `x y z vx vy vz`, one per node, '#' comments; a first comment `# t <seconds>`
 * gives the time (else 0). After the rows, comments `# multipliers <count>` and `# <Pa>` for each tet
 * give the multipliers: read where state->multipliers is not NULL, 0 where the file has none; `# internal
 * <count>` and `# <number>` likewise the internal variables. Fills
 * the caller's state->x, v [3*nodes]. FLESH_ERR_FILE, with file and line, when a number is missing,
 * wrong or not finite, or the rows, multipliers or internal variables are not as many as they must be.
 * Further errors: FLESH_ERR_ARGUMENT. */
FLESH_API int flesh_state_read(const char *path, int nodes, flesh_state *state);
/* Writes it so that it reads back bit for bit, whole or not at all. FLESH_ERR_NONFINITE, nothing
 * written, when a number is not finite. Further errors: FLESH_ERR_ARGUMENT. */
FLESH_API int flesh_state_write(const char *path, int nodes, const flesh_state *state);

#ifdef __cplusplus
}
#endif
#endif
