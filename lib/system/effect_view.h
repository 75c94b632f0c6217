/* effect_view.h: the point of evaluation as each effect sees it: with what is its own. */
#ifndef FLESH_SYSTEM_EFFECT_VIEW_H
#define FLESH_SYSTEM_EFFECT_VIEW_H

#include "effect/environment.h"
#include "system/layout.h"
#include "system/parts.h"

/* A run's memory of nodes near each other (proximity.h). */
struct flesh_proximity {
  const flesh_system *system; /* borrowed */
  int effects;
  void **near; /* [effects] the memory of each; NULL where it has none. NULL: no effect has */
  void **predicted; /* [effects] likewise, of predictions of forces */
  int updates;      /* of the predictions */
  flesh_layout layout; /* of the matrix; its pattern is empty while it has the system's */
};
typedef struct flesh_proximity flesh_proximity;

/* The memory of effect k; NULL: it has none, or there is no run. */
static inline void *flesh_proximity_of(const flesh_proximity *proximity, int k)
{
  return proximity && proximity->near ? proximity->near[k] : NULL;
}

/* Whether some effect of the system remembers what is near. */
int flesh_system_has_proximity(const flesh_system *system);

typedef struct flesh_effect_view {
  const flesh_system *system;
  const double *internal, *sums; /* of all effects; NULL: none */
  double load;                   /* of effects that do not follow the shape */
  flesh_point point;             /* that of the effect turned to last */
  flesh_environment environment;
} flesh_effect_view;

/* Counts the effects that need sums over all ranks, once they are all there; without a team none does. */
void flesh_effect_sums_count(flesh_system *system);
/* How many numbers of such sums the caller makes room for. */
int flesh_effect_sums_room(const flesh_system *system);

/* A view of the point, without sums. */
flesh_effect_view flesh_effect_view_of(const flesh_system *system, const flesh_point *point);
/* A view with the effects' sums over all ranks, found into `sums` [room]: collective, and cannot fail; to be called
 * before anything that can. */
flesh_effect_view flesh_effect_view_with(const flesh_system *system, const flesh_point *point, double *sums);
/* The point as effect k sees it, until the view turns to another. */
const flesh_point *flesh_effect_view_turn(flesh_effect_view *view, int k);

#endif
