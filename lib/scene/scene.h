/* scene.h: the contents of a scene, and the steps from its keys to a system. */
#ifndef FLESH_SCENE_SCENE_H
#define FLESH_SCENE_SCENE_H

#include "scene/node.h"
#include "scene/scene_keys.h"

struct flesh_scene {
  flesh_arena arena;
  const char *path;       /* path of the scene's file */
  const char *text;       /* text that replaces the file while it is read; NULL: the file is read */
  const flesh_node *root; /* tree of the text with the overrides applied */
  flesh_scene_keys keys;  /* all values in force */
  flesh_mesh *mesh;
  int part_count; /* number of bodies */
  flesh_body_part *parts;
  int *part_nodes; /* [part_count+1] first node of each */
  flesh_material *materials;
  flesh_element *material_elements; /* [material_count] element of the tets with each material; AUTO: the body's */
  int material_count;
  flesh_body body;
  flesh_system *system;
  flesh_scene_time time;
  int probe_count;
  flesh_probe *probes;
  flesh_state start; /* arrays [3*n] in the arena */
  const char *warning; /* in the arena; NULL: none */
  int rank, ranks;   /* the rank that reads it, and the number of ranks; 0, 0: a single process */
};

/* Checks every key and its value as flesh_scene_read does, but reads no mesh and builds nothing. */
int flesh_scene_check_keys(const char *path, int count, const char *const *overrides);

/* Prints the text of flesh_scene_write. */
void flesh_scene_print(const flesh_scene *scene, flesh_text *text);

/* Adds a result of flesh_arena_print to the scene's warning. FLESH_ERR_MEMORY, also for NULL. */
int flesh_scene_warn(flesh_scene *scene, const char *words);
/* Adds keys and effects without any effect in this scene to the warning; needs the system, the time and the start.
 * FLESH_ERR_MEMORY. */
int flesh_scene_warn_of_unused(flesh_scene *scene);

/* Returns the node of the key at `offset` below `above` (may be NULL), else `above`: the place to report an error about
 * the key. */
const flesh_node *flesh_scene_place(const flesh_node *above, const flesh_key *keys, size_t offset);

/* Chooses the constants in force and makes the material; `node` is its mapping, `path` its key. Constants that are not
 * used become absent in *keys. FLESH_ERR_ARGUMENT, also if `element` cannot have the material. */
int flesh_scene_make_material(const flesh_node *node, const char *path, flesh_scene_material *keys,
                              flesh_element element, flesh_material *material);
/* Returns the element of body 0, keys.body, or of one of keys.bodies, from 1; AUTO if the body has tets of four nodes
 * and of ten. Needs the mesh. */
flesh_element flesh_scene_element(const flesh_scene *scene, int body);
/* Reads the meshes of keys.bodies and joins them to the scene's mesh. */
int flesh_scene_join_bodies(flesh_scene *scene);

/* Makes the mesh that body.refine, its element and the surfaces `curved` [flesh_scene_curved] ask for, from the mesh of
 * `body` ("body" or "bodies[0]") as it was read. FLESH_ERR_ARGUMENT if that is impossible. */
int flesh_scene_fit_mesh(flesh_scene *scene, const char *body, flesh_element element, const flesh_objects *curved,
                         flesh_mesh **mesh);
/* Does the last part of flesh_scene_fit_mesh: puts the boundary of an unrefined mesh on the surfaces, and refines it
 * there. */
int flesh_scene_curve_mesh(flesh_scene *scene, const char *body, const flesh_objects *curved, flesh_mesh **mesh);
/* Reads a mesh; of a split mesh, a rank reads only its part. */
int flesh_scene_read_body_mesh(const flesh_scene *scene, flesh_mesh **mesh);
/* Fails with FLESH_ERR_ARGUMENT if the mesh is a part of a split one and a key asks for something that needs the
 * whole. */
int flesh_scene_check_split(const flesh_scene *scene);
/* Reads start.state into `state`; interpolates a state of the nodes of body.mesh as it was read. */
int flesh_scene_read_state(const flesh_scene *scene, flesh_state *state);
/* Sets the densities and materials of the tets of keys.bodies. scene->materials has room for one material of each, from
 * material_count on; `base` is the first body's, or -1. */
int flesh_scene_assign_bodies(flesh_scene *scene, int base, double *density, int *tet_material);
/* Reads body.material_map; `of` [material_count] are the keys of the first body's materials, NULL for others. */
int flesh_scene_map_materials(flesh_scene *scene, const flesh_scene_material *const *of, int *tet_material);
/* Sets the start velocities of keys.bodies, v [3*nodes]. */
void flesh_scene_start_bodies(const flesh_scene *scene, double *v);
/* Chooses and checks the nodes of keys.output.probes; needs the system. */
int flesh_scene_make_probes(flesh_scene *scene);
/* Returns `status` after putting the place of the scene's k-th probe before the error's text. */
int flesh_scene_probe_fail(const flesh_scene *scene, int k, int status);
/* Checks that frames can have keys.output.given.fields; needs the system. */
int flesh_scene_check_fields(const flesh_scene *scene);
/* Makes a path absolute. FLESH_ERR_FILE, FLESH_ERR_MEMORY. */
int flesh_scene_make_absolute(flesh_scene *scene, char **path);
/* Sets the densities and materials of the tets from keys.body; needs the mesh. */
int flesh_scene_make_body(flesh_scene *scene);
/* Sets scene->time: the method, its steps and the end in force; needs the system. */
int flesh_scene_settle_time(flesh_scene *scene);
/* Returns whether there is inertia; without it there is nothing to step. */
int flesh_scene_has_inertia(const flesh_scene *scene);
/* Makes the effects, elasticity included, and their system; needs the body. */
int flesh_scene_make_system(flesh_scene *scene);

/* Origin of the direction that is up in pictures. */
typedef enum flesh_up_origin {
  FLESH_UP_GIVEN,   /* output.camera.up */
  FLESH_UP_GRAVITY, /* opposite to the sum of the gravity effects */
  FLESH_UP_Z        /* z, without either */
} flesh_up_origin;

/* Computes the unit vector along v, which may be the same array; returns 0 if v is zero or not finite. */
int flesh_scene_direction(const double v[3], double unit[3]);
/* Finds the unit vector up [3] for pictures of the scene, and returns where it comes from. */
flesh_up_origin flesh_scene_up(const flesh_scene *scene, double up[3]);

/* Calls visit(data, path) for every file that the scene names, as often as it does: meshes of the bodies and of
 * obstacles, the start, the skin. A path that is not absolute is relative to the working directory of flesh_scene_read;
 * the scene owns it. */
void flesh_scene_visit_files(const flesh_scene *scene, void (*visit)(void *data, const char *path), void *data);

/* Returns whether some effect has a positive number under this key. */
int flesh_scene_has_positive(const flesh_scene *scene, const char *name);
/* Returns whether solves end by the solver's newton_tolerance, not by the tolerance of the time steps. */
int flesh_scene_uses_newton_tolerance(const flesh_scene *scene);
/* Returns why the scene's results are not equilibria that depend only on its parameters, or "". */
const char *flesh_scene_tangents_refused(const flesh_scene *scene);

/* Returns the path of the body's mesh, absolute, with links resolved. */
const char *flesh_scene_mesh_path(const flesh_scene *scene);

#endif
