/* parts.h: what a system is made of. */
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
  flesh_motion motion; /* count 0: a pin */
} flesh_constraint;

typedef struct flesh_system_entry {
  flesh_effect *effect;
  int *slots; /* of its cells; owned by the entry with owns_slots */
  int owns_slots;
  int internal; /* where its internal variables begin among those of all effects */
  int sums;     /* likewise its sums over all ranks; -1: it needs none */
  int softened; /* the effect is this softened system's alone, and goes with it */
} flesh_system_entry;

/* Which constraint holds each component at time t, counted from 1; 0: none. holder [3*nodes]. */
void flesh_system_holders(const flesh_system *system, double t, int *holder);

struct flesh_system {
  const flesh_mesh *mesh;
  int nodes, finished, limits_step; /* limits_step: some effect has a max_feasible_step */
  int entry_count, constraint_count, internal_count;
  flesh_system_entry *entries;
  flesh_constraint *constraints;
  flesh_pattern pattern;
  int leader;            /* the entry whose `jacobian_assign` is called; -1: none */
  int left_count, *left; /* blocks that it does not set; NULL: all */
  const flesh_team *team; /* borrowed; NULL: none */
  int others_hold;        /* 1: an effect of some rank holds constraints by multipliers, so that all ranks have such */
  int summed;             /* how many effects need sums over all ranks */
};

/* The internal variables of effect k among those of all effects (NULL: 0, as they begin). */
static inline const double *flesh_internal_of(const flesh_system *system, int k, const double *internal)
{
  return internal ? internal + system->entries[k].internal : NULL;
}

#endif
