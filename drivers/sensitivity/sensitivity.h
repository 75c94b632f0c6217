/* sensitivity.h: derivatives of what probes tell of a run's end by keys of its scene. */
#ifndef FLESH_SENSITIVITY_SENSITIVITY_H
#define FLESH_SENSITIVITY_SENSITIVITY_H

#include "cli/lists.h"
#include "cli/overrides.h"
#include "flesh/scene.h"
#include "flesh/sensitivity.h"
#include "output/resume.h"
#include "sensitivity/stage_tangent.h"

/* The derivatives of a column by the state at a time: those that are not 0, by x and, from 3*nodes on, by v. */
typedef struct flesh_asked_row {
  double t;
  int count, *at; /* [count] */
  double *by;     /* [count] */
} flesh_asked_row;

/* A column of probes.csv. */
typedef struct flesh_asked {
  char name[FLESH_LIST_ITEM], unit[16];
  double value;     /* at the end, or over time */
  flesh_over over;
  double last, begin; /* at the last step; s, the first one's time */
  double *by_x, *by_v, *of_residual; /* [3*nodes]; NULL: it does not depend on that, or has rows. Owned */
  flesh_probes *probes; /* of a column that is not linear in the state, alone; NULL: it is. Owned, as are the next */
  flesh_probe probe;    /* that one; its nodes are the scene's */
  int n, column;        /* 3*nodes; of those of the quantity */
  double *figures;
  flesh_stage_tangent tangent; /* of forces; its system is NULL: not made */
  int row_count, row_room;
  flesh_asked_row *rows;
} flesh_asked;

/* The probe that a column such as tip.position_z is of; NULL: none. */
const flesh_probe *flesh_probe_of(const flesh_scene *scene, const char *column);
/* Whether the probe is at a point in a tet of which a node is held at time t. FLESH_ERR_MEMORY. */
int flesh_probe_is_at_pin(const flesh_scene *scene, const flesh_probe *probe, double t, int *is);

/* Finds the column of the scene's probes, with its derivatives by the state at time t. FLESH_ERR_ARGUMENT for one that
 * there is not or that has no derivative here; FLESH_ERR_MEMORY. */
int flesh_asked_find(const flesh_scene *scene, const char *name, double t, flesh_asked *asked);
/* A reaction's value at an equilibrium, whose residual [3*nodes] is given. */
void flesh_asked_measure(const flesh_scene *scene, const double *residual, flesh_asked *asked);
/* Its value up to a step. The record may be of another scene, of as many nodes. FLESH_ERR_MEMORY. */
int flesh_asked_go_on(const flesh_scene *scene, const flesh_step_record *record, flesh_asked *asked);
/* Keeps the derivatives of one that is not linear at a step that counts. FLESH_ERR_ARGUMENT where forces have none;
 * FLESH_ERR_MEMORY, FLESH_ERR_SOLVE. */
int flesh_asked_keep(const flesh_scene *scene, const flesh_step_record *record, flesh_asked *asked);
/* Adds those that were kept at a time. Implements flesh_adjoint_visit. */
int flesh_asked_visit(void *asked, double t, double *by_x, double *by_v);
void flesh_asked_clear(flesh_asked *asked);

/* A key of the scene that is a number, with the scenes at four values beside its own. */
typedef struct flesh_varied {
  char key[FLESH_LIST_ITEM];
  double value;
  flesh_scene *scenes[4];
  flesh_parameter parameter; /* its systems */
} flesh_varied;

/* Reads the scene again with the key at p -+ 1 and 2 millionths of its size; a hundredth of these where the scene does not take
 * them. The size is that of p, of a vector's component of the largest one, of a translation at least the body's, of a rotation
 * at least a radian, and 1 where all these are 0. FLESH_ERR_ARGUMENT with a sentence for a key that is not there, or no number;
 * what reading scenes returns. */
int flesh_varied_make(const flesh_scene *scene, const char *path, const flesh_overrides *overrides, const char *key,
                      flesh_varied *varied);
void flesh_varied_clear(flesh_varied *varied);

#endif
