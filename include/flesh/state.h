/* state.h: positions and velocities of a body, as plain data and as a file. */
#ifndef FLESH_STATE_H
#define FLESH_STATE_H

#include "flesh/status.h"

#ifdef __cplusplus
extern "C" {
#endif

/* State {t, x, v, multipliers, internal variables}. The caller owns its arrays. */
typedef struct flesh_state {
  double t;      /* s */
  double *x, *v; /* [3*n] m, m/s */
  /* [multiplier_count] Pa: the pressures by which incompressible tets keep their volumes, in the mesh's order
   * (flesh_system_multiplier_count; 0 for other tets). NULL, with a count of 0: an integrator keeps its own,
   * starting at 0. */
  double *multipliers;
  int multiplier_count;
  /* [internal_count] internal variables of the effects, one effect after the other (flesh_system_internal_count).
   * NULL, with a count of 0: an integrator keeps its own, starting at 0, and observers see them as 0. */
  double *internal;
  int internal_count;
} flesh_state;

/* Reads a state file into the caller's state->x and v [3*nodes]. The file has rows `x y z vx vy vz`, one per node,
 * and '#' comments; a first comment `# t <seconds>` gives the time (else 0). After the rows, comments `# multipliers
 * <count>` and one `# <Pa>` per tet give the multipliers; likewise `# internal <count>` and `# <number>` the
 * internal variables. Each is read where its array in *state is not NULL, and is 0 where the file has none.
 * FLESH_ERR_FILE, with file and line, when a number is missing, wrong or not finite, or the count of rows,
 * multipliers or internal variables is wrong. Further errors: FLESH_ERR_ARGUMENT. */
FLESH_API int flesh_state_read(const char *path, int nodes, flesh_state *state);
/* Writes the state so that it reads back bit for bit, whole or not at all. FLESH_ERR_NONFINITE, nothing written,
 * when a number is not finite. Further errors: FLESH_ERR_ARGUMENT. */
FLESH_API int flesh_state_write(const char *path, int nodes, const flesh_state *state);

#ifdef __cplusplus
}
#endif
#endif
