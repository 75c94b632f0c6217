/* map.h: a constant of the material of each tet as what is fitted: thousands of parameters, held together by a penalty for
 * differences between tets that share a face. */
#ifndef FLESH_FIT_MAP_H
#define FLESH_FIT_MAP_H

#include "fit/fit.h"
#include "scene/fibres.h"

/* In the order of their names. */
enum { FLESH_FIT_QUADRATIC, FLESH_FIT_VARIATION };

struct flesh_fit_map {
  flesh_fit_parameter of; /* each tet's; its key is a constant's name */
  flesh_tet_selection tets_chosen;
  int penalty;
  double edge;   /* of q between neighbours, from which on variation counts differences by their size */
  double weight; /* of the penalty; NaN: such that the residuals are the deviations */
  const char *unit;
  int count, *tets; /* [count] rising */
  int tet_count;    /* of the mesh */
  int face_count, *faces; /* [2 * face_count] neighbours, as indices into the fit's parameters */
  double *face_weights;   /* [face_count] area over the distance of the centres, over the cube root of the volume */
};

/* Reads the chosen tets and their neighbours, and whether experiments can have a map. FLESH_ERR_ARGUMENT. */
int flesh_fit_map_prepare(flesh_fit *fit);
extern const flesh_key flesh_fit_map_table[];

/* Writes a scene's map of values p [parameters] to a path. */
int flesh_fit_map_write(const flesh_fit *fit, const char *path, const double *p);

/* The measured numbers, linearised at p: products of their derivatives by q. */
typedef struct flesh_fit_linear flesh_fit_linear;
/* Makes the runs at p again whose equilibria are not kept. Returns new. FLESH_ERR_SOLVE where a run fails; FLESH_ERR_MEMORY. */
int flesh_fit_linear_create(flesh_fit *fit, const double *p, flesh_fit_linear **linear);
void flesh_fit_linear_destroy(flesh_fit_linear **linear);
/* y [measured numbers] = J u, each over its deviation, u [parameters]. */
int flesh_fit_linear_times(flesh_fit_linear *linear, const double *u, double *y);
/* u [parameters] = J^T y. */
int flesh_fit_linear_times_transposed(flesh_fit_linear *linear, const double *y, double *u);

/* The residual of face k's penalty at values p [parameters], without its weight, and its derivative by the difference of q. */
double flesh_fit_map_bend(const flesh_fit *fit, int k, const double *p, double *slope);

/* A stage of an earlier run of the fit, with its p [parameters], and whether it is there. FLESH_ERR_FILE. */
int flesh_fit_stage_read(flesh_fit *fit, int number, flesh_fit_stage *stage, double *p, int *there);
/* Writes one that began at that wall time, s. */
int flesh_fit_stage_write(flesh_fit *fit, int number, double began, const flesh_fit_stage *stage, const double *p);

/* Searches a map with what stands beside it. FLESH_ERR_SOLVE where the start cannot be run. */
int flesh_fit_map_search(flesh_fit *fit, flesh_fit_found *found);
/* Fills in deviations, resolutions and determined, and the covariance of the keys. */
int flesh_fit_map_judge(flesh_fit *fit, flesh_fit_found *found, flesh_fit_statistics *statistics);
/* Says in words what is known of the map. */
int flesh_fit_map_tell(const flesh_fit *fit, const flesh_fit_found *found, flesh_fit_statistics *statistics);
/* tets.csv and map.vtu. */
int flesh_fit_map_tables(const flesh_fit *fit, const flesh_fit_found *found);
/* New object of the map for result.json. */
json_t *flesh_fit_map_json(const flesh_fit *fit, const flesh_fit_found *found);

#endif
