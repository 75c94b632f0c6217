/* sensitivity.h: derivatives of columns of probes at the end of a run by keys of its scene. */
#ifndef FLESH_SENSITIVITY_SENSITIVITY_H
#define FLESH_SENSITIVITY_SENSITIVITY_H

#include "cli/lists.h"
#include "cli/overrides.h"
#include "flesh/scene.h"
#include "flesh/sensitivity.h"
#include "output/resume.h"
#include "sensitivity/stage_tangent.h"

/* The derivatives of a column by the state at one time: the nonzero ones, by x and, from 3*nodes on, by v. */
typedef struct flesh_response_row {
  double t;
  int count, *at; /* [count] */
  double *by;     /* [count] */
  struct flesh_response_row *before; /* row of the time before; NULL: none */
} flesh_response_row;

/* A response: a column of probes.csv, with its value and derivatives. */
typedef struct flesh_response {
  flesh_arena memory; /* owns all arrays and rows */
  char name[FLESH_LIST_ITEM], unit[16];
  double value;     /* at the end, or over time */
  flesh_over over;
  double last, begin; /* value at the last step; time of the first one, s */
  double *by_x, *by_v, *of_residual; /* [3*nodes]; NULL: the column does not depend on it, or has rows */
  flesh_probes *probes; /* opened for this column alone if it is not linear in the state, else NULL. Owned */
  flesh_probe probe;    /* probe of that column; its nodes are the scene's */
  int n, column;        /* 3*nodes; index among the columns of the quantity */
  double *figures;
  flesh_stage_tangent tangent; /* for forces; its system is NULL until it is made */
  flesh_response_row *rows;    /* the latest one */
} flesh_response;

/* Returns the probe of a column such as tip.position_z; NULL: none. */
const flesh_probe *flesh_probe_of(const flesh_scene *scene, const char *column);
/* Finds whether the probe is at a point in a tet with a constrained node at time t. FLESH_ERR_MEMORY. */
int flesh_probe_is_at_pin(const flesh_scene *scene, const flesh_probe *probe, double t, int *is);

/* Finds the column among the scene's probes, with its derivatives by the state at time t. FLESH_ERR_ARGUMENT if there
 * is no such column or if it has no derivative here; FLESH_ERR_MEMORY. Clear it in any case. */
int flesh_response_find(const flesh_scene *scene, const char *name, double t, flesh_response *response);
/* Computes the value of a reaction at an equilibrium with the given residual [3*nodes]. */
void flesh_response_measure(const double *residual, flesh_response *response);
/* Updates the value with a step. The record may be of another scene with as many nodes. FLESH_ERR_MEMORY. */
int flesh_response_observe(const flesh_scene *scene, const flesh_step_record *record, flesh_response *response);
/* Keeps the derivatives of a column that is not linear, at a step that counts. FLESH_ERR_ARGUMENT if its forces have no
 * derivatives; FLESH_ERR_MEMORY, FLESH_ERR_SOLVE. */
int flesh_response_differentiate(const flesh_scene *scene, const flesh_step_record *record, flesh_response *response);
/* Adds the derivatives that were kept at a time. Implements flesh_adjoint_visit. */
int flesh_response_visit(void *response, double t, double *by_x, double *by_v);
void flesh_response_clear(flesh_response *response);

/* Runs a scene from its start, which *state becomes, with an observer, and records the steps with this tolerance unless
 * `trajectory` is NULL. The integrator, the trajectory and state->x are new, also after an error. */
int flesh_response_run(const flesh_scene *scene, const flesh_solver_options *solver, const flesh_observer *observer,
                       flesh_state *state, flesh_integrator **integrator, double tolerance, flesh_trajectory **trajectory);

#endif
