/* fields.h: stress, strain, energy and forces as arrays over nodes, tets and the points of tets, for frames. */
#ifndef FLESH_OUTPUT_FIELDS_H
#define FLESH_OUTPUT_FIELDS_H

#include "flesh/observer.h"
#include "output/even_pressure.h"
#include "output/node_forces.h"
#include "output/tet_stress.h"
#include "output/vtu.h"

/* Fields that tets have, in the order of flesh_field's bits from FLESH_FIELD_J on. */
enum { FLESH_TET_FIELDS = 6 };

/* Arrays over nodes, or over tets; with room for the two that every frame has, and the numbers that parts have. */
typedef struct flesh_field_list {
  int count;
  flesh_vtu_array arrays[2 * FLESH_TET_FIELDS + 6];
} flesh_field_list;

typedef struct flesh_fields {
  flesh_field_list nodes, tets; /* for a .vtu; values are the last found */
  /* The rest is fields.c's own. */
  unsigned fields, places;
  const flesh_body *body;
  const struct flesh_team *team; /* the system's; NULL: there is one rank */
  flesh_tet_stress stress;
  flesh_even_pressure even; /* where pressures are wanted at nodes or of tets */
  flesh_node_forces forces;
  double *weight;                            /* [n] m^3 at rest of each node's tets */
  double *at_nodes[FLESH_TET_FIELDS];        /* [n * components]; NULL: not wanted, likewise below */
  double *at_tets[FLESH_TET_FIELDS];         /* [tets * components] */
  double *at_points[FLESH_TET_FIELDS];       /* [tets * points * components] */
} flesh_fields;

/* Whether the body has these fields: FLESH_ERR_ARGUMENT with a sentence that begins with "fields" otherwise. */
int flesh_fields_check(const flesh_body *body, const flesh_system *system, unsigned fields, unsigned places);

/* Borrows body and system; of a part of a body every rank calls this and flesh_fields_find. As above, and
 * FLESH_ERR_MEMORY; cleared then. */
int flesh_fields_open(const flesh_body *body, const flesh_system *system, flesh_method method, unsigned fields,
                      unsigned places, flesh_fields *result);
void flesh_fields_clear(flesh_fields *fields);

/* Finds the values of a step. */
void flesh_fields_find(flesh_fields *fields, const flesh_step_record *record);

/* A frame as it is written, with its arrays. */
typedef struct flesh_frame {
  flesh_field_list nodes, tets;
  flesh_vtu content;
} flesh_frame;

/* Makes a frame of what every one has and the fields of the step, which it finds; of a rank's part (team not NULL) also of
 * the numbers of nodes and tets in the whole. displacement [3*n] is room. */
void flesh_frame_make(const flesh_mesh *mesh, flesh_fields *fields, const struct flesh_team *team, double *displacement,
                      const flesh_step_record *record, flesh_frame *frame);

#endif
