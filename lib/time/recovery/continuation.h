/* continuation.h: continuation in Poisson's ratio. The less the materials resist changes of volume, the fewer tangles
 * are minima of the potential: softer materials lead out of a tangle, and then to the true ones. */
#ifndef FLESH_TIME_RECOVERY_CONTINUATION_H
#define FLESH_TIME_RECOVERY_CONTINUATION_H

#include "sundials/kinsol.h"
#include "time/multipliers.h"
#include "time/recovery/untangle.h"

enum { FLESH_SOFTENINGS = 3 };

typedef struct flesh_continuation {
  flesh_nonlinear *nonlinear;     /* this and the next three are borrowed */
  flesh_multipliers *multipliers;
  const flesh_system *system;
  double *start;                  /* [n] where solves with softened materials have led */
  int n;                          /* unknowns */
  int count;                      /* number of levels that are worth a solve; at least 1 */
  flesh_system *softened[FLESH_SOFTENINGS]; /* [count] of the first levels, each stiffer than the one before */
} flesh_continuation;

/* Makes the softened systems of the solver's system; `start` [n] is room. FLESH_ERR_MEMORY on this rank alone; to be
 * cleared even then. Collective. */
int flesh_continuation_create(flesh_nonlinear *nonlinear, flesh_multipliers *multipliers, double *start,
                              flesh_continuation *continuation);
void flesh_continuation_clear(flesh_continuation *continuation);

/* Solves a stage of a tangled body: from where solves with softened materials have led, if the true potential is lower
 * there than at the guesses (at most two, not in `start`; NULL ends them). *led: whether it began there. Status as of a
 * solve. */
int flesh_continuation_step(const flesh_continuation *continuation, flesh_stage *stage, const flesh_state *state,
                            const flesh_stage_end *end, const double *const *guesses, int *led, flesh_solve_stats *stats);
/* Leads from a state that is tangled for good, in statics or in motion, to one of lower potential at the same time.
 * Returns 1 if there is one, else 0 with the state as it was, or a negative status. */
int flesh_continuation_rest(const flesh_continuation *continuation, flesh_untangler *untangler, int is_static,
                            flesh_state *state, flesh_solve_stats *stats);

#endif
