/* scene.h: what a scene holds while it lives, and the steps from its keys to a system. */
#ifndef FLESH_SCENE_SCENE_H
#define FLESH_SCENE_SCENE_H

#include "scene/node.h"
#include "scene/scene_keys.h"

struct flesh_scene {
  flesh_arena arena;
  const char *path;       /* of the scene's file */
  const char *text;       /* what stands in for the file while it is read; NULL: nothing */
  const flesh_node *root; /* its text with the overrides applied */
  flesh_scene_keys keys;  /* every value in force */
  flesh_mesh *mesh;
  int part_count; /* bodies */
  flesh_body_part *parts;
  int *part_nodes; /* [part_count+1] first node of each */
  flesh_material *materials;
  flesh_element *material_elements; /* [material_count] of the tets of each; AUTO: the body's */
  int material_count;
  flesh_body body;
  flesh_system *system;
  flesh_scene_time time;
  int probe_count;
  flesh_probe *probes;
  flesh_state start; /* arrays [3*n] in the arena */
  const char *warning; /* in the arena; NULL: none */
  int rank, ranks;   /* who reads it, of how many; 0, 0: a process by itself */
};

/* Whether every key and its value are valid, as flesh_scene_read finds them; no mesh is read and
 * nothing is built. */
int flesh_scene_check_keys(const char *path, int count, const char *const *overrides);

/* Prints the text of flesh_scene_write. */
void flesh_scene_print(const flesh_scene *scene, flesh_text *text);

/* Adds what flesh_arena_print returned to the scene's warning. FLESH_ERR_MEMORY, also for NULL. */
int flesh_scene_warn(flesh_scene *scene, const char *words);
/* Adds to it the keys and effects that mean nothing in this scene; needs the system, the time and the start. */
int flesh_scene_warn_of_unused(flesh_scene *scene);

/* The node of `name` (may be NULL), else the one above it: where an error about it is reported. */
const flesh_node *flesh_scene_place(const flesh_node *above, const flesh_key *keys, size_t offset);

/* Chooses the constants in force and makes the material; `node` is its mapping, `path` its key.
 * What is not used becomes absent in *keys. FLESH_ERR_ARGUMENT where `element` cannot have it. */
int flesh_scene_make_material(const flesh_node *node, const char *path, flesh_scene_material *keys,
                              flesh_element element, flesh_material *material);
/* The element of body 0, keys.body, or of one of keys.bodies, from 1; AUTO where its tets have four nodes and ten. Needs
 * the mesh. */
flesh_element flesh_scene_element(const flesh_scene *scene, int body);
/* Reads the meshes of keys.bodies and joins them to the scene's. */
int flesh_scene_join_bodies(flesh_scene *scene);

/* Makes of the mesh of `body` ("body" or "bodies[0]"), as it was read, the one that body.refine, its element and the
 * surfaces `curved` [flesh_scene_curved] ask for. FLESH_ERR_ARGUMENT where that cannot be. */
int flesh_scene_fit_mesh(flesh_scene *scene, const char *body, flesh_element element, const flesh_objects *curved,
                         flesh_mesh **mesh);
/* The last part of that: puts the boundary of a mesh that is not refined on the surfaces, and refines it on them. */
int flesh_scene_curve_mesh(flesh_scene *scene, const char *body, const flesh_objects *curved, flesh_mesh **mesh);
/* Reads a mesh that may be a split one: of that a rank reads its part alone. */
int flesh_scene_read_body_mesh(const flesh_scene *scene, flesh_mesh **mesh);
/* FLESH_ERR_ARGUMENT where the mesh is a part of a split one, and a key asks for what needs the whole. */
int flesh_scene_check_split(const flesh_scene *scene);
/* Reads start.state into `state`; one of the nodes of body.mesh as it was read is interpolated. */
int flesh_scene_read_state(const flesh_scene *scene, flesh_state *state);
/* Densities and materials of their tets; scene->materials has room for one of each, from
 * material_count on; `base` is the body's or -1. */
int flesh_scene_assign_bodies(flesh_scene *scene, int base, double *density, int *tet_material);
/* Reads body.material_map; `of` [material_count] are the keys of the materials of the first body, NULL of others. */
int flesh_scene_map_materials(flesh_scene *scene, const flesh_scene_material *const *of, int *tet_material);
/* Their velocities at the start, v [3*nodes]. */
void flesh_scene_start_bodies(const flesh_scene *scene, double *v);
/* Chooses the nodes of keys.output.probes and checks them; needs the system. */
int flesh_scene_make_probes(flesh_scene *scene);
/* Returns `status` after adding the place of the scene's k-th probe to the error's text. */
int flesh_scene_probe_fail(const flesh_scene *scene, int k, int status);
/* Whether frames can have keys.output.given.fields; needs the system. */
int flesh_scene_check_fields(const flesh_scene *scene);
/* Makes a path absolute. */
int flesh_scene_make_absolute(flesh_scene *scene, char **path);
/* Densities and materials of the tets from keys.body; needs the mesh. */
int flesh_scene_make_body(flesh_scene *scene);
/* Chooses the method, its steps and the end in force into scene->time; needs the system. */
int flesh_scene_settle_time(flesh_scene *scene);
/* Whether an effect is inertia: without it there is nothing to step. */
int flesh_scene_has_inertia(const flesh_scene *scene);
/* The effects, elasticity included, and the system of them; needs the body. */
int flesh_scene_make_system(flesh_scene *scene);

/* Which way is up in pictures of the scene, a unit vector, and why. */
typedef enum flesh_up_origin {
  FLESH_UP_GIVEN,   /* output.camera.up */
  FLESH_UP_GRAVITY, /* against the sum of its gravity effects */
  FLESH_UP_Z        /* neither says: z */
} flesh_up_origin;

/* Fills in a unit vector along v, which may be v itself; 0 where v is zero or not finite. */
int flesh_scene_direction(const double v[3], double unit[3]);
/* Fills in up [3]. */
flesh_up_origin flesh_scene_up(const flesh_scene *scene, double up[3]);

/* Calls visit(data, path) for every file that the scene names, as often as it does: meshes of the
 * body, of the bodies beside it and of obstacles, the start, the skin. A path that is not absolute
 * is relative to the working directory of flesh_scene_read; it is the scene's and lives as long. */
void flesh_scene_visit_files(const flesh_scene *scene, void (*visit)(void *data, const char *path), void *data);

/* Whether a number of an effect, by the key's name, is positive. */
int flesh_scene_has_positive(const flesh_scene *scene, const char *name);
/* Why the scene's results are no equilibria that depend on its parameters alone, or "". */
const char *flesh_scene_tangents_refused(const flesh_scene *scene);

/* The path of the body's mesh, absolute, links resolved. */
const char *flesh_scene_mesh_path(const flesh_scene *scene);

#endif
