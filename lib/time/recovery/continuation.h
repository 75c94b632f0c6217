/* continuation.h: continuation in Poisson's ratio. The fewer tangles are minima of the potential the less the materials
 * resist changes of volume, so that the way out of one goes through softer materials to the true ones. */
#ifndef FLESH_TIME_RECOVERY_CONTINUATION_H
#define FLESH_TIME_RECOVERY_CONTINUATION_H

#include "sundials/kinsol.h"
#include "time/multipliers.h"
#include "time/recovery/untangle.h"

enum { FLESH_SOFTENINGS = 3 };

typedef struct flesh_continuation {
  flesh_nonlinear *nonlinear;     /* borrowed, as are the next three */
  flesh_multipliers *multipliers;
  const flesh_system *system;
  double *start;                  /* [n] where solves with softened materials have led */
  int n;                          /* unknowns */
  int count;                      /* how many are worth a solve on the way to the true materials; at least 1 */
  flesh_system *softened[FLESH_SOFTENINGS]; /* the first of them, each ten times as stiff as the one before */
} flesh_continuation;

/* Makes the softened systems of the solver's; `start` [n] is room. FLESH_ERR_MEMORY on this rank alone. To be cleared also
 * then. Collective. */
int flesh_continuation_create(flesh_nonlinear *nonlinear, flesh_multipliers *multipliers, double *start,
                              flesh_continuation *continuation);
void flesh_continuation_clear(flesh_continuation *continuation);

/* Solves a stage of a tangled body: from where solves with softened materials have led, where the true potential is lower
 * there than at the guesses, which end with NULL (at most two) and are not in `start`; *led: whether it began there.
 * Status as of a solve. */
int flesh_continuation_step(const flesh_continuation *continuation, flesh_stage *stage, const flesh_state *state,
                            const flesh_stage_end *end, const double *const *guesses, int *led, flesh_solve_stats *stats);
/* Leads from a state that the untangler has found tangled for good, in statics or in motion, to one of less potential at
 * the same time: 1 where there is one, else 0 and the state as it was, or a negative status. */
int flesh_continuation_rest(const flesh_continuation *continuation, flesh_untangler *untangler, int is_static,
                            flesh_state *state, flesh_solve_stats *stats);

#endif
