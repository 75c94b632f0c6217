/* fields.h: stress, strain, energy and forces as arrays over nodes, tets and the points of tets, for frames. */
#ifndef FLESH_OUTPUT_FIELDS_H
#define FLESH_OUTPUT_FIELDS_H

#include "flesh/observer.h"
#include "output/even_pressure.h"
#include "output/node_forces.h"
#include "output/tet_stress.h"
#include "output/vtu.h"

/* Number of fields of tets, in the order of flesh_field's bits from FLESH_FIELD_J on. */
enum { FLESH_TET_FIELDS = 6 };

/* Arrays over nodes or over tets, with room for the two that every frame has and for the numbers that parts have. */
typedef struct flesh_field_list {
  int count;
  flesh_vtu_array arrays[2 * FLESH_TET_FIELDS + 6];
} flesh_field_list;

typedef struct flesh_fields {
  flesh_field_list nodes, tets; /* for a .vtu; values are those found last */
  /* The other members are private to fields.c. */
  unsigned fields, places;
  const flesh_body *body;
  const struct flesh_team *team; /* the system's; NULL: a single rank */
  flesh_tet_stress stress;
  flesh_even_pressure even; /* used if pressures at nodes or of tets are wanted */
  flesh_node_forces forces;
  double *weight;                            /* [n] rest volume of each node's tets, m^3 */
  double *at_nodes[FLESH_TET_FIELDS];        /* [n * components]; here and below NULL: not wanted */
  double *at_tets[FLESH_TET_FIELDS];         /* [tets * components] */
  double *at_points[FLESH_TET_FIELDS];       /* [tets * points * components] */
} flesh_fields;

/* Checks that the body has these fields. FLESH_ERR_ARGUMENT with a sentence that begins with "fields". */
int flesh_fields_check(const flesh_body *body, const flesh_system *system, unsigned fields, unsigned places);

/* Prepares the fields of a body. Borrows body and system; for a part of a body every rank calls this and
 * flesh_fields_find. Fails as flesh_fields_check, or with FLESH_ERR_MEMORY; *result is then cleared. */
int flesh_fields_open(const flesh_body *body, const flesh_system *system, flesh_method method, unsigned fields,
                      unsigned places, flesh_fields *result);
void flesh_fields_clear(flesh_fields *fields);

/* Computes the fields of a step. */
void flesh_fields_find(flesh_fields *fields, const flesh_step_record *record);

/* A frame with its arrays, ready to be written. */
typedef struct flesh_frame {
  flesh_field_list nodes, tets;
  flesh_vtu content;
} flesh_frame;

/* Makes a frame of the arrays that every frame has and the fields of the step, which it computes; for a rank's part
 * (team not NULL) it also has the numbers of nodes and tets in the whole. displacement [3*n] is work space. */
void flesh_frame_make(const flesh_mesh *mesh, flesh_fields *fields, const struct flesh_team *team, double *displacement,
                      const flesh_step_record *record, flesh_frame *frame);

#endif
