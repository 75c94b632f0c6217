/* effect_list.h: the scene's list of effects: one-key mappings whose rows are the registry's. */
#ifndef FLESH_SCENE_EFFECT_LIST_H
#define FLESH_SCENE_EFFECT_LIST_H

#include "scene/effect_registry.h"
#include "scene/keys.h"

typedef struct flesh_effect_entry {
  const flesh_effect_row *row;
  void *parameters;       /* read from the row's keys */
  const flesh_node *node; /* of the parameters; NULL for one that was added without being listed */
  const char *path;       /* "effects[1].gravity" */
  /* Its number in the finished system, counted from 1, as a constraint (pins, prescribed motions) or as an effect; 0:
   * it is not one. */
  int constraint, effect;
  int found; /* of a part of a split mesh: nodes or triangles that it acts on here; -1: no selection was made */
} flesh_effect_entry;

/* The row of that name; NULL if none. */
const flesh_effect_row *flesh_effect_row_named(const char *name);
/* Makes `- inertia` and `- inertia:` into `- inertia: {}` everywhere in the list. */
int flesh_effect_list_normalise(flesh_arena *arena, flesh_node *list);
/* How keys read the list into entries (flesh_objects of flesh_effect_entry) and write it. */
extern const flesh_key_list flesh_effect_key_list;

#endif
