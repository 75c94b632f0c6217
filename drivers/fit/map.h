/* map.h: fits a material constant of each tet: thousands of parameters, which a penalty for differences between tets
 * with a common face regularises. */
#ifndef FLESH_FIT_MAP_H
#define FLESH_FIT_MAP_H

#include "fit/fit.h"

/* Reads the chosen tets and their neighbours, and checks that the experiments can have a map. FLESH_ERR_ARGUMENT. */
int flesh_fit_map_prepare(flesh_fit *fit);
extern const flesh_key flesh_fit_map_table[];

/* Writes the map of the values p [parameters] to a path, for scenes. */
int flesh_fit_map_write(const flesh_fit *fit, const char *path, const double *p);

/* The measured quantities linearised at p: products with their derivatives by q. */
typedef struct flesh_fit_linear flesh_fit_linear;
/* Makes a new linearisation; runs at p are repeated if their equilibria are not kept. FLESH_ERR_SOLVE if a run fails;
 * FLESH_ERR_MEMORY. */
int flesh_fit_linear_create(flesh_fit *fit, const double *p, flesh_fit_linear **linear);
void flesh_fit_linear_destroy(flesh_fit_linear **linear);
/* Computes y [measured numbers] = J u, each over its deviation, for u [parameters]. */
int flesh_fit_linear_times(flesh_fit_linear *linear, const double *u, double *y);
/* Computes u [parameters] = J^T y. */
int flesh_fit_linear_times_transposed(flesh_fit_linear *linear, const double *y, double *u);

/* Returns the residual of face k's penalty at values p [parameters], without its weight; *slope is its derivative by
 * the difference of q. */
double flesh_fit_map_residual(const flesh_fit *fit, int k, const double *p, double *slope);

/* Reads a stage of an earlier run of the fit, with its p [parameters]; *there is whether it exists. FLESH_ERR_FILE. */
int flesh_fit_stage_read(flesh_fit *fit, int number, flesh_fit_stage *stage, double *p, int *there);
/* Writes a stage; `began` is the wall time of its start, s. */
int flesh_fit_stage_write(flesh_fit *fit, int number, double began, const flesh_fit_stage *stage, const double *p);

/* Searches a map together with the keys. FLESH_ERR_SOLVE if the experiments cannot be run at the start. */
int flesh_fit_map_search(flesh_fit *fit, flesh_fit_found *found);
/* Computes deviations, resolutions and `determined` of the map, and the covariance of the keys. */
int flesh_fit_map_statistics(flesh_fit *fit, flesh_fit_found *found, flesh_fit_statistics *statistics);

#endif
