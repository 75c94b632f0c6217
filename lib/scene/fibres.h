/* fibres.h: the tets of a muscle and the directions of its fibres, as given in a scene. */
#ifndef FLESH_SCENE_FIBRES_H
#define FLESH_SCENE_FIBRES_H

#include "base/key.h"
#include "flesh/body.h"

/* Selection of tets: all that meet every given condition. */
typedef struct flesh_tet_selection {
  flesh_integers regions;
  double box[6]; /* NaN: none */
  char *set;     /* name of a set of the mesh; NULL: any */
  char *body;    /* NULL: any */
} flesh_tet_selection;

/* Directions of fibres; one of the three is given. */
typedef struct flesh_fibre_field {
  double direction[3]; /* NaN: not given */
  char *file;          /* NULL: not given */
  struct {
    double from[3], to[3]; /* NaN: not given */
  } along;
} flesh_fibre_field;

extern const flesh_key flesh_fibre_field_keys[];

/* clang-format off */
/* Keys of a struct that has a flesh_tet_selection as `member`. */
#define FLESH_TET_SET_AND_BOX_KEYS(parameters, member)                                                    \
  {.name = "box", .type = FLESH_KEY_BOX, .offset = offsetof(parameters, member.box), .unit = "m",         \
   .default_value = "", .doc = "only tets whose centre at rest lies in [[low], [high]], bounds included"}, \
  {.name = "set", .type = FLESH_KEY_TEXT, .offset = offsetof(parameters, member.set),                     \
   .default_value = "", .doc = "only tets of the set of this name in the mesh file"}
#define FLESH_TET_SELECTION_KEYS(parameters, member)                                                      \
  {.name = "regions", .type = FLESH_KEY_INTEGERS, .offset = offsetof(parameters, member.regions),         \
   .default_value = "", .doc = "only tets with these region tags"},                                       \
  FLESH_TET_SET_AND_BOX_KEYS(parameters, member),                                                         \
  {.name = "body", .type = FLESH_KEY_TEXT, .offset = offsetof(parameters, member.body),                   \
   .default_value = "", .doc = "only tets of the body of this name"}
/* clang-format on */

/* Tets in rising order, and for each the direction of its fibre, of any length, 0 if it has none. Freed by
 * flesh_fibres_free. */
typedef struct flesh_chosen_fibres {
  int count;
  int *tets;          /* [count] */
  double *directions; /* [3*count] */
} flesh_chosen_fibres;

/* Chooses the tets, without directions. FLESH_ERR_ARGUMENT if none is chosen, FLESH_ERR_MEMORY. The caller frees
 * `chosen`, also after an error. */
int flesh_tets_choose(const flesh_tet_selection *selection, const flesh_body *body, flesh_chosen_fibres *chosen);
/* Chooses the tets and their directions. FLESH_ERR_ARGUMENT if no tet is chosen, not exactly one field is given, or the
 * file's rows do not match the tets; FLESH_ERR_FILE with the file's line, FLESH_ERR_MEMORY. The caller frees `chosen`,
 * also after an error. */
int flesh_fibres_choose(const flesh_tet_selection *selection, const flesh_fibre_field *field, const flesh_body *body,
                        flesh_chosen_fibres *chosen);
void flesh_fibres_free(flesh_chosen_fibres *chosen);

#endif
