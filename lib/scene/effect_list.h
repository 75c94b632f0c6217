/* effect_list.h: the scene's list of effects: one-key mappings whose names are rows of the registry. */
#ifndef FLESH_SCENE_EFFECT_LIST_H
#define FLESH_SCENE_EFFECT_LIST_H

#include "scene/effect_registry.h"
#include "scene/keys.h"

typedef struct flesh_effect_entry {
  const flesh_effect_row *row;
  void *parameters;       /* read from the row's keys */
  const flesh_node *node; /* node of the parameters; NULL for an effect that was added without being listed */
  const char *path;       /* "effects[1].gravity" */
  /* Number in the finished system, from 1, of the constraint (pins, prescribed motions) or of the effect; 0: it is not
   * one. */
  int constraint, effect;
  int found; /* in a part of a split mesh: number of selected nodes or triangles; -1: no selection made */
} flesh_effect_entry;

/* Returns the row of that name; NULL: none. */
const flesh_effect_row *flesh_effect_row_named(const char *name);
/* Makes `- inertia` and `- inertia:` into `- inertia: {}` everywhere in the list. FLESH_ERR_MEMORY. */
int flesh_effect_list_normalise(flesh_arena *arena, flesh_node *list);
/* Reads the list into entries (flesh_objects of flesh_effect_entry) and writes it. */
extern const flesh_key_list flesh_effect_key_list;

#endif
