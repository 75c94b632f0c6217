/* selection.h: selects the nodes and surface triangles that an effect acts on, by box, sphere, list, region or named
 * set of the mesh. */
#ifndef FLESH_SCENE_SELECTION_H
#define FLESH_SCENE_SELECTION_H

#include "base/key.h"
#include "flesh/effects.h"
#include "mesh/sets.h"

typedef struct flesh_selection {
  double box[6]; /* low, high; NaN: none */
  struct {
    double centre[3], radius; /* NaN: none */
  } sphere;
  flesh_integers nodes, regions;
  char *set;  /* name of a set of the mesh; NULL: none */
  char *body; /* name of a body; NULL: any */
} flesh_selection;

/* Key rows for a struct that has a flesh_selection as `member`. */
extern const flesh_key flesh_sphere_keys[];
/* clang-format off */
#define FLESH_SELECTION_KEYS(parameters, member)                                                   \
  {.name = "box", .type = FLESH_KEY_BOX, .offset = offsetof(parameters, member.box),               \
   .unit = "m", .default_value = "",                                                               \
   .doc = "nodes whose rest position lies in [[low], [high]], bounds included"},                   \
  {.name = "sphere", .type = FLESH_KEY_OBJECT, .offset = offsetof(parameters, member.sphere),      \
   .default_value = "", .children = flesh_sphere_keys,                                             \
   .doc = "nodes whose rest position lies in a sphere"},                                           \
  {.name = "nodes", .type = FLESH_KEY_INTEGERS, .offset = offsetof(parameters, member.nodes),      \
   .default_value = "",                                                                            \
   .doc = "nodes by number, from 0 in the mesh file's order, and those that body.element or "       \
          "body.refine puts between them; with several bodies, numbers continue from body to body, " \
          "new nodes included, so that refining shifts those of the next: a box or set does not"}, \
  {.name = "regions", .type = FLESH_KEY_INTEGERS, .offset = offsetof(parameters, member.regions),  \
   .default_value = "", .doc = "nodes of the tets with these region tags"},             \
  {.name = "set", .type = FLESH_KEY_TEXT, .offset = offsetof(parameters, member.set),              \
   .default_value = "",                                                                            \
   .doc = "nodes of the set of this name in the mesh file, and of its tets (flesh mesh info lists the sets)"}, \
  {.name = "body", .type = FLESH_KEY_TEXT, .offset = offsetof(parameters, member.body),            \
   .default_value = "",                                                                            \
   .doc = "restricts the selection to this body; given alone, selects all of it"}
/* clang-format on */

/* Keys of a selection, for messages. */
#define FLESH_SELECTION_NAMES "box, sphere, nodes, regions, set or body"

/* Returns whether any key of the selection is given. */
int flesh_selection_is_given(const flesh_selection *selection);

/* Returns whether a box or sphere of the selection contains the point p, m, bounds included; 0 if neither is given. */
int flesh_selection_contains(const flesh_selection *selection, const double p[3]);

/* Finds the mesh's set with that name; *set is NULL if `name` is. FLESH_ERR_ARGUMENT, with the names of all sets, if
 * there is none. */
int flesh_selection_set(const char *name, const flesh_mesh *mesh, const flesh_mesh_set **set);

/* Finds the body with that name; *part is NULL if `name` is. FLESH_ERR_ARGUMENT if there is none. */
int flesh_selection_body(const char *name, const flesh_body *body, const flesh_body_part **part);

/* Selects nodes by all given criteria together. Returns new *nodes [*count], in rising order, freed by the caller.
 * FLESH_ERR_ARGUMENT when nothing is given, a number is out of range, or no node is selected; FLESH_ERR_MEMORY. */
int flesh_selection_nodes(const flesh_selection *selection, const flesh_body *body, int *count,
                          int **nodes);

/* Selects boundary triangles whose nodes are all chosen by box, sphere, list or the nodes of a set, or whose tet is in
 * a chosen region or set; outward normals. Returns new *triangles [3 * *count], freed by the caller. Fails as
 * flesh_selection_nodes, also when no triangle is selected. */
int flesh_selection_triangles(const flesh_selection *selection, const flesh_body *body, int *count,
                              int **triangles);

#endif
