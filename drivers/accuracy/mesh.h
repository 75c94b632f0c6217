/* mesh.h: the error that the mesh makes, beside that of the step: the scene on other meshes and with other elements, at
 * the same times, against a reference of refined meshes.
 *
 * All are compared at the nodes of the scene's own mesh, where the others' displacements are interpolated. */
#ifndef FLESH_ACCURACY_MESH_H
#define FLESH_ACCURACY_MESH_H

#include "accuracy/accuracy.h"
#include "flesh/body.h"

/* A run on one mesh with one element; plain data: it comes through a pipe. */
typedef struct flesh_accuracy_mesh_row {
  int source;  /* 0: the scene, k: the k-th of --coarser */
  int element; /* flesh_element */
  int refine;  /* times that each tet of the source's mesh is cut into eight, beyond what its scene says */
  int done, status, crashed_by;
  int tets, nodes;
  double poisson;   /* largest of its materials */
  double cpu_s;     /* of the integration */
  double error;     /* of the mesh, over the motion: largest over time of the mass-weighted rms distance from the
                       reference; NaN: not known */
  int below;        /* 1: the error is below what the reference leaves open */
  char message[200];
} flesh_accuracy_mesh_row;

enum { FLESH_ACCURACY_MESH_ROWS = 48, FLESH_ACCURACY_MESH_LEVELS = 8 };

/* The limit of an element: the order at which its runs converge, and the extrapolated result. */
typedef struct flesh_accuracy_limit {
  int levels;    /* runs that it is made of; 0: there is none */
  int rows[3];   /* the last of them, coarse to fine */
  double order;  /* of the size of the cells; measured where levels are 3, else assumed */
  double change; /* how far the limit is from the finest run [m] */
} flesh_accuracy_limit;

typedef struct flesh_accuracy_meshes {
  int source_count;
  const char *sources[FLESH_ACCURACY_LIMIT]; /* files: the scene, then --coarser */
  double seconds;                            /* to spend */
  int method;                                /* of all runs, in flesh_accuracy_methods; -1: equilibrium */
  flesh_accuracy_value step;
  double step_error; /* of method and step on the scene's mesh, over the motion; NaN: not known, 0: equilibrium */
  int own_element, own_refine;
  const char *point_load; /* an effect that acts at single nodes; NULL: none does */
  int row_count;
  flesh_accuracy_mesh_row rows[FLESH_ACCURACY_MESH_ROWS];
  flesh_accuracy_limit limits[FLESH_ELEMENT_COUNT];
  int first, second;   /* elements whose limits are the reference and what checks it; 0: there is none */
  double apart;        /* how far these differ [m] */
  double uncertainty;  /* [m] the larger of `apart` and the change to the limit */
  double motion;       /* largest rms distance of the reference from the start [m] */
} flesh_accuracy_meshes;

/* A mesh and a step that together reach an error. */
typedef struct flesh_accuracy_choice {
  const flesh_accuracy_mesh_row *mesh; /* NULL: nothing does */
  const flesh_accuracy_row *step;      /* NULL in equilibrium */
  double mesh_error, step_error;       /* over the motion */
  double cpu_s;                        /* measured, or from what the two cost beside what they were run with */
  int measured;
} flesh_accuracy_choice;

/* The order p at which differences |f0-f1| and |f1-f2| of sizes h0 > h1 > h2 fall, f = limit + c h^p; within 0.5 to 4,
 * NaN where they do not fall. */
double flesh_accuracy_order(const double h[3], double first, double second);

/* The error of a step, over the motion of the time reference, where what is below it counts as its uncertainty; NaN of other
 * prices and of runs that failed. */
double flesh_accuracy_step_error(const flesh_accuracy_plan *plan, const flesh_accuracy_row *row);

/* Chooses method and step, runs the meshes as far as the seconds go, finds reference and errors. plan->rows have been
 * run, or there are none and the scene is for equilibrium. FLESH_ERR_INTERRUPTED, FLESH_ERR_FILE; FLESH_ERR_SOLVE where
 * no reference can be made. */
int flesh_accuracy_run_meshes(const flesh_accuracy_plan *plan, flesh_accuracy_meshes *meshes);

/* Runs one row at the method and step of `step` (NULL: equilibrium) again for its CPU time; NaN where it fails. */
double flesh_accuracy_time_mesh(const flesh_accuracy_plan *plan, const flesh_accuracy_meshes *meshes,
                                const flesh_accuracy_mesh_row *row, const flesh_accuracy_row *step);

/* The CPU time [s] at which the element's runs pass an error over the motion, along straight lines in log-log; that of
 * its coarsest where it is as good already. Beyond its finest *beyond is 1, and it is the least that it can take: with
 * errors that fall as well as they can, by order 2 with linear and 3 with quadratic displacements, and time that grows
 * with the tets alone. NaN: not known. */
double flesh_accuracy_time_to(const flesh_accuracy_meshes *meshes, int element, double error, int *beyond);

/* The least CPU time for errors of mesh and step that add up to `error` over the motion at most. */
flesh_accuracy_choice flesh_accuracy_choose(const flesh_accuracy_plan *plan, const flesh_accuracy_meshes *meshes,
                                            double error);

/* mesh.csv; table and words on the stream, `timed`: choices for 10, 1 and 0.1 %; and the picture work_mesh.png. */
int flesh_accuracy_write_meshes(const flesh_accuracy_plan *plan, const flesh_accuracy_meshes *meshes);
void flesh_accuracy_say_meshes(const flesh_accuracy_plan *plan, const flesh_accuracy_meshes *meshes,
                               const flesh_accuracy_choice timed[3], FILE *stream);
/* Writes the same words to mesh.txt and stdout. */
int flesh_accuracy_write_mesh_verdict(const flesh_accuracy_plan *plan, const flesh_accuracy_meshes *meshes,
                                      const flesh_accuracy_choice timed[3]);
int flesh_accuracy_draw_meshes(const flesh_accuracy_plan *plan, const flesh_accuracy_meshes *meshes);
extern const double flesh_accuracy_shares[3];

typedef struct flesh_accuracy_sampler {
  const flesh_mesh *mesh;      /* of the run */
  const double *points;        /* [3*count] at rest */
  int count;
  int *nodes;                  /* [10*count] of the tet that holds the point */
  double *weights;             /* [10*count] */
  flesh_accuracy_grid grid;    /* the times that are kept */
  int next;
  flesh_accuracy_track track;  /* where the points are at these times */
} flesh_accuracy_sampler;

/* For the nodes of plan->measure and times of the plan's grid; the scene must stay. */
int flesh_accuracy_sampler_open(const flesh_accuracy_plan *plan, const flesh_scene *scene,
                                flesh_accuracy_sampler *sampler);
void flesh_accuracy_sampler_close(flesh_accuracy_sampler *sampler);

/* Integrates the scene, or finds its equilibrium where it has no inertia; `sampler` may be NULL. Short runs are
 * repeated: the least CPU time [s]. */
int flesh_accuracy_sample(const flesh_accuracy_plan *plan, const flesh_scene *scene, flesh_accuracy_sampler *sampler,
                          double *cpu_s);

#endif
