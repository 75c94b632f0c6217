/* effect_view.h: the point of evaluation as each effect sees it, with the effect's own data. */
#ifndef FLESH_SYSTEM_EFFECT_VIEW_H
#define FLESH_SYSTEM_EFFECT_VIEW_H

#include "effect/environment.h"
#include "system/layout.h"
#include "system/parts.h"

/* A run's caches of nodes near each other (proximity.h). */
struct flesh_proximity {
  const flesh_system *system; /* borrowed */
  int effects;
  void **near; /* [effects] cache of each effect; NULL: it has none. NULL: no effect has one */
  void **predicted; /* [effects] likewise, cached predictions of forces */
  int updates;      /* number of updates of the predictions */
  flesh_layout layout; /* layout of the matrix; its pattern is empty while the matrix has the system's */
};
typedef struct flesh_proximity flesh_proximity;

/* Returns the cache of effect k; NULL: it has none, or there is no run. */
static inline void *flesh_proximity_of(const flesh_proximity *proximity, int k)
{
  return proximity && proximity->near ? proximity->near[k] : NULL;
}

/* Whether some effect of the system caches near pairs. */
int flesh_system_has_proximity(const flesh_system *system);

typedef struct flesh_effect_view {
  const flesh_system *system;
  const double *internal, *sums; /* variables and sums of all effects; NULL: none */
  double load;                   /* load factor of effects that do not follow the shape */
  flesh_point point;             /* point of the effect that the view was last turned to */
  flesh_environment environment;
} flesh_effect_view;

/* Counts the effects that need sums over all ranks, after all effects were added; without a team none does. */
void flesh_effect_sums_count(flesh_system *system);
/* Returns the room, in numbers, that the caller needs for these sums. */
int flesh_effect_sums_room(const flesh_system *system);

/* Returns a view of the point, without sums. */
flesh_effect_view flesh_effect_view_of(const flesh_system *system, const flesh_point *point);
/* Returns a view with the effects' sums over all ranks, found into `sums` [room]. Collective, and cannot fail; call it
 * before anything that can. */
flesh_effect_view flesh_effect_view_with(const flesh_system *system, const flesh_point *point, double *sums);
/* Turns the view to effect k. Returns the point as that effect sees it, valid until the view turns to another. */
const flesh_point *flesh_effect_view_turn(flesh_effect_view *view, int k);

#endif
