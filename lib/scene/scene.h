/* scene.h: what a scene holds while it lives, and the steps from its keys to a system. */
#ifndef FLESH_SCENE_SCENE_H
#define FLESH_SCENE_SCENE_H

#include "scene/node.h"
#include "scene/scene_keys.h"

struct flesh_scene {
  flesh_arena arena;
  const char *path;       /* of the scene's file */
  const flesh_node *root; /* its text with the overrides applied */
  flesh_scene_keys keys;  /* every value in force */
  flesh_mesh *mesh;
  flesh_material *materials;
  int material_count;
  flesh_body body;
  flesh_system *system;
  flesh_scene_time time;
  flesh_state start; /* arrays [3*n] in the arena */
};

/* Whether every key and its value are valid, as flesh_scene_read finds them; no mesh is read and
 * nothing is built. */
int flesh_scene_check_keys(const char *path, int count, const char *const *overrides);

/* The node of `name` (may be NULL), else the one above it: where an error about it is reported. */
const flesh_node *flesh_scene_place(const flesh_node *above, const flesh_key *keys, size_t offset);

/* Chooses the constants in force and makes the material; `node` is its mapping, `path` its key.
 * What is not used becomes absent in *keys. */
int flesh_scene_make_material(const flesh_node *node, const char *path, flesh_scene_material *keys,
                              flesh_material *material);
/* Densities and materials of the tets from keys.body; needs the mesh. */
int flesh_scene_make_body(flesh_scene *scene);
/* The effects, elasticity included, and the system of them; needs the body. */
int flesh_scene_make_system(flesh_scene *scene);

#endif
