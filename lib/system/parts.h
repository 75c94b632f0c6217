/* parts.h: the structure of a system. */
#ifndef FLESH_SYSTEM_PARTS_H
#define FLESH_SYSTEM_PARTS_H

#include "base/team.h"
#include "flesh/system.h"
#include "geometry/motion.h"
#include "system/pattern.h"

typedef struct flesh_constraint {
  int count, *nodes;
  unsigned axes;
  double from, until;
  flesh_motion motion; /* with count 0: a pin */
} flesh_constraint;

typedef struct flesh_system_entry {
  flesh_effect *effect;
  int *slots; /* slots of its cells; owned by the entry with owns_slots */
  int owns_slots;
  int internal; /* index of its first internal variable among those of all effects */
  int sums;     /* index of its first sum over all ranks; -1: it needs none */
  int softened; /* 1: the effect belongs to this softened system alone, and is destroyed with it */
} flesh_system_entry;

/* Finds which constraint holds each component at time t, counted from 1; 0: none. holder [3*nodes]. */
void flesh_system_holders(const flesh_system *system, double t, int *holder);

struct flesh_system {
  const flesh_mesh *mesh;
  int nodes, finished, limits_step; /* limits_step: some effect has a max_feasible_step */
  int entry_count, constraint_count, internal_count;
  flesh_system_entry *entries;
  flesh_constraint *constraints;
  flesh_pattern pattern;
  int leader;            /* entry whose `jacobian_assign` is called; -1: none */
  int left_count, *left; /* blocks that this entry does not set; NULL: all */
  const flesh_team *team; /* borrowed; NULL: none */
  /* 1: an effect of some rank enforces constraints by multipliers, so that all ranks have multipliers */
  int others_hold;
  int summed;             /* number of effects that need sums over all ranks */
};

/* Returns the internal variables of effect k, given those of all effects (NULL: 0, their initial values). */
static inline const double *flesh_internal_of(const flesh_system *system, int k, const double *internal)
{
  return internal ? internal + system->entries[k].internal : NULL;
}

#endif
